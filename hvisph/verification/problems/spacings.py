"""Bodies of unlike spacings that touch: a sound wave passes from one into the other, of the same material, unreflected.

A smooth pulse of velocity in the first body sends half of it to the right, into the second, whose spacing is twice or
four times as large. Exact is d'Alembert's solution: half the momentum of the start, and no wave that comes back.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from hvisph.core.particles import Particles
from hvisph.pictures.curves import Curve
from hvisph.verification.figure import Figure, limit
from hvisph.verification.materials import ELASTIC, POISSON_RATIO, RHO, YOUNGS_MODULUS
from hvisph.verification.problem import EULERIAN, Options, Problem, Start, Trial
from hvisph.verification.ran import Ran, vectors

SPEED, CENTRE, WIDTH = 10.0, -8e-3, 8e-3  # of the pulse [m/s], [m]
LENGTHS, THICKNESS = (20e-3, 12e-3), 16e-3  # of the bodies, and of the strip [m]
C = float(np.sqrt(YOUNGS_MODULUS * (1.0 - POISSON_RATIO) / ((1.0 + POISSON_RATIO) * (1.0 - 2.0 * POISSON_RATIO)) / RHO))
END = 14e-3 / C  # the pulse is in the second body, what came back is on its way [s]
# The face is as thick as the kernel of the coarser body, and the pulse as long as 8 to 20 of its spacings.
REFLECTED = {1: 0.01, 2: 0.03, 4: 0.06}


def pulse(x: np.ndarray) -> np.ndarray:
    """Return the velocity [m/s] of the start at `x` [m]."""
    inside = np.abs(x - CENTRE) < 0.5 * WIDTH
    return np.asarray(np.where(inside, SPEED * np.cos(np.pi * (x - CENTRE) / WIDTH) ** 2, 0.0))


def _trials(options: Options) -> Iterator[Trial]:
    for dim in (1, 2):
        dx = options.dx((0.1e-3, 0.25e-3)[dim - 1], (0.2e-3, 0.5e-3)[dim - 1])
        for ratio in (1, 2, 4):
            if not (options.quick and dim == 2 and ratio == 4):
                yield _trial(dim, dx, ratio)


def _case(dim: int, dx: float, ratio: int) -> dict[str, Any]:
    def shape(length: float) -> dict[str, Any]:
        return {"type": "interval", "length": length} if dim == 1 else {"type": "box", "size": [length, THICKNESS]}

    return {
        "title": f"spacings 1:{ratio}, {dim}D",
        "kinematics": "uniaxial_strain" if dim == 1 else "plane_strain",
        "resolution": dx,
        "bodies": {
            "first": {"material": ELASTIC, "shape": shape(LENGTHS[0])},
            "second": {"material": ELASTIC, "shape": shape(LENGTHS[1]), "resolution": ratio * dx},
        },
        "symmetry": [{"axis": "y", "at": 0.0}, {"axis": "y", "at": 0.5 * THICKNESS, "keep": "below"}][: 2 * (dim - 1)],
        "time": {"end": END},
    }


def _trial(dim: int, dx: float, ratio: int) -> Trial:
    def start(particles: Particles) -> None:
        x = particles["position"].reshape(particles.count, -1)[:, 0]
        face = 0.5 * (x[particles.body == 0].max() + x[particles.body == 1].min() - 0.5 * (ratio - 1) * dx)
        velocity = np.zeros((particles.count, dim))
        velocity[:, 0] = np.where(particles.body == 0, pulse(x - face), 0.0)
        particles["velocity"] = velocity

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        passed = ran.momentum(1)[0] / ran.momentum(0, ran.first)[0]
        yield Figure("momentum that passes", float(passed), 0.5, 0.02, why="half of the pulse")
        x, u = _along(ran, 0)
        back = np.abs(u[(x > x.max() - 10e-3) & (x < x.max() - 2e-3)]).max()
        yield limit("wave that comes back, over the one that goes in", float(back / (0.5 * SPEED)),
                    REFLECTED[ratio], why="a face as thick as the coarser kernel")  # fmt: skip

    def curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
        (ran,) = runs
        return {"velocity_x": [Curve(name, *_along(ran, body)) for body, name in enumerate(("first", "second"))]}

    return Trial(f"{dim}D, 1:{ratio}", [Start(_case(dim, dx, ratio), state=start)], figures, curves)


def _along(ran: Ran, body: int) -> tuple[np.ndarray, np.ndarray]:
    """Return x and velocity along x of a body, in order of x."""
    own = np.flatnonzero(ran.last.body == body)
    x = vectors(ran.last, "position")[own, 0]
    order = np.argsort(x)
    return x[order], vectors(ran.last, "velocity")[own[order], 0]


PROBLEM = Problem(
    "spacings", "bodies of unlike spacings that touch: a wave passes from one into the other", _trials, EULERIAN,
    why_not="Total Lagrangian bodies have one smoothing length, projection has no equation of state",
)  # fmt: skip
