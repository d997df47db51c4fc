"""How bodies meet: they touch and separate, are welded, or repel each other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field

from hvisph.case.context import Surroundings
from hvisph.case.dimensions import NUMBER
from hvisph.case.model import Problem, StrictModel
from hvisph.case.units import PositiveNumber, Quantity


class SeparatingContact(StrictModel):
    """Bodies press on each other and slide with Coulomb's friction, and part freely; those that touch at rest stay so.

    The Riemann problem of each pair, which takes no energy but that of slip. Total Lagrangian bodies: a repulsion that
    starts unloaded; what it holds is an account of its own and comes back.
    """

    type: Literal["separating"] = "separating"
    friction: Annotated[float, Quantity(NUMBER, minimum=0, maximum=10)] = Field(
        default=0.0, description="Coefficient of friction mu [-], 0 to 10"
    )
    own_faces: bool | None = Field(
        default=None,
        description="Whether faces of one body that meet press, slide and part as bodies do. Of Total Lagrangian "
        "bodies those farther apart at the start than kernels reach; if not they pass through each other. Of "
        "`riemann` and `eulerian` those of pieces that have come farther apart than that; if not they weld. Yes unless "
        "given, but for a body of one piece alone in its case with `riemann` or `eulerian`",
    )
    folds: bool = Field(
        default=False,
        description="Of `riemann` alone: whether faces of one body that is connected elsewhere, prongs or a shell that "
        "folds, press, slide and part as well, told by the directions in which they face; a step takes a fifth longer",
    )
    stiffness: PositiveNumber | None = Field(
        default=None,
        description="Of Total Lagrangian bodies alone: stiffness at first touch over that of a spacing of each "
        "material [-], above 0; unless given 1, and more where the impact needs it",
    )


class WeldedContact(StrictModel):
    """Bodies that touch are one for good: the kernel sums bear tension and shear between them as within a body."""

    type: Literal["welded"] = "welded"


class RepulsiveContact(StrictModel):
    """Repulsion between particles of different bodies, without friction (Vignjevic et al. 2006).

    No kernel force acts between bodies then.
    """

    type: Literal["repulsive"] = "repulsive"
    stiffness: PositiveNumber = Field(
        default=0.025,
        description="k, stiffness K over rho0 c0^2/dx^d of each material [-], above 0; a pair takes the softer K",
    )
    exponent: Annotated[int, Field(strict=True, ge=2, le=8)] = Field(
        default=4, description="Exponent n of W/W(dx), 2 to 8"
    )
    absolute_stiffness: PositiveNumber | None = Field(
        default=None,
        description="K [Pa/m^d] for all bodies, above 0, in place of `stiffness`; it carries about 20 K dx^2 of "
        "pressure in 2D and 40 K dx^3 in 3D",
    )


Contact = Annotated[SeparatingContact | WeldedContact | RepulsiveContact, Field(discriminator="type")]


def stiffness_problems(contact: Any, formulation: str) -> Iterator[Problem]:
    """Yield what separating bodies of `formulation` have not to choose."""
    if isinstance(contact, SeparatingContact) and contact.folds and formulation != "riemann":
        yield Problem(("formulation", "contact", "folds"), f"is of 'riemann', not of '{formulation}'; leave it out")
    if isinstance(contact, SeparatingContact) and contact.stiffness is not None:
        yield Problem(
            ("formulation", "contact", "stiffness"),
            f"is of Total Lagrangian bodies; '{formulation}' solves the Riemann problem of each pair; leave it out",
        )


def unavailable(contact: Any, formulation: str) -> Iterator[Problem]:
    """Yield that `formulation` has no such contact."""
    yield Problem(("formulation", "contact", "type"), f"'{contact.type}' is not available with '{formulation}'")


def parted_problems(case: Surroundings, smoothing_length: str, what: str) -> Iterator[Problem]:
    """Yield what is not available where bodies are in pieces: Total Lagrangian, or parted by a contact algorithm.

    Parameters
    ----------
    case
        The rest of the case.
    smoothing_length
        The type of the formulation's smoothing length.
    what
        What wants it fixed, with its verb.
    """
    if smoothing_length == "variable":
        reason = f"{what} of a fixed smoothing length; leave it out"
        yield Problem(("formulation", "smoothing_length"), reason)
    if case.time.integrator == "staggered":
        yield Problem(
            ("time", "integrator"),
            "'staggered' is for Eulerian bodies that are welded or separating; leave it out here",
        )
    if case.kinematics == "plane_stress":
        yield Problem(
            ("kinematics",),
            "plane_stress is for Eulerian and Riemann bodies that are welded or separating; use plane_strain",
        )
