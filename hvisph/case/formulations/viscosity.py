"""Artificial viscosities and artificial stresses of the standard SPH form."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hvisph.case.dimensions import NUMBER
from hvisph.case.model import StrictModel
from hvisph.case.units import NonNegativeNumber, PositiveNumber, Quantity


class NoViscosity(StrictModel):
    """No artificial viscosity: shocks ring."""

    type: Literal["none"] = "none"


class MonaghanViscosity(StrictModel):
    """(-alpha c mu + beta mu^2)/rho between approaching particles; SAV1 is 1 and 2, SAV2 is 2.5 and 2.5."""

    type: Literal["monaghan"] = "monaghan"
    alpha: NonNegativeNumber = Field(default=1.0, description="Linear coefficient alpha [-], at least 0")
    beta: NonNegativeNumber = Field(default=2.0, description="Quadratic coefficient beta [-], at least 0")


class BalsaraViscosity(StrictModel):
    """BAL: Monaghan's viscosity times |div u|/(|div u| + |curl u|), so that shear feels less of it (Balsara 1995)."""

    type: Literal["balsara"] = "balsara"
    alpha: NonNegativeNumber = Field(default=1.0, description="Linear coefficient alpha [-], at least 0")
    beta: NonNegativeNumber = Field(default=2.0, description="Quadratic coefficient beta [-], at least 0")


class MorrisMonaghanViscosity(StrictModel):
    """MON: every particle its own alpha, raised by compression and relaxing; beta is twice it (1997)."""

    type: Literal["morris_monaghan"] = "morris_monaghan"
    alpha_min: NonNegativeNumber = Field(default=0.1, description="What alpha relaxes to [-], at least 0")
    decay: PositiveNumber = Field(default=0.2, description="C1: alpha relaxes in the time h/(C1 c) [-], above 0")


Viscosity = Annotated[
    NoViscosity | MonaghanViscosity | BalsaraViscosity | MorrisMonaghanViscosity, Field(discriminator="type")
]


class NoArtificialStress(StrictModel):
    """No artificial stress."""

    type: Literal["none"] = "none"


class GrayArtificialStress(StrictModel):
    """Repulsion in tension against clumping (Gray, Monaghan & Swift 2001)."""

    type: Literal["gray"] = "gray"
    eps: NonNegativeNumber = Field(
        default=0.3, description="Strength of the repulsion [-], at least 0; 0.15 is Young 2021's"
    )
    n: Annotated[int, Field(strict=True, ge=1, le=16)] = Field(
        default=4, description="Exponent of W/W(dx) [-], a whole number from 1 to 16"
    )


ArtificialStress = Annotated[NoArtificialStress | GrayArtificialStress, Field(discriminator="type")]


class NoDensityDissipation(StrictModel):
    """No density dissipation."""

    type: Literal["none"] = "none"


class ZisisDensityDissipation(StrictModel):
    """Diffusion of density by pressure differences, for layered materials (Zisis 2013, eqs. 22-24)."""

    type: Literal["zisis"] = "zisis"
    alpha: Annotated[float, Quantity(NUMBER, minimum=0, maximum=2)] = Field(
        default=0.3, description="Coefficient alpha_rho [-], 0 to 2; 0.3 for touching bodies, 0.8 with a gap"
    )


DensityDissipation = Annotated[NoDensityDissipation | ZisisDensityDissipation, Field(discriminator="type")]
