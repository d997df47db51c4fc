"""From a shape, an arrangement's name and a spacing to particles: the room's front door."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from hvisph.core.errors import CaseError, nearest
from hvisph.geometry.arrangements.hcp import fill_hcp
from hvisph.geometry.arrangements.hexagonal import fill_hexagonal
from hvisph.geometry.arrangements.lattice import fill_lattice
from hvisph.geometry.arrangements.lattice_two_rings import fill_lattice_two_rings
from hvisph.geometry.arrangements.rings import fill_rings
from hvisph.geometry.filling import Filling
from hvisph.geometry.shapes import Box, Cylinder, Disc, Interval, Shape, Sphere


@dataclass(frozen=True)
class Arrangement:
    """One way to place particles: the shapes it has a meaning for, and the function that does it."""

    name: str
    dim: int
    shapes: tuple[type, ...]
    function: Callable[[Any, float], Filling]


# The first that suits a shape is its default.
ARRANGEMENTS: dict[str, Arrangement] = {
    arrangement.name: arrangement
    for arrangement in (
        Arrangement("even", 1, (Interval,), fill_lattice),
        Arrangement("square", 2, (Disc, Box), fill_lattice),
        Arrangement("cubic", 3, (Sphere, Box, Cylinder), fill_lattice),
        Arrangement("hexagonal", 2, (Disc, Box), fill_hexagonal),
        Arrangement("hcp", 3, (Sphere, Box, Cylinder), fill_hcp),
        Arrangement("rings", 2, (Disc,), fill_rings),
        Arrangement("lattice_two_rings", 2, (Disc,), fill_lattice_two_rings),
    )
}


def allowed_arrangements(shape: Shape) -> list[str]:
    """Return the names of the arrangements that have a meaning for `shape`, its default first."""
    return [a.name for a in ARRANGEMENTS.values() if a.dim == shape.dim and isinstance(shape, a.shapes)]


def fill(shape: Shape, arrangement: str | None, dx: float) -> Filling:
    """Fill `shape` with particles of volume dx^dim.

    Parameters
    ----------
    shape
        One of `hvisph.geometry.shapes`.
    arrangement
        A name in `ARRANGEMENTS`; None for the shape's default (even, square or cubic).
    dx
        Particle spacing [m].

    Returns
    -------
    Filling
        Positions about the shape's centre, volumes, the size they stand for and a note where it
        is not the size asked for.

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
        kind = type(shape).__name__.lower()
        raise CaseError(
            f"arrangement '{name}' has no meaning for a {kind} in {shape.dim}D; allowed: {', '.join(allowed)}",
            where="arrangement",
        )
    return ARRANGEMENTS[name].function(shape, dx)


def estimated_count(shape: Shape, dx: float) -> float:
    """Return roughly how many particles `fill` would make, without making them: volume / dx^dim."""
    return shape.volume / dx**shape.dim
