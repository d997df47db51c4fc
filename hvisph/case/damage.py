"""Damage and spall models that a material can name."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hvisph.case.model import StrictModel
from hvisph.case.units import NegativePressure, Number, PositiveRate


class NoDamage(StrictModel):
    """The material never fails."""

    type: Literal["none"] = "none"


class PressureCutoff(StrictModel):
    """Tension is limited: p >= pressure."""

    type: Literal["pressure_cutoff"] = "pressure_cutoff"
    pressure: NegativePressure = Field(description="Lowest pressure that the material bears [Pa]; negative, tension")


class JohnsonCookDamage(StrictModel):
    """Strain to failure eps_f = (D1 + D2 exp(D3 s*)) (1 + D4 ln(rate/reference)) (1 + D5 T*).

    s* is the mean stress (tension positive) over the von Mises stress; damage grows by
    d(eps_p)/eps_f, and at 1 the deviator and all tension vanish.
    """

    type: Literal["johnson_cook"] = "johnson_cook"
    d1: Number = Field(description="Failure strain at any triaxiality, D1 [-]")
    d2: Number = Field(default=0.0, description="Triaxiality coefficient D2 [-]")
    d3: Number = Field(default=0.0, description="Triaxiality exponent D3 [-]; below 0 where tension embrittles")
    d4: Number = Field(default=0.0, description="Rate coefficient D4 [-]")
    d5: Number = Field(default=0.0, description="Temperature coefficient D5 [-]; needs `johnson_cook` strength")
    reference_rate: PositiveRate = Field(default=1.0, description="Reference plastic strain rate [1/s]")
    failed: Literal["loses_stress", "keeps_stress"] = Field(
        default="loses_stress",
        description="Whether a failed particle loses deviator and tension, or is only marked: in AdapTLE it turns "
        "Eulerian, and the crack is what opens between Eulerian particles",
    )
    pressure_cutoff: NegativePressure | None = Field(
        default=None, description="Lowest pressure that the intact material bears [Pa]; negative"
    )


Damage = Annotated[NoDamage | PressureCutoff | JohnsonCookDamage, Field(discriminator="type")]
