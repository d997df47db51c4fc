"""Noh's implosion: cold gas converges at unit speed on a plane, an axis or a point.

The shocked gas is at rest and uniform; some particles at the wall are too hot and too thin in every scheme with a
finite shock, and are left out of the means. W. F. Noh, J. Comput. Phys. 72 (1987) 78.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hvisph.core.catalogues import KINEMATICS
from hvisph.core.particles import Particles
from hvisph.core.text import Plain
from hvisph.verification.problem import Figure, Options, Problem, Ran, Start, Trial, limit, vectors
from hvisph.verification.problems.sod import Noh
from hvisph.visualization.curves import Curve

GAMMA, END = 5.0 / 3.0, 0.6
COLD = 1e-6  # specific internal energy at the start, beside 1/2 behind the shock

READ = (0.35, 0.8)  # shares of the shock's radius between which the state is read


@dataclass(frozen=True)
class Implosion:
    """A gas that implodes."""

    # what it is called, and towards what it runs: 1 a plane, 2 an axis, 3 a point
    name: str
    dim: int
    # what the case file calls it
    kinematics: str
    shape: Plain
    spacing: tuple[float, float]  # particle spacing, in full and quick
    tolerance: float  # relative, of density and pressure
    planes: str  # axes of its planes of symmetry
    drift: float = 1e-4  # of energy, relative


DISC, SPHERE = {"type": "disc", "diameter": 2.0}, {"type": "sphere", "diameter": 2.0}
PLANAR = Implosion("planar", 1, "uniaxial_strain", {"type": "interval", "length": 1.0}, (0.005, 0.01), 0.05, "x")
CYLINDRICAL = Implosion("cylindrical", 2, "plane_strain", DISC, (0.0125, 0.025), 0.05, "xy")
SPHERICAL = Implosion("spherical", 3, "three_d", SPHERE, (0.04, 0.08), 0.15, "xyz")


def _trials(options: Options) -> Iterator[Trial]:
    for gas in (PLANAR, CYLINDRICAL) if options.quick else (PLANAR, CYLINDRICAL, SPHERICAL):
        yield trial(gas, options)


def trial(gas: Implosion, options: Options) -> Trial:
    """Return the trial of a gas that implodes."""
    material = {"density": 1.0, "eos": {"type": "ideal_gas", "gamma": GAMMA}}
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
    exact = Noh(GAMMA, gas.dim)

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
        right = exact.sample(r[order], last.time)
        return {
            name: [
                Curve("computed", r[order], last.fields[name][order]),
                Curve("exact", r[order], right[name], exact=True),
            ]
            for name in ("density", "pressure")
        }

    return Trial(gas.name, [Start(case, state=inwards)], figures, curves)


PROBLEM = Problem("noh", "Noh's implosion, planar, cylindrical and spherical: state behind the shock", _trials)
