"""Shapes of bodies in a case file, and their combinations."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from hvisph.core.catalogues import SHAPES

from .model import SCALAR_AS_LIST, Shorthand, StrictModel, key
from .simple_shapes import (
    AnnulusShape,
    Axis,
    AxisField,
    BoxShape,
    ConeShape,
    CylinderShape,
    Direction,
    DiscShape,
    DomeShape,
    FrustumShape,
    HollowSphereShape,
    IntervalShape,
    MeshShape,
    OgiveShape,
    ParticlesShape,
    PolygonShape,
    RoundedCylinderShape,
    ShapeOptions,
    SphereShape,
    TubeShape,
)
from .units import NUMBER, Angle, Length, NonNegativeLength, PositiveLength, Quantity

Position = Annotated[tuple[Length, ...], SCALAR_AS_LIST, Field(min_length=1, max_length=3)]


class Rotation(StrictModel):
    """Counter-clockwise rotation about the centre of the body."""

    angle: Angle = key("Angle [deg]")
    axis: Direction = key("Direction of the axis [-], not all zero, or x, y or z; in 2D always z", (0.0, 0.0, 1.0))

    @property
    def radians(self) -> float:
        """Angle [rad]."""
        return math.radians(self.angle)


OptionalRotation = Annotated[
    Rotation | None, Shorthand(lambda value, _: {"angle": value} if isinstance(value, int | float | str) else value)
]


class PrismShape(ShapeOptions):
    """Plane shape extruded along an axis (3D), centred at 0."""

    type: Literal["prism"] = "prism"
    section: Shape = key("Shape in 2D, in the two other axes in their order")
    length: PositiveLength = key("Length [m]")
    axis: AxisField = "x"

    def thickness(self) -> float:
        """Return the lesser of the section's thickness and the length [m]."""
        return min(self.section.thickness(), self.length)


class RingShape(ShapeOptions):
    """Plane shape revolved about an axis (3D): a torus from a disc, a solid of revolution from a polygon."""

    type: Literal["ring"] = "ring"
    section: Shape = key("Shape in 2D: its x along the axis, its y outwards")
    radius: NonNegativeLength = key(
        "Distance from the axis to the section's origin [m]; 0 where its y is the radius", 0.0
    )
    axis: Axis = key("Axis that it goes round", "x")

    def thickness(self) -> float:
        """Return the section's thickness [m]."""
        return self.section.thickness()


class HoneycombShape(ShapeOptions):
    """Hexagonal cells along x in a box, a cell at its centre; walls normal to y have two foils (3D)."""

    type: Literal["honeycomb"] = "honeycomb"
    cell: PositiveLength = key("Width of a cell between opposite walls [m]")
    foil: PositiveLength = key("Thickness of the foil [m]")
    thickened: Annotated[float, Quantity(NUMBER, minimum=1)] = key(
        "Drawn thickness over that of the foil [-], at least 1; the material's `porosity.distension` must "
        "be the same, so that cell and mass are those of the foil",
        1.0,
    )
    size: tuple[PositiveLength, PositiveLength, PositiveLength] = key("Depth along x, and sizes along y and z [m]")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return self.size

    def thickness(self) -> float:
        """Return the drawn thickness of a wall of one foil [m]."""
        return self.foil * self.thickened


class Part(StrictModel):
    """Shape within a combined shape."""

    shape: Shape = key("Shape of the part")
    position: Position | None = key("Where its centre is [m]; the origin unless given", None)
    rotation: OptionalRotation = key("Turn about its centre before placing: an angle [deg], or angle and axis", None)


class UnionShape(ShapeOptions):
    """Union of shapes (2D, 3D)."""

    type: Literal["union"] = "union"
    parts: tuple[Part, ...] = key("Shapes that are united", min_length=1, max_length=1000)


class IntersectionShape(ShapeOptions):
    """Intersection of shapes (2D, 3D)."""

    type: Literal["intersection"] = "intersection"
    parts: tuple[Part, ...] = key("Shapes that are intersected", min_length=1, max_length=1000)


class DifferenceShape(ShapeOptions):
    """Difference of shapes: a plate with holes (2D, 3D)."""

    type: Literal["difference"] = "difference"
    whole: Shape = key("Shape that is cut")
    removed: tuple[Part, ...] = key("Shapes that are cut out", min_length=1, max_length=1000)


class RepeatShape(ShapeOptions):
    """Copies of a shape in a row or on a lattice, centred at 0: honeycombs, meshes, tiles (2D, 3D)."""

    type: Literal["repeat"] = "repeat"
    shape: Shape = key("Shape that is repeated")
    vectors: tuple[Position, ...] = key(
        "Steps from copy to copy [m]: one for a row, two or three for a lattice", min_length=1, max_length=3
    )
    counts: tuple[Annotated[int, Field(strict=True, ge=1, le=10_000)], ...] = key(
        "Number of copies along each", min_length=1, max_length=3
    )

    def thickness(self) -> float:
        """Return the thickness of one copy [m]."""
        return self.shape.thickness()


Shape = Annotated[
    IntervalShape
    | DiscShape
    | AnnulusShape
    | PolygonShape
    | SphereShape
    | HollowSphereShape
    | BoxShape
    | CylinderShape
    | TubeShape
    | ConeShape
    | FrustumShape
    | OgiveShape
    | DomeShape
    | RoundedCylinderShape
    | PrismShape
    | RingShape
    | HoneycombShape
    | UnionShape
    | IntersectionShape
    | DifferenceShape
    | RepeatShape
    | MeshShape
    | ParticlesShape,
    Field(discriminator="type"),
]

for _model in (Part, PrismShape, RingShape, UnionShape, IntersectionShape, DifferenceShape, RepeatShape):
    _model.model_rebuild()


def shape_problems(shape: Shape, dim: int, path: tuple[str | int, ...]) -> list[tuple[tuple[str | int, ...], str]]:
    """Return the errors in the dimensions of `shape` and its parts as paths and messages."""
    if shape.type not in SHAPES[dim]:
        return [((*path, "type"), f"a {shape.type} has no meaning in {dim}D; allowed: {', '.join(SHAPES[dim])}")]
    problems: list[tuple[tuple[str | int, ...], str]] = []
    if isinstance(shape, BoxShape) and len(shape.size) != dim:
        axes = ", ".join("xyz"[:dim])
        problems.append(((*path, "size"), f"has {len(shape.size)} sizes, needs {dim} in {dim}D: [{axes}]"))
    if dim == 2 and getattr(shape, "axis", "x") == "z":
        problems.append(((*path, "axis"), "there is no axis z in 2D; allowed: x, y"))
    if isinstance(shape, PrismShape | RingShape):
        problems += shape_problems(shape.section, 2, (*path, "section"))
    if isinstance(shape, RepeatShape):
        problems += shape_problems(shape.shape, dim, (*path, "shape"))
        for number, vector in enumerate(shape.vectors):
            if len(vector) != dim:
                problems.append(((*path, "vectors", number), f"has {len(vector)} components, needs {dim} in {dim}D"))
        if len(shape.counts) != len(shape.vectors):
            problems.append(((*path, "counts"), f"has {len(shape.counts)} counts for {len(shape.vectors)} vectors"))
    if isinstance(shape, DifferenceShape):
        problems += shape_problems(shape.whole, dim, (*path, "whole"))
    for name in ("parts", "removed"):
        for number, part in enumerate(getattr(shape, name, ())):
            place = (*path, name, number)
            problems += shape_problems(part.shape, dim, (*place, "shape"))
            if part.shape.type in ("particles",):
                problems.append(((*place, "shape", "type"), "particles from a file cannot be part of a combined shape"))
            if part.position is not None and len(part.position) != dim:
                problems.append(((*place, "position"), f"has {len(part.position)} components, needs {dim} in {dim}D"))
    return problems
