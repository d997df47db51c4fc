"""Simple shapes of a case file: by formula, or from a file."""

import math
from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator

from .model import SCALAR_AS_LIST, DataFile, Shorthand, StrictModel, key
from .units import Length, NonNegativeLength, Number, PositiveLength

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
        """Return the known sizes along the axes [m]; empty for combined shapes."""
        return ()

    def thickness(self) -> float:
        """Return the least thickness [m]; infinite for combined shapes."""
        return min(self.extent(), default=math.inf)


class IntervalShape(ShapeOptions):
    """Interval of the x axis (1D)."""

    type: Literal["interval"] = "interval"
    length: PositiveLength = key("Length [m]")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.length,)


class DiscShape(ShapeOptions):
    """A disc (2D): the section of a long cylinder."""

    type: Literal["disc"] = "disc"
    diameter: PositiveLength = key("Diameter [m]")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.diameter,) * 2


class AnnulusShape(ShapeOptions):
    """A disc with a concentric hole (2D): the section of a long tube."""

    type: Literal["annulus"] = "annulus"
    outer_diameter: PositiveLength = key("Outer diameter [m]")
    inner_diameter: PositiveLength = key("Diameter of the hole [m], below the outer one")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.outer_diameter,) * 2

    def thickness(self) -> float:
        """Return the thickness of the wall [m]."""
        return (self.outer_diameter - self.inner_diameter) / 2


class PolygonShape(ShapeOptions):
    """A region with straight edges (2D), in the coordinates of its points."""

    type: Literal["polygon"] = "polygon"
    points: tuple[tuple[Length, Length], ...] = key(
        "Corners in order, either way round; the last joins the first [m]", min_length=3, max_length=10_000
    )


class SphereShape(ShapeOptions):
    """A ball (3D)."""

    type: Literal["sphere"] = "sphere"
    diameter: PositiveLength = key("Diameter [m]")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.diameter,) * 3


class HollowSphereShape(ShapeOptions):
    """A ball with a concentric cavity (3D)."""

    type: Literal["hollow_sphere"] = "hollow_sphere"
    outer_diameter: PositiveLength = key("Outer diameter [m]")
    inner_diameter: PositiveLength = key("Diameter of the cavity [m], below the outer one")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.outer_diameter,) * 3

    def thickness(self) -> float:
        """Return the thickness of the wall [m]."""
        return (self.outer_diameter - self.inner_diameter) / 2


class BoxShape(ShapeOptions):
    """A rectangle (2D) or a cuboid (3D), edges along the axes."""

    type: Literal["box"] = "box"
    size: Sizes = key("Full sizes along x, y and, in 3D, z [m]")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return self.size


class CylinderShape(ShapeOptions):
    """A circular cylinder of finite length (3D)."""

    type: Literal["cylinder"] = "cylinder"
    diameter: PositiveLength = key("Diameter [m]")
    length: PositiveLength = key("Length [m]")
    axis: AxisField = "x"

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return _axis_extents(self.axis, self.length, self.diameter)


class TubeShape(ShapeOptions):
    """A circular tube of finite length (3D)."""

    type: Literal["tube"] = "tube"
    outer_diameter: PositiveLength = key("Outer diameter [m]")
    inner_diameter: PositiveLength = key("Inner diameter [m], below the outer one")
    length: PositiveLength = key("Length [m]")
    axis: AxisField = "x"

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return _axis_extents(self.axis, self.length, self.outer_diameter)

    def thickness(self) -> float:
        """Return the lesser of the wall's thickness and the length [m]."""
        return min((self.outer_diameter - self.inner_diameter) / 2, self.length)


class ConeShape(ShapeOptions):
    """A cone, tip ahead (3D), or its section (2D)."""

    type: Literal["cone"] = "cone"
    diameter: PositiveLength = key("Diameter of the base [m]")
    length: PositiveLength = key("Length [m]")
    axis: NoseField = "x"

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return _axis_extents(self.axis, self.length, self.diameter)


class FrustumShape(ShapeOptions):
    """A truncated cone (3D), or its section (2D)."""

    type: Literal["frustum"] = "frustum"
    back_diameter: NonNegativeLength = key("Diameter of the end at the back [m]")
    front_diameter: NonNegativeLength = key("Diameter of the end ahead [m]")
    length: PositiveLength = key("Length [m]")
    axis: NoseField = "x"

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return _axis_extents(self.axis, self.length, max(self.back_diameter, self.front_diameter))


class OgiveShape(ShapeOptions):
    """A tangent ogive with a cylinder behind it, the usual shape of a bullet (3D), or its section (2D).

    A calibre radius head q is a nose of D/2 sqrt(4 q - 1).
    """

    type: Literal["ogive"] = "ogive"
    diameter: PositiveLength = key("Diameter of the cylinder [m]")
    nose_length: PositiveLength = key("Length of the nose [m], at least half the diameter")
    shank_length: NonNegativeLength = key("Length of the cylinder behind the nose [m]", 0.0)
    axis: NoseField = "x"

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return _axis_extents(self.axis, self.nose_length + self.shank_length, self.diameter)


class DomeShape(ShapeOptions):
    """A cap of a ball on a flat base, by default a hemisphere (3D), or its section (2D)."""

    type: Literal["dome"] = "dome"
    diameter: PositiveLength = key("Diameter of the base [m]")
    height: PositiveLength | None = key("Height [m], at most half the diameter; a hemisphere unless given", None)
    axis: NoseField = "x"

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return _axis_extents(self.axis, self.height or self.diameter / 2, self.diameter)


class RoundedCylinderShape(ShapeOptions):
    """A cylinder with rounded edges (3D), or its section (2D)."""

    type: Literal["rounded_cylinder"] = "rounded_cylinder"
    diameter: PositiveLength = key("Diameter [m]")
    length: PositiveLength = key("Full length [m]")
    edge_radius: PositiveLength = key("Radius of the edges [m]; half the diameter makes the ends hemispheres")
    ends: Literal["both", "front"] = key("Which ends have rounded edges", "both")
    axis: NoseField = "x"

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return _axis_extents(self.axis, self.length, self.diameter)


class MeshShape(ShapeOptions):
    """Solid within a closed triangulated surface (3D), in the coordinates of its file.

    Needs the extra `hvisph[mesh]`.
    """

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


def _axis_extents(axis: str, length: float, width: float) -> tuple[float, ...]:
    return tuple(length if axis == name else width for name in ("x", "y", "z"))
