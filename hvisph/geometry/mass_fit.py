"""Filling of exact mass: the spacing is stretched to fit, then the masses are scaled.

Between flat faces a lattice of n = round(L/dx) layers is stretched to L/n, by less than half a layer. Across round
and oblique surfaces the count N jumps with the spacing s: among spacings a few per cent about dx the one is
taken at which N s^dim comes nearest to the volume. What is then left goes into the masses, all by one factor, so that
their sum is the shape's to round-off.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hvisph.core.errors import CaseError

from .lattice_count import ROUND_OFF, Filling
from .shapes import Shape

# How far the spacing may move from the one asked for (more in a body of few layers: less than half
# of one), and in how many steps either way.
FARTHEST, FEW_LAYERS, MOST, STEPS = 0.06, 0.48, 0.15, 24
# Nodes that the search may look at in all; a shape of more keeps dx, and its count is near enough.
MOST_NODES = 3_000_000
# A share of the mass that costs as much as twice the share of the spacing.
DEAR = 2.0


def fill_exactly(shape: Shape, dx: float, arrange: Callable[[Shape, float], Filling]) -> Filling:
    """Fill `shape` by `arrange` so that the volumes of the particles add up to that of the shape.

    Parameters
    ----------
    shape
        What is filled.
    dx
        Spacing asked for [m].
    arrange
        The arrangement: a function of shape and spacing.
    """
    best, cost = _stretch_to_mass(shape, dx, arrange), 0.0
    if len(shape.flat_axes) < shape.dim:
        cost = DEAR * abs(math.log(_share(shape, best)))
        nodes = math.prod(side / dx for side in shape.extent())
        farthest = min(max(FARTHEST, FEW_LAYERS * 2 * dx / min(shape.extent())), MOST)
        steps = min(STEPS, int(MOST_NODES / nodes / 2))
        for k in (sign * j for j in range(1, steps + 1) for sign in (-1, 1)):
            change = abs(k) / steps * farthest
            if change >= cost:
                continue
            try:
                other = _stretch_to_mass(shape, dx * (1 + k / steps * farthest), arrange)
            except CaseError:
                continue
            worth = change + DEAR * abs(math.log(_share(shape, other)))
            if worth < cost:
                best, cost = other, worth
    share = _share(shape, best)
    if abs(share - 1) > ROUND_OFF:
        best = replace(best, volumes=best.volumes * share)
    return replace(best, note=_note(shape, best, dx, share))


def _share(shape: Shape, filling: Filling) -> float:
    """Return the factor from the filling's volume to the shape's."""
    return shape.volume / float(filling.volumes.sum())


def _stretch_to_mass(shape: Shape, dx: float, arrange: Callable[[Shape, float], Filling]) -> Filling:
    """Return the nominal filling, stretched between the shape's flat faces."""
    filling = arrange(shape, dx)
    stretch = np.ones(shape.dim)
    for axis in shape.flat_axes:
        change = shape.extent()[axis] / filling.size[axis]
        stretch[axis] = change if abs(change - 1) > ROUND_OFF else 1.0
    if (stretch == 1.0).all():
        return filling
    middle = np.add(*shape.bounds()) / 2
    factor = float(stretch.prod())
    return replace(
        filling,
        positions=np.ascontiguousarray((filling.positions - middle) * stretch + middle),
        volumes=filling.volumes * factor,
        size=tuple(float(s) for s in np.asarray(filling.size) * stretch),
        spacing=filling.spacing * factor ** (1 / shape.dim),
    )


def _note(shape: Shape, filling: Filling, dx: float, share: float) -> str:
    """Return what gave way."""
    notes = []
    change = float(filling.spacing / dx - 1)
    if abs(change) > ROUND_OFF:
        notes.append(f"the spacing is changed by {100 * change:+.2g} %")
    if abs(share - 1) > 1e-6:
        notes.append(f"every mass by {100 * (share - 1):+.2g} %")
    return f"so that size and mass are exact, {' and '.join(notes)}" if notes else ""
