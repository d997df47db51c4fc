"""Points on the surface of a shape from its signed distance."""

from __future__ import annotations

import numpy as np

from .shapes import Shape


def on_surface(shape: Shape, points: np.ndarray) -> np.ndarray:
    """Return `points` (n, dim) moved to the surface; those that do not reach it are left out."""
    scale = max(shape.extent())
    points = points.copy()
    for _ in range(8):
        d = shape.distance(points)
        points -= d[:, None] * shape.outward(points, 1e-7 * scale)
    return points[np.abs(shape.distance(points)) < 1e-6 * scale]
