"""Filling of a shape with particles of a lattice and a spacing."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.core.shapes import arrangements_of
from hvisph.geometry.lattices.cubic import fill_lattice
from hvisph.geometry.lattices.hcp import fill_hcp
from hvisph.geometry.lattices.hexagonal import fill_hexagonal
from hvisph.geometry.lattices.relaxation import fill_relaxed
from hvisph.geometry.lattices.rings import fill_lattice_two_rings, fill_rings

from .lattice_count import Filling
from .mass_fit import fill_exactly
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

    Parameters
    ----------
    shape
        One of `hvisph.geometry.shapes`.
    arrangement
        A name in the catalogue; None for the shape's default (uniform, square or cubic).
    dx
        Particle spacing [m].
    exact
        Whether spacing and volumes give way so that sizes and mass are the shape's; otherwise
        every particle has the volume dx^dim, whatever that makes of the body.
    even
        Axes in whose middle no layer may lie, because a plane of symmetry does.

    Returns
    -------
    Filling
        Positions in the shape's coordinates, volumes, the size they stand for and a note of what
        had to give way.

    Raises
    ------
    CaseError
        When `dx` is not positive, the arrangement is unknown or has no meaning for the shape, or the
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
    arrange: Any = partial(function, even=even) if even and name in PAIRED else function
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
