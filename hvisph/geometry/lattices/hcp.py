"""Hexagonal close packing (3D): twelve neighbours at the distance a.

A node's cell has the volume a^3 / sqrt(2); a = 2^(1/6) dx = 1.1225 dx makes it dx^3. Triangular layers
lie across x (across the axis of a cylinder), a sqrt(2/3) apart, so that the face towards the other body
is flat; every second layer is shifted into the hollows of the first. Spheres have a node at the centre.
"""

from __future__ import annotations

import math

import numpy as np

from hvisph.geometry.lattice_count import Filling, count_across, make_filling
from hvisph.geometry.shapes import Box, Cylinder, Shape

NODE_DISTANCE = 2 ** (1 / 6)  # a / dx [-]


def fill_hcp(shape: Shape, dx: float) -> Filling:
    """Fill the shape with close-packed layers of cell volume `dx`^3 [m^3].

    Raises
    ------
    CaseError
        When the shape is thinner than half a layer or row.
    """
    a = NODE_DISTANCE * dx
    steps = (a * math.sqrt(2 / 3), a, a * math.sqrt(3) / 2)  # layer, node in a row, row
    if isinstance(shape, Cylinder):
        layers = count_across(shape.length, steps[0])
        half = [count_across(shape.diameter / 2, step, "cylinder's radius") + 1 for step in steps[1:]]
        points = _nodes([np.arange(layers), *(np.arange(-h, h + 1) for h in half)]) * steps
        points[:, 0] -= (layers - 1) / 2 * steps[0]
        points = np.roll(points, shape.axis_column, axis=1)
        size = tuple(layers * steps[0] if axis == shape.axis_column else shape.diameter for axis in range(3))
        return make_filling(points[shape.contains(points)], dx, size, shape.extent())
    if not isinstance(shape, Box):
        low, high = shape.bounds()
        sides = zip((high - low) / 2, steps, strict=True)
        half = [count_across(max(float(side), step), step, f"{shape.kind}'s half width") + 1 for side, step in sides]
        points = _nodes([np.arange(-h, h + 1) for h in half]) * steps + (low + high) / 2
        return make_filling(points[shape.contains(points)], dx, shape.extent(), shape.extent())
    counts = [count_across(side, step) for side, step in zip(shape.extent(), steps, strict=True)]
    points = _nodes([np.arange(count) for count in counts]) * steps
    points -= (points.min(axis=0) + points.max(axis=0)) / 2
    return make_filling(points, dx, tuple(n * step for n, step in zip(counts, steps, strict=True)), shape.extent())


def _nodes(indices: list[np.ndarray]) -> np.ndarray:
    """Return the nodes of `indices` (layer, node, row) in units of the three steps: (n, 3)."""
    layer, node, row = (index.ravel() for index in np.meshgrid(*indices, indexing="ij"))
    odd_layer = layer % 2
    return np.stack([layer, node + ((row + layer) % 2) / 2, row + odd_layer / 3], axis=1)
