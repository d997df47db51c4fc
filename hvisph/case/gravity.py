"""Gravity, and the stress of the overburden at the start."""

from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo

from .bodies import Position
from .model import SCALAR_AS_LIST, Problem, Shorthand, StrictModel
from .units import MASS, NUMBER, Acceleration, PositiveLength, Quantity

Components = Annotated[tuple[Acceleration, ...], SCALAR_AS_LIST, Field(min_length=1, max_length=3)]


class UniformGravity(StrictModel):
    """Uniform field of gravity."""

    type: Literal["uniform"] = "uniform"
    acceleration: Components = Field(description="Acceleration, one component per dimension [m/s^2]")

    def words(self, number: Callable[[float, str], str]) -> str:
        """Return the field in words, with quantities by `number`."""
        return ", ".join(number(value, "m/s^2") for value in self.acceleration)


class SphereGravity(StrictModel):
    """Field of a homogeneous sphere: G M/r^2 outside, proportional to r inside."""

    type: Literal["sphere"] = "sphere"
    mass: Annotated[float, Quantity(MASS, above=0)] = Field(description="Mass of the sphere [kg], above 0")
    radius: PositiveLength = Field(description="Radius of the sphere [m], above 0")
    centre: Position = Field(default=(), description="Centre of the sphere [m]; the origin unless given")

    def words(self, number: Callable[[float, str], str]) -> str:
        """Return the field in words, with quantities by `number`."""
        return f"of a sphere of {number(self.mass, 'kg')}, radius {number(self.radius, 'm')}"


class Overburden(StrictModel):
    """Initial stress of bodies under their own weight, from their free face downwards."""

    lateral: Annotated[float, Quantity(NUMBER, minimum=0, maximum=1)] = Field(
        default=1.0, description="Horizontal over vertical stress, 0 to 1; 1 is a pressure alone"
    )


def _expand_vector(value: object, info: ValidationInfo) -> object:
    plain = isinstance(value, list | tuple | int | float | str) and not isinstance(value, bool)
    return {"type": "uniform", "acceleration": value} if plain else value


def _expand_switch(value: object, info: ValidationInfo) -> object:
    return {} if value is True else None if value is False else value


Gravity = Annotated[
    Annotated[UniformGravity | SphereGravity, Field(discriminator="type")],
    Shorthand(_expand_vector, ("array", "number", "string")),
]
OptionalOverburden = Annotated[Overburden | None, Shorthand(_expand_switch, ("boolean",))]


def gravity_problems(case: Any) -> Iterator[Problem]:
    """Yield the errors of gravity and overburden."""
    gravity, dim = case.gravity, case.dim
    if gravity is None:
        if case.overburden is not None:
            yield Problem(("overburden",), "needs `gravity`")
        return
    if case.formulation.type == "projection":
        yield Problem(("gravity",), "projection has `formulation.body_force` in its place")
    vector = gravity.acceleration if gravity.type == "uniform" else gravity.centre
    key = ("gravity", "acceleration" if gravity.type == "uniform" else "centre")
    if vector and len(vector) != dim:
        yield Problem(key, f"has {len(vector)} components, needs {dim} in {dim}D")
    elif case.kinematics == "axisymmetric" and any(vector[1:]):
        yield Problem(key, "axisymmetric cases have gravity along the axis x alone; set the other component to 0")
    if case.overburden is None:
        return
    if case.formulation.type in ("total_lagrangian", "adaptive"):
        yield Problem(("overburden",), "a Total Lagrangian reference is free of stress; use riemann or eulerian")
    elif gravity.type == "uniform" and not case.clamped and not _is_supported(case, vector):
        yield Problem(
            ("overburden",), "nothing supports the bodies: give a symmetry plane below them, or clamp their lowest rows"
        )


def _is_supported(case: Any, acceleration: tuple[float, ...]) -> bool:
    """Return whether a symmetry plane lies across a component of gravity, on the side to which it points."""
    return any(
        acceleration["xyz".index(plane.axis)] * (1.0 if plane.keep == "above" else -1.0) < 0.0
        for plane in case.symmetry
        if "xyz".index(plane.axis) < len(acceleration)
    )
