"""A square lattice inside two rings that follow the circumference of a disc.

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

from .concentric_rings import ring


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
