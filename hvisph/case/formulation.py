"""Formulations: which published scheme computes the run, with its options."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from hvisph.case.contact import Contact, KernelContact, RepulsiveContact
from hvisph.case.conversion import ConversionLimits, EulerianRegion
from hvisph.case.correction import Correction, NoCorrection, correction_problems, fill_correction, fill_factor
from hvisph.case.dimensions import NUMBER, TIME
from hvisph.case.model import SCALAR_AS_LIST, StrictModel, refuse
from hvisph.case.units import Acceleration, NonNegativeNumber, Quantity
from hvisph.case.viscosity import (
    ArtificialStress,
    DensityDissipation,
    GrayArtificialStress,
    MonaghanViscosity,
    NoArtificialStress,
    NoDensityDissipation,
    NoViscosity,
    Viscosity,
)

Kernel = Literal[
    "cubic_spline", "quadratic", "quartic_spline", "quintic_spline", "gaussian", "wendland_c2", "wendland_c4"
]
# Support radius over h of those that do not reach to 2h.
REACH = {"quartic_spline": 2.5, "quintic_spline": 3.0, "gaussian": 3.0}


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
        default="cubic_spline",
        description="Smoothing kernel; reaches to 2h, `quartic_spline` to 2.5h, `quintic_spline` and "
        "`gaussian` (cut off there) to 3h",
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
        return REACH.get(self.kernel, 2.0)


NO_CONVERSION = {"conversion": "only particles of the formulation 'adaptive' turn Eulerian"}


class EulerianFormulation(KernelOptions):
    """Standard SPH in the current configuration, with artificial viscosity (the SAV family)."""

    meaningless: ClassVar[dict[str, str]] = NO_CONVERSION

    type: Literal["eulerian"] = "eulerian"
    viscosity: Viscosity = Field(default=MonaghanViscosity(), description="Artificial viscosity")
    artificial_stress: ArtificialStress = Field(
        default=NoArtificialStress(), description="Artificial stress against the tensile instability"
    )
    momentum_form: Literal["sigma_over_rho_squared", "product"] = Field(
        default="sigma_over_rho_squared",
        description="Pair stress: sigma_a/rho_a^2 + sigma_b/rho_b^2, or (sigma_a + sigma_b)/(rho_a rho_b)",
    )
    density_form: Literal["volume", "mass"] = Field(
        default="volume",
        description="Rate of density: rho_a sum m_b/rho_b u_ab . grad W, which neighbours of another density leave "
        "alone, or sum m_b u_ab . grad W, which keeps to the particles' spacing through strong shocks",
    )
    correction: Correction = Field(
        default=NoCorrection(),
        description="Correction of the kernel and its gradient (Young 2021 eqs. 3-5), in the form `product`",
    )
    density_dissipation: DensityDissipation = Field(
        default=NoDensityDissipation(), description="Density dissipation at material interfaces"
    )
    contact: Contact = Field(default=KernelContact(), description="How bodies meet")

    @model_validator(mode="before")
    @classmethod
    def _fill_what_depends_on_correction(cls, data: Any) -> Any:
        return fill_correction(data)

    @model_validator(mode="after")
    def _consistent(self) -> EulerianFormulation:
        refuse(tuple(correction_problems(self)))
        return self


PlainViscosity = Annotated[NoViscosity | MonaghanViscosity, Field(discriminator="type")]


class TotalLagrangianFormulation(KernelOptions):
    """SPH in the reference configuration: no tensile instability, for distortions that a body survives.

    Bodies, or regions of them, may be Eulerian (standard SPH) in the same run.
    """

    meaningless: ClassVar[dict[str, str]] = NO_CONVERSION

    type: Literal["total_lagrangian"] = "total_lagrangian"
    viscosity: PlainViscosity = Field(default=MonaghanViscosity(), description="Artificial viscosity")
    viscosity_gradient: Literal["current", "reference"] = Field(
        default="current",
        description="Gradient of the viscosity between Total Lagrangian particles: the plain one at current "
        "positions, which dissipates in every pair, or that of Young 2021 eq. 9 in the reference configuration",
    )
    correction: Literal["none", "gradient", "mixed"] = Field(
        default="mixed", description="Correction of the reference kernel (Young 2021 eqs. 3-5)"
    )
    spatial_correction: Correction = Field(
        default=NoCorrection(),
        description="Correction of the kernel in the current configuration, for Eulerian particles and those near them",
    )
    hourglass: NonNegativeNumber = Field(
        default=0.0,
        description="Coefficient of the control of zero-energy modes (Ganzenmueller 2015) [-], at least 0, 0 is "
        "off; 10 to 50 is usual in elastic bodies, and a body that flows takes less than 1: more hardens it",
    )
    failed_particles: Literal["leave", "stay"] = Field(
        default="leave",
        description="Whether a failed Total Lagrangian particle leaves its neighbours' lists; it bears no stress",
    )
    artificial_stress: ArtificialStress = Field(
        default=NoArtificialStress(), description="Artificial stress of the Eulerian particles"
    )
    artificial_stress_at_interface: Literal["both", "neither"] = Field(
        default="both",
        description="Whether it acts between Eulerian and Total Lagrangian particles, on both sides or on neither",
    )
    contact: Contact = Field(default=RepulsiveContact(), description="How bodies meet")
    eulerian_regions: tuple[EulerianRegion, ...] = Field(
        default=(), description="Regions that are Eulerian from the start", max_length=100
    )

    @model_validator(mode="before")
    @classmethod
    def _fill_factor(cls, data: Any) -> Any:
        return fill_factor(data, "spatial_correction", cls.model_fields["artificial_stress"].default.type)


class AdaptiveFormulation(TotalLagrangianFormulation):
    """AdapTLE (Young 2021): Total Lagrangian until a particle's strain or damage turns it Eulerian, for good."""

    type: Literal["adaptive"] = "adaptive"  # type: ignore[assignment]
    artificial_stress: ArtificialStress = Field(
        default=GrayArtificialStress(), description="Artificial stress of the Eulerian particles"
    )
    conversion: ConversionLimits = Field(description="What turns a particle Eulerian")


class RiemannFormulation(KernelOptions):
    """Contact SPH (CON): each pair meets through an acoustic Riemann problem; nothing to tune."""

    meaningless: ClassVar[dict[str, str]] = NO_CONVERSION | {
        "viscosity": "the Riemann problem of each pair dissipates what a shock needs",
        "artificial_stress": "the contact stress of each pair keeps particles from clumping",
        "correction": "its pair forces are those of the plain kernel gradient, equal and opposite",
        "contact": "bodies meet by the Riemann problem of each pair",
        "momentum_form": "each pair has one contact stress",
        "density_form": "the contact velocity of each pair gives the rate of density",
        "density_dissipation": "the contact velocity of each pair smooths density at interfaces",
    }

    type: Literal["riemann"] = "riemann"
    reconstruction: Literal["none", "minmod", "van_leer"] = Field(
        default="van_leer",
        description="Limited reconstruction of the states that meet; `none` is first order, as published",
    )


class ProjectionFormulation(KernelOptions):
    """SPH-projection (Farahani 2009): density restored each step by a pressure from a Poisson equation.

    Neither equation of state nor energy: a material gives its density and its strength alone.
    """

    meaningless: ClassVar[dict[str, str]] = NO_CONVERSION | {
        "eos": "its pressure restores density and comes from no equation of state",
        "viscosity": "it has neither shocks nor an artificial viscosity to spread them",
        "artificial_stress": "its pressure keeps particles in order",
        "correction": "its Poisson equation is that of the plain kernel gradient",
        "contact": "bodies meet in the pressure's Poisson equation",
        "momentum_form": "give pressure_gradient: conjugate or printed",
        "density_form": "density is restored each step",
        "density_dissipation": "density is restored each step",
    }

    type: Literal["projection"] = "projection"
    h_over_dx: Annotated[float, Quantity(NUMBER, minimum=1.0, maximum=2.5)] = Field(
        default=1.5, description="Initial smoothing length h over the resolution dx [-], 1 to 2.5"
    )
    pressure_gradient: Literal["conjugate", "printed"] = Field(
        default="conjugate",
        description="Pair pressure: `conjugate` is (P_a + P_b)/(rho_a rho_b); `printed` is the paper's eq. 31, "
        "P_a/rho_a^2 + P_b/rho_b^2, which fails where bodies of different densities meet",
    )
    guard: Annotated[float, Quantity(NUMBER, minimum=0, below=1)] = Field(
        default=0.3,
        description="Fullness of a particle's neighbourhood below which it has no pressure [-], at least 0 and "
        "below 1; inside a body it is 1, at a flat surface 0.5. It stops small detached groups, whose Poisson "
        "equation is ill-posed, from pumping each other",
    )
    pressure_average: Annotated[float, Quantity(TIME, above=0)] = Field(
        default=2e-7,
        description="Time over which the pressures of the history are averaged [s], above 0: single values ring",
    )
    body_force: Annotated[tuple[Acceleration, ...], SCALAR_AS_LIST] = Field(
        default=(),
        description="Acceleration of all particles, one component per dimension [m/s^2]; none unless given",
    )


Formulation = Annotated[
    EulerianFormulation | RiemannFormulation | ProjectionFormulation | TotalLagrangianFormulation | AdaptiveFormulation,
    Field(discriminator="type"),
]
