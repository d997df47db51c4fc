"""Contact between bodies: frictional, bonded, or by a penalty force."""

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field

from hvisph.case.model import AnyCase, Problem, StrictModel
from hvisph.case.units import NUMBER, PositiveNumber, Quantity


class FrictionalContact(StrictModel):
    """Contact pressure, Coulomb friction and free separation between bodies.

    The contact stress is that of each pair's Riemann problem, which dissipates the work of friction alone. Between
    Total Lagrangian bodies it is a penalty force, unloaded at the start, with an elastic energy that is recovered.
    """

    type: Literal["frictional"] = "frictional"
    friction: Annotated[float, Quantity(NUMBER, minimum=0, maximum=10)] = Field(
        default=0.0, description="Coefficient of friction mu [-], 0 to 10"
    )
    self_contact: Literal["none", "fragments", "all"] | None = Field(
        default=None,
        description="Contact within one body: `none`; `fragments`, between pieces farther apart than the kernel "
        "support (`riemann`, `eulerian`); `all`, also between surfaces of one connected piece (`riemann`, 20 % more "
        "time a step; Total Lagrangian bodies). Without it `riemann` and `eulerian` surfaces bond, Total Lagrangian "
        "ones penetrate. Default: `all` for Total Lagrangian bodies, else `fragments`; `none` for a single connected "
        "body",
    )
    stiffness: PositiveNumber | None = Field(
        default=None,
        description="Initial contact stiffness over that of one particle spacing of each material [-], above 0; Total "
        "Lagrangian bodies only; 1 unless given, more where the impact velocity requires it",
    )


class BondedContact(StrictModel):
    """Permanently bonded bodies: kernel sums transmit tension and shear between them as within one body."""

    type: Literal["bonded"] = "bonded"


class PenaltyContact(StrictModel):
    """Frictionless penalty force between particles of different bodies (Vignjevic et al. 2006).

    No kernel sum acts between the bodies.
    """

    type: Literal["penalty"] = "penalty"
    stiffness: PositiveNumber = Field(
        default=0.025,
        description="k, stiffness K over rho0 c0^2/dx^d of each material [-], above 0; a pair takes the softer K",
    )
    exponent: Annotated[int, Field(strict=True, ge=2, le=8)] = Field(
        default=4, description="Exponent n of W/W(dx), 2 to 8"
    )
    absolute_stiffness: PositiveNumber | None = Field(
        default=None,
        description="K [Pa/m^d] of all bodies, above 0, instead of `stiffness`; supports a pressure of about "
        "20 K dx^2 in 2D and 40 K dx^3 in 3D",
    )


Contact = Annotated[FrictionalContact | BondedContact | PenaltyContact, Field(discriminator="type")]


def frictional_problems(contact: Any, formulation: str) -> Iterator[Problem]:
    """Yield the options of frictional contact that `formulation` does not have."""
    if isinstance(contact, FrictionalContact) and contact.self_contact == "all" and formulation == "eulerian":
        yield Problem(
            ("formulation", "contact", "self_contact"), "'all' is not available with 'eulerian'; give 'fragments'"
        )
    if isinstance(contact, FrictionalContact) and contact.stiffness is not None:
        yield Problem(
            ("formulation", "contact", "stiffness"),
            f"is an option of Total Lagrangian bodies; '{formulation}' solves the Riemann problem of each pair; "
            "leave it out",
        )


def unavailable(contact: Any, formulation: str) -> Iterator[Problem]:
    """Yield that `formulation` has no such contact."""
    yield Problem(("formulation", "contact", "type"), f"'{contact.type}' is not available with '{formulation}'")


def separate_bodies_problems(case: AnyCase, smoothing_length: str, what: str) -> Iterator[Problem]:
    """Yield the options that are not available with a contact algorithm or with Total Lagrangian bodies.

    `case`: the rest of the case.
    `smoothing_length`: the type of the formulation's smoothing length.
    `what`: what requires a fixed one, with its verb.
    """
    if smoothing_length == "variable":
        reason = f"{what} of a fixed smoothing length; leave it out"
        yield Problem(("formulation", "smoothing_length"), reason)
    if case.time.integrator == "staggered":
        yield Problem(
            ("time", "integrator"),
            "'staggered' requires Eulerian bodies in bonded or frictional contact; leave it out",
        )
    if case.kinematics == "plane_stress":
        yield Problem(
            ("kinematics",),
            "plane_stress requires eulerian or riemann bodies in bonded or frictional contact; use plane_strain",
        )
