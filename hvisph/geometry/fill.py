"""From a shape, an arrangement's name and a spacing to particles: the room's front door."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from hvisph.core.errors import CaseError, nearest
from hvisph.geometry.arrangements.hcp import fill_hcp
from hvisph.geometry.arrangements.hexagonal import fill_hexagonal
from hvisph.geometry.arrangements.lattice import fill_lattice
from hvisph.geometry.arrangements.lattice_two_rings import fill_lattice_two_rings
from hvisph.geometry.arrangements.relaxed import fill_relaxed
from hvisph.geometry.arrangements.rings import fill_rings
from hvisph.geometry.filling import Filling
from hvisph.geometry.fit import fill_exactly
from hvisph.geometry.shapes import Disc, Shape


@dataclass(frozen=True)
class Arrangement:
    """One way to place particles: the shapes it has a meaning for, and the function that does it."""

    name: str
    dims: tuple[int, ...]
    shapes: type
    function: Callable[..., Filling]
    paired: bool = False  # lays even numbers of layers where asked to


# The first that suits a shape is its default.
ARRANGEMENTS: dict[str, Arrangement] = {
    arrangement.name: arrangement
    for arrangement in (
        Arrangement("even", (1,), Shape, fill_lattice, paired=True),
        Arrangement("square", (2,), Shape, fill_lattice, paired=True),
        Arrangement("cubic", (3,), Shape, fill_lattice, paired=True),
        Arrangement("hexagonal", (2,), Shape, fill_hexagonal),
        Arrangement("hcp", (3,), Shape, fill_hcp),
        Arrangement("relaxed", (2, 3), Shape, fill_relaxed, paired=True),
        Arrangement("rings", (2,), Disc, fill_rings),
        Arrangement("lattice_two_rings", (2,), Disc, fill_lattice_two_rings),
    )
}


def allowed_arrangements(shape: Shape) -> list[str]:
    """Return the names of the arrangements that have a meaning for `shape`, its default first."""
    return [a.name for a in ARRANGEMENTS.values() if shape.dim in a.dims and isinstance(shape, a.shapes)]


def fill(
    shape: Shape, arrangement: str | None, dx: float, *, exact: bool = True, even: tuple[int, ...] = ()
) -> Filling:
    """Fill `shape` with particles.

    Parameters
    ----------
    shape
        One of `hvisph.geometry.shapes`.
    arrangement
        A name in `ARRANGEMENTS`; None for the shape's default (even, square or cubic).
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
    if name not in ARRANGEMENTS:
        raise CaseError(f"unknown arrangement '{name}'{nearest(name, allowed)}", where="arrangement")
    if name not in allowed:
        raise CaseError(
            f"arrangement '{name}' has no meaning for a {shape.kind} in {shape.dim}D; allowed: {', '.join(allowed)}",
            where="arrangement",
        )
    chosen = ARRANGEMENTS[name]
    arrange: Any = partial(chosen.function, even=even) if even and chosen.paired else chosen.function
    return fill_exactly(shape, dx, arrange) if exact else arrange(shape, dx)


def estimated_count(shape: Shape, dx: float) -> float:
    """Return roughly how many particles `fill` would make, without making them: volume / dx^dim."""
    return shape.volume / dx**shape.dim
