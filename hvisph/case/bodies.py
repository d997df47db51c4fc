"""Bodies: material, shape, how particles fill it, where they stand and how fast they move."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo

from hvisph.case.materials import NamedMaterial
from hvisph.case.model import SCALAR_AS_LIST, Shorthand, StrictModel
from hvisph.case.units import (
    Angle,
    Length,
    NonNegativeLength,
    NonNegativeSpecificEnergy,
    Number,
    PositiveLength,
    Velocity,
)

Axis = Literal["x", "y", "z"]
Arrangement = Literal["even", "square", "cubic", "hexagonal", "hcp", "rings", "lattice_two_rings"]
Sizes = Annotated[tuple[PositiveLength, ...], SCALAR_AS_LIST, Field(min_length=2, max_length=3)]
Position = Annotated[tuple[Length, ...], SCALAR_AS_LIST, Field(min_length=1, max_length=3)]
VelocityVector = Annotated[tuple[Velocity, ...], SCALAR_AS_LIST, Field(max_length=3)]


class IntervalShape(StrictModel):
    """A stretch of the line (1D)."""

    type: Literal["interval"] = "interval"
    length: PositiveLength = Field(description="Length [m]")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.length,)


class DiscShape(StrictModel):
    """A disc (2D): the section of a long cylinder."""

    type: Literal["disc"] = "disc"
    diameter: PositiveLength = Field(description="Diameter [m]")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.diameter,) * 2


class SphereShape(StrictModel):
    """A ball (3D)."""

    type: Literal["sphere"] = "sphere"
    diameter: PositiveLength = Field(description="Diameter [m]")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return (self.diameter,) * 3


class BoxShape(StrictModel):
    """A rectangle (2D) or a cuboid (3D), edges along the axes."""

    type: Literal["box"] = "box"
    size: Sizes = Field(description="Full sizes along x, y and, in 3D, z [m]")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return self.size


class CylinderShape(StrictModel):
    """A circular cylinder of finite length (3D)."""

    type: Literal["cylinder"] = "cylinder"
    diameter: PositiveLength = Field(description="Diameter [m]")
    length: PositiveLength = Field(description="Length [m]")
    axis: Axis = Field(default="x", description="Axis along which the length lies")

    def extent(self) -> tuple[float, ...]:
        """Return the full size along each axis [m]."""
        return tuple(self.length if axis == self.axis else self.diameter for axis in ("x", "y", "z"))


Shape = Annotated[IntervalShape | DiscShape | SphereShape | BoxShape | CylinderShape, Field(discriminator="type")]

# The shapes of each number of dimensions, and the arrangements of each shape there, default first.
SHAPES = {1: ("interval",), 2: ("disc", "box"), 3: ("sphere", "box", "cylinder")}
_IN_PLANE: tuple[Arrangement, ...] = ("square", "hexagonal")
_IN_SPACE: tuple[Arrangement, ...] = ("cubic", "hcp")
ARRANGEMENTS: dict[tuple[int, str], tuple[Arrangement, ...]] = {
    (1, "interval"): ("even",),
    (2, "disc"): (*_IN_PLANE, "rings", "lattice_two_rings"),
    (2, "box"): _IN_PLANE,
    (3, "sphere"): _IN_SPACE,
    (3, "box"): _IN_SPACE,
    (3, "cylinder"): _IN_SPACE,
}


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


class Body(StrictModel):
    """One piece of one material, moving as a whole at the start."""

    material: NamedMaterial = Field(description="Name of a material of the library, or a material written out")
    shape: Shape = Field(description="Shape, about the body's centre")
    arrangement: Arrangement | None = Field(
        default=None,
        description="How particles fill the shape; by default `even` in 1D, `square` in 2D, `cubic` in 3D",
    )
    velocity: VelocityVector = Field(
        default=(), description="Initial velocity, one component per dimension [m/s]; at rest unless given"
    )
    position: Position | None = Field(
        default=None,
        description="Centre of the body [m]; unless given, bodies stand in a row along x in the order of the "
        "file, and the face between the first and the second is x = 0",
    )
    gap: NonNegativeLength = Field(
        default=0.0, description="Distance to the body before it in the row [m], at least 0; 0 touches"
    )
    rotation: Annotated[Rotation | None, Shorthand(_angle_alone)] = Field(
        default=None, description="Turn about the centre before placing: an angle [deg], or angle and axis"
    )
    role: Literal["projectile", "layer", "other"] | None = Field(
        default=None,
        description="What measures take it for: the `projectile`, a `layer` that it meets, or neither (`other`); by "
        "default the first body that moves is the projectile, with those that have its velocity, and all others are "
        "layers but for what lies behind it",
    )
    formulation: Literal["eulerian", "total_lagrangian", "adaptive"] | None = Field(
        default=None,
        description="Kernels of this body, where the case's formulation is `total_lagrangian` or `adaptive`; that of "
        "the case unless given",
    )
    internal_energy: NonNegativeSpecificEnergy = Field(
        default=0.0, description="Initial specific internal energy [J/kg], at least 0"
    )
