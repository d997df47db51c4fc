"""Impacts cut by planes of symmetry: the same as the whole, nothing lost through the planes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from hvisph.verification.problem import SOLIDS, Figure, Options, Problem, Ran, Start, Trial, limit, vectors

from .random_collisions import BRITTLE

STEPS, STEP = 60, 6e-9  # the same for all, so that the same steps are compared [s]
SPEED = 1500.0
SHAPES: dict[int, tuple[dict[str, Any], dict[str, Any]]] = {
    2: ({"type": "disc", "diameter": 5e-3}, {"type": "box", "size": [3e-3, 12e-3]}),
    3: ({"type": "sphere", "diameter": 4e-3}, {"type": "box", "size": [3e-3, 8e-3, 8e-3]}),
}


def _trials(options: Options) -> Iterator[Trial]:
    dx = options.dx(0.5e-3, 0.5e-3)
    for dim in (2,) if options.quick else (2, 3):
        yield _same(dim, dx)
    yield _kept(options.dx(0.25e-3, 0.5e-3), 4e-6 if options.quick else 16e-6)


def _case(dim: int, dx: float, planes: int, time: dict[str, float], speed: float = SPEED,
          metal: object = "aluminium-howell-ball") -> dict[str, Any]:  # fmt: skip
    shot, plate = SHAPES[dim]
    return {
        "title": "impact cut by planes of symmetry" if planes else "whole impact",
        "kinematics": "plane_strain" if dim == 2 else "three_d",
        "resolution": dx,
        "bodies": {
            "projectile": {"material": metal, "shape": shot, "velocity": [speed] + [0.0] * (dim - 1)},
            "target": {"material": metal, "shape": plate},
        },
        "symmetry": [{"axis": axis} for axis in "yz"[:planes]],
        "time": time,
    }


def _same(dim: int, dx: float) -> Trial:
    time = {"end": STEPS * STEP, "step": STEP}

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        full, part = runs
        at = vectors(full.first, "position")
        side = (at[:, 1:] > 0.0).all(axis=1)
        in_part, in_whole = _ordered(vectors(part.first, "position"), dx), np.flatnonzero(side)[_ordered(at[side], dx)]
        for name, field, scale in (("positions, over dx", "position", dx),
                                   ("velocities, over impact velocity", "velocity", SPEED)):  # fmt: skip
            difference = np.abs(vectors(part.last, field)[in_part] - vectors(full.last, field)[in_whole]).max()
            yield limit(name, float(difference) / scale, 1e-9, why="sums in another order: round-off of 60 steps")

    return Trial(f"{dim}D, {('half', 'quarter')[dim - 2]} beside whole",
                 [Start(_case(dim, dx, 0, time)), Start(_case(dim, dx, dim - 1, time))], figures)  # fmt: skip


def _ordered(x: np.ndarray, dx: float) -> np.ndarray:
    """Return the order of lattice places that is the same for a part and the whole."""
    return np.lexsort(np.round(x / dx * 4.0).T)


def _kept(dx: float, end: float) -> Trial:
    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        y = vectors(ran.last, "position")[:, 1]
        yield limit("particles behind the plane", int((y < 0.0).sum()), 0)
        yield limit("largest distance behind the plane, over dx", max(0.0, -float(y.min())) / dx, 0.0)
        yield limit("drift of momentum along the plane", ran.drift, 1e-12, why="round-off")

    return Trial("2D, half, fragmenting, 1.5 km/s", [Start(_case(2, dx, 1, {"end": end}, metal=BRITTLE))], figures)


PROBLEM = Problem("symmetry", "impacts with symmetry planes: the same as the whole model", _trials, SOLIDS)
