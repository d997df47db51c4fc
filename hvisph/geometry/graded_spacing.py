"""Graded spacing of boxes and rectangular sections: fine at the impact, coarse towards the rim.

Along each graded axis the layers are `dx` thick in the fine part and grow from layer to layer outside of it, by as much
less than the ratio as makes them fill the body, up to the coarsest. A particle's volume is that of its cell, of rings
that of the whole ring, so its mass follows; its smoothing length follows the cell's longest side, so that no neighbour
is lost.
"""

from dataclasses import dataclass

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.geometry.lattices import ROUND_OFF, Filling, count_across
from hvisph.geometry.shapes.shape import Shape, grid

STEEPEST = 1.1  # thickness of a layer over that of the layer before it


@dataclass(frozen=True)
class Grading:
    """How the spacing grows."""

    # full width of the fine part along each axis, about the box's middle or of rings about the axis, None where the
    # axis is not graded [m]
    fine: tuple[float | None, ...]
    coarsest: float  # largest spacing [m]
    ratio: float = STEEPEST  # thickness of a layer over that of the layer before it, above 1 and at most 1.1
    # where along x the fine part lies: in the `middle`, at the `front` (the face at lower x) or at the `rear`
    face: str = "middle"


def fill_graded(shape: Shape, dx: float, grading: Grading, even: tuple[int, ...] = ()) -> Filling:
    """Fill a box with layers that grow away from its fine part.

    `shape`: an `Interval` or a `Box`, or the `Section` of a cylinder, a tube or a ring of a box, whose y is the radius;
        the volumes of these are areas of the section.
    `dx`: spacing in the fine part [m].
    `grading`: where it grows, and how far.
    `even`: axes in whose middle no layer may lie.

    Raises `CaseError` when the coarsest spacing is not above `dx` or the ratio not between 1 and 1.1, or the shape is
    no box.
    """
    if len(shape.flat_axes) < shape.dim:
        raise CaseError(f"a {shape.kind} has even spacing; only what flat faces bound is graded", where="grading")
    if not grading.coarsest > dx:
        raise CaseError(f"the coarsest spacing must be above the finest, {dx:g}", where="grading.coarsest")
    if not 1 < grading.ratio <= STEEPEST + 1e-12:
        raise CaseError(f"the ratio must be above 1 and at most {STEEPEST:g}", where="grading.ratio")
    low, high = shape.bounds()
    edges = []
    for axis, fine in enumerate(grading.fine):
        length = float(high[axis] - low[axis])
        if axis in shape.radial_axes:
            share = None if fine is None else max(fine / 2 - float(low[axis]), dx)
            edges.append(low[axis] + _from_face(length, share, dx, grading))
        elif axis == 0 and grading.face == "front":
            edges.append(low[axis] + _from_face(length, fine, dx, grading))
        elif axis == 0 and grading.face == "rear":
            edges.append(high[axis] - _from_face(length, fine, dx, grading)[::-1])
        else:
            edges.append((low[axis] + high[axis]) / 2 + _from_middle(length, fine, dx, grading, axis in even))
    widths = grid([np.diff(e) for e in edges])
    positions = grid([(e[1:] + e[:-1]) / 2 for e in edges])
    longest = widths.max(axis=1)
    note = (
        f"graded from {min(float(w.min()) for w in map(np.diff, edges)):.4g} to {float(longest.max()):.4g}, "
        f"by {_steepest(edges):.3g} a layer at most"
    )
    return Filling(positions, widths.prod(axis=1), shape.extent(), longest, note)


def _from_face(length: float, fine: float | None, dx: float, grading: Grading) -> np.ndarray:
    """Return the edges of the layers, fine from 0 on."""
    count = count_across(min(fine or dx, length), dx)
    grown = _layer_thicknesses(length - count * dx, dx, grading) if fine is not None else None
    if grown is None:
        return np.linspace(0.0, length, count_across(length, dx) + 1)
    edges = np.concatenate([np.arange(count + 1) * dx, count * dx + np.cumsum(grown)])
    edges[-1] = length
    return edges


def _from_middle(length: float, fine: float | None, dx: float, grading: Grading, even: bool) -> np.ndarray:
    """Return the edges of the layers, symmetric about 0."""
    middle = count_across(min(fine or dx, length), dx, even=even)
    half = middle * dx / 2
    grown = _layer_thicknesses(length / 2 - half, dx, grading) if fine is not None else None
    if grown is None:
        return np.linspace(-0.5, 0.5, count_across(length, dx, even=even) + 1) * length
    outer = half + np.cumsum(grown)
    edges = np.concatenate([-outer[::-1], np.linspace(-half, half, middle + 1), outer])
    edges[0], edges[-1] = -length / 2, length / 2
    return edges


def _layer_thicknesses(rest: float, dx: float, grading: Grading) -> np.ndarray | None:
    """Return the thicknesses of as few layers as fill `rest` [m], each at most the ratio times the one before it.

    None where there is no space to grow: where as many layers of `dx` are thicker than `rest`.
    """

    def layers(count: int, ratio: float) -> np.ndarray:
        return np.asarray(np.minimum(dx * ratio ** np.arange(1, count + 1), grading.coarsest))

    count = 1
    while layers(count, grading.ratio).sum() < rest * (1 - ROUND_OFF):
        count += 1
    if count * dx > rest:
        return None
    low, high = 1.0, grading.ratio
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if layers(count, middle).sum() < rest else (low, middle)
    return layers(count, high)


def _steepest(edges: list[np.ndarray]) -> float:
    return max(float(np.max(np.maximum(w[1:] / w[:-1], w[:-1] / w[1:]), initial=1.0)) for w in map(np.diff, edges))
