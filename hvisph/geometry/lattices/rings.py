"""Disc of concentric circles of particles, and a square lattice inside two such circles.

The first particle of each ring is at angle 0. A disc 100 dx across holds 8012 particles, the count of
Farahani et al. 2009. The last ring lies on the disc's circumference, so the particles stand for a
little more area than the disc has (1 + dx / R times).

With m = round(R / dx), the nodes (i, j) dx with i^2 + j^2 < (m - 2)^2, then rings of radius (m - 1) dx
and m dx. The inner ring's count is 2 pi (m - 1) rounded down, the outer's 2 pi m rounded: the reading
with which a disc 100 dx across holds 7209 + 307 + 314 = 7830 particles, the count and the remark on
rounding of Young et al. 2021, sec. 3.2 (after Mehra & Chaturvedi 2006).
"""

from __future__ import annotations

import math

import numpy as np

from hvisph.core.errors import CaseError
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


def fill_lattice_two_rings(shape: Disc, dx: float) -> Filling:
    """Fill the disc with a lattice of spacing `dx` [m] inside two rings.

    Raises
    ------
    CaseError
        When the radius is shorter than 3 dx: no lattice would be left inside the rings.
    """
    last = count_across(shape.diameter / 2, dx, "disc's radius")
    if last < 3:
        raise CaseError(
            f"lattice_two_rings needs a radius of at least 3 particle spacings, not {last}; "
            "refine the resolution or take the arrangement square",
            where="arrangement",
        )
    # whole numbers: which nodes are strictly inside must not hang on round-off
    nodes = np.arange(-(last - 3), last - 2)
    i, j = (index.ravel() for index in np.meshgrid(nodes, nodes, indexing="ij"))
    inside = i * i + j * j < (last - 2) ** 2
    lattice = np.stack([i[inside], j[inside]], axis=1) * dx
    inner = ring((last - 1) * dx, math.floor(2 * math.pi * (last - 1)))
    outer = ring(last * dx, round(2 * math.pi * last))
    return make_filling(np.concatenate([lattice, inner, outer]), dx, (2 * last * dx,) * 2, shape.extent())
