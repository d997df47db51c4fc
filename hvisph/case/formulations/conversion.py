"""When Total Lagrangian particles turn Eulerian."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from hvisph.case.dimensions import NUMBER
from hvisph.case.model import StrictModel
from hvisph.case.units import PositiveNumber, Quantity


class ConversionLimits(StrictModel):
    """What turns a Total Lagrangian particle Eulerian, for good."""

    strain: Annotated[float, Quantity(NUMBER, minimum=0)] | None = Field(
        default=None,
        description="Equivalent deviatoric Green-Lagrange strain at which a particle turns [-], at least 0; 0 is "
        "Eulerian from the first step on; none unless given",
    )
    damage: bool = Field(default=False, description="Whether a failed particle (damage 1) turns")
    neighbours: bool = Field(
        default=True, description="Whether the reference neighbours of a particle that turns do, too"
    )
    guard: bool = Field(
        default=True,
        description="Whether Total Lagrangian particles turn whose Eulerian neighbours have lost a sound "
        "deformation gradient: J outside 0.2 to 5, or strain above `guard_strain`",
    )
    guard_strain: PositiveNumber | None = Field(
        default=None,
        description="Strain limit of the guard [-], above 0; 1.5 in 1D and 2D, 1 in 3D unless given",
    )
    guard_damage: bool = Field(
        default=True,
        description="Whether the guard turns the neighbours of Eulerian particles that fail, too; with `damage: true`",
    )
