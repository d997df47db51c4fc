"""Exact flows of an ideal gas: the Riemann problem, and Noh's implosion.

    p = (gamma - 1) rho e

Riemann problem: Toro, *Riemann Solvers and Numerical Methods for Fluid Dynamics*, ch. 4. Noh: W. F. Noh, J. Comput.
Phys. 72 (1987) 78.
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np

from .wave_curves import bracketed_root


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
        away = side * (speed - state.velocity)
        inner = side * (self.velocity - state.velocity)
        if ratio > 1.0:
            share = (g - 1.0) / (g + 1.0)
            front = c * sqrt((g + 1.0) / (2.0 * g) * ratio + (g - 1.0) / (2.0 * g))
            shocked = rho * (ratio + share) / (share * ratio + 1.0)
            ahead = away > front
            return {
                "density": np.where(ahead, rho, shocked),
                "velocity": np.where(ahead, state.velocity, self.velocity),
                "pressure": np.where(ahead, p, self.pressure),
            }
        c_inner = c * ratio ** ((g - 1.0) / (2.0 * g))
        at = np.clip(away, inner + c_inner, c)  # within the fan, or at the nearer edge of it
        u = 2.0 / (g + 1.0) * (at - c)
        sound = at - u
        return {
            "density": rho * (sound / c) ** (2.0 / (g - 1.0)),
            "velocity": state.velocity + side * u,
            "pressure": p * (sound / c) ** (2.0 * g / (g - 1.0)),
        }


def riemann(left: GasState, right: GasState, gamma: float) -> RiemannSolution:
    """Solve the Riemann problem of an ideal gas. Raises `RunError` if the gases part and leave a vacuum."""

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


@dataclass(frozen=True)
class Noh:
    """Cold gas of unit density that runs at unit speed towards a plane, an axis or a point."""

    gamma: float  # ratio of specific heats
    dimensions: int  # 1 planar, 2 cylindrical, 3 spherical

    @property
    def front(self) -> float:
        """Speed of the shock that runs outwards."""
        return 0.5 * (self.gamma - 1.0)

    @property
    def density(self) -> float:
        """Density behind the shock."""
        return ((self.gamma + 1.0) / (self.gamma - 1.0)) ** self.dimensions

    @property
    def pressure(self) -> float:
        """Pressure behind the shock, where the specific internal energy is 1/2."""
        return 0.5 * (self.gamma - 1.0) * self.density

    def sample(self, r: np.ndarray, time: float) -> dict[str, np.ndarray]:
        """Return density, velocity along r and pressure at distances `r` and a time."""
        r = np.asarray(r, float)
        behind = r < self.front * time
        ahead = (1.0 + time / np.maximum(r, 1e-300)) ** (self.dimensions - 1)
        return {
            "density": np.where(behind, self.density, ahead),
            "velocity": np.where(behind, 0.0, -1.0),
            "pressure": np.where(behind, self.pressure, 0.0),
        }
