"""Contact SPH by Riemann problems, CON."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from hvisph.case.formulations.options import NO_CONVERSION, KernelOptions


class RiemannFormulation(KernelOptions):
    """Contact SPH (CON): each pair meets through an acoustic Riemann problem; nothing to tune."""

    retires: ClassVar[bool] = True
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
