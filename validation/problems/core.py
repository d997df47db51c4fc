"""A flat steel core through an aluminium plate at 850 m/s: residual velocity.

Without exact solution schemes are compared with each other. A core of 6.1 x 27.6 mm of Johnson-Cook's steel 4340 meets
10 mm of 6061-T6 (both Johnson & Cook 1983, 1985; the plate with their damage), one quarter of it. Separated contact,
standard SPH and plane strain leave it 640 to 720 m/s.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from hvisph.verification.problem import Figure, Options, Problem, Ran, Start, Trial, limit

SPEED, KEPT = 850.0, 680.0  # at impact, and the middle of 640 to 720 [m/s]
CORE: dict[str, Any] = {
    "density": 7830.0,
    "eos": {"type": "mie_gruneisen", "sound_speed": 4570.0, "s1": 1.49, "gamma": 1.93, "a": 0.5},
    "strength": {"type": "johnson_cook", "shear_modulus": 81.8e9, "a": 792e6, "b": 510e6, "n": 0.26, "c": 0.014,
                 "m": 1.03, "room_temperature": 298.0, "melt_temperature": 1793.0, "heat_capacity": 477.0},
}  # fmt: skip
PLATE: dict[str, Any] = {
    "density": 2703.0,
    "eos": {"type": "mie_gruneisen", "sound_speed": 5240.0, "s1": 1.4, "gamma": 1.97, "a": 0.48},
    "strength": {"type": "johnson_cook", "shear_modulus": 27.6e9, "a": 324e6, "b": 114e6, "n": 0.42, "c": 0.002,
                 "m": 1.34, "room_temperature": 294.0, "melt_temperature": 925.0, "heat_capacity": 896.0},
    "damage": {"type": "johnson_cook", "d1": -0.77, "d2": 1.45, "d3": -0.47, "d5": 1.6},
}  # fmt: skip


def _trials(options: Options) -> Iterator[Trial]:
    dx = options.dx(0.75e-3, 1e-3)
    case = {
        "title": "steel core on 10 mm of 6061-T6, 850 m/s",
        "kinematics": "three_d",
        "resolution": dx,
        "bodies": {
            "core": {"material": CORE, "shape": {"type": "cylinder", "diameter": 6.1e-3, "length": 27.6e-3},
                     "velocity": [SPEED, 0.0, 0.0]},
            "plate": {"material": PLATE, "shape": {"type": "box", "size": [10e-3, 50e-3, 50e-3]}},
        },
        "symmetry": [{"axis": "y"}, {"axis": "z"}],
        "time": {"end": 15e-6 if options.quick else 40e-6},
    }  # fmt: skip

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        if not options.quick:
            yield Figure("speed of the core", float(ran.mean_velocity(0)[0]), KEPT, 0.08, "m/s",
                         why="640 to 720 m/s by the schemes that keep energy and do not weld")  # fmt: skip
        energy = ran.last.fields["mass"] * ran.last.fields["internal_energy"]
        share = abs(energy[energy < 0.0].sum()) / ran.kinetic_energy(ran.first)
        yield limit("negative internal energy over initial energy", float(share), 1e-3, why="a body cannot hold less")

    yield Trial(f"dx {1e3 * dx:g} mm", [Start(case)], figures)


PROBLEM = Problem(
    "core", "a flat steel core through 10 mm of 6061-T6 at 850 m/s, 3D: residual velocity", _trials,
    slow=True, agree=("speed of the core", 0.08),
)  # fmt: skip
