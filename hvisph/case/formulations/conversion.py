"""Criteria for the conversion of Total Lagrangian to Eulerian particles."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from hvisph.case.dimensions import NUMBER
from hvisph.case.model import StrictModel
from hvisph.case.units import PositiveNumber, Quantity


class ConversionLimits(StrictModel):
    """Criteria for the permanent conversion of a Total Lagrangian particle to an Eulerian one."""

    strain: Annotated[float, Quantity(NUMBER, minimum=0)] | None = Field(
        default=None,
        description="Equivalent deviatoric Green-Lagrange strain at which a particle converts [-], at least 0; 0: "
        "Eulerian from the first step on; none unless given",
    )
    damage: bool = Field(default=False, description="Whether a failed particle (damage 1) converts")
    neighbours: bool = Field(
        default=True, description="Whether the reference neighbours of a converted particle convert, too"
    )
    fallback: bool = Field(
        default=True,
        description="Whether Total Lagrangian particles with Eulerian neighbours convert where the deformation "
        "gradient is no longer valid: J outside 0.2 to 5, or strain above `fallback_strain`",
    )
    fallback_strain: PositiveNumber | None = Field(
        default=None,
        description="Strain limit of the fallback [-], above 0; 1.5 in 1D and 2D, 1 in 3D unless given",
    )
    fallback_damage: bool = Field(
        default=True,
        description="Whether the fallback also converts the neighbours of failed Eulerian particles; with "
        "`damage: true`",
    )
