"""Equations of state that a material can name."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hvisph.case.dimensions import NUMBER
from hvisph.case.model import StrictModel
from hvisph.case.units import NonNegativeNumber, Number, PositivePressure, PositiveVelocity, Quantity

PoissonRatio = Annotated[float, Quantity(NUMBER, above=-1, below=0.5)]
AdiabaticIndex = Annotated[float, Quantity(NUMBER, above=1)]


class LinearEos(StrictModel):
    """p = K (rho/rho0 - 1), blind to energy."""

    type: Literal["linear"] = "linear"
    bulk_modulus: PositivePressure = Field(description="Bulk modulus K [Pa]")


class ElasticEos(StrictModel):
    """p = K (rho/rho0 - 1) with K = E / (3 (1 - 2 nu)); the strength takes its G = E / (2 (1 + nu))."""

    type: Literal["elastic"] = "elastic"
    youngs_modulus: PositivePressure = Field(description="Young's modulus E [Pa]")
    poisson_ratio: PoissonRatio = Field(description="Poisson's ratio nu [-], above -1 and below 0.5")

    @property
    def bulk_modulus(self) -> float:
        """Bulk modulus K [Pa]."""
        return self.youngs_modulus / (3.0 * (1.0 - 2.0 * self.poisson_ratio))

    @property
    def shear_modulus(self) -> float:
        """Shear modulus G [Pa]."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))


class StiffenedGasEos(StrictModel):
    """p = c0^2 (rho - rho0) + (gamma - 1) rho e."""

    type: Literal["stiffened_gas"] = "stiffened_gas"
    sound_speed: PositiveVelocity = Field(description="Bulk sound speed c0 at rest [m/s]")
    gamma: AdiabaticIndex = Field(
        description="Exponent gamma [-], above 1; gamma - 1 is the Grueneisen coefficient"
    )


class MieGruneisenEos(StrictModel):
    """Mie-Grueneisen about a cubic shock Hugoniot Us = c0 + s1 up + s2 (up/Us) up + s3 (up/Us)^2 up."""

    type: Literal["mie_gruneisen"] = "mie_gruneisen"
    sound_speed: PositiveVelocity = Field(description="Bulk sound speed c0 at rest [m/s]")
    s1: NonNegativeNumber = Field(description="Slope s1 of the Us-up line [-], at least 0")
    s2: Number = Field(default=0.0, description="Second coefficient s2 of the Us-up curve [-]")
    s3: Number = Field(default=0.0, description="Third coefficient s3 of the Us-up curve [-]")
    gamma: NonNegativeNumber = Field(
        description="Grueneisen coefficient Gamma0 at reference density [-], at least 0"
    )
    a: Number = Field(default=0.0, description="First-order volume correction to Gamma0 [-]")


class IdealGasEos(StrictModel):
    """p = (gamma - 1) rho e; the body's `internal_energy` sets its initial pressure."""

    type: Literal["ideal_gas"] = "ideal_gas"
    gamma: AdiabaticIndex = Field(description="Ratio of specific heats gamma [-], above 1")


Eos = Annotated[
    LinearEos | ElasticEos | StiffenedGasEos | MieGruneisenEos | IdealGasEos, Field(discriminator="type")
]
