"""Noh's implosion: cold gas runs at unit speed into a plane, an axis or a point, and a shock runs out.

The shocked gas is at rest and uniform; some particles at the wall are too hot and too thin in every scheme with a
finite shock, and are left out of the means. W. F. Noh, J. Comput. Phys. 72 (1987) 78.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from hvisph.core.particles import Particles
from hvisph.exact.gas import Noh
from hvisph.pictures.curves import Curve
from hvisph.verification.figure import Figure, limit
from hvisph.verification.problem import Options, Problem, Start, Trial
from hvisph.verification.ran import Ran, vectors

GAMMA, END = 5.0 / 3.0, 0.6
COLD = 1e-6  # specific internal energy at the start, beside 1/2 behind the shock
NAMES = {1: "planar", 2: "cylindrical", 3: "spherical"}
KINEMATICS = {1: "uniaxial_strain", 2: "plane_strain", 3: "three_d"}
SHAPES = {
    1: {"type": "interval", "length": 1.0},
    2: {"type": "disc", "diameter": 2.0},
    3: {"type": "sphere", "diameter": 2.0},
}
SPACING = {1: (0.005, 0.01), 2: (0.0125, 0.025), 3: (0.04, 0.08)}  # full, quick
TOLERANCE = {1: 0.05, 2: 0.05, 3: 0.15}
READ = (0.35, 0.8)  # shares of the shock's radius between which the state is read


def _trials(options: Options) -> Iterator[Trial]:
    for dim in (1, 2) if options.quick else (1, 2, 3):
        yield _trial(dim, options.dx(*SPACING[dim]))


def _trial(dim: int, dx: float) -> Trial:
    gas = {"density": 1.0, "eos": {"type": "ideal_gas", "gamma": GAMMA}}
    case = {
        "title": f"Noh, {NAMES[dim]}",
        "units": "none",
        "kinematics": KINEMATICS[dim],
        "resolution": dx,
        "bodies": {"gas": {"material": gas, "shape": SHAPES[dim], "position": [0.5 if dim == 1 else 0.0] * dim,
                           "internal_energy": COLD}},
        "symmetry": [{"axis": axis} for axis in "xyz"[:dim]],
        "time": {"end": END},
    }  # fmt: skip
    exact = Noh(GAMMA, dim)

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
            yield Figure(f"{name} behind the shock", computed, value, TOLERANCE[dim], why=why)
        yield limit("drift of energy", abs(float(runs[0].summary["conservation"]["energy_drift"])), 1e-4)

    def curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
        last = runs[0].last
        r = np.linalg.norm(vectors(last, "position"), axis=1)
        order = np.argsort(r)
        order = order[r[order] < 2.0 * exact.front * last.time]
        right = exact.sample(r[order], last.time)
        return {name: [Curve("computed", r[order], last.fields[name][order]),
                       Curve("exact", r[order], right[name], exact=True)]
                for name in ("density", "pressure")}  # fmt: skip

    return Trial(NAMES[dim], [Start(case, state=inwards)], figures, curves)


PROBLEM = Problem("noh", "Noh's implosion, planar, cylindrical and spherical: state behind the shock", _trials)
