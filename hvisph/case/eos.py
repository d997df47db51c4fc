"""Equations of state that a material can name."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, model_validator

from hvisph.case.dimensions import NUMBER
from hvisph.case.model import Problem, StrictModel, refuse
from hvisph.case.units import (
    NonNegativeNumber,
    Number,
    PositiveNumber,
    PositivePressure,
    PositiveVelocity,
    Quantity,
)

PoissonRatio = Annotated[float, Quantity(NUMBER, above=-1, below=0.5)]
AdiabaticIndex = Annotated[float, Quantity(NUMBER, above=1)]


class LinearEos(StrictModel):
    """p = K (rho/rho0 - 1), blind to energy.

    In a case with `units: none` a Cauchy number Ca may stand for K: p = (rho - rho0)/Ca, that is
    K = rho0/Ca and a sound speed of Ca^-1/2 whatever rho0 is. The other reading of Zisis 2013,
    p = (rho/rho0 - 1)/Ca, is K = 1/Ca.
    """

    type: Literal["linear"] = "linear"
    bulk_modulus: PositivePressure | None = Field(
        default=None, description="Bulk modulus K [Pa]; unless a Cauchy number is given"
    )
    cauchy_number: PositiveNumber | None = Field(
        default=None,
        description="Cauchy number Ca = rho0 v^2/K of the impact velocity v = 1 [-], above 0; only with "
        "`units: none`, and in place of the modulus",
    )
    reading: Literal["density_difference", "density_ratio"] = Field(
        default="density_difference",
        description="What Ca divides: `density_difference` rho - rho0, `density_ratio` rho/rho0 - 1",
    )

    @model_validator(mode="after")
    def _one_stiffness(self, info: ValidationInfo) -> LinearEos:
        units = (info.context or {}).get("units")
        if self.cauchy_number is None and self.bulk_modulus is None:
            message = "missing: give the bulk modulus K" + (" or a cauchy_number" if units == "none" else "")
            refuse([Problem(("bulk_modulus",), message)])
        if self.cauchy_number is not None and self.bulk_modulus is not None:
            refuse([Problem(("cauchy_number",), "given beside `bulk_modulus`, which says the same; leave one out")])
        if self.cauchy_number is not None and units != "none":
            message = "has a meaning only in a case with `units: none`; give `bulk_modulus` in Pa"
            refuse([Problem(("cauchy_number",), message)])
        if self.cauchy_number is None and self.reading != "density_difference":
            refuse([Problem(("reading",), "has a meaning only beside `cauchy_number`; leave it out")])
        return self

    def modulus(self, density: float) -> float:
        """Return K [Pa] of a material of reference density `density` [kg/m^3]."""
        if self.bulk_modulus is not None:
            return self.bulk_modulus
        assert self.cauchy_number is not None
        return (density if self.reading == "density_difference" else 1.0) / self.cauchy_number


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
    gamma: AdiabaticIndex = Field(description="Exponent gamma [-], above 1; gamma - 1 is the Grueneisen coefficient")


class MieGruneisenEos(StrictModel):
    """Mie-Grueneisen about a cubic shock Hugoniot Us = c0 + s1 up + s2 (up/Us) up + s3 (up/Us)^2 up."""

    type: Literal["mie_gruneisen"] = "mie_gruneisen"
    sound_speed: PositiveVelocity = Field(description="Bulk sound speed c0 at rest [m/s]")
    s1: NonNegativeNumber = Field(description="Slope s1 of the Us-up line [-], at least 0")
    s2: Number = Field(default=0.0, description="Second coefficient s2 of the Us-up curve [-]")
    s3: Number = Field(default=0.0, description="Third coefficient s3 of the Us-up curve [-]")
    gamma: NonNegativeNumber = Field(description="Grueneisen coefficient Gamma0 at reference density [-], at least 0")
    a: Number = Field(default=0.0, description="First-order volume correction to Gamma0 [-]")


class IdealGasEos(StrictModel):
    """p = (gamma - 1) rho e; the body's `internal_energy` sets its initial pressure."""

    type: Literal["ideal_gas"] = "ideal_gas"
    gamma: AdiabaticIndex = Field(description="Ratio of specific heats gamma [-], above 1")


Eos = Annotated[LinearEos | ElasticEos | StiffenedGasEos | MieGruneisenEos | IdealGasEos, Field(discriminator="type")]
