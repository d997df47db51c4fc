"""Temperature, melting and pores of a material."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hvisph.case.dimensions import NUMBER
from hvisph.case.model import StrictModel
from hvisph.case.units import (
    NonNegativeNumber,
    NonNegativePressure,
    PositiveHeatCapacity,
    PositiveNumber,
    PositivePressure,
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


class TotalEnergyTemperature(_Temperature):
    """T = T_room + e/c_v, as Young 2021 has it: the work of compression counts as heat."""

    type: Literal["total_energy"] = "total_energy"


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
