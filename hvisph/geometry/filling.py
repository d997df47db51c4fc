"""Filling of a shape with particles of a lattice and a spacing, and of exact mass.

For the exact mass the spacing is stretched to fit, then the masses are scaled. Between flat faces a lattice of
n = round(L/dx) layers is stretched to L/n, by less than half a layer. Across round and oblique surfaces the count N
jumps with the spacing s: among spacings a few per cent about dx the one is taken at which N s^dim comes nearest to the
volume. The rest goes into the masses by one factor, so that their sum is the shape's to round-off.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from hvisph.core.catalogues import arrangements_of
from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.geometry.lattices import ROUND_OFF, Filling

from .lattices import fill_hcp, fill_hexagonal, fill_lattice, fill_lattice_two_rings, fill_rings
from .relaxation import fill_relaxed
from .shapes import Shape

# How each arrangement of the catalogue is made, and those that lay even numbers of layers where asked to.
FUNCTIONS: dict[str, Callable[..., Filling]] = {
    "uniform": fill_lattice,
    "square": fill_lattice,
    "cubic": fill_lattice,
    "hexagonal": fill_hexagonal,
    "hcp": fill_hcp,
    "relaxed": fill_relaxed,
    "rings": fill_rings,
    "lattice_two_rings": fill_lattice_two_rings,
}
# Places of a lattice in the box around a shape up to which all are looked at, some seconds; beyond, a shape that fills
# less than this share of its box is refused: wires or drops that a slip of the unit has thrown far apart.
MOST_PLACES = 5e7
LEAST_SHARE = 1 / 300
PAIRED = ("uniform", "square", "cubic", "relaxed")


def allowed_arrangements(shape: Shape) -> list[str]:
    """Return the names of the arrangements that have a meaning for `shape`, its default first."""
    return list(arrangements_of(shape.dim, shape.kind))


def fill(
    shape: Shape, arrangement: str | None, dx: float, *, exact: bool = True, even: tuple[int, ...] = ()
) -> Filling:
    """Fill `shape` with particles.

    `shape`: one of `hvisph.geometry.shapes`.
    `arrangement`: a name in the catalogue; None for the shape's default (uniform, square or cubic).
    `dx`: particle spacing [m].
    `exact`: whether spacing and volumes give way so that sizes and mass are the shape's; otherwise every particle has
        the volume dx^dim, whatever that makes of the body.
    `even`: axes in whose middle no layer may lie, because a plane of symmetry does.

    Returns positions in the shape's coordinates, volumes, the size they stand for and a note of what had to give way.
    Raises `CaseError` when `dx` is not positive, the arrangement is unknown or has no meaning for the shape, or the
    shape is too small for it.
    """
    if not (math.isfinite(dx) and dx > 0):
        raise CaseError(f"the particle spacing must be positive and finite, not {dx:g}", where="resolution")
    allowed = allowed_arrangements(shape)
    name = allowed[0] if arrangement is None else arrangement
    if name not in FUNCTIONS:
        raise CaseError(f"unknown arrangement '{name}'{suggest_nearest(name, allowed)}", where="arrangement")
    if name not in allowed:
        raise CaseError(
            f"arrangement '{name}' has no meaning for a {shape.kind} in {shape.dim}D; allowed: {', '.join(allowed)}",
            where="arrangement",
        )
    function = FUNCTIONS[name]
    arrange: Callable[[Shape, float], Filling] = partial(function, even=even) if even and name in PAIRED else function
    return fill_exactly(shape, dx, arrange) if exact else arrange(shape, dx)


def refuse_sparse(shape: Shape, dx: float) -> None:
    """Raise `CaseError` for a shape that is nearly all empty, and so large that looking through it takes minutes."""
    places = math.prod(max(side / dx, 1.0) for side in shape.extent())
    if places > MOST_PLACES and estimated_count(shape, dx) < LEAST_SHARE * places:
        size = " by ".join(f"{side:.3g}" for side in shape.extent())
        raise CaseError(
            f"the shape measures {size} and is nearly all empty: less than one in {1 / LEAST_SHARE:.0f} of "
            f"{places:.2g} places at a spacing of {dx:.3g} would hold a particle; check the units of "
            "its parts, or make them bodies"
        )


def estimated_count(shape: Shape, dx: float) -> float:
    """Return roughly how many particles `fill` would make, without making them: volume / dx^dim."""
    return shape.volume / dx**shape.dim


# How far the spacing may move from the one asked for (more in a body of few layers: less than half
# of one), and in how many steps either way.
FARTHEST, FEW_LAYERS, MOST, STEPS = 0.06, 0.48, 0.15, 24
# Nodes that the search may look at in all; a shape of more keeps dx, and its count is near enough.
MOST_NODES = 3_000_000
# A share of the mass that costs as much as twice the share of the spacing.
DEAR = 2.0


def fill_exactly(shape: Shape, dx: float, arrange: Callable[[Shape, float], Filling]) -> Filling:
    """Fill `shape` by `arrange` so that the volumes of the particles add up to that of the shape.

    `shape`: shape that is filled.
    `dx`: spacing asked for [m].
    `arrange`: the arrangement: a function of shape and spacing.
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
    """Return the adjustment in words."""
    notes = []
    change = float(filling.spacing / dx - 1)
    if abs(change) > ROUND_OFF:
        notes.append(f"the spacing is changed by {100 * change:+.2g} %")
    if abs(share - 1) > 1e-6:
        notes.append(f"every mass by {100 * (share - 1):+.2g} %")
    return f"so that size and mass are exact, {' and '.join(notes)}" if notes else ""
