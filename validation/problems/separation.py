"""Bodies without tensile strength separate, and fluids slide, without losing kinetic energy.

Water with a cut-off of 1 kPa, in two bodies and in one whose halves separate; water sliding on water; failed metal
sliding on failed metal. No force acts, so that all velocities remain.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from hvisph.core.particles import Particles
from hvisph.verification.problem import WATER, Figure, Options, Problem, Ran, Start, Trial, vectors

SPEED, END = 50.0, 20e-6  # of each half [m/s], [s]


def _trials(options: Options) -> Iterator[Trial]:
    fine, coarse = options.dx(0.1e-3, 0.2e-3), options.dx(0.25e-3, 0.5e-3)
    line, box = {"type": "interval", "length": 5e-3}, {"type": "box", "size": [4e-3, 4e-3]}
    shape = {"type": "interval", "length": 10e-3}
    velocities = [[-SPEED], [SPEED]]
    yield _trial("two bodies of water separate, 1D", _case(fine, line, velocities, WATER))
    yield _trial("one body of water separates, 1D", _case(fine, shape, [[0.0]], WATER), _split)
    yield _trial("two bodies of water separate, 2D", _case(coarse, box, [[-SPEED, 0.0], [SPEED, 0.0]], WATER))
    sliding = [[0.0, -SPEED], [0.0, SPEED]]
    yield _trial("water slides on water, 2D", _case(coarse, box, sliding, WATER), slides=True)
    yield _trial("failed metal slides on failed metal, 2D", _case(coarse, box, sliding, "aluminium-young-3d"),
                 _failed, slides=True)  # fmt: skip


def _case(dx: float, shape: dict[str, Any], velocities: list[list[float]], material: object) -> dict[str, Any]:
    bodies = {
        name: {"material": material, "shape": shape, "velocity": velocity}
        for name, velocity in zip(("left", "right"), velocities, strict=False)
    }
    if len(velocities) == 1:
        bodies["left"]["position"] = [0.0] * len(velocities[0])
    return {
        "title": "parting",
        "kinematics": "uniaxial_strain" if len(velocities[0]) == 1 else "plane_strain",
        "resolution": dx,
        "bodies": bodies,
        "time": {"end": END},
    }


def _split(particles: Particles) -> None:
    particles["velocity"] = SPEED * np.sign(particles["position"])


def _failed(particles: Particles) -> None:
    particles["damage"] = 1.0


def _trial(
    name: str, case: dict[str, Any], state: Callable[[Particles], None] | None = None, slides: bool = False
) -> Trial:
    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        ratio = ran.kinetic_energy() / (0.5 * ran.last.fields["mass"].sum() * SPEED**2)
        why = "edges that pass one another" if slides else "a cut-off of 1 kPa, a few waves long"
        yield Figure("kinetic energy left", float(ratio), 1.0, 1e-2 if slides else 1e-3, why=why)
        if not slides:
            slowest = np.abs(vectors(ran.last, "velocity")[:, 0]).min()
            yield Figure("slowest particle", float(slowest), SPEED, 0.01, "m/s")

    return Trial(name, [Start(case, state=state)], figures)


PROBLEM = Problem("separation", "bodies without tension and shear separate and slide: kinetic energy kept", _trials)
