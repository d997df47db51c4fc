"""Normals of shapes and points on their surfaces, from the signed distance alone."""

from __future__ import annotations

import numpy as np

from hvisph.geometry.shapes import Shape


def gradient(shape: Shape, points: np.ndarray, step: float) -> np.ndarray:
    """Return unit vectors (n, dim) along which the distance to the surface grows, by differences of `step` [m]."""
    slopes = np.empty_like(points)
    for axis in range(points.shape[1]):
        move = np.zeros(points.shape[1])
        move[axis] = step
        slopes[:, axis] = shape.distance(points + move) - shape.distance(points - move)
    size = np.sqrt((slopes**2).sum(axis=1))
    return slopes / np.maximum(size, 1e-300)[:, None]


def on_surface(shape: Shape, points: np.ndarray, rounds: int = 8) -> np.ndarray:
    """Return `points` (n, dim) moved to the surface; those that do not reach it are left out."""
    scale = max(shape.extent())
    points = points.copy()
    for _ in range(rounds):
        d = shape.distance(points)
        points -= d[:, None] * gradient(shape, points, 1e-7 * scale)
    return points[np.abs(shape.distance(points)) < 1e-6 * scale]
