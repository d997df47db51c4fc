"""Particles on concentric rings of a disc: the centre and rings r = k dx with round(2 pi k) particles.

The first particle of each ring is at angle 0. A disc 100 dx across holds 8012 particles, the count of
Farahani et al. 2009. The last ring lies on the disc's circumference, so the particles stand for a
little more area than the disc has (1 + dx / R times).
"""

from __future__ import annotations

import math

import numpy as np

from hvisph.geometry.lattice_count import Filling, count_across, make_filling
from hvisph.geometry.shapes import Disc


def fill_rings(shape: Disc, dx: float) -> Filling:
    """Fill the disc with rings a distance `dx` [m] apart.

    Raises
    ------
    CaseError
        When the radius is shorter than half a particle.
    """
    last = count_across(shape.diameter / 2, dx, "disc's radius")
    rings = [ring(k * dx, round(2 * math.pi * k)) for k in range(1, last + 1)]
    points = np.concatenate([np.zeros((1, 2)), *rings])
    return make_filling(points, dx, (2 * last * dx,) * 2, shape.extent())


def ring(radius: float, count: int) -> np.ndarray:
    """Return `count` points equally spaced on a circle of `radius` [m], the first at angle 0: (count, 2).

    The lower half mirrors the upper half bit for bit.
    """
    half = count // 2
    angles = 2 * math.pi / count * np.arange(half + 1)
    upper = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    upper[0, 1] = 0.0
    if count % 2 == 0:
        upper[half] = (-radius, 0.0)
    lower = upper[1 : count - half][::-1] * (1.0, -1.0)
    return np.concatenate([upper, lower])
