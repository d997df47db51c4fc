"""Total Lagrangian SPH, and AdapTLE with conversion to Eulerian particles (Young 2021)."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import model_validator

from hvisph.case.model import BY_TYPE, AnyCase, Problem, StrictModel, key
from hvisph.case.output import EulerianRegion, region_problems
from hvisph.case.units import NUMBER, NonNegativeNumber, PositiveNumber, Quantity

from . import options


class ConversionLimits(StrictModel):
    """Criteria for the permanent conversion of a Total Lagrangian particle to an Eulerian one."""

    strain: Annotated[float, Quantity(NUMBER, minimum=0)] | None = key(
        "Equivalent deviatoric Green-Lagrange strain at which a particle converts [-]; 0: "
        "Eulerian from the first step on",
        None,
    )
    damage: bool = key("Whether a failed particle (damage 1) converts", False)
    neighbours: bool = key("Whether the reference neighbours of a converted particle convert, too", True)
    fallback: bool = key(
        "Whether Total Lagrangian particles with Eulerian neighbours convert where the deformation "
        "gradient is no longer valid: J outside 0.2 to 5, or strain above `fallback_strain`",
        True,
    )
    fallback_strain: PositiveNumber | None = key("Strain limit of the fallback [-]; 1.5, in 3D 1 unless given", None)
    fallback_damage: bool = key("With `damage: true`: whether neighbours of failed Eulerian particles convert", True)


PlainViscosity = Annotated[options.NoViscosity | options.MonaghanViscosity, BY_TYPE]  # what a composite pair law knows


class TotalLagrangianFormulation(options.KernelOptions):
    """SPH in the reference configuration: no tensile instability, for distortions that a body survives.

    Bodies, or regions of them, may be Eulerian (standard SPH) in the same run.
    """

    mixes_kernels: ClassVar[bool] = True
    meaningless: ClassVar[dict[str, str]] = options.NO_CONVERSION

    type: Literal["total_lagrangian"] = "total_lagrangian"
    viscosity: PlainViscosity = key("Artificial viscosity", options.MonaghanViscosity())
    viscosity_gradient: Literal["current", "reference"] = key(
        "Gradient of the viscosity between Total Lagrangian particles: the plain one at current "
        "positions, which dissipates in every pair, or that of Young 2021 eq. 9 in the reference configuration",
        "current",
    )
    correction: Literal["none", "gradient", "mixed"] = key(
        "Correction of reference kernels (Young 2021 eqs. 3-5)", "mixed"
    )
    spatial_correction: options.Correction = key(
        "Correction of kernels in the current configuration", options.NoCorrection()
    )
    viscosity_in_shear: Literal["reduced", "full"] = key(
        "Linear viscosity of Total Lagrangian particles in plastic flow: `reduced` by the volumetric share "
        "of the strain rate (to 0.88 in a plane shock, 0.1 in shear), or `full`, which raises the flow stress",
        "reduced",
    )
    hourglass: NonNegativeNumber = key("Coefficient of hourglass control (Ganzenmueller 2015) [-]; 0 is off", 10.0)
    hourglass_stiffness: Literal["secant", "elastic"] = key(
        "Stiffness of the hourglass control: the secant modulus E Y/(Y + E eps_p) (1 - D), or E, as printed, "
        "which hardens a body that flows (coefficients below 1 then)",
        "secant",
    )
    failed_particles: Literal["removed", "removed_renormalized", "retained"] = key(
        "What becomes of failed Total Lagrangian particles, which carry no stress: `removed` from the neighbour "
        "lists; `removed_renormalized`, in which the kernel sums are also renormalized over the remaining neighbours, "
        "which does not conserve energy; or `retained`",
        "removed",
    )
    reference_update_strain: PositiveNumber | None = key(
        "Equivalent strain since the last update at which the current configuration becomes the reference "
        "of all Total Lagrangian particles [-]; 0.3 for distortions that a fixed reference does not permit. "
        "Touching surfaces of one body bond. No update unless given",
        None,
    )
    artificial_stress: options.ArtificialStress = key(
        "Artificial stress of the Eulerian particles", options.NoArtificialStress()
    )
    artificial_stress_at_interface: Literal["both", "neither"] = key(
        "Whether it acts between Eulerian and Total Lagrangian particles, on both sides or on neither", "both"
    )
    contact: options.Contact = key("Contact between bodies", options.FrictionalContact())
    eulerian_regions: tuple[EulerianRegion, ...] = key("Regions that are Eulerian from the start", (), max_length=100)

    @model_validator(mode="before")
    @classmethod
    def _fill_factor(cls, data: object) -> object:
        return options.fill_factor(data, "spatial_correction", cls.model_fields["artificial_stress"].default.type)

    @property
    def contact_algorithm(self) -> bool:
        return isinstance(self.contact, options.PenaltyContact | options.FrictionalContact)

    def problems(self, case: AnyCase) -> Iterator[Problem]:
        yield from super().problems(case)
        if self.reference_update_strain is not None and self.viscosity_gradient == "reference":
            message = "the printed viscosity is for one reference density; leave out viscosity_gradient"
            yield "formulation.reference_update_strain", message
        if isinstance(self.contact, options.FrictionalContact) and self.contact.self_contact == "fragments":
            message = f"'fragments' is not available with '{self.type}'; give 'all' or 'none'"
            yield "formulation.contact.self_contact", message
        yield from options.separate_bodies_problems(case, self.smoothing_length.type, "reference kernels are")
        if self.spatial_correction.type != "none" and not self.contact_algorithm and len(case.bodies) > 1:
            message = "where bodies meet through the kernel their corrections would mix; leave contact out"
            yield "formulation.spatial_correction", message
        for number, region in enumerate(self.eulerian_regions):
            path = f"formulation.eulerian_regions.{number}"
            yield from region_problems(region, path, case.dim, case.bodies)
        yield from self._own_formulations(case)

    def _own_formulations(self, case: AnyCase) -> Iterator[Problem]:
        for name, body in case.bodies.items():
            if body.formulation == "adaptive":
                message = "needs the limits of conversion; give the case the formulation adaptive"
                yield f"bodies.{name}.formulation", message


class AdaptiveFormulation(TotalLagrangianFormulation):
    """AdapTLE (Young 2021): Total Lagrangian until strain or damage converts a particle to Eulerian permanently."""

    type: Literal["adaptive"] = "adaptive"  # type: ignore[assignment]
    artificial_stress: options.ArtificialStress = key(
        "Artificial stress of the Eulerian particles", options.GrayArtificialStress()
    )
    conversion: ConversionLimits = key("Criteria by which a particle becomes Eulerian")

    def _own_formulations(self, case: AnyCase) -> Iterator[Problem]:
        path = "formulation.conversion"
        if self.conversion.strain is None and not self.conversion.damage:
            yield path, "names no limit; give strain, or damage: true, or use total_lagrangian"
        adaptive = [body for body in case.bodies.values() if body.formulation in (None, "adaptive")]
        if not adaptive:
            yield path, "no body is adaptive; use the formulation total_lagrangian"
        elif self.conversion.damage and all(body.material.damage.type == "none" for body in adaptive):
            yield f"{path}.damage", "no material of an adaptive body can fail; give one a model of damage"
