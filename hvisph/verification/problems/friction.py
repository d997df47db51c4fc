"""A block and a disc that slide over a plate: the impulse along it over that into it is Coulomb's coefficient.

Both bodies are elastic and the contact is short, so that sliding does not end before they part.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from hvisph.verification.figure import Figure, limit
from hvisph.verification.materials import ELASTIC
from hvisph.verification.problem import SOLIDS, Options, Problem, Start, Trial
from hvisph.verification.ran import Ran

DOWN = 20.0  # into the plate [m/s]
ALONG = {"block": 100.0, "disc": 60.0}  # fast enough that a disc does not come to roll [m/s]
SHAPES = {"block": {"type": "box", "size": [4e-3, 4e-3]}, "disc": {"type": "disc", "diameter": 4e-3}}
PLATE = [4e-3, 24e-3]
END = 8e-6


def _trials(options: Options) -> Iterator[Trial]:
    dx = options.dx(0.25e-3, 0.5e-3)
    for shape in SHAPES:
        for mu in (0.0, 0.3) if options.quick else (0.0, 0.1, 0.3):
            yield _trial(shape, mu, dx)


def _trial(shape: str, mu: float, dx: float) -> Trial:
    case: dict[str, Any] = {
        "title": f"{shape} on a plate, friction {mu:g}",
        "kinematics": "plane_strain",
        "resolution": dx,
        "bodies": {
            "slider": {"material": ELASTIC, "shape": SHAPES[shape], "velocity": [DOWN, ALONG[shape]]},
            "plate": {"material": ELASTIC, "shape": {"type": "box", "size": PLATE}},
        },
        "time": {"end": END},
    }
    if mu:  # without friction: whatever contact a formulation has by default
        case["formulation"] = {"contact": {"type": "separating", "friction": mu}}

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        into, along = ran.momentum(0, ran.first) - ran.momentum(0)
        yield Figure("impulse along over into", float(along / into), mu, 0.03, scale=0.0, why="Coulomb's coefficient")
        start = float(ran.first.fields["mass"][ran.first.body == 0].sum()) * DOWN
        yield Figure("impulse into the plate over the start's", float(into) / start, 1.2, 0.5, scale=0.0,
                     why="above the momentum brought, below twice of it: they have parted")  # fmt: skip
        yield limit("drift of momentum", ran.drift, 1e-12, why="round-off")

    return Trial(f"{shape}, friction {mu:g}", [Start(case)], figures)


PROBLEM = Problem("friction", "a block and a disc slide over a plate: impulses by Coulomb's law", _trials, SOLIDS)
