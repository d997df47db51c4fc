"""Contact SPH (CON) by Riemann problems: the corrected and the original variant."""

from collections.abc import Iterable, Iterator
from typing import Any, ClassVar, Literal

from pydantic import model_validator

from hvisph.case.bodies import Body
from hvisph.case.model import AnyCase, Problem, key
from hvisph.case.units import SmoothingRatio
from hvisph.core.text import Plain

from . import options

# Defaults of each variant.
VARIANTS: dict[str, Plain] = {
    name: {"tension_stabilization": stable, "conserve_angular_momentum": conserved, "contact": {"type": contact}}
    for name, stable, conserved, contact in (
        ("original", False, False, "bonded"),
        ("corrected", True, True, "frictional"),
        ("elastic", True, False, "frictional"),
    )
}
GASES = ("ideal_gas", "jwl")  # equations of state of what expands without end
# How the smoothing length of a gas follows it unless given: a fixed one does not reach through an expansion of 1.5, and
# a strong shock takes air to a sixth of its length.
FOLLOWING = {"type": "variable", "min_over_initial": 0.1, "max_over_initial": 4.0}
# With detonation products none shrinks, and in more than a line they grow to 2. What tears off a driven plate is
# squeezed without end where it may shrink to 0.8, single products that have streamed far where they may grow to 4.
PRODUCTS_SHRINK, PRODUCTS_GROW = 1.0, 2.0
# Distension above which crushed pores bring particles of a plane shock closer than the steepest place of the kernel,
# at 0.6 h: there particles pair (Price 2012, J. Comput. Phys. 231, 759).
PAIRING_DISTENSION, PORES_GROW = 1.3, 1.0


def formulation_by_materials(data: Plain) -> Plain | None:
    """Return the formulation of a raw case with the defaults for gases and foams, None without a change.

    `riemann` has a smoothing length that follows them. Where gases drive solids it returns no angular momentum, which
    throws detached pieces (a plate of 4340, at 5.9 km/s for 0.9). Standard SPH of gases alone has the density
    that keeps to the particles' spacing: behind a shock that squeezes fourfold the other form is a fifth off (Noh's
    problem), and none is better in Sod's tube.
    """
    formulation, bodies = data.get("formulation", {"type": "riemann"}), data.get("bodies")
    if not isinstance(formulation, dict) or not isinstance(bodies, dict):
        return None
    if formulation.get("type") == "eulerian":
        penalty = "penalty" in str(formulation.get("contact"))
        given = penalty or "density_form" in formulation or "correction" in formulation
        gases = bool(bodies) and all(is_gas(body, ("ideal_gas",)) for body in bodies.values())
        return formulation | {"density_form": "mass"} if gases and not given else None
    if formulation.get("type") != "riemann":
        return None
    if formulation.get("variant") == "original":
        return None
    if formulation.get("reconstruction") == "none" and "variant" not in formulation:
        return None
    gaseous = [is_gas(body) for body in bodies.values()]
    if not any(gaseous) and not any(map(is_foam, bodies.values())):
        return None
    if formulation.get("variant") == "elastic" and not any(gaseous):
        return None
    free = {"conserve_angular_momentum": False} if any(gaseous) and not all(gaseous) else {}
    return {"smoothing_length": following(bodies.values(), str(data.get("kinematics")))} | free | formulation


def following(bodies: Iterable[object], kinematics: str) -> Plain:
    """Return how the smoothing length follows the gases, detonation products and foams among `bodies`."""
    bodies = list(bodies)
    if not any(map(is_gas, bodies)):
        return FOLLOWING | {"max_over_initial": PORES_GROW}
    products = any(is_gas(body, ("jwl",)) for body in bodies)
    least = {"min_over_initial": PRODUCTS_SHRINK} if products else {}
    most = {"max_over_initial": PRODUCTS_GROW} if products and kinematics != "uniaxial_strain" else {}
    return FOLLOWING | least | most


def is_gas(body: object, kinds: tuple[str, ...] = GASES) -> bool:
    """Whether a raw body is of a gas or of detonation products, which become one; or of these `kinds` of them."""
    for name in ("material", "eos"):
        body = body.get(name) if isinstance(body, dict) else getattr(body, name, None)
    kind = body.get("type") if isinstance(body, dict) else getattr(body, "type", None)
    return bool(kind in kinds)


def is_foam(body: object) -> bool:
    """Whether a raw body is of a material whose pores crush so far that particles of a fixed h would pair."""
    for name in ("material", "porosity", "distension"):
        body = body.get(name) if isinstance(body, dict) else getattr(body, name, None)
    return isinstance(body, int | float) and body > PAIRING_DISTENSION


def bears_any_tension(body: Body) -> bool:
    """Whether only the equation of state limits the tension of a body."""
    material = body.material
    breaks = material.damage.type != "none" or material.strength.type in ("elastic", "fabric")
    breaks |= getattr(material.strength, "tension", None) is not None
    return not (breaks or is_gas(body))


class RiemannFormulation(options.PairOptions):
    """Contact SPH (CON): the pair interaction is the solution of an acoustic Riemann problem."""

    retires: ClassVar[bool] = True
    meaningless: ClassVar[dict[str, str]] = options.NO_CONVERSION | {
        "viscosity": "the Riemann problem of each pair dissipates what a shock needs",
        "artificial_stress": "the contact stress of each pair keeps particles from clumping",
        "correction": "its pair forces are those of the plain kernel gradient, equal and opposite",
        "momentum_form": "each pair has one contact stress",
        "density_form": "the contact velocity of each pair gives the rate of density; see `variant`",
        "density_dissipation": "the contact velocity of each pair smooths density at interfaces",
    }

    type: Literal["riemann"] = "riemann"
    kernel: options.Kernel = key(
        "Smoothing kernel; support 2h, quartic 2.5h, quintic and gaussian 3h", "quartic_spline"
    )
    h_over_dx: SmoothingRatio = key("Initial smoothing length h over the resolution dx [-]", 1.2)
    reconstruction: Literal["none", "minmod", "van_leer", "van_albada"] = key(
        "Slope limiter of the reconstruction of the Riemann states; `none` is first order, as published", "van_albada"
    )
    variant: Literal["corrected", "original", "elastic"] = key(
        "`corrected`: density consistent with the particle spacing through shocks of any strength, shock "
        "impedances, tractions limited by the strength of the material, exact gradients at free surfaces; `original`: "
        "CON as published, whose stress is 2 % too low at 3 km/s and 37 % at 24 km/s; `elastic`: `corrected` with "
        "force and work adjoint to the velocity gradient and little dissipation in solids that have not yielded, for "
        "impacts below the elastic limit. Default with reconstruction `none`: `original`",
        "corrected",
    )
    tension_stabilization: bool = key(
        "Whether solids are stabilized against the tensile instability, up to a plastic strain of 0.2; "
        "not available with variant `original`",
        True,
    )
    conserve_angular_momentum: bool = key(
        "Whether the torque of non-central pair forces is compensated in the following step; not available "
        "with variant `original`",
        True,
    )
    contact: options.Contact = key(
        "Contact between bodies; default with variant `original`: `bonded`", options.FrictionalContact()
    )

    @model_validator(mode="before")
    @classmethod
    def _fill_variant_defaults(cls, data: Any) -> object:
        if not isinstance(data, dict):
            return data
        variant = data.get("variant", "original" if data.get("reconstruction") == "none" else "corrected")
        known = VARIANTS.get(variant, {}) if isinstance(variant, str) else {}
        return {"variant": variant} | known | data

    def _faults(self) -> Iterator[Problem]:
        if self.variant == "original":
            given = [name for name in ("tension_stabilization", "conserve_angular_momentum") if getattr(self, name)]
            yield from ((name, "true requires variant 'corrected'; leave it out or give false") for name in given)
        if self.variant != "elastic":
            return
        if self.reconstruction == "none":
            yield "reconstruction", "variant 'elastic' needs a limiter; leave it out"
        if self.conserve_angular_momentum:
            operator = "variant 'elastic' conserves angular momentum by its operator; leave it out"
            yield "conserve_angular_momentum", operator
        if self.smoothing_length.type == "variable":
            solids = "needs a constant smoothing length, and is for solids; take variant 'corrected' with gases"
            yield "smoothing_length", f"variant 'elastic' {solids}"

    def problems(self, case: AnyCase) -> Iterator[Problem]:
        yield from super().problems(case)
        yield from options.frictional_problems(self.contact, self.type)
        if self.variant == "elastic" and case.kinematics == "axisymmetric":
            fault = "'elastic' is for uniaxial, plane and three-dimensional cases; take 'corrected' or total_lagrangian"
            yield "formulation.variant", fault
        if isinstance(self.contact, options.PenaltyContact):
            yield from options.unavailable(self.contact, self.type)
