"""Filling of a shape with particles of a lattice and a spacing, and of exact mass.

For the exact mass the spacing is stretched to fit, then the masses are scaled. Between flat faces a lattice of
n = round(L/dx) layers is stretched to L/n, by less than half a layer. Across round and oblique surfaces the count N
jumps with the spacing s: among spacings a few per cent about dx the one is taken at which N s^dim comes nearest to the
volume. The rest goes into the masses by one factor, so that their sum is the shape's to round-off.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np
import scipy

from hvisph.core.catalogues import arrangements_of
from hvisph.core.errors import CaseError
from hvisph.geometry import lattices
from hvisph.geometry.lattices import Filling
from hvisph.geometry.shapes import Box, Intersection, Placed, Shape
from hvisph.geometry.shapes.shape import push_inside

REACH = 1.5  # of the pair force, in close-packed distances
ROUNDS = 80
PAIRS_EVERY = 5
FIRST_STEP, LAST_STEP = 0.25, 0.02  # [a]
UNSURE = 0.25  # [a]; how well a distance to the surface is known
DEPTH = 0.5  # of the outer layer below the surface, in spacings


def fill_relaxed(shape: Shape, dx: float, even: tuple[int, ...] = ()) -> Filling:
    """Spread particles of volume `dx`^dim evenly, mirrored across the axes `even`; `CaseError` if none fits."""
    middle = np.add(*shape.bounds()) / 2
    part = shape
    if even:  # the part above the middle planes
        low, high = shape.bounds()
        corner = np.where(np.isin(np.arange(shape.dim), even), middle, low - (high - low))
        size = 2 * high - low - corner
        part = Intersection((shape, Placed(Box(tuple(size.tolist())), corner + size / 2)))
    share = 0.5 ** len(even)
    count = max(1, round(shape.volume * share / dx**shape.dim))
    points = _relax(part, _start(part, dx, count), dx)
    for axis in even:
        mirrored = points.copy()
        mirrored[:, axis] = 2 * middle[axis] - mirrored[:, axis]
        points = np.concatenate([points, mirrored])
    return lattices.make_filling(points, dx, shape.extent(), shape.extent())


def _start(shape: Shape, dx: float, count: int) -> np.ndarray:
    """Return `count` points inside the shape, on a close-packed lattice."""
    close = lattices.fill_hexagonal if shape.dim == 2 else lattices.fill_hcp
    grown, points = dx, np.empty((0, shape.dim))
    for _ in range(40):  # finer until there are enough
        with suppress(CaseError):
            points = close(shape, grown).positions
        if len(points) >= count:
            break
        grown *= 0.97
    if len(points) < count:
        raise CaseError(f"no particle at spacing {dx:g} fits into the body", where="resolution")
    deepest = np.argsort(shape.distance(points), kind="stable")[:count]
    return np.asarray(points[np.sort(deepest)])


def _relax(shape: Shape, points: np.ndarray, dx: float) -> np.ndarray:
    """Return `points` moved apart until they are evenly spread."""
    a = dx * (lattices.TRIANGULAR if shape.dim == 2 else lattices.CLOSE_PACKED)
    reach = REACH * a
    # a lattice is in balance wherever it stands: shaken, so that it finds the shape
    points = points + 0.05 * a * np.random.default_rng(0).uniform(-1, 1, points.shape)
    pairs, outer = np.empty((0, 2), int), np.empty(0, int)
    lengths = [FIRST_STEP * (LAST_STEP / FIRST_STEP) ** (step / (ROUNDS - 1)) * a for step in range(ROUNDS)]
    for step, length in enumerate(lengths):
        if step % PAIRS_EVERY == 0:
            pairs = scipy.spatial.cKDTree(points).query_pairs(reach + 0.3 * a, output_type="ndarray")
            farthest = sum(lengths[step : step + PAIRS_EVERY]) + UNSURE * a  # that a point goes until the next look
            outer = np.flatnonzero(shape.distance(points) > -DEPTH * dx - farthest)
        first, partner = pairs.T
        offset = points[first] - points[partner]
        r = np.maximum(np.sqrt((offset**2).sum(axis=1)), 1e-6 * a)
        push = offset * (np.maximum(1 - r / reach, 0.0) ** 2 / r)[:, None]
        move = np.stack(
            [
                np.bincount(first, push[:, k], len(points)) - np.bincount(partner, push[:, k], len(points))
                for k in range(shape.dim)
            ],
            axis=1,
        )
        size = np.sqrt((move**2).sum(axis=1)).max()
        points = points + move * (length / max(size, 0.2))
        points[outer] = push_inside(shape, points[outer], DEPTH * dx, 1e-3 * DEPTH * dx, 1e-3 * DEPTH * dx)
    return points


# How each arrangement of the catalogue is made, and those that lay even numbers of layers where asked to.
FUNCTIONS: dict[str, Callable[..., Filling]] = {
    "uniform": lattices.fill_lattice,
    "square": lattices.fill_lattice,
    "cubic": lattices.fill_lattice,
    "hexagonal": lattices.fill_hexagonal,
    "hcp": lattices.fill_hcp,
    "relaxed": fill_relaxed,
    "rings": lattices.fill_rings,
    "lattice_two_rings": lattices.fill_lattice_two_rings,
}
# Places of a lattice in the box around a shape up to which all are looked at, some seconds; beyond, a shape that fills
# less than this share of its box is refused: wires or drops that a slip of the unit has thrown far apart.
MOST_PLACES = 5e7
LEAST_SHARE = 1 / 300
PAIRED = ("uniform", "square", "cubic", "relaxed")


def fill(
    shape: Shape, arrangement: str | None, dx: float, *, exact: bool = True, even: tuple[int, ...] = ()
) -> Filling:
    """Fill `shape` with particles.

    `arrangement`: a name in the catalogue; None for the shape's default (uniform, square or cubic).
    `exact`: whether spacing and volumes give way so that sizes and mass are the shape's; otherwise every particle has
        the volume dx^dim, whatever that makes of the body.
    `even`: axes in whose middle no layer may lie, because a plane of symmetry does.
    Returns positions in the shape's coordinates, volumes, the size they stand for and a note of what had to give way.
    Raises `CaseError` when the shape is too small for the arrangement.
    """
    name = arrangements_of(shape.dim, shape.kind)[0] if arrangement is None else arrangement
    function = FUNCTIONS[name]
    arrange: Callable[[Shape, float], Filling] = partial(function, even=even) if even and name in PAIRED else function
    return fill_exactly(shape, dx, arrange) if exact else arrange(shape, dx)


def refuse_sparse(shape: Shape, dx: float) -> None:
    """Raise `CaseError` for a shape that is nearly all empty, and so large that looking through it takes minutes."""
    places = math.prod(max(side / dx, 1.0) for side in shape.extent())
    if places > MOST_PLACES and estimated_count(shape, dx) < LEAST_SHARE * places:
        size = " by ".join(f"{side:.3g}" for side in shape.extent())
        raise CaseError(
            f"the shape measures {size} and is nearly all empty: less than one in {1 / LEAST_SHARE:.0f} of "
            f"{places:.2g} places at a spacing of {dx:.3g} would hold a particle; check the units of "
            "its parts, or make them bodies"
        )


def estimated_count(shape: Shape, dx: float) -> float:
    """Return roughly how many particles `fill` would make, without making them: volume / dx^dim."""
    return shape.volume / dx**shape.dim


# How far the spacing may move from the one asked for (more in a body of few layers: less than half
# of one), and in how many steps either way.
FARTHEST, FEW_LAYERS, MOST, STEPS = 0.06, 0.48, 0.15, 24
# Nodes that the search may look at in all; a shape of more keeps dx, and its count is near enough.
MOST_NODES = 3_000_000
DEAR = 2.0  # a share of the mass that costs as much as twice the share of the spacing


def fill_exactly(shape: Shape, dx: float, arrange: Callable[[Shape, float], Filling]) -> Filling:
    """Fill `shape` by `arrange` at a spacing near `dx` [m], so that particles have the shape's volume."""
    best, cost = _stretch_to_mass(shape, dx, arrange), 0.0
    if len(shape.flat_axes) < shape.dim:
        cost = DEAR * abs(math.log(_share(shape, best)))
        nodes = math.prod(side / dx for side in shape.extent())
        farthest = min(max(FARTHEST, FEW_LAYERS * 2 * dx / min(shape.extent())), MOST)
        steps = min(STEPS, int(MOST_NODES / nodes / 2))
        for k in (sign * j for j in range(1, steps + 1) for sign in (-1, 1)):
            change = abs(k) / steps * farthest
            if change >= cost:
                continue
            try:
                candidate = _stretch_to_mass(shape, dx * (1 + k / steps * farthest), arrange)
            except CaseError:
                continue
            worth = change + DEAR * abs(math.log(_share(shape, candidate)))
            if worth < cost:
                best, cost = candidate, worth
    share = _share(shape, best)
    if abs(share - 1) > lattices.ROUND_OFF:
        best = replace(best, volumes=best.volumes * share)
    return replace(best, note=_note(shape, best, dx, share))


def _share(shape: Shape, filling: Filling) -> float:
    """Return the factor from the filling's volume to the shape's."""
    return shape.volume / float(filling.volumes.sum())


def _stretch_to_mass(shape: Shape, dx: float, arrange: Callable[[Shape, float], Filling]) -> Filling:
    """Return the nominal filling, stretched between the shape's flat faces."""
    filling = arrange(shape, dx)
    stretch = np.ones(shape.dim)
    for axis in shape.flat_axes:
        change = shape.extent()[axis] / filling.size[axis]
        stretch[axis] = change if abs(change - 1) > lattices.ROUND_OFF else 1.0
    if (stretch == 1.0).all():
        return filling
    middle = np.add(*shape.bounds()) / 2
    factor = float(stretch.prod())
    return replace(
        filling,
        positions=np.ascontiguousarray((filling.positions - middle) * stretch + middle),
        volumes=filling.volumes * factor,
        size=tuple(float(s) for s in np.asarray(filling.size) * stretch),
        spacing=filling.spacing * factor ** (1 / shape.dim),
    )


def _note(shape: Shape, filling: Filling, dx: float, share: float) -> str:
    notes = []
    change = float(filling.spacing / dx - 1)
    if abs(change) > lattices.ROUND_OFF:
        notes.append(f"the spacing is changed by {100 * change:+.2g} %")
    if abs(share - 1) > 1e-6:
        notes.append(f"every mass by {100 * (share - 1):+.2g} %")
    return f"so that size and mass are exact, {' and '.join(notes)}" if notes else ""
