"""What slides along a wall: the impulse along it over that into it is Coulomb's coefficient.

A block and a disc slide over a plate, also with lattices that are turned or in disorder, and a disc spins in a hole.
All are elastic and the contact is short, so that sliding does not end before they part.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hvisph.output.snapshot import Snapshot
from hvisph.setup.bodies import PlacedBody
from hvisph.verification.problem import ELASTIC, SOLIDS, Figure, Options, Problem, Ran, Start, Trial, limit, vectors

from .implosion import rings

Placing = Callable[[list[PlacedBody]], list[PlacedBody]]

DOWN = 20.0  # into the wall [m/s]
ALONG = {"block": 100.0, "disc": 60.0}  # fast enough that a disc does not come to roll [m/s]
SIDE = 4e-3  # of the block, and the disc's diameter [m]
SHAPES = {"block": {"type": "box", "size": [SIDE, SIDE]}, "disc": {"type": "disc", "diameter": SIDE}}
PLATE = [4e-3, 24e-3]
HOLE, AROUND, SPIN = 6e-3, 12e-3, 100.0  # diameters [m], and the speed of the disc's rim in its hole [m/s]
END = 8e-6


def _trials(options: Options) -> Iterator[Trial]:
    dx = options.dx(0.25e-3, 0.5e-3)
    for shape in SHAPES:
        for mu in (0.0, 0.3) if options.quick else (0.0, 0.1, 0.3):
            yield _over_plate(f"{shape}, friction {mu:g}", shape, mu, dx)


def _uneven(options: Options) -> Iterator[Trial]:
    dx = options.dx(0.25e-3, 0.5e-3)
    for angle, mu in ((37.0, 0.0),) if options.quick else ((15.0, 0.0), (37.0, 0.0), (37.0, 0.3)):
        yield _over_plate(f"block lattice rotated by {angle:g}, friction {mu:g}", "block", mu, dx, _turned(angle, dx))
    if not options.quick:
        yield _over_plate("disordered lattices, friction 0", "block", 0.0, dx, _in_disorder)
    yield _in_hole("disc spinning in a hole, friction 0", dx, lambda placed: placed)
    if not options.quick:
        yield _in_hole("disc in a hole, disordered, friction 0", dx, _in_disorder)


def _over_plate(name: str, shape: str, mu: float, dx: float, place: Placing | None = None) -> Trial:
    case: dict[str, Any] = {
        "title": name,
        "kinematics": "plane_strain",
        "resolution": dx,
        "bodies": {
            "slider": {"material": ELASTIC, "shape": SHAPES[shape], "velocity": [DOWN, ALONG[shape]]},
            "plate": {"material": ELASTIC, "shape": {"type": "box", "size": PLATE}},
        },
        "time": {"end": END},
    }
    if mu:  # without friction: whatever contact a formulation has by default
        case["formulation"] = {"contact": {"type": "frictional", "friction": mu}}

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        normal, tangential = ran.momentum(0, ran.first) - ran.momentum(0)
        return _figures(ran, float(normal), float(tangential), mu)

    return Trial(name, [Start(case, place)], figures)


def _in_hole(name: str, dx: float, place: Placing) -> Trial:
    spin = {"type": "spin", "rate": SPIN / (0.5 * HOLE)}
    ring = {"type": "annulus", "outer_diameter": AROUND, "inner_diameter": HOLE}
    case: dict[str, Any] = {
        "title": name,
        "kinematics": "plane_strain",
        "resolution": dx,
        "bodies": {
            "slider": {"material": ELASTIC, "shape": {"type": "disc", "diameter": HOLE}, "velocity": [DOWN, 0.0],
                       "initial_velocity": [spin], "position": [0.0, 0.0]},
            "ring": {"material": ELASTIC, "shape": ring, "position": [0.0, 0.0]},
        },
        "time": {"end": END},
    }  # fmt: skip

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        impulse = ran.momentum(0, ran.first) - ran.momentum(0)
        loss = (_spin(ran.first) - _spin(ran.last)) / (0.5 * HOLE)
        return _figures(ran, float(np.sqrt(impulse @ impulse)), loss, 0.0)

    def smooth(placed: list[PlacedBody]) -> list[PlacedBody]:  # walls of a lattice would be cogs, and geared
        faces = (0.0, 0.5 * HOLE), (0.5 * HOLE, 0.5 * AROUND)
        return place([_in_rings(body, *radii, dx) for body, radii in zip(placed, faces, strict=True)])

    return Trial(name, [Start(case, smooth)], figures)


def _in_rings(body: PlacedBody, inner: float, outer: float, dx: float) -> PlacedBody:
    quarter, volumes = rings(inner, outer, dx)
    positions = np.concatenate([quarter, quarter[:, ::-1] * [-1.0, 1.0], -quarter, quarter[:, ::-1] * [1.0, -1.0]])
    volumes = np.tile(volumes, 4)
    return replace(body, positions=positions, volumes=volumes, spacing=np.full(len(volumes), dx))


def _figures(ran: Ran, into: float, tangential: float, mu: float) -> Iterator[Figure]:
    yield Figure("tangential over normal impulse", tangential / into, mu, 0.03, scale=0.0, why="Coulomb's coefficient")
    start = float(ran.first.fields["mass"][ran.first.body == 0].sum()) * DOWN
    yield Figure("normal impulse over initial momentum", into / start, 1.2, 0.5, scale=0.0,
                 why="above the momentum brought, below twice of it: they have parted")  # fmt: skip
    yield limit("drift of momentum", ran.drift, 1e-12, why="round-off")


def _spin(snapshot: Snapshot) -> float:
    """Return the slider's angular momentum about its own middle [kg m/s]."""
    ball = snapshot.body == 0
    mass, x, u = snapshot.fields["mass"][ball], vectors(snapshot, "position")[ball], vectors(snapshot, "velocity")[ball]
    x, u = (values - np.average(values, axis=0, weights=mass) for values in (x, u))
    return float((mass * (x[:, 0] * u[:, 1] - x[:, 1] * u[:, 0])).sum())


def _turned(angle: float, dx: float) -> Placing:
    turn = np.radians(angle)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])

    def place(placed: list[PlacedBody]) -> list[PlacedBody]:
        slider, plate = placed
        steps = (np.arange(-round(SIDE / dx), round(SIDE / dx)) + 0.5) * dx
        lattice = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) @ rotation.T
        lattice = lattice[(np.abs(lattice) < 0.5 * SIDE).all(axis=1)]
        volumes = np.full(len(lattice), dx * dx)
        return [replace(slider, positions=lattice + slider.middle, volumes=volumes, spacing=0.0 * volumes + dx), plate]

    return place


def _in_disorder(placed: list[PlacedBody]) -> list[PlacedBody]:
    rng = np.random.default_rng(1)
    moves = [0.1 * body.spacing[:, None] * rng.uniform(-1.0, 1.0, body.positions.shape) for body in placed]
    return [replace(body, positions=body.positions + move) for body, move in zip(placed, moves, strict=True)]


PROBLEM = Problem("friction", "a block and a disc slide over a plate: impulses by Coulomb's law", _trials, SOLIDS)
WALLS = Problem("walls", "bodies slide along rough lattices: impulses by Coulomb's law", _uneven, SOLIDS)
