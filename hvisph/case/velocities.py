"""Initial velocities: a vector, a speed and an angle, or a field over the body."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo

from .dimensions import ANGLE, RATE, VELOCITY
from .model import SCALAR_AS_LIST, DataFile, Shorthand, StrictModel
from .shapes import Position
from .simple_shapes import Direction
from .units import Number, PositiveLength, Quantity, Velocity

Rate = Annotated[float, Quantity(RATE)]


def _vector(value: object, info: ValidationInfo) -> Any:
    """Return the components of {speed, angle}, and a single number as a list."""
    if isinstance(value, Mapping):
        if set(value) - {"speed", "angle"} or "speed" not in value:
            raise ValueError("expected components, or a speed and an angle: {speed: 3.1 km/s, angle: 30 deg}")
        speed = Quantity(VELOCITY).validate(value["speed"], info)
        angle = math.radians(Quantity(ANGLE).validate(value.get("angle", 0.0), info))
        dim = (info.context or {}).get("dim", 2)
        if dim == 1 and angle != 0.0:
            raise ValueError("there is no angle in 1D; give the speed alone")
        return [speed * math.cos(angle), speed * math.sin(angle), 0.0][:dim]
    return SCALAR_AS_LIST.expand(value, info)


VelocityVector = Annotated[
    tuple[Velocity, ...], Shorthand(_vector, ("number", "string", "object")), Field(max_length=3)
]


class AboutPoint(StrictModel):
    """Options of velocity fields about a point."""

    centre: Position | None = Field(
        default=None, description="Point where the field is zero [m]; the middle of the body's mass unless given"
    )


class UniformField(StrictModel):
    """Uniform velocity."""

    type: Literal["uniform"] = "uniform"
    velocity: VelocityVector = Field(description="Velocity [m/s]")


class SpinField(AboutPoint):
    """Rigid rotation, u = omega x (x - centre) (2D, 3D)."""

    type: Literal["spin"] = "spin"
    rate: Rate = Field(description="Angular velocity [rad/s], counter-clockwise about the axis")
    axis: Direction = Field(
        default=(0.0, 0.0, 1.0), description="Direction of the axis [-], or x, y or z; in 2D always z"
    )


class RadialField(AboutPoint):
    """u = speed (r/radius)^power along the radius: outwards where the speed is positive."""

    type: Literal["radial"] = "radial"
    speed: Velocity = Field(description="Speed at the radius [m/s], negative inwards")
    radius: PositiveLength = Field(description="Radius where it has that speed [m]")
    power: Number = Field(default=0.0, description="Power of the radius [-]: -1 (2D) and -2 (3D) keep the volume")
    axis: Direction | None = Field(
        default=None, description="In 3D, an axis from which the radius is measured [-]; from the centre unless given"
    )


class LinearField(AboutPoint):
    """u = G (x - centre)."""

    type: Literal["linear"] = "linear"
    gradient: tuple[tuple[Rate, ...], ...] = Field(
        description="Velocity gradient G, a row per component [1/s]", min_length=1, max_length=3
    )


class TableField(StrictModel):
    """Velocities interpolated linearly in a table, constant outside."""

    type: Literal["table"] = "table"
    file: DataFile = Field(description="CSV in SI with the columns x, y, z and u, v, w, one a dimension")


VelocityField = Annotated[
    UniformField | SpinField | RadialField | LinearField | TableField, Field(discriminator="type")
]
