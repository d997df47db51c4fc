"""Shapes of bodies, as a case file writes them."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo

from hvisph.case.model import SCALAR_AS_LIST, DataFile, Shorthand, StrictModel
from hvisph.case.units import Angle, Length, NonNegativeLength, Number, PositiveLength
from hvisph.core.shapes import SHAPES

Axis = Literal["x", "y", "z"]
Sizes = Annotated[tuple[PositiveLength, ...], SCALAR_AS_LIST, Field(min_length=2, max_length=3)]
Position = Annotated[tuple[Length, ...], SCALAR_AS_LIST, Field(min_length=1, max_length=3)]
AxisField = Annotated[Axis, Field(description="Axis along which the length lies")]
NoseField = Annotated[Axis, Field(description="Axis along which the nose points, towards larger coordinates")]


class Rotation(StrictModel):
    """A turn about the body's centre, counter-clockwise."""

    angle: Angle = Field(description="Angle [deg]")
    axis: tuple[Number, Number, Number] = Field(
        default=(0.0, 0.0, 1.0), description="Direction of the axis [-], not all zero; in 2D always z"
    )

    @property
    def radians(self) -> float:
        """Angle [rad]."""
        return math.radians(self.angle)


def _angle_alone(value: Any, info: ValidationInfo) -> Any:
    return {"angle": value} if isinstance(value, int | float | str) else value


OptionalRotation = Annotated[Rotation | None, Shorthand(_angle_alone)]


class ShapeOptions(StrictModel):
    """What every shape has."""

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis, as many as are known; empty where the parts decide [m]."""
        return ()

    def thickness(self) -> float:
        """Return the least size that has to hold particles, infinite where the parts decide [m]."""
        return min(self.extent(), default=math.inf)


class IntervalShape(ShapeOptions):
    """A stretch of the line (1D)."""

    type: Literal["interval"] = "interval"
    length: PositiveLength = Field(description="Length [m]")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.length,)


class DiscShape(ShapeOptions):
    """A disc (2D): the section of a long cylinder."""

    type: Literal["disc"] = "disc"
    diameter: PositiveLength = Field(description="Diameter [m]")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.diameter,) * 2


class AnnulusShape(ShapeOptions):
    """A disc with a concentric hole (2D): the section of a long tube."""

    type: Literal["annulus"] = "annulus"
    outer_diameter: PositiveLength = Field(description="Outer diameter [m]")
    inner_diameter: PositiveLength = Field(description="Diameter of the hole [m], below the outer one")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.outer_diameter,) * 2

    def thickness(self) -> float:
        """Return the thickness of the wall [m]."""
        return (self.outer_diameter - self.inner_diameter) / 2


class PolygonShape(ShapeOptions):
    """A region with straight edges (2D), in the coordinates of its points."""

    type: Literal["polygon"] = "polygon"
    points: tuple[tuple[Length, Length], ...] = Field(
        description="Corners in order, either way round; the last joins the first [m]", min_length=3, max_length=10_000
    )


class SphereShape(ShapeOptions):
    """A ball (3D)."""

    type: Literal["sphere"] = "sphere"
    diameter: PositiveLength = Field(description="Diameter [m]")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.diameter,) * 3


class HollowSphereShape(ShapeOptions):
    """A ball with a concentric cavity (3D)."""

    type: Literal["hollow_sphere"] = "hollow_sphere"
    outer_diameter: PositiveLength = Field(description="Outer diameter [m]")
    inner_diameter: PositiveLength = Field(description="Diameter of the cavity [m], below the outer one")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.outer_diameter,) * 3

    def thickness(self) -> float:
        """Return the thickness of the wall [m]."""
        return (self.outer_diameter - self.inner_diameter) / 2


class BoxShape(ShapeOptions):
    """A rectangle (2D) or a cuboid (3D), edges along the axes."""

    type: Literal["box"] = "box"
    size: Sizes = Field(description="Full sizes along x, y and, in 3D, z [m]")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return self.size


class CylinderShape(ShapeOptions):
    """A circular cylinder of finite length (3D)."""

    type: Literal["cylinder"] = "cylinder"
    diameter: PositiveLength = Field(description="Diameter [m]")
    length: PositiveLength = Field(description="Length [m]")
    axis: AxisField = "x"

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return _along(self.axis, self.length, self.diameter)


class TubeShape(ShapeOptions):
    """A circular tube of finite length (3D)."""

    type: Literal["tube"] = "tube"
    outer_diameter: PositiveLength = Field(description="Outer diameter [m]")
    inner_diameter: PositiveLength = Field(description="Inner diameter [m], below the outer one")
    length: PositiveLength = Field(description="Length [m]")
    axis: AxisField = "x"

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return _along(self.axis, self.length, self.outer_diameter)

    def thickness(self) -> float:
        """Return the lesser of the wall's thickness and the length [m]."""
        return min((self.outer_diameter - self.inner_diameter) / 2, self.length)


class ConeShape(ShapeOptions):
    """A cone, tip ahead (3D), or its section (2D)."""

    type: Literal["cone"] = "cone"
    diameter: PositiveLength = Field(description="Diameter of the base [m]")
    length: PositiveLength = Field(description="Length [m]")
    axis: NoseField = "x"

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return _along(self.axis, self.length, self.diameter)


class FrustumShape(ShapeOptions):
    """A truncated cone (3D), or its section (2D)."""

    type: Literal["frustum"] = "frustum"
    back_diameter: NonNegativeLength = Field(description="Diameter of the end at the back [m]")
    front_diameter: NonNegativeLength = Field(description="Diameter of the end ahead [m]")
    length: PositiveLength = Field(description="Length [m]")
    axis: NoseField = "x"

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return _along(self.axis, self.length, max(self.back_diameter, self.front_diameter))


class OgiveShape(ShapeOptions):
    """A tangent ogive with a cylinder behind it, the usual shape of a bullet (3D), or its section (2D).

    A calibre radius head q is a nose of D/2 sqrt(4 q - 1).
    """

    type: Literal["ogive"] = "ogive"
    diameter: PositiveLength = Field(description="Diameter of the cylinder [m]")
    nose_length: PositiveLength = Field(description="Length of the nose [m], at least half the diameter")
    shank_length: NonNegativeLength = Field(default=0.0, description="Length of the cylinder behind the nose [m]")
    axis: NoseField = "x"

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return _along(self.axis, self.nose_length + self.shank_length, self.diameter)


class DomeShape(ShapeOptions):
    """A cap of a ball on a flat base, by default a hemisphere (3D), or its section (2D)."""

    type: Literal["dome"] = "dome"
    diameter: PositiveLength = Field(description="Diameter of the base [m]")
    height: PositiveLength | None = Field(
        default=None, description="Height [m], at most half the diameter; a hemisphere unless given"
    )
    axis: NoseField = "x"

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return _along(self.axis, self.height or self.diameter / 2, self.diameter)


class RoundedCylinderShape(ShapeOptions):
    """A cylinder with rounded edges (3D), or its section (2D)."""

    type: Literal["rounded_cylinder"] = "rounded_cylinder"
    diameter: PositiveLength = Field(description="Diameter [m]")
    length: PositiveLength = Field(description="Full length [m]")
    edge_radius: PositiveLength = Field(
        description="Radius of the edges [m]; half the diameter makes the ends hemispheres"
    )
    ends: Literal["both", "front"] = Field(default="both", description="Which ends have rounded edges")
    axis: NoseField = "x"

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return _along(self.axis, self.length, self.diameter)


class PrismShape(ShapeOptions):
    """A plane shape drawn out along an axis (3D), its middle at 0."""

    type: Literal["prism"] = "prism"
    section: Shape = Field(description="Shape in 2D, in the two other axes in their order")
    length: PositiveLength = Field(description="Length [m]")
    axis: AxisField = "x"

    def thickness(self) -> float:
        """Return the lesser of the section's thickness and the length [m]."""
        return min(self.section.thickness(), self.length)


class RingShape(ShapeOptions):
    """A plane shape swept round an axis (3D): a torus from a disc, any solid of revolution from a polygon."""

    type: Literal["ring"] = "ring"
    section: Shape = Field(description="Shape in 2D: its x along the axis, its y outwards")
    radius: NonNegativeLength = Field(
        default=0.0, description="Distance from the axis to the section's origin [m]; 0 where its y is the radius"
    )
    axis: Axis = Field(default="x", description="Axis that it goes round")

    def thickness(self) -> float:
        """Return the section's thickness [m]."""
        return self.section.thickness()


class Part(StrictModel):
    """A shape within a combined one."""

    shape: Shape = Field(description="Shape of the part")
    position: Position | None = Field(default=None, description="Where its centre is [m]; the origin unless given")
    rotation: OptionalRotation = Field(
        default=None, description="Turn about its centre before placing: an angle [deg], or angle and axis"
    )


class UnionShape(ShapeOptions):
    """All that lies in one of the parts (2D, 3D)."""

    type: Literal["union"] = "union"
    parts: tuple[Part, ...] = Field(description="Shapes that are united", min_length=1, max_length=1000)


class IntersectionShape(ShapeOptions):
    """All that lies in every part (2D, 3D)."""

    type: Literal["intersection"] = "intersection"
    parts: tuple[Part, ...] = Field(description="Shapes that are intersected", min_length=1, max_length=1000)


class DifferenceShape(ShapeOptions):
    """A shape out of which others are cut: a plate with holes (2D, 3D)."""

    type: Literal["difference"] = "difference"
    whole: Shape = Field(description="Shape that is cut")
    removed: tuple[Part, ...] = Field(description="Shapes that are cut out", min_length=1, max_length=1000)


class RepeatShape(ShapeOptions):
    """Copies of a shape in a row or on a lattice, their middle at 0: honeycombs, meshes, tiles (2D, 3D)."""

    type: Literal["repeat"] = "repeat"
    shape: Shape = Field(description="Shape that is repeated")
    vectors: tuple[Position, ...] = Field(
        description="Steps from copy to copy [m]: one for a row, two or three for a lattice", min_length=1, max_length=3
    )
    counts: tuple[Annotated[int, Field(strict=True, ge=1, le=10_000)], ...] = Field(
        description="Number of copies along each", min_length=1, max_length=3
    )

    def thickness(self) -> float:
        """Return the thickness of one copy [m]."""
        return self.shape.thickness()


class MeshShape(ShapeOptions):
    """The solid within a closed surface of triangles (3D), in the coordinates of its file.

    Needs the extra `hvisph[mesh]`.
    """

    type: Literal["mesh"] = "mesh"
    file: DataFile = Field(description="STL, OBJ, PLY or OFF file; beside the case file unless the path is absolute")
    unit: PositiveLength = Field(description="Length of one unit of the file [m], such as 1 mm")


class ParticlesShape(ShapeOptions):
    """Particles from a file, as somebody made them: positions and masses (1D, 2D, 3D)."""

    type: Literal["particles"] = "particles"
    file: DataFile = Field(
        description="CSV with the columns x, y, z, mass; VTU with point data mass; HDF5 with position and mass"
    )
    unit: PositiveLength = Field(default=1.0, description="Length of one unit of the file's positions [m]")


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


def _along(axis: str, length: float, width: float) -> tuple[float, ...]:
    return tuple(length if axis == name else width for name in ("x", "y", "z"))


def shape_problems(shape: Any, dim: int, path: tuple[str | int, ...]) -> list[tuple[tuple[str | int, ...], str]]:
    """Return what is wrong with the dimensions of `shape` and its parts: places and messages."""
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
    for key in ("parts", "removed"):
        for number, part in enumerate(getattr(shape, key, ())):
            place = (*path, key, number)
            problems += shape_problems(part.shape, dim, (*place, "shape"))
            if part.shape.type in ("particles",):
                problems.append(((*place, "shape", "type"), "particles from a file cannot be part of a combined shape"))
            if part.position is not None and len(part.position) != dim:
                problems.append(((*place, "position"), f"has {len(part.position)} components, needs {dim} in {dim}D"))
    return problems
