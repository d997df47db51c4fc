"""Particles on a simple lattice: evenly spaced in 1D, square in 2D, cubic in 3D.

Along an axis a body of size L holds n = round(L / dx) particles at (i - (n - 1) / 2) dx, so that the
outer particles lie dx / 2 inside the faces: 2 mm at 0.1 mm are 20 layers. Round shapes keep the nodes
strictly inside. A sphere 12 dx across holds 912 particles.
"""

from __future__ import annotations

from hvisph.geometry.filling import Filling, centred, count_across, filled, grid
from hvisph.geometry.shapes import Shape


def fill_lattice(shape: Shape, dx: float) -> Filling:
    """Fill `shape` with the lattice of spacing `dx` [m].

    Raises
    ------
    CaseError
        When the shape is thinner than half a particle.
    """
    extent = shape.extent()
    counts = [count_across(side, dx) for side in extent]
    points = grid([centred(count, dx) for count in counts])
    # n - 1 spacings are always shorter than the size, so a box or an interval keeps every node
    points = points[shape.contains(points)]
    return filled(points, dx, tuple(count * dx for count in counts), extent)
