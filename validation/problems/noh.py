"""Noh's implosion: cold gas moves at unit speed towards a plane, axis or point (J. Comput. Phys. 72 (1987) 78).

The shocked gas is at rest and uniform; some particles at the wall are too hot and too thin in every scheme with a
finite shock, and are left out of the means.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hvisph.core.catalogues import KINEMATICS
from hvisph.core.particles import Particles
from hvisph.core.text import Plain
from hvisph.verification.problem import Figure, Options, Problem, Ran, Start, Trial, computed_and_exact, limit, vectors
from hvisph.visualization.curves import Curve

MONATOMIC, END = 5.0 / 3.0, 0.6  # ratio of specific heats and time of the implosions
COLD = 1e-6  # specific internal energy at the start, beside 1/2 behind the shock
READ = (0.35, 0.8)  # shares of the shock's radius between which the state is read
DISC, SPHERE = {"type": "disc", "diameter": 2.0}, {"type": "sphere", "diameter": 2.0}


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
        shocked = r < self.front * time
        inflow = (1.0 + time / np.maximum(r, 1e-300)) ** (self.dimensions - 1)
        return {
            "density": np.where(shocked, self.density, inflow),
            "velocity": np.where(shocked, 0.0, -1.0),
            "pressure": np.where(shocked, self.pressure, 0.0),
        }


@dataclass(frozen=True)
class Implosion:
    """A gas that implodes."""

    # name, and symmetry: 1 plane, 2 cylindrical, 3 spherical
    name: str
    dim: int
    # kinematics in the case file
    kinematics: str
    shape: Plain
    spacing: tuple[float, float]  # particle spacing, in full and quick
    tolerance: float  # relative, of density and pressure
    planes: str  # axes of its planes of symmetry
    drift: float = 1e-4  # of energy, relative


PLANAR = Implosion("planar", 1, "uniaxial_strain", {"type": "interval", "length": 1.0}, (0.005, 0.01), 0.05, "x")
CYLINDRICAL = Implosion("cylindrical", 2, "plane_strain", DISC, (0.0125, 0.025), 0.05, "xy")
SPHERICAL = Implosion("spherical", 3, "three_d", SPHERE, (0.04, 0.08), 0.15, "xyz")


def trial(gas: Implosion, options: Options) -> Trial:
    """Return the trial of a gas that implodes."""
    material = {"density": 1.0, "eos": {"type": "ideal_gas", "gamma": MONATOMIC}}
    middle = [0.5] if gas.dim == 1 else [0.0] * KINEMATICS[gas.kinematics].dim
    case = {
        "title": f"Noh, {gas.name}",
        "units": "none",
        "kinematics": gas.kinematics,
        "resolution": options.dx(*gas.spacing),
        "bodies": {"gas": {"material": material, "shape": gas.shape, "position": middle, "internal_energy": COLD}},
        "symmetry": [{"axis": axis} for axis in gas.planes],
        "time": {"end": END},
    }
    exact = Noh(MONATOMIC, gas.dim)

    def inwards(particles: Particles) -> None:
        x = particles["position"]
        particles["velocity"] = -x / np.linalg.norm(x, axis=1)[:, None]

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        last = runs[0].last
        r = np.linalg.norm(vectors(last, "position"), axis=1)
        front = exact.front * last.time
        inside = (r > READ[0] * front) & (r < READ[1] * front)
        why = "of the mean outside the wall-heated zone; the shock is spread over some particles"
        for name, value in (("density", exact.density), ("pressure", exact.pressure)):
            computed = float(last.fields[name][inside].mean()) if inside.any() else float("nan")
            yield Figure(f"{name} behind the shock", computed, value, gas.tolerance, why=why)
        yield limit("drift of energy", abs(float(runs[0].summary["conservation"]["energy_drift"])), gas.drift)

    def curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
        last = runs[0].last
        r = np.linalg.norm(vectors(last, "position"), axis=1)
        order = np.argsort(r)
        order = order[r[order] < 2.0 * exact.front * last.time]
        right = {name: exact.sample(r[order], last.time)[name] for name in ("density", "pressure")}
        return computed_and_exact(r[order], {name: last.fields[name][order] for name in right}, r[order], right)

    return Trial(gas.name, [Start(case, state=inwards)], figures, curves)


PROBLEM = Problem(
    "noh",
    "Noh's implosion, planar, cylindrical and spherical: state behind the shock",
    lambda options: [trial(gas, options) for gas in (PLANAR, CYLINDRICAL, SPHERICAL)[: 2 if options.quick else 3]],
)
