"""Options of formulations: kernel and smoothing length; viscosity, artificial stress, corrections; contact."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, Field

from hvisph.case.model import BY_TYPE, AnyCase, Problem, StrictModel, key
from hvisph.case.units import NUMBER, NonNegativeNumber, PositiveNumber, PositiveShare, Quantity, SmoothingRatio
from hvisph.core.catalogues import REACH

if TYPE_CHECKING:  # a type checker cannot read types made from the catalogue
    Kernel = str
else:
    Kernel = Literal[tuple(REACH)]


class FixedSmoothingLength(StrictModel):
    """h stays h_over_dx times the resolution."""

    type: Literal["fixed"] = "fixed"


class VariableSmoothingLength(StrictModel):
    """h follows density, dh/dt = -(h/d) (drho/dt)/rho, within limits."""

    type: Literal["variable"] = "variable"
    min_over_initial: PositiveShare = key("Lower limit of h over its initial value [-]", 0.5)
    max_over_initial: Annotated[float, Quantity(NUMBER, minimum=1, maximum=10)] = key(
        "Upper limit of h over its initial value [-]", 2.0
    )


SmoothingLength = Annotated[FixedSmoothingLength | VariableSmoothingLength, BY_TYPE]


class KernelOptions(StrictModel):
    """Options of every kernel-based formulation."""

    kernel: Kernel = key("Smoothing kernel; support 2h, quartic 2.5h, quintic and gaussian 3h", "cubic_spline")
    h_over_dx: SmoothingRatio = key("Initial smoothing length h over the resolution dx [-]", 1.4)
    smoothing_length: SmoothingLength = key("Whether h stays fixed or follows density", FixedSmoothingLength())

    @property
    def support_over_h(self) -> float:
        """Kernel support in smoothing lengths [-]."""
        return REACH[self.kernel]

    @property
    def contact_algorithm(self) -> bool:
        """Whether a contact algorithm instead of the kernel sums acts between bodies."""
        return False

    # Whether bodies, or regions of them, may have kernels of their own kind; whether a particle may leave the
    # others without a trace.
    mixes_kernels: ClassVar[bool] = False
    retires: ClassVar[bool] = False

    def problems(self, case: AnyCase) -> Iterator[Problem]:
        """Yield the errors of this formulation in `case`, with paths from the root."""
        kind = getattr(self, "type")  # noqa: B009 - every formulation has one, of a literal of its own
        if not self.mixes_kernels:
            yield from _kernels_of_another_kind(kind, case)
        if case.domain is not None and not self.retires:
            fault = f"particles cannot be retired with '{kind}', whose particles keep what surrounds them;"
            yield "domain", f"{fault} leave it out, or use eulerian or riemann"

    def warnings(self, case: AnyCase) -> Iterator[str]:
        """Yield warnings about this formulation in a valid `case`."""
        yield from ()


class PairOptions(KernelOptions):
    """Options of the formulations whose pair laws also exist in single precision."""

    precision: Literal["double", "single"] = key(
        "Arithmetic of the pairs; the state and its integration are double. `single` takes 0.73 of their "
        "time in 3D with `riemann` and 0.86 with `eulerian`, and keeps energy and momentum to 1e-8 of their size",
        "double",
    )

    def problems(self, case: AnyCase) -> Iterator[Problem]:
        yield from super().problems(case)
        contact, correction = getattr(self, "contact", None), getattr(self, "correction", None)
        excluded = (
            (getattr(contact, "type", None) == "penalty", "contact 'penalty', whose forces are double"),
            (getattr(correction, "type", "none") != "none", "a correction, whose tests need the range of double"),
        )
        for present, what in excluded if self.precision == "single" else ():
            if present:
                yield "formulation.precision", f"'single' is not available with {what}; give 'double'"


def _kernels_of_another_kind(kind: str, case: AnyCase) -> Iterator[Problem]:
    for number, _ in enumerate(case.initial_loads):
        message = f"has no meaning for '{kind}'; use the formulation total_lagrangian, where a body may be eulerian"
        yield f"initial_loads.{number}", message
    for name, body in case.bodies.items():
        if body.formulation is not None:
            fault = f"beside '{kind}' no body has a formulation of its own; give the case total_lagrangian or adaptive"
            yield f"bodies.{name}.formulation", fault


# What formulations say of keys of `adaptive` and of `PairOptions`.
NO_CONVERSION = {
    "conversion": "only particles of the formulation 'adaptive' turn Eulerian",
    "precision": "only the pairs of riemann and eulerian exist in single precision",
}


class NoViscosity(StrictModel):
    """No artificial viscosity: shocks oscillate."""

    type: Literal["none"] = "none"


class MonaghanViscosity(StrictModel):
    """(-alpha c mu + beta mu^2)/rho between approaching particles; SAV1 is 1 and 2, SAV2 is 2.5 and 2.5."""

    type: Literal["monaghan"] = "monaghan"
    alpha: NonNegativeNumber = key("Linear coefficient alpha [-]", 1.0)
    beta: NonNegativeNumber = key("Quadratic coefficient beta [-]", 2.0)


class BalsaraViscosity(StrictModel):
    """BAL: Monaghan's viscosity times |div u|/(|div u| + |curl u|), which reduces it in shear (Balsara 1995)."""

    type: Literal["balsara"] = "balsara"
    alpha: NonNegativeNumber = key("Linear coefficient alpha [-]", 1.0)
    beta: NonNegativeNumber = key("Quadratic coefficient beta [-]", 2.0)


class MorrisMonaghanViscosity(StrictModel):
    """MON: every particle its own alpha, raised by compression and relaxing; beta is twice it (1997)."""

    type: Literal["morris_monaghan"] = "morris_monaghan"
    alpha_min: NonNegativeNumber = key("What alpha relaxes to [-]", 0.1)
    decay: PositiveNumber = key("C1: alpha relaxes in the time h/(C1 c) [-]", 0.2)


Viscosity = Annotated[NoViscosity | MonaghanViscosity | BalsaraViscosity | MorrisMonaghanViscosity, BY_TYPE]


class NoArtificialStress(StrictModel):
    """No artificial stress."""

    type: Literal["none"] = "none"


class GrayArtificialStress(StrictModel):
    """Repulsion in tension against clumping (Gray, Monaghan & Swift 2001)."""

    type: Literal["gray"] = "gray"
    eps: NonNegativeNumber = key("Strength of the repulsion [-]; 0.15 is Young 2021's", 0.3)
    n: Annotated[int, Field(strict=True, ge=1, le=16)] = key("Exponent of W/W(dx) [-], a whole number from 1 to 16", 4)


ArtificialStress = Annotated[NoArtificialStress | GrayArtificialStress, BY_TYPE]


class NoDensityDissipation(StrictModel):
    """No density dissipation."""

    type: Literal["none"] = "none"


class ZisisDensityDissipation(StrictModel):
    """Diffusion of density by pressure differences, for layered materials (Zisis 2013, eqs. 22-24)."""

    type: Literal["zisis"] = "zisis"
    alpha: Annotated[float, Quantity(NUMBER, minimum=0, maximum=2)] = key(
        "Coefficient alpha_rho [-]; 0.3 for touching bodies, 0.8 with a gap", 0.3
    )


DensityDissipation = Annotated[NoDensityDissipation | ZisisDensityDissipation, BY_TYPE]
# C_f without and with artificial stress (Young 2021 section 3.2).
FACTORS = {"none": 7.5, "gray": 90.0}
CORRECTIONS = ("shepard", "gradient", "mixed")


class NoCorrection(StrictModel):
    """The plain kernel gradient."""

    type: Literal["none"] = "none"


class _Limited(StrictModel):
    factor: Annotated[float, Quantity(NUMBER, above=1)] | None = key(
        "C_f: a pair whose corrected gradient is more than C_f times as long as the plain one, or has "
        "less than 1/C_f of it along the pair, takes the plain one [-]; unless given, 7.5 without "
        "artificial stress and 90 with it",
        None,
    )
    limiter: Literal["pair", "components"] = key(
        "Criterion of C_f: `pair`, independent of the frame of reference; `components` limits each "
        "component of the gradient, as published, so that results depend on the orientation of the axes",
        "pair",
    )


class ShepardCorrection(_Limited):
    """The kernel over its own sum: a constant is exact."""

    type: Literal["shepard"] = "shepard"


class GradientCorrection(_Limited):
    """The gradient times the inverse of its moment matrix: the gradient of a linear field is exact."""

    type: Literal["gradient"] = "gradient"


class MixedCorrection(_Limited):
    """Both (Young 2021 eqs. 3-5, 14)."""

    type: Literal["mixed"] = "mixed"


Correction = Annotated[NoCorrection | ShepardCorrection | GradientCorrection | MixedCorrection, BY_TYPE]


def fill_factor(data: object, key: str, unless_given: str) -> Any:
    """Write out C_f of the correction under `key`, by the artificial stress or what it is `unless_given`."""
    if not isinstance(data, dict):
        return data
    correction = data.get(key)
    if isinstance(correction, BaseModel):
        correction = correction.model_dump()
    if not isinstance(correction, dict) or correction.get("type") not in CORRECTIONS:
        return data
    stress = data.get("artificial_stress")
    kind = stress.get("type") if isinstance(stress, dict) else getattr(stress, "type", unless_given)
    if correction.get("factor") is None and isinstance(kind, str) and kind in FACTORS:
        return data | {key: correction | {"factor": FACTORS[kind]}}
    return data


def fill_correction(data: object) -> object:
    """Write out C_f, by the artificial stress, and the momentum form where a formulation has a correction."""
    if not isinstance(data, dict):
        return data
    correction = data.get("correction")
    kind = correction.get("type") if isinstance(correction, dict) else getattr(correction, "type", None)
    if kind not in CORRECTIONS:
        return data
    return {"momentum_form": "product"} | fill_factor(data, "correction", "none")


class FrictionalContact(StrictModel):
    """Contact pressure, Coulomb friction and free separation between bodies.

    The contact stress is that of each pair's Riemann problem, which dissipates the work of friction alone. Between
    Total Lagrangian bodies it is a penalty force, unloaded at the start, with an elastic energy that is recovered.
    """

    type: Literal["frictional"] = "frictional"
    friction: Annotated[float, Quantity(NUMBER, minimum=0, maximum=10)] = key("Coefficient of friction mu [-]", 0.0)
    self_contact: Literal["none", "fragments", "all"] | None = key(
        "Contact within one body: `none`; `fragments`, between pieces farther apart than the kernel support "
        "(`riemann`, `eulerian`); `all`, also between surfaces of one connected piece (`riemann`, 5 to 15 % more time "
        "a step; Total Lagrangian bodies). Without it `riemann` and `eulerian` surfaces bond, Total Lagrangian ones "
        "penetrate. Default: `all` for Total Lagrangian bodies, else `fragments`; `none` for a single connected body",
        None,
    )
    stiffness: PositiveNumber | None = key(
        "Initial contact stiffness over that of one particle spacing of each material [-]; Total "
        "Lagrangian bodies only; 1 unless given, more where the impact velocity requires it",
        None,
    )


class BondedContact(StrictModel):
    """Permanently bonded bodies: kernel sums transmit tension and shear between them as within one body."""

    type: Literal["bonded"] = "bonded"


class PenaltyContact(StrictModel):
    """Frictionless penalty force between bodies (Vignjevic et al. 2006), in place of kernel sums."""

    type: Literal["penalty"] = "penalty"
    stiffness: PositiveNumber = key("k, stiffness K over rho0 c0^2/dx^d [-]; a pair has the lower K", 0.025)
    exponent: Annotated[int, Field(strict=True, ge=2, le=8)] = key("Exponent n of W/W(dx), 2 to 8", 4)
    absolute_stiffness: PositiveNumber | None = key(
        "K [Pa/m^d] of all bodies, above 0, instead of `stiffness`; supports a pressure of about "
        "20 K dx^2 in 2D and 40 K dx^3 in 3D",
        None,
    )


Contact = Annotated[FrictionalContact | BondedContact | PenaltyContact, BY_TYPE]


def frictional_problems(contact: Any, formulation: str) -> Iterator[Problem]:
    """Yield the options of frictional contact that `formulation` does not have."""
    if isinstance(contact, FrictionalContact) and contact.self_contact == "all" and formulation == "eulerian":
        yield "formulation.contact.self_contact", "'all' is not available with 'eulerian'; give 'fragments'"
    if isinstance(contact, FrictionalContact) and contact.stiffness is not None:
        fault = f"is an option of Total Lagrangian bodies; '{formulation}' solves the Riemann problem of each pair;"
        yield "formulation.contact.stiffness", f"{fault} leave it out"


def unavailable(contact: Any, formulation: str) -> Iterator[Problem]:
    """Yield that `formulation` has no such contact."""
    yield "formulation.contact.type", f"'{contact.type}' is not available with '{formulation}'"


def separate_bodies_problems(case: AnyCase, smoothing_length: str, what: str) -> Iterator[Problem]:
    """Yield the options that are not available with a contact algorithm or with Total Lagrangian bodies, `what`."""
    if smoothing_length == "variable":
        reason = f"{what} of a fixed smoothing length; leave it out"
        yield "formulation.smoothing_length", reason
    if case.time.integrator == "staggered":
        yield "time.integrator", "'staggered' requires Eulerian bodies in bonded or frictional contact; leave it out"
    if case.kinematics == "plane_stress":
        message = "plane_stress requires eulerian or riemann bodies in bonded or frictional contact; use plane_strain"
        yield "kinematics", message
