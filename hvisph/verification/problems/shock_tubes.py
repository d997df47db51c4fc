"""Shock tubes of Sod and of Woodward and Colella, with exact solutions.

Both gases of a tube start on one spacing. Tubes are longer than the evaluated part, so that no wave arrives from their
ends. Sod: J. Comput. Phys. 27 (1978) 1. Woodward & Colella: J. Comput. Phys. 54 (1984) 115, the left half.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from hvisph.exact.wave_curves import bracketed_root
from hvisph.verification.problem import Figure, Problem, Ran, Start, Trial, computed_and_exact, limit, vectors
from hvisph.visualization.curves import Curve


@dataclass(frozen=True)
class GasState:
    """A uniform state of an ideal gas; any consistent units."""

    density: float
    velocity: float
    pressure: float


@dataclass(frozen=True)
class RiemannSolution:
    """Solution of the Riemann problem of one gas, with the initial discontinuity at x = 0."""

    # the states
    left: GasState
    right: GasState
    gamma: float  # ratio of specific heats
    # between the two waves
    pressure: float
    velocity: float

    def sample(self, speed: np.ndarray) -> dict[str, np.ndarray]:
        """Return density, velocity and pressure at x/t = `speed`, each of its shape."""
        speed = np.asarray(speed, float)
        profile = {name: np.empty_like(speed) for name in ("density", "velocity", "pressure")}
        for side, state in ((-1, self.left), (1, self.right)):
            mine = side * (speed - self.velocity) >= 0.0 if side > 0 else speed < self.velocity
            for name, values in self._side(state, side, speed[mine]).items():
                profile[name][mine] = values
        return profile

    def _side(self, state: GasState, side: int, speed: np.ndarray) -> dict[str, np.ndarray]:
        """Return the flow on one side of the contact, which is left (-1) or right (1) of it."""
        g, p, rho = self.gamma, state.pressure, state.density
        c, ratio = sqrt(g * p / rho), self.pressure / p
        # all speeds as seen by the side's own gas, waves running outwards
        outward = side * (speed - state.velocity)
        inner = side * (self.velocity - state.velocity)
        if ratio > 1.0:
            share = (g - 1.0) / (g + 1.0)
            front = c * sqrt((g + 1.0) / (2.0 * g) * ratio + (g - 1.0) / (2.0 * g))
            shocked = rho * (ratio + share) / (share * ratio + 1.0)
            undisturbed = outward > front
            return {
                "density": np.where(undisturbed, rho, shocked),
                "velocity": np.where(undisturbed, state.velocity, self.velocity),
                "pressure": np.where(undisturbed, p, self.pressure),
            }
        c_inner = c * ratio ** ((g - 1.0) / (2.0 * g))
        at = np.clip(outward, inner + c_inner, c)  # within the fan, or at the nearer edge of it
        u = 2.0 / (g + 1.0) * (at - c)
        sound = at - u
        return {
            "density": rho * (sound / c) ** (2.0 / (g - 1.0)),
            "velocity": state.velocity + side * u,
            "pressure": p * (sound / c) ** (2.0 * g / (g - 1.0)),
        }


def riemann(left: GasState, right: GasState, gamma: float) -> RiemannSolution:
    """Solve the Riemann problem of an ideal gas. Raises `RunError` if the gases separate by a vacuum."""

    def change(p: float, state: GasState) -> float:
        """Velocity by which a wave to the pressure `p` slows the state's gas."""
        if p > state.pressure:
            a, b = 2.0 / ((gamma + 1.0) * state.density), (gamma - 1.0) / (gamma + 1.0) * state.pressure
            return (p - state.pressure) * sqrt(a / (p + b))
        c = sqrt(gamma * state.pressure / state.density)
        return 2.0 * c / (gamma - 1.0) * ((p / state.pressure) ** ((gamma - 1.0) / (2.0 * gamma)) - 1.0)

    def excess(p: float) -> float:
        return change(p, left) + change(p, right) + right.velocity - left.velocity

    high = max(left.pressure, right.pressure)
    while excess(high) < 0.0:
        high *= 2.0
    pressure = bracketed_root(excess, 0.0, high)
    velocity = 0.5 * (left.velocity + right.velocity + change(pressure, right) - change(pressure, left))
    return RiemannSolution(left, right, gamma, pressure, velocity)


GAMMA = 1.4
SEEN = 0.5  # of the tube on either side
COLUMNS = ("density", "pressure", "velocity")
WHY = "of the mean of the exact profile; contact and shock are spread over a few particles"
SOD = (GasState(1.0, 0.0, 1.0), GasState(0.125, 0.0, 0.1))
BLAST = (GasState(1.0, 0.0, 1000.0), GasState(1.0, 0.0, 0.01))


def tube(states: tuple[GasState, GasState], end: float, lengths: tuple[float, float], dx: float) -> Trial:
    """Return a tube of two gases at rest, of the given lengths, until `end`, with the spacing `dx`."""
    case = {
        "title": "shock tube",
        "units": "none",
        "kinematics": "uniaxial_strain",
        "resolution": dx,
        "bodies": {
            name: {
                "material": {"density": state.density, "eos": {"type": "ideal_gas", "gamma": GAMMA}},
                "shape": {"type": "interval", "length": length},
                "internal_energy": state.pressure / ((GAMMA - 1.0) * state.density),
            }
            for name, state, length in zip(("left", "right"), states, lengths, strict=True)
        },
        "time": {"end": end},
    }
    exact = riemann(*states, GAMMA)

    def profiles(ran: Ran) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray]]:
        x = vectors(ran.last, "position")[:, 0]
        order = np.argsort(x)
        order = order[np.abs(x[order]) < SEEN]
        computed = {name: ran.last.fields[name].reshape(len(x))[order] for name in COLUMNS}
        return x[order], computed, exact.sample(x[order] / ran.last.time)

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        x, computed, right = profiles(runs[0])
        width = np.gradient(x)  # particles are dense behind the shock: the mean is over the length
        for name in COLUMNS:
            error = (np.abs(computed[name] - right[name]) * width).sum() / (np.abs(right[name]) * width).sum()
            yield limit(f"L1 error of the {name}", float(error), 0.015, why=WHY)
        yield limit("drift of energy", abs(float(runs[0].summary["conservation"]["energy_drift"])), 1e-4)

    def curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
        x, computed, right = profiles(runs[0])
        return computed_and_exact(x, computed, x, {name: right[name] for name in COLUMNS})

    return Trial(f"dx {dx:g}", [Start(case)], figures, curves)


SOD_PROBLEM = Problem(
    "sod",
    "Sod's shock tube: L1 errors against the Riemann problem",
    lambda options: [tube(SOD, 0.2, (0.8, 0.9), options.dx(0.0025, 0.005))],
)
BLAST_PROBLEM = Problem(
    "blast",
    "blast wave, pressures 1000 : 0.01, against the Riemann problem",
    lambda options: [tube(BLAST, 0.012, (1.0, 0.6), options.dx(0.00125, 0.005))],
)
