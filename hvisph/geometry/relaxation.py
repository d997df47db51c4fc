"""Relaxed particle arrangement in any shape, by repulsion until the distances are uniform.

N = round(volume / dx^dim) particles start on a close-packed lattice inside the shape, those nearest to its surface left
out or doubled to make the number. Every pair closer than 1.5 of the close-packed distance a pushes
itself apart in proportion to (1 - r / 1.5 a)^2, with steps that shrink, and particles closer to the surface
than half a spacing are put back to that depth: so the outer layer follows the surface, and there is no axis
along which holes could line up. A packing by repulsion as in the generation of SPH particles by
Diehl et al. 2015 (weighted Voronoi relaxation), here with equal weights and a wall.
"""

from contextlib import suppress

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.geometry.lattices import Filling, make_filling

from .lattices import CLOSE_PACKED, TRIANGULAR, fill_hcp, fill_hexagonal
from .shapes import Intersection, Shape

REACH = 1.5  # of the pair force, in close-packed distances
ROUNDS = 80
PAIRS_EVERY = 5
FIRST_STEP, LAST_STEP = 0.25, 0.02  # [a]
UNSURE = 0.25  # [a]; how well a distance to the surface is known
DEPTH = 0.5  # of the outer layer below the surface, in spacings


def fill_relaxed(shape: Shape, dx: float, even: tuple[int, ...] = ()) -> Filling:
    """Fill the shape with evenly spread particles of volume `dx`^dim [m^dim].

    `shape`, `dx`: the shape and the spacing [m].
    `even`: axes across whose middle planes the particles are mirror images.

    Raises `CaseError` when the shape holds no particle.
    """
    middle = np.add(*shape.bounds()) / 2
    part = _clip_to_octant(shape, middle, even) if even else shape
    share = 0.5 ** len(even)
    count = max(1, round(shape.volume * share / dx**shape.dim))
    points = _relax(part, _start(part, dx, count), dx)
    for axis in even:
        mirrored = points.copy()
        mirrored[:, axis] = 2 * middle[axis] - mirrored[:, axis]
        points = np.concatenate([points, mirrored])
    return make_filling(points, dx, shape.extent(), shape.extent())


def _clip_to_octant(shape: Shape, middle: np.ndarray, even: tuple[int, ...]) -> Shape:
    """Return the part of the shape above its middle planes."""
    from hvisph.geometry.shapes import Box, Placed

    low, high = shape.bounds()
    corner = np.where(np.isin(np.arange(shape.dim), even), middle, low - (high - low))
    size = 2 * high - low - corner
    return Intersection((shape, Placed(Box(tuple(size.tolist())), corner + size / 2)))


def _start(shape: Shape, dx: float, count: int) -> np.ndarray:
    """Return `count` points inside the shape, on a close-packed lattice."""
    close = fill_hexagonal if shape.dim == 2 else fill_hcp
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
    from scipy.spatial import cKDTree

    a = dx * (TRIANGULAR if shape.dim == 2 else CLOSE_PACKED)
    reach = REACH * a
    # a lattice is in balance wherever it stands: shaken, so that it finds the shape
    points = points + 0.05 * a * np.random.default_rng(0).uniform(-1, 1, points.shape)
    pairs, outer = np.empty((0, 2), int), np.empty(0, int)
    lengths = [FIRST_STEP * (LAST_STEP / FIRST_STEP) ** (step / (ROUNDS - 1)) * a for step in range(ROUNDS)]
    for step, length in enumerate(lengths):
        if step % PAIRS_EVERY == 0:
            pairs = cKDTree(points).query_pairs(reach + 0.3 * a, output_type="ndarray")
            farthest = sum(lengths[step : step + PAIRS_EVERY]) + UNSURE * a  # that a point goes until the next look
            outer = np.flatnonzero(shape.distance(points) > -DEPTH * dx - farthest)
        first, second = pairs.T
        apart = points[first] - points[second]
        r = np.maximum(np.sqrt((apart**2).sum(axis=1)), 1e-6 * a)
        push = apart * (np.maximum(1 - r / reach, 0.0) ** 2 / r)[:, None]
        move = np.stack(
            [
                np.bincount(first, push[:, k], len(points)) - np.bincount(second, push[:, k], len(points))
                for k in range(shape.dim)
            ],
            axis=1,
        )
        size = np.sqrt((move**2).sum(axis=1)).max()
        points = points + move * (length / max(size, 0.2))
        points[outer] = _project_inside(shape, points[outer], DEPTH * dx)
    return points


def _project_inside(shape: Shape, points: np.ndarray, depth: float) -> np.ndarray:
    """Return `points` with those closer to the surface than `depth` put back to it."""
    left = np.arange(len(points))
    for _ in range(3):  # a point that is deep enough stays where it is
        d = shape.distance(points[left]) + depth
        out = d > 1e-3 * depth
        left = left[out]
        if len(left) == 0:
            break
        points[left] -= d[out, None] * shape.outward(points[left], 1e-3 * depth)
    return points
