"""Formulations: which published scheme computes the run, with its options."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hvisph.case.dimensions import NUMBER
from hvisph.case.model import StrictModel
from hvisph.case.units import Quantity
from hvisph.case.viscosity import (
    ArtificialStress,
    DensityDissipation,
    MonaghanViscosity,
    NoArtificialStress,
    NoDensityDissipation,
    Viscosity,
)

Kernel = Literal["cubic_spline"]


class FixedSmoothingLength(StrictModel):
    """h stays h_over_dx times the resolution."""

    type: Literal["fixed"] = "fixed"


class VariableSmoothingLength(StrictModel):
    """h follows density, dh/dt = -(h/d) (drho/dt)/rho, within limits."""

    type: Literal["variable"] = "variable"
    min_over_initial: Annotated[float, Quantity(NUMBER, above=0, maximum=1)] = Field(
        default=0.5, description="Lower limit of h over its initial value [-], above 0 and at most 1"
    )
    max_over_initial: Annotated[float, Quantity(NUMBER, minimum=1, maximum=10)] = Field(
        default=2.0, description="Upper limit of h over its initial value [-], 1 to 10"
    )


SmoothingLength = Annotated[FixedSmoothingLength | VariableSmoothingLength, Field(discriminator="type")]


class KernelOptions(StrictModel):
    """What every kernel-based formulation shares."""

    kernel: Kernel = Field(
        default="cubic_spline", description="Smoothing kernel; `cubic_spline` reaches to 2h"
    )
    h_over_dx: Annotated[float, Quantity(NUMBER, minimum=1.0, maximum=2.5)] = Field(
        default=1.4, description="Initial smoothing length h over the resolution dx [-], 1 to 2.5"
    )
    smoothing_length: SmoothingLength = Field(
        default=FixedSmoothingLength(), description="Whether h stays fixed or follows density"
    )

    @property
    def support_over_h(self) -> float:
        """Reach of the kernel in smoothing lengths [-]."""
        return 2.0


class EulerianFormulation(KernelOptions):
    """Standard SPH in the current configuration, with artificial viscosity (the SAV family)."""

    type: Literal["eulerian"] = "eulerian"
    viscosity: Viscosity = Field(default=MonaghanViscosity(), description="Artificial viscosity")
    artificial_stress: ArtificialStress = Field(
        default=NoArtificialStress(), description="Artificial stress against the tensile instability"
    )
    momentum_form: Literal["sigma_over_rho_squared", "product"] = Field(
        default="sigma_over_rho_squared",
        description="Pair stress: sigma_a/rho_a^2 + sigma_b/rho_b^2, or (sigma_a + sigma_b)/(rho_a rho_b)",
    )
    density_dissipation: DensityDissipation = Field(
        default=NoDensityDissipation(), description="Density dissipation at material interfaces"
    )


class RiemannFormulation(KernelOptions):
    """Contact SPH (CON): each pair meets through an acoustic Riemann problem; nothing to tune."""

    type: Literal["riemann"] = "riemann"
    reconstruction: Literal["none", "minmod", "van_leer"] = Field(
        default="van_leer",
        description="Limited reconstruction of the states that meet; `none` is first order, as published",
    )


Formulation = Annotated[EulerianFormulation | RiemannFormulation, Field(discriminator="type")]
