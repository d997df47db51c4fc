"""Strength models that a material can name."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hvisph.case.model import StrictModel
from hvisph.case.units import (
    NonNegativeNumber,
    NonNegativePressure,
    PositiveHeatCapacity,
    PositiveNumber,
    PositivePressure,
    PositiveRate,
    PositiveTemperature,
)

_SHEAR = "Shear modulus G [Pa]; left out where the equation of state is `elastic`, which implies it"


class NoStrength(StrictModel):
    """A fluid: no deviatoric stress."""

    type: Literal["none"] = "none"


class ElasticStrength(StrictModel):
    """Linear elastic in shear, without a limit."""

    type: Literal["elastic"] = "elastic"
    shear_modulus: PositivePressure | None = Field(default=None, description=_SHEAR)


class VonMisesStrength(StrictModel):
    """Elastic and perfectly plastic."""

    type: Literal["von_mises"] = "von_mises"
    shear_modulus: PositivePressure | None = Field(default=None, description=_SHEAR)
    yield_stress: PositivePressure = Field(description="Yield stress Y in uniaxial tension [Pa]")


class LinearHardeningStrength(StrictModel):
    """Y = Y0 + H eps_p."""

    type: Literal["linear_hardening"] = "linear_hardening"
    shear_modulus: PositivePressure | None = Field(default=None, description=_SHEAR)
    yield_stress: PositivePressure = Field(description="Initial yield stress Y0 [Pa]")
    hardening_modulus: NonNegativePressure = Field(
        description="Plastic hardening modulus H = dY/d(eps_p) [Pa], not the tangent modulus"
    )


class JohnsonCookStrength(StrictModel):
    """Y = (A + B eps_p^n) (1 + C ln(rate/reference)) (1 - T*^m), T* = (T - T_room)/(T_melt - T_room)."""

    type: Literal["johnson_cook"] = "johnson_cook"
    shear_modulus: PositivePressure | None = Field(default=None, description=_SHEAR)
    a: PositivePressure = Field(description="Yield stress A at the reference rate and room temperature [Pa]")
    b: NonNegativePressure = Field(description="Hardening coefficient B [Pa], at least 0")
    n: PositiveNumber = Field(description="Hardening exponent n [-], above 0")
    c: NonNegativeNumber = Field(description="Rate coefficient C [-], at least 0")
    m: PositiveNumber = Field(description="Thermal softening exponent m [-], above 0")
    reference_rate: PositiveRate = Field(default=1.0, description="Reference plastic strain rate [1/s]")
    room_temperature: PositiveTemperature = Field(default=300.0, description="T_room, at the start [K]")
    melt_temperature: PositiveTemperature = Field(description="Melting temperature T_melt [K], above room temperature")
    heat_capacity: PositiveHeatCapacity = Field(
        description="Specific heat capacity [J/(kg K)], which turns internal energy into temperature"
    )


Strength = Annotated[
    NoStrength | ElasticStrength | VonMisesStrength | LinearHardeningStrength | JohnsonCookStrength,
    Field(discriminator="type"),
]
