"""Volumes and moments of shapes without a formula, from their signed distance.

A box around the shape is halved along all axes again and again. A cell whose centre is farther from the surface
than its corners is wholly in or out; what is left at the end lies along the surface, and a cell of it of size s
with its centre at the signed distance d counts clip(1/2 - d/s, 0, 1). Over a smooth surface the errors of the cells
cancel and along edges they go like s^2, which the last two sizes tell (Richardson's extrapolation).
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from hvisph.geometry.shapes.shape import Shape

# Cells along the surface at the end, by dimensions: some 1e-5 of the volume.
MOST_CELLS = 1_500_000
DEEPEST = 24
AT_ONCE = 250_000


def integrated_volume(shape: Shape) -> float:
    """Return the area or volume of `shape`, to about 1e-5 of its box [m^dim]."""
    return _integral(shape, None, 0.0)


def first_moment(shape: Shape, axis: int, offset: float) -> float:
    """Return the integral of (coordinate `axis` + `offset`) over `shape` [m^(dim+1)]."""
    exact = shape.centroid()
    if exact is not None:
        return shape.volume * (exact[axis] + offset)
    return _integral(shape, axis, offset)


def _integral(shape: Shape, axis: int | None, offset: float) -> float:
    dim = shape.dim
    low, high = shape.bounds()
    size = float((high - low).max())
    # cubes that cover the box, of which none is larger than the shortest side
    side = size / max(1, math.ceil(size / float((high - low).min()) - 1e-9))
    side = max(side, size / 64)
    counts = [max(1, math.ceil(float(s) / side - 1e-9)) for s in high - low]
    # an irrational shift keeps faces off the planes between cells
    start = (low + high) / 2 - np.array(counts) * side / 2 + side * 0.0137 * np.array([1.0, 0.618, 0.367][:dim])
    counts = [n + 1 for n in counts]
    cells = np.stack([g.ravel() for g in np.meshgrid(*map(np.arange, counts), indexing="ij")], axis=1)
    centres = start + cells * side
    corners = np.array(list(itertools.product((-0.25, 0.25), repeat=dim)))
    total, coarser, depth = 0.0, math.nan, 0
    while True:
        d = _distances(shape, centres)
        reach = side * math.sqrt(dim) / 2
        inside, along = d <= -reach, np.abs(d) < reach
        total += _weight(centres[inside], axis, offset).sum() * side**dim
        centres, d = centres[along], d[along]
        depth += 1
        share = np.clip(0.5 - d / side, 0.0, 1.0)
        integral = float(total + (share * _weight(centres, axis, offset)).sum() * side**dim)
        if len(centres) * 2**dim > MOST_CELLS or depth >= DEEPEST or len(centres) == 0:
            return integral + (integral - coarser) / 3 if depth > 3 else integral
        coarser = integral
        centres = (centres[:, None, :] + side * corners).reshape(-1, dim)
        side /= 2


def _weight(points: np.ndarray, axis: int | None, offset: float) -> np.ndarray:
    return np.ones(len(points)) if axis is None else points[:, axis] + offset


def _distances(shape: Shape, points: np.ndarray) -> np.ndarray:
    parts = [shape.distance(points[k : k + AT_ONCE]) for k in range(0, len(points), AT_ONCE)]
    return np.concatenate(parts) if parts else np.empty(0)
