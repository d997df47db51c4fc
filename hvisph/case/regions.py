"""Symmetry planes and clamped regions."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hvisph.case.bodies import Axis
from hvisph.case.model import SCALAR_AS_LIST, StrictModel
from hvisph.case.units import Length

Corner = Annotated[tuple[Length | None, ...], SCALAR_AS_LIST, Field(max_length=3)]


class SymmetryPlane(StrictModel):
    """A mirror across one axis: only the kept side is computed."""

    axis: Axis = Field(description="Axis normal to the plane")
    at: Length = Field(default=0.0, description="Coordinate of the plane on that axis [m]")
    keep: Literal["above", "below"] = Field(
        default="above", description="Side that is computed: coordinates above or below `at`"
    )


class BoxRegion(StrictModel):
    """A region between two corners; a component left null is unbounded."""

    min: Corner = Field(default=(), description="Lower corner [m], a component per dimension, null if unbounded")
    max: Corner = Field(default=(), description="Upper corner [m], a component per dimension, null if unbounded")


class Clamp(StrictModel):
    """Particles that are held still for the whole run."""

    box: BoxRegion = Field(description="Region in the initial configuration whose particles are held")
    bodies: tuple[str, ...] = Field(default=(), description="Bodies that are held; all unless given")
