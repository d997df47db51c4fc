"""Symmetry planes, and clamped, loaded and Eulerian regions."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Annotated, Literal

from pydantic import Field

from hvisph.core.errors import suggest_nearest

from .bodies import Axis
from .model import SCALAR_AS_LIST, Path, Problem, StrictModel
from .units import Length, Pressure

Corner = Annotated[tuple[Length | None, ...], SCALAR_AS_LIST, Field(max_length=3)]


class SymmetryPlane(StrictModel):
    """Symmetry plane normal to an axis; one side is computed."""

    axis: Axis = Field(description="Axis normal to the plane")
    at: Length = Field(default=0.0, description="Coordinate of the plane on that axis [m]")
    keep: Literal["above", "below"] = Field(
        default="above", description="Side that is computed: coordinates above or below `at`"
    )


class BoxRegion(StrictModel):
    """Box between two corners; a null component is unbounded."""

    min: Corner = Field(default=(), description="Lower corner [m], a component per dimension, null if unbounded")
    max: Corner = Field(default=(), description="Upper corner [m], a component per dimension, null if unbounded")


class Region(StrictModel):
    """Particles of some or all bodies within a box."""

    box: BoxRegion = Field(description="Region in the initial configuration whose particles are meant")
    bodies: tuple[str, ...] = Field(default=(), description="Bodies of which they are; all unless given")


class Clamp(Region):
    """Particles at rest for the whole run."""

    box: BoxRegion = Field(description="Region in the initial configuration whose particles are held")
    bodies: tuple[str, ...] = Field(default=(), description="Bodies that are held; all unless given")


class InitialLoad(Region):
    """Impulse: pressure added to that of the material during the first step."""

    box: BoxRegion = Field(description="Region in the initial configuration whose particles are loaded")
    pressure: Pressure = Field(description="Pressure added [Pa]; negative is tension")


class EulerianRegion(Region):
    """Particles that are Eulerian from the start of the run."""

    box: BoxRegion = Field(description="Region in the initial configuration whose particles are Eulerian")


def region_problems(region: Region, path: Path, dim: int, bodies: Collection[str]) -> Iterator[Problem]:
    """Yield the errors of a region in `dim` dimensions of a case with these `bodies`."""
    for number, name in enumerate(region.bodies):
        if name not in bodies:
            yield Problem((*path, "bodies", number), f"unknown body '{name[:64]}'{suggest_nearest(name, list(bodies))}")
    yield from box_problems(region.box, (*path, "box"), dim)


def box_problems(box: BoxRegion, path: Path, dim: int) -> Iterator[Problem]:
    """Yield the errors of a box in `dim` dimensions."""
    axes = "xyz"[:dim]
    for side, corner in (("min", box.min), ("max", box.max)):
        if corner and len(corner) != dim:
            yield Problem((*path, side), f"has {len(corner)} components, needs {dim} in {dim}D: [{', '.join(axes)}]")
    for axis, low, high in zip(axes, box.min, box.max, strict=False):
        if low is not None and high is not None and not low < high:
            yield Problem(path, f"min {low:g} must be below max {high:g} along {axis}")
