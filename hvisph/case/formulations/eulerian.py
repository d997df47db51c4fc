"""Eulerian SPH in its standard form, and what its options ask of one another and of the rest of a case."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Literal

from pydantic import Field, model_validator

from hvisph.case.context import Surroundings
from hvisph.case.model import Problem, refuse

from .contact import Contact, RepulsiveContact, SeparatingContact, parted_problems, stiffness_problems
from .correction import Correction, NoCorrection, fill_correction
from .options import NO_CONVERSION, AngularMomentum, KernelOptions
from .viscosity import (
    ArtificialStress,
    DensityDissipation,
    MonaghanViscosity,
    NoArtificialStress,
    NoDensityDissipation,
    Viscosity,
)


class EulerianFormulation(KernelOptions):
    """Standard SPH in the current configuration, with artificial viscosity (the SAV family)."""

    retires: ClassVar[bool] = True
    meaningless: ClassVar[dict[str, str]] = NO_CONVERSION

    type: Literal["eulerian"] = "eulerian"
    viscosity: Viscosity = Field(default=MonaghanViscosity(), description="Artificial viscosity")
    viscosity_in_shear: Literal["reduced", "whole"] = Field(
        default="whole",
        description="Linear viscosity of particles that flow: `whole`, which hardens plastic flow, or `reduced` by the "
        "share of the change of volume in the rate of strain (to 0.88 in a plane shock, 0.1 in shear); solid "
        "rings have it `reduced` unless given",
    )
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
        "alone, or sum m_b u_ab . grad W, which keeps to the particles' spacing through strong shocks; where all "
        "bodies are ideal gases `mass` unless given",
    )
    correction: Correction = Field(
        default=NoCorrection(),
        description="Correction of the kernel and its gradient (Young 2021 eqs. 3-5), in the form `product`",
    )
    density_dissipation: DensityDissipation = Field(
        default=NoDensityDissipation(), description="Density dissipation at material interfaces"
    )
    angular_momentum: AngularMomentum = Field(
        default="free",
        description="`kept`: what pairs make by shear beside their line of centres is taken back a step later, and "
        "turning strains nothing, for a tenth of a step in 2D and a third in 3D; `free`: as published",
    )
    contact: Contact = Field(default=SeparatingContact(), description="How bodies meet")

    @model_validator(mode="before")
    @classmethod
    def _fill_what_depends_on_correction(cls, data: Any) -> Any:
        return fill_correction(data)

    @model_validator(mode="after")
    def _consistent(self) -> EulerianFormulation:
        refuse(tuple(self._beside_the_correction()))
        return self

    @property
    def _cannot_keep(self) -> str:
        """What leaves angular momentum free, in words; empty where nothing does."""
        if self.correction.type != "none":
            return f"correction '{self.correction.type}'"
        return "repulsive contact" if self.parted else ""

    @property
    def parted(self) -> bool:
        """Whether a contact algorithm, and no kernel sum, acts between bodies."""
        return isinstance(self.contact, RepulsiveContact)

    def problems(self, case: Surroundings) -> Iterator[Problem]:
        """Yield what is wrong with this formulation in `case`, by paths from the case's root."""
        yield from super().problems(case)
        yield from stiffness_problems(self.contact, self.type)
        if not self.parted:
            return
        if len(case.bodies) < 2:
            yield Problem(("formulation", "contact"), "there is only one body; leave it out")
        yield from parted_problems(case, self.smoothing_length.type, "contact is")
        why = "not available where a contact algorithm parts the bodies"
        if self.viscosity.type not in ("none", "monaghan"):
            yield Problem(("formulation", "viscosity", "type"), f"{why}; give 'monaghan'")
        if self.density_dissipation.type != "none":
            yield Problem(("formulation", "density_dissipation", "type"), f"{why}; give 'none'")
        if self.density_form != "volume":
            yield Problem(("formulation", "density_form"), f"{why}; give 'volume'")
        if self.correction.type != "none":
            yield Problem(("formulation", "correction", "type"), f"{why}; give 'none'")

    def _beside_the_correction(self) -> Iterator[Problem]:
        if self._cannot_keep and self.angular_momentum == "kept":
            yield Problem(("angular_momentum",), f"not kept with {self._cannot_keep}; leave it out or give 'free'")
        kind = self.correction.type
        if kind == "none":
            return
        if self.momentum_form != "product":
            yield Problem(
                ("momentum_form",),
                f"'{self.momentum_form}' has no meaning with correction '{kind}', where each side's "
                "gradient goes with its own stress; leave it out or give 'product'",
            )
        why = f"not available with correction '{kind}'"
        if self.viscosity.type not in ("none", "monaghan"):
            yield Problem(("viscosity", "type"), f"{why}; give 'monaghan' or 'none'")
        if self.density_dissipation.type != "none":
            yield Problem(("density_dissipation", "type"), f"{why}; give 'none'")
        if self.density_form != "volume":
            yield Problem(("density_form",), f"{why}; give 'volume'")
        if self.parted:
            yield Problem(("contact", "type"), f"{why}; give 'welded'")
