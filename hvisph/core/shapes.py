"""Catalogue of shapes and arrangements by dimension."""

from __future__ import annotations

from dataclasses import dataclass

_NOSED = ("cone", "frustum", "ogive", "dome", "rounded_cylinder")
_COMBINED = ("union", "intersection", "difference", "repeat")
# The shapes of each number of dimensions.
SHAPES: dict[int, tuple[str, ...]] = {
    1: ("interval", "particles"),
    2: ("disc", "box", "annulus", "polygon", *_NOSED, *_COMBINED, "particles"),
    3: ("sphere", "box", "cylinder", "tube", "hollow_sphere", *_NOSED, "prism", "ring", *_COMBINED, "mesh",
        "particles"),
}  # fmt: skip


@dataclass(frozen=True)
class Arrangement:
    """Particle arrangement in a shape; its function is in `hvisph.geometry.filling`.

    Parameters
    ----------
    name
        Name in case files.
    dims
        Numbers of dimensions in which it has a meaning.
    shapes
        Shapes that it is for; empty where it is for all that have to be filled.
    """

    name: str
    dims: tuple[int, ...]
    shapes: tuple[str, ...] = ()


# The first that suits a shape is its default.
ARRANGEMENTS: dict[str, Arrangement] = {
    arrangement.name: arrangement
    for arrangement in (
        Arrangement("uniform", (1,)),
        Arrangement("square", (2,)),
        Arrangement("cubic", (3,)),
        Arrangement("hexagonal", (2,)),
        Arrangement("hcp", (3,)),
        Arrangement("relaxed", (2, 3)),
        Arrangement("rings", (2,), ("disc",)),
        Arrangement("lattice_two_rings", (2,), ("disc",)),
        Arrangement("from_file", (1, 2, 3), ("particles",)),
    )
}


# Those for rings about an axis: their first row stands half a spacing from it.
SECTION_ARRANGEMENTS = ("square", "relaxed")


def arrangements_of(dim: int, shape: str) -> tuple[str, ...]:
    """Return the arrangements that have a meaning for a shape in `dim` dimensions, its default first."""
    suiting = [a for a in ARRANGEMENTS.values() if dim in a.dims]
    if shape == "particles":  # they stand where their file says
        return tuple(a.name for a in suiting if shape in a.shapes)
    return tuple(a.name for a in suiting if not a.shapes or shape in a.shapes)
