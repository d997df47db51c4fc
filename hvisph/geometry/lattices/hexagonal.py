"""Triangular lattice (2D): six neighbours at the distance a.

A node's cell has the area a^2 sqrt(3) / 2; a = dx (4/3)^(1/4) = 1.0746 dx makes it dx^2. Columns stand
along y, a sqrt(3) / 2 apart in x, so that the face towards the other body is flat. Discs have a node at
the centre. In boxes columns of n and n + 1 nodes alternate, each centred on the axis, with n chosen so
that their mean comes nearest to the height.
"""

from __future__ import annotations

import math

import numpy as np

from hvisph.geometry.lattice_count import Filling, centre_coordinates, count_across, make_filling
from hvisph.geometry.shapes import Box, Shape

NODE_DISTANCE = (4 / 3) ** 0.25  # a / dx [-]


def fill_hexagonal(shape: Shape, dx: float) -> Filling:
    """Fill the shape with a triangular lattice of cell area `dx`^2 [m^2].

    Raises
    ------
    CaseError
        When the shape is thinner than half a column.
    """
    a = NODE_DISTANCE * dx
    between = a * math.sqrt(3) / 2
    if not isinstance(shape, Box):
        low, high = shape.bounds()
        across, up = ((high - low) / 2).tolist()
        half = count_across(across, between, f"{shape.kind}'s half width") + 1
        nodes = 2 * (count_across(max(up, a), a) + 1) + 1
        columns = [_column(k * between, centre_coordinates(nodes + k % 2, a)) for k in range(-half, half + 1)]
        points = np.concatenate(columns) + (low + high) / 2
        return make_filling(points[shape.contains(points)], dx, shape.extent(), shape.extent())
    width, height = shape.extent()
    count = count_across(width, between)
    count_across(height, a)
    short = max(1, math.floor(height / a))
    columns = [
        _column(x, centre_coordinates(short + (k + 1) % 2, a)) for k, x in enumerate(centre_coordinates(count, between))
    ]
    mean = short + sum((k + 1) % 2 for k in range(count)) / count
    return make_filling(np.concatenate(columns), dx, (count * between, mean * a), shape.extent())


def _column(x: float, y: np.ndarray) -> np.ndarray:
    return np.stack([np.full(len(y), x), y], axis=1)
