"""Shapes of bodies in a case file: by formula or from a file, and their combinations."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, ValidationInfo, field_validator

from hvisph.core.catalogues import SHAPES

from .model import BY_TYPE, SCALAR_AS_LIST, DataFile, Problem, Shorthand, StrictModel, key
from .units import NUMBER, Angle, Length, NonNegativeLength, Number, PositiveLength, Quantity

Axis = Literal["x", "y", "z"]
Sizes = Annotated[tuple[PositiveLength, ...], SCALAR_AS_LIST, Field(min_length=2, max_length=3)]
UNIT_VECTORS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def _along_axis(value: object, info: ValidationInfo) -> object:
    if isinstance(value, str) and value not in UNIT_VECTORS:
        raise ValueError(f"'{value}' is no axis: write x, y, z, or a direction such as [0, 1, 1]")
    return UNIT_VECTORS[value] if isinstance(value, str) else value


# A direction [-], or the letter of an axis.
Direction = Annotated[tuple[Number, Number, Number], Shorthand(_along_axis, forms=("string",))]
AxisField = Annotated[Axis, Field(description="Axis along which the length lies")]
NoseField = Annotated[Axis, Field(description="Axis along which the nose points, towards larger coordinates")]


class ShapeOptions(StrictModel):
    """Options of every shape."""

    def extent(self) -> tuple[float, ...]:
        """Return the full sizes along the axes [m]; empty where the keys do not give them."""
        return ()

    def thickness(self) -> float:
        """Return the least thickness [m]; infinite for combined shapes."""
        return min(self.extent(), default=math.inf)


class _Round(ShapeOptions):
    """Shape as wide along every axis, or along every axis but its own, on which its length lies."""

    axes: ClassVar[int] = 3

    def extent(self) -> tuple[float, ...]:
        width = self._width()
        return tuple(self._length() if axis == getattr(self, "axis", "") else width for axis in "xyz"[: self.axes])

    def thickness(self) -> float:
        shape: Any = self
        wall = [(shape.outer_diameter - shape.inner_diameter) / 2] if hasattr(self, "inner_diameter") else []
        return min(*self.extent(), *wall)

    def _faults(self) -> Iterator[Problem]:
        inner, outer = getattr(self, "inner_diameter", 0.0), getattr(self, "outer_diameter", math.inf)
        if inner >= outer:
            yield "inner_diameter", f"{inner:g} must be below the outer_diameter, {outer:g}"

    def _width(self) -> float:
        return float(getattr(self, "diameter", 0.0) or getattr(self, "outer_diameter", 0.0))

    def _length(self) -> float:
        return float(getattr(self, "length", 0.0))


class IntervalShape(ShapeOptions):
    """Interval of the x axis (1D)."""

    type: Literal["interval"] = "interval"
    length: PositiveLength = key("Length [m]")

    def extent(self) -> tuple[float, ...]:
        return (self.length,)


class DiscShape(_Round):
    """A disc (2D): the section of a long cylinder."""

    axes: ClassVar[int] = 2

    type: Literal["disc"] = "disc"
    diameter: PositiveLength = key("Diameter [m]")


class AnnulusShape(_Round):
    """A disc with a concentric hole (2D): the section of a long tube."""

    axes: ClassVar[int] = 2

    type: Literal["annulus"] = "annulus"
    outer_diameter: PositiveLength = key("Outer diameter [m]")
    inner_diameter: PositiveLength = key("Diameter of the hole [m], below the outer one")


class PolygonShape(ShapeOptions):
    """A region with straight edges (2D), in the coordinates of its points."""

    type: Literal["polygon"] = "polygon"
    points: tuple[tuple[Length, Length], ...] = key("Corners in order [m]", min_length=3, max_length=10_000)


class SphereShape(_Round):
    """A ball (3D)."""

    type: Literal["sphere"] = "sphere"
    diameter: PositiveLength = key("Diameter [m]")


class HollowSphereShape(_Round):
    """A ball with a concentric cavity (3D)."""

    type: Literal["hollow_sphere"] = "hollow_sphere"
    outer_diameter: PositiveLength = key("Outer diameter [m]")
    inner_diameter: PositiveLength = key("Diameter of the cavity [m], below the outer one")


class BoxShape(ShapeOptions):
    """A rectangle (2D) or a cuboid (3D), edges along the axes."""

    type: Literal["box"] = "box"
    size: Sizes = key("Full sizes along x, y and, in 3D, z [m]")

    def extent(self) -> tuple[float, ...]:
        return self.size


class CylinderShape(_Round):
    """A circular cylinder of finite length (3D)."""

    type: Literal["cylinder"] = "cylinder"
    diameter: PositiveLength = key("Diameter [m]")
    length: PositiveLength = key("Length [m]")
    axis: AxisField = "x"


class TubeShape(_Round):
    """A circular tube of finite length (3D)."""

    type: Literal["tube"] = "tube"
    outer_diameter: PositiveLength = key("Outer diameter [m]")
    inner_diameter: PositiveLength = key("Inner diameter [m], below the outer one")
    length: PositiveLength = key("Length [m]")
    axis: AxisField = "x"


class ConeShape(_Round):
    """A cone, tip ahead (3D), or its section (2D)."""

    type: Literal["cone"] = "cone"
    diameter: PositiveLength = key("Diameter of the base [m]")
    length: PositiveLength = key("Length [m]")
    axis: NoseField = "x"


class FrustumShape(_Round):
    """A truncated cone (3D), or its section (2D)."""

    type: Literal["frustum"] = "frustum"
    back_diameter: NonNegativeLength = key("Diameter of the end at the back [m]")
    front_diameter: NonNegativeLength = key("Diameter of the end ahead [m]")
    length: PositiveLength = key("Length [m]")
    axis: NoseField = "x"

    def _width(self) -> float:
        return max(self.back_diameter, self.front_diameter)


class OgiveShape(_Round):
    """Tangent ogive before a cylinder (3D), or its section (2D); calibre radius head q: a nose of D/2 sqrt(4 q - 1)."""

    type: Literal["ogive"] = "ogive"
    diameter: PositiveLength = key("Diameter of the cylinder [m]")
    nose_length: PositiveLength = key("Length of the nose [m], at least half the diameter")
    shank_length: NonNegativeLength = key("Length of the cylinder behind the nose [m]", 0.0)
    axis: NoseField = "x"

    def _length(self) -> float:
        return self.nose_length + self.shank_length


class DomeShape(_Round):
    """A cap of a ball on a flat base, by default a hemisphere (3D), or its section (2D)."""

    type: Literal["dome"] = "dome"
    diameter: PositiveLength = key("Diameter of the base [m]")
    height: PositiveLength | None = key("Height [m], at most half the diameter; a hemisphere unless given", None)
    axis: NoseField = "x"

    def _length(self) -> float:
        return self.height or self.diameter / 2


class RoundedCylinderShape(_Round):
    """A cylinder with rounded edges (3D), or its section (2D)."""

    type: Literal["rounded_cylinder"] = "rounded_cylinder"
    diameter: PositiveLength = key("Diameter [m]")
    length: PositiveLength = key("Full length [m]")
    edge_radius: PositiveLength = key("Radius of the edges [m]; half the diameter makes the ends hemispheres")
    ends: Literal["both", "front"] = key("Which ends have rounded edges", "both")
    axis: NoseField = "x"


class MeshShape(ShapeOptions):
    """Solid within a closed triangulated surface (3D), in its file's coordinates; needs `hvisph[mesh]`."""

    type: Literal["mesh"] = "mesh"
    file: DataFile = key("STL, OBJ, PLY or OFF file; beside the case file unless the path is absolute")
    unit: PositiveLength = key("Length of one unit of the file [m], such as 1 mm or 25.4 mm")

    @field_validator("unit", mode="before")
    @classmethod
    def _from_scalar(cls, value: object) -> object:
        return f"1 {value}" if isinstance(value, str) and value.strip().isalpha() else value


class ParticlesShape(ShapeOptions):
    """Particles from a file: positions and masses (1D, 2D, 3D)."""

    type: Literal["particles"] = "particles"
    file: DataFile = key("CSV with the columns x, y, z, mass; VTU with point data mass; HDF5 with position and mass")
    unit: PositiveLength = key("Length of one unit of the file's positions [m]", 1.0)


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
        return min(self.section.thickness(), self.length)


class RingShape(ShapeOptions):
    """Plane shape revolved about an axis (3D): a torus from a disc, a solid of revolution from a polygon."""

    type: Literal["ring"] = "ring"
    section: Shape = key("Shape in 2D: its x along the axis, its y outwards")
    radius: NonNegativeLength = key("Distance from the axis to the origin of the section [m]; 0: y is the radius", 0.0)
    axis: Axis = key("Axis that it goes round", "x")

    def thickness(self) -> float:
        return self.section.thickness()


class HoneycombShape(ShapeOptions):
    """Hexagonal cells along x in a box, a cell at its centre; walls normal to y have two foils (3D)."""

    type: Literal["honeycomb"] = "honeycomb"
    cell: PositiveLength = key("Width of a cell between opposite walls [m]")
    foil: PositiveLength = key("Thickness of the foil [m]")
    thickened: Annotated[float, Quantity(NUMBER, minimum=1)] = key(
        "Drawn thickness over that of the foil [-]; the material's `porosity.distension` must "
        "be the same, so that cell and mass are those of the foil",
        1.0,
    )
    size: tuple[PositiveLength, PositiveLength, PositiveLength] = key("Depth along x, and sizes along y and z [m]")

    def extent(self) -> tuple[float, ...]:
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
    vectors: tuple[Position, ...] = key("Lattice vectors of the copies [m], one for a row", min_length=1, max_length=3)
    counts: tuple[Annotated[int, Field(strict=True, ge=1, le=10_000)], ...] = key(
        "Number of copies along each", min_length=1, max_length=3
    )

    def thickness(self) -> float:
        return self.shape.thickness()


_Plane = IntervalShape | DiscShape | AnnulusShape | PolygonShape
_Solid = SphereShape | HollowSphereShape | BoxShape | CylinderShape | TubeShape
_Nosed = ConeShape | FrustumShape | OgiveShape | DomeShape | RoundedCylinderShape
_Swept = PrismShape | RingShape | HoneycombShape
_Combined = UnionShape | IntersectionShape | DifferenceShape | RepeatShape
Shape = Annotated[_Plane | _Solid | _Nosed | _Swept | _Combined | MeshShape | ParticlesShape, BY_TYPE]

for _model in (Part, PrismShape, RingShape, UnionShape, IntersectionShape, DifferenceShape, RepeatShape):
    _model.model_rebuild()


def shape_problems(shape: Shape, dim: int, path: str) -> Iterator[Problem]:
    """Yield the errors in the dimensions of `shape` and its parts."""
    if shape.type not in SHAPES[dim]:
        yield f"{path}.type", f"a {shape.type} has no meaning in {dim}D; allowed: {', '.join(SHAPES[dim])}"
        return
    if isinstance(shape, BoxShape) and len(shape.size) != dim:
        axes = ", ".join("xyz"[:dim])
        yield f"{path}.size", f"has {len(shape.size)} sizes, needs {dim} in {dim}D: [{axes}]"
    if dim == 2 and getattr(shape, "axis", "x") == "z":
        yield f"{path}.axis", "there is no axis z in 2D; allowed: x, y"
    if isinstance(shape, PrismShape | RingShape):
        yield from shape_problems(shape.section, 2, f"{path}.section")
    if isinstance(shape, RepeatShape):
        yield from shape_problems(shape.shape, dim, f"{path}.shape")
        for number, vector in enumerate(shape.vectors):
            if len(vector) != dim:
                yield f"{path}.vectors.{number}", f"has {len(vector)} components, needs {dim} in {dim}D"
        if len(shape.counts) != len(shape.vectors):
            yield f"{path}.counts", f"has {len(shape.counts)} counts for {len(shape.vectors)} vectors"
    if isinstance(shape, DifferenceShape):
        yield from shape_problems(shape.whole, dim, f"{path}.whole")
    for name in ("parts", "removed"):
        for number, part in enumerate(getattr(shape, name, ())):
            place = f"{path}.{name}.{number}"
            yield from shape_problems(part.shape, dim, f"{place}.shape")
            if part.shape.type == "particles":
                yield f"{place}.shape.type", "particles from a file cannot be part of a combined shape"
            if part.position is not None and len(part.position) != dim:
                yield f"{place}.position", f"has {len(part.position)} components, needs {dim} in {dim}D"
