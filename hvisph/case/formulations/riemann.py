"""Contact SPH by Riemann problems, CON: as printed, and the form whose density keeps to the particles' spacing."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from hvisph.case.context import Surroundings
from hvisph.case.dimensions import NUMBER
from hvisph.case.model import Problem, refuse
from hvisph.case.units import Quantity

from .contact import Contact, RepulsiveContact, SeparatingContact, stiffness_problems, unavailable
from .options import NO_CONVERSION, AngularMomentum, Kernel, KernelOptions

# What goes with each form unless given.
FORMS: dict[str, dict[str, Any]] = {
    "printed": {"tension": "plain", "angular_momentum": "free", "contact": {"type": "welded"}},
    "consistent": {"tension": "held", "angular_momentum": "kept", "contact": {"type": "separating"}},
}

# Equations of state of what expands without end.
GASES = ("ideal_gas", "jwl")
# How the smoothing length of a gas follows it unless given: a fixed one does not reach through an expansion of 1.5, and
# a strong shock takes air to a sixth of its length.
FOLLOWING = {"type": "variable", "min_over_initial": 0.1, "max_over_initial": 4.0}
# With detonation products none shrinks, and in more than a line they grow to 2. What tears off a driven plate is
# squeezed without end where it may shrink to 0.8, single products that have streamed far where they may grow to 4.
PRODUCTS_SHRINK, PRODUCTS_GROW = 1.0, 2.0


def gas_formulation(data: dict[str, Any]) -> dict[str, Any] | None:
    """Return the formulation of a raw case with what a gas has unless given, None where that is nothing.

    `riemann` has a smoothing length that follows it. Where gases drive solids it gives no angular momentum back, which
    throws what has torn off them (a plate of 4340, at 5.9 km/s for 0.9). Standard SPH of gases alone has the density
    that keeps to the particles' spacing: behind a shock that squeezes fourfold the other form is a fifth off (Noh's
    problem), and none is better in Sod's tube.
    """
    formulation, bodies = data.get("formulation", {"type": "riemann"}), data.get("bodies")
    if not isinstance(formulation, dict) or not isinstance(bodies, dict):
        return None
    if formulation.get("type") == "eulerian":
        parted = "repulsive" in str(formulation.get("contact"))
        given = parted or "density_form" in formulation or "correction" in formulation
        gases = bool(bodies) and all(is_gas(body, ("ideal_gas",)) for body in bodies.values())
        return formulation | {"density_form": "mass"} if gases and not given else None
    if formulation.get("type") != "riemann":
        return None
    if formulation.get("form") == "printed":
        return None
    if formulation.get("reconstruction") == "none" and "form" not in formulation:
        return None
    if not any(map(is_gas, bodies.values())):
        return None
    free = {} if all(map(is_gas, bodies.values())) else {"angular_momentum": "free"}
    return {"smoothing_length": following(bodies.values(), str(data.get("kinematics")))} | free | formulation


def following(bodies: Iterable[Any], kinematics: str) -> dict[str, Any]:
    """Return how the smoothing length follows the gases and detonation products among `bodies`."""
    products = any(is_gas(body, ("jwl",)) for body in bodies)
    least = {"min_over_initial": PRODUCTS_SHRINK} if products else {}
    most = {"max_over_initial": PRODUCTS_GROW} if products and kinematics != "uniaxial_strain" else {}
    return FOLLOWING | least | most


def is_gas(body: Any, kinds: tuple[str, ...] = GASES) -> bool:
    """Whether a raw body is of a gas or of detonation products, which become one; or of these `kinds` of them."""
    for key in ("material", "eos"):
        body = body.get(key) if isinstance(body, dict) else getattr(body, key, None)
    kind = body.get("type") if isinstance(body, dict) else getattr(body, "type", None)
    return bool(kind in kinds)


def bears_any_tension(body: Any) -> bool:
    """Whether nothing limits the tension of what a body is made of but its equation of state."""
    material = body.material
    return bool(material.damage.type == "none" and material.strength.type != "elastic") and not is_gas(body)


class RiemannFormulation(KernelOptions):
    """Contact SPH (CON): the pair interaction is the solution of an acoustic Riemann problem."""

    retires: ClassVar[bool] = True
    meaningless: ClassVar[dict[str, str]] = NO_CONVERSION | {
        "viscosity": "the Riemann problem of each pair dissipates what a shock needs",
        "artificial_stress": "the contact stress of each pair keeps particles from clumping",
        "correction": "its pair forces are those of the plain kernel gradient, equal and opposite",
        "momentum_form": "each pair has one contact stress",
        "density_form": "the contact velocity of each pair gives the rate of density; see `form`",
        "density_dissipation": "the contact velocity of each pair smooths density at interfaces",
    }

    type: Literal["riemann"] = "riemann"
    kernel: Kernel = Field(
        default="quartic_spline",
        description="Smoothing kernel; reaches to 2h, `quartic_spline` to 2.5h, `quintic_spline` and "
        "`gaussian` (cut off there) to 3h",
    )
    h_over_dx: Annotated[float, Quantity(NUMBER, minimum=1.0, maximum=2.5)] = Field(
        default=1.2, description="Initial smoothing length h over the resolution dx [-], 1 to 2.5"
    )
    reconstruction: Literal["none", "minmod", "van_leer", "van_albada"] = Field(
        default="van_albada",
        description="Limiter of the reconstruction of the states that meet; `none` is first order, as published",
    )
    form: Literal["consistent", "printed"] = Field(
        default="consistent",
        description="`consistent`: density keeps to the particles' spacing through shocks of any strength, impedances "
        "are those of shocks, tractions what the material bears, gradients exact at free faces; `printed`: CON as "
        "published, which loses 2 % of the stress at 3 km/s and 37 % at 24. With reconstruction `none` it is "
        "`printed` unless given",
    )
    tension: Literal["held", "plain"] = Field(
        default="held",
        description="`held`: particles of a solid keep their order in tension until it has flowed by 0.2 of plastic "
        "strain; `plain`: tension brings them into disorder and tears the lattice. `plain` with form `printed`",
    )
    angular_momentum: AngularMomentum = Field(
        default="kept",
        description="`kept`: what pairs make by shear beside their line of centres is taken back a step later; `free`: "
        "it stays. `free` with form `printed`",
    )
    contact: Contact = Field(
        default=SeparatingContact(), description="How bodies meet; `welded` unless given with form `printed`"
    )

    @model_validator(mode="before")
    @classmethod
    def _fill_what_depends_on_form(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        form = data.get("form", "printed" if data.get("reconstruction") == "none" else "consistent")
        known = FORMS.get(form, {}) if isinstance(form, str) else {}
        return {"form": form} | known | data

    @model_validator(mode="after")
    def _nothing_held_as_printed(self) -> RiemannFormulation:
        held = {"tension": ("held", "plain"), "angular_momentum": ("kept", "free")}
        if self.form == "printed":
            refuse(
                [
                    Problem((name,), f"'{no}' is for form 'consistent'; leave it out or give '{yes}'")
                    for name, (no, yes) in held.items()
                    if getattr(self, name) == no
                ]
            )
        return self

    def problems(self, case: Surroundings) -> Iterator[Problem]:
        """Yield what is wrong with this formulation in `case`, by paths from the case's root."""
        yield from super().problems(case)
        yield from stiffness_problems(self.contact, self.type)
        if isinstance(self.contact, RepulsiveContact):
            yield from unavailable(self.contact, self.type)
