"""Boxes with graded spacing: fine where they are struck, coarse towards the rim.

Along each graded axis the layers are `dx` thick in the fine part, grow by at most a tenth from layer to layer outside
of it, up to the coarsest, and are stretched together so that they fill the box. A particle's volume is that of its
cell, so its mass follows; its smoothing length follows the cell's longest side, so that no neighbour is lost.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.geometry.filling import Filling, count_across
from hvisph.geometry.shapes.shape import Shape, grid

STEEPEST = 1.1  # thickness of a layer over that of the layer before it


@dataclass(frozen=True)
class Grading:
    """How the spacing grows.

    Parameters
    ----------
    fine
        Full width of the fine part along each axis, about the box's middle, None where the axis is
        not graded [m].
    coarsest
        Largest spacing [m].
    ratio
        Thickness of a layer over that of the layer before it, above 1 and at most 1.1.
    """

    fine: tuple[float | None, ...]
    coarsest: float
    ratio: float = STEEPEST


def fill_graded(shape: Shape, dx: float, grading: Grading, even: tuple[int, ...] = ()) -> Filling:
    """Fill a box with layers that grow away from its middle.

    Parameters
    ----------
    shape
        An `Interval` or a `Box`.
    dx
        Spacing in the fine part [m].
    grading
        Where it grows, and how far.
    even
        Axes in whose middle no layer may lie.

    Raises
    ------
    CaseError
        When the coarsest spacing is not above `dx` or the ratio not between 1 and 1.1.
    """
    if not grading.coarsest > dx:
        raise CaseError(f"the coarsest spacing must be above the finest, {dx:g}", where="grading.coarsest")
    if not 1 < grading.ratio <= STEEPEST + 1e-12:
        raise CaseError(f"the ratio must be above 1 and at most {STEEPEST:g}", where="grading.ratio")
    edges = []
    for axis, (length, fine) in enumerate(zip(shape.extent(), grading.fine, strict=True)):
        if fine is None or fine >= length:
            edges.append(np.linspace(-0.5, 0.5, count_across(length, dx, even=axis in even) + 1) * length)
        else:
            edges.append(_layers(length, fine, dx, grading, axis in even))
    widths = grid([np.diff(e) for e in edges])
    positions = grid([(e[1:] + e[:-1]) / 2 for e in edges])
    longest = widths.max(axis=1)
    note = (
        f"graded from {min(float(w.min()) for w in map(np.diff, edges)):.4g} to {float(longest.max()):.4g}, "
        f"by {_steepest(edges):.3g} a layer at most"
    )
    return Filling(positions, widths.prod(axis=1), shape.extent(), longest, note)


def _layers(length: float, fine: float, dx: float, grading: Grading, even: bool) -> np.ndarray:
    """Return the edges of the layers, symmetric about 0."""
    middle = count_across(fine, dx, even=even)
    half, width = middle * dx / 2, dx
    grown: list[float] = []
    while half + sum(grown) < length / 2:
        width = min(width * grading.ratio, grading.coarsest)
        grown.append(width)
    # the number of grown layers that fills the box with the least stretching of them
    rest = length / 2 - half
    if len(grown) > 1 and abs(sum(grown[:-1]) / rest - 1) < abs(sum(grown) / rest - 1):
        grown.pop()
    factor = rest / sum(grown)
    outer = half + np.cumsum(np.asarray(grown) * factor)
    inner = np.linspace(-half, half, middle + 1)
    edges = np.concatenate([-outer[::-1], inner, outer])
    edges[0], edges[-1] = -length / 2, length / 2
    return edges


def _steepest(edges: list[np.ndarray]) -> float:
    return max(float(np.max(np.maximum(w[1:] / w[:-1], w[:-1] / w[1:]), initial=1.0)) for w in map(np.diff, edges))
