"""Simple lattice: equidistant in 1D, square in 2D, cubic in 3D.

Along an axis a body of size L holds n = round(L / dx) particles at (i - (n - 1) / 2) dx, so that the
outer particles lie dx / 2 inside the faces: 2 mm at 0.1 mm are 20 layers. Round shapes keep the nodes
strictly inside. A sphere 12 dx across holds 912 particles.
"""

from __future__ import annotations

import numpy as np

from hvisph.geometry.lattice_count import Filling, centre_coordinates, count_across, cover, make_filling
from hvisph.geometry.shapes import Box, Interval, Shape
from hvisph.geometry.shapes.shape import grid

# Nodes that are looked at together.
AT_ONCE = 2_000_000


def fill_lattice(shape: Shape, dx: float, even: tuple[int, ...] = ()) -> Filling:
    """Fill `shape` with the lattice of spacing `dx` [m].

    Parameters
    ----------
    shape, dx
        The shape and the spacing [m].
    even
        Axes along which the number of layers is even, so that none lies in the middle.

    Raises
    ------
    CaseError
        When the shape is thinner than half a particle.
    """
    low, high = shape.bounds()
    axes = [
        low[k] + (np.arange(count_across(high[k] - low[k], dx) + 1) + 0.5) * dx
        if k in shape.wall_axes and k not in shape.flat_axes
        else cover(low[k], high[k], dx, k in even)
        for k in range(shape.dim)
    ]
    size = tuple(len(axis) * dx for axis in axes)
    if isinstance(shape, Box | Interval):
        return make_filling(grid([centre_coordinates(len(axis), dx) for axis in axes]), dx, size, shape.extent())
    step = max(1, AT_ONCE // max(1, int(np.prod([len(axis) for axis in axes[1:]]))))
    slabs = [[axes[0][k : k + step], *axes[1:]] for k in range(0, len(axes[0]), step)]
    points = np.concatenate([grid(slab)[shape.contains_grid(slab)] for slab in slabs])
    return make_filling(points, dx, size, shape.extent())
