"""Bodies of unlike spacings that touch, and a graded one: a sound wave passes from fine to coarse, unreflected.

A smooth pulse of velocity in the first body sends half of it to the right, into the second, whose spacing is twice or
four times as large, or in one body to where its layers have grown to twice the thickness; of rings along the axis of a
cylinder, within a radius that nothing has reached from the rim. Exact is d'Alembert's solution: half the momentum of
the start, and no wave that comes back.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from hvisph.core.particles import Particles
from hvisph.verification.problem import (
    ELASTIC,
    EULERIAN,
    POISSON_RATIO,
    RHO,
    YOUNGS_MODULUS,
    Figure,
    Options,
    Problem,
    Ran,
    Start,
    Trial,
    limit,
    vectors,
)
from hvisph.visualization.curves import Curve

SPEED, CENTRE, WIDTH = 10.0, -8e-3, 8e-3  # of the pulse [m/s], [m]
LENGTHS, THICKNESS = (20e-3, 12e-3), 16e-3  # of the bodies, and of the strip [m]
RIM, CORE = 18e-3, 2e-3  # radii of the cylinder of rings, and of its part that is looked at [m]
C = float(np.sqrt(YOUNGS_MODULUS * (1.0 - POISSON_RATIO) / ((1.0 + POISSON_RATIO) * (1.0 - 2.0 * POISSON_RATIO)) / RHO))
END = 14e-3 / C  # the pulse is in the second body, what came back is on its way [s]
# The face is as thick as the kernel of the coarser body, and the pulse as long as 8 to 20 of its spacings.
REFLECTED = {1: 0.01, 2: 0.03, 3: 0.045, 4: 0.06}
GRADED = 0.01  # a tenth a layer


def pulse(x: np.ndarray) -> np.ndarray:
    """Return the velocity [m/s] of the start at `x` [m]."""
    inside = np.abs(x - CENTRE) < 0.5 * WIDTH
    return np.asarray(np.where(inside, SPEED * np.cos(np.pi * (x - CENTRE) / WIDTH) ** 2, 0.0))


def _trials(options: Options) -> Iterator[Trial]:
    for dim in (1, 2):
        dx = options.dx((0.1e-3, 0.25e-3)[dim - 1], (0.2e-3, 0.5e-3)[dim - 1])
        for ratio in (1, 2, 4):
            if not (options.quick and dim == 2 and ratio == 4):
                yield unlike_spacings(dim, dx, ratio)
    for rings in (False, True):
        yield _graded(options.dx(0.25e-3, 0.5e-3), rings)


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


def unlike_spacings(dim: int, dx: float, ratio: int) -> Trial:
    """Return a wave from a body of the spacing `dx` [m] into one of `ratio` times that."""

    def start(particles: Particles) -> None:
        x = particles["position"].reshape(particles.count, -1)[:, 0]
        face = 0.5 * (x[particles.body == 0].max() + x[particles.body == 1].min() - 0.5 * (ratio - 1) * dx)
        velocity = np.zeros((particles.count, dim))
        velocity[:, 0] = np.where(particles.body == 0, pulse(x - face), 0.0)
        particles["velocity"] = velocity

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        passed = ran.momentum(1)[0] / ran.momentum(0, ran.first)[0]
        yield Figure("transmitted momentum", float(passed), 0.5, 0.02, why="half of the pulse")
        x, u = _along(ran, 0)
        reflected = np.abs(u[(x > x.max() - 10e-3) & (x < x.max() - 2e-3)]).max()
        yield limit("reflected over incident velocity", float(reflected / (0.5 * SPEED)),
                    REFLECTED[ratio], why="a face as thick as the coarser kernel")  # fmt: skip

    def curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
        (ran,) = runs
        return {"velocity_x": [Curve(name, *_along(ran, body)) for body, name in enumerate(("first", "second"))]}

    return Trial(f"{dim}D, 1:{ratio}", [Start(_case(dim, dx, ratio), state=start)], figures, curves)


def _graded(dx: float, rings: bool) -> Trial:
    """Return a strip, or a cylinder of rings, whose layers grow from dx to 2 dx behind the pulse's start."""
    length = sum(LENGTHS)
    solid = {"type": "cylinder", "diameter": 2.0 * RIM, "length": length}
    bar = {
        "material": ELASTIC,
        "shape": solid if rings else {"type": "box", "size": [length, THICKNESS]},
        "grading": {"fine": [LENGTHS[0], None], "coarsest": 2.0 * dx, "face": "front"},
        "position": [0.5 * length - LENGTHS[0], 0.0],
    }
    case = _case(2, dx, 1) | {"bodies": {"bar": bar}}
    if rings:
        case |= {"kinematics": "axisymmetric", "symmetry": []}

    def start(particles: Particles) -> None:
        x = particles["position"]
        particles["velocity"] = np.column_stack([pulse(x[:, 0]), np.zeros(particles.count)])

    def core(ran: Ran) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return masses, x, and velocities along x at the start and now, of what no wave from the rim has reached."""
        core_rows = vectors(ran.first, "position")[:, 1] < CORE
        u0, u = (vectors(snapshot, "velocity")[core_rows, 0] for snapshot in (ran.first, ran.last))
        return ran.first.fields["mass"][core_rows], vectors(ran.last, "position")[core_rows, 0], u0, u

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        mass, x, before, u = core(runs[0])
        passed = (mass * u)[x > 0.0].sum() / (mass * before).sum()
        yield Figure("transmitted momentum", float(passed), 0.5, 0.02, why="half of the pulse")
        reflected = np.abs(u[(x > -10e-3) & (x < -2e-3)]).max()
        yield limit("reflected over incident velocity", float(reflected / (0.5 * SPEED)), GRADED,
                    why="a tenth a layer")  # fmt: skip

    def curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
        _, x, _, u = core(runs[0])
        order = np.argsort(x)
        at = np.linspace(float(x.min()), float(x.max()), 400)
        exact = 0.5 * (pulse(at - C * END) + pulse(at + C * END) + pulse(-2.0 * LENGTHS[0] - at + C * END))
        return {"velocity_x": [Curve("computed", x[order], u[order]), Curve("exact", at, exact, exact=True)]}

    return Trial(f"{'axisymmetric' if rings else '2D'}, graded to 1:2", [Start(case, state=start)], figures, curves)


def _along(ran: Ran, body: int) -> tuple[np.ndarray, np.ndarray]:
    """Return x and velocity along x of a body, in order of x."""
    rows = np.flatnonzero(ran.last.body == body)
    x = vectors(ran.last, "position")[rows, 0]
    order = np.argsort(x)
    return x[order], vectors(ran.last, "velocity")[rows[order], 0]


PROBLEM = Problem(
    "spacings", "a wave passes between bodies of different spacings", _trials, EULERIAN,
    why_not="Total Lagrangian bodies have one smoothing length, projection has no equation of state",
)  # fmt: skip
