"""How bodies meet: a contact algorithm between their particles, or the kernel sums alone."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hvisph.case.model import StrictModel
from hvisph.case.units import PositiveNumber


class KernelContact(StrictModel):
    """No contact algorithm: bodies feel each other through the conservation sums."""

    type: Literal["kernel"] = "kernel"


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


Contact = Annotated[KernelContact | RepulsiveContact, Field(discriminator="type")]
