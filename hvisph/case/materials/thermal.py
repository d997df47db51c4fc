"""Temperature, melting and porosity of a material."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from hvisph.case.dimensions import NUMBER
from hvisph.case.model import Problem, StrictModel, refuse
from hvisph.case.units import (
    NonNegativeNumber,
    NonNegativePressure,
    PositiveHeatCapacity,
    PositiveNumber,
    PositivePressure,
    PositiveSpecificEnergy,
    PositiveTemperature,
    Quantity,
)


class _Temperature(StrictModel):
    heat_capacity: PositiveHeatCapacity | None = Field(
        default=None, description="Specific heat capacity c_v [J/(kg K)]; that of the strength model unless given"
    )
    room_temperature: PositiveTemperature | None = Field(
        default=None, description="Temperature at rest [K]; that of the strength model unless given, else 300 K"
    )


class IsentropeTemperature(_Temperature):
    """T = T_s(rho) + (e - e_s(rho))/c_v about the isentrope through the state at rest: compression is no heat."""

    type: Literal["isentrope"] = "isentrope"
    heat_capacities: tuple[tuple[PositiveTemperature, PositiveHeatCapacity], ...] = Field(
        default=(),
        description="Points [T, c_p] of the heat capacity without pressure, joined by lines and held beyond their "
        "ends, in place of a constant",
    )
    heat_of_melting: PositiveSpecificEnergy | None = Field(
        default=None, description="Heat of melting [J/kg], beside `heat_capacities`; left out unless given"
    )
    melting_point: PositiveTemperature | None = Field(
        default=None, description="Where it is taken up, without pressure [K]"
    )

    @model_validator(mode="after")
    def _one_capacity(self) -> IsentropeTemperature:
        if self.heat_capacities and self.heat_capacity is not None:
            refuse([Problem(("heat_capacities",), "given beside `heat_capacity`; leave one out")])
        if any(later <= before for (before, _), (later, _) in pairwise(self.heat_capacities)):
            refuse([Problem(("heat_capacities",), "temperatures must rise from point to point")])
        if (self.heat_of_melting is None) != (self.melting_point is None):
            missing = "melting_point" if self.melting_point is None else "heat_of_melting"
            refuse([Problem((missing,), "missing: heat of melting and melting point go together")])
        if self.heat_of_melting is not None and not self.heat_capacities:
            refuse([Problem(("heat_of_melting",), "has a meaning only beside `heat_capacities`")])
        return self

    @property
    def is_known(self) -> bool:
        """Whether a heat capacity is given here."""
        return self.heat_capacity is not None or bool(self.heat_capacities)


class TotalEnergyTemperature(_Temperature):
    """T = T_room + e/c_v, as Young 2021 has it: the work of compression counts as heat."""

    type: Literal["total_energy"] = "total_energy"

    @property
    def is_known(self) -> bool:
        """Whether a heat capacity is given here."""
        return self.heat_capacity is not None


Temperature = Annotated[IsentropeTemperature | TotalEnergyTemperature, Field(discriminator="type")]


class LindemannMelting(StrictModel):
    """T_m = T_m0 exp(2 a (1 - 1/eta)) eta^(2 (Gamma0 - a - 1/3)), eta = rho/rho0."""

    type: Literal["lindemann"] = "lindemann"
    temperature: PositiveTemperature = Field(description="T_m0, without pressure [K]")
    gamma: NonNegativeNumber = Field(description="Gamma0, Grueneisen coefficient at rest [-]")
    a: NonNegativeNumber = Field(description="a [-]")


class SimonMelting(StrictModel):
    """T_m = T_m0 (1 + p/a)^(1/c)."""

    type: Literal["simon"] = "simon"
    temperature: PositiveTemperature = Field(description="T_m0, without pressure [K]")
    a: PositivePressure = Field(description="a [Pa]")
    c: PositiveNumber = Field(description="c [-]")


Melting = Annotated[LindemannMelting | SimonMelting, Field(discriminator="type")]


class Porosity(StrictModel):
    """P-alpha pores in the solid that `density`, `eos` and `strength` describe: p = p_s(alpha rho, e)/alpha."""

    distension: Annotated[float, Quantity(NUMBER, above=1)] = Field(
        description="alpha0 = density of the solid over that of the porous body at rest [-], above 1"
    )
    elastic_pressure: NonNegativePressure = Field(description="p_e, where pores begin to crush [Pa], at least 0")
    solid_pressure: PositivePressure = Field(description="p_s, where they are gone [Pa], above p_e")
