"""Standard Eulerian SPH: options and consistency checks."""

from collections.abc import Iterator
from typing import ClassVar, Literal

from pydantic import model_validator

from hvisph.case.model import AnyCase, Problem, key

from . import options


class EulerianFormulation(options.PairOptions):
    """Standard SPH in the current configuration, with artificial viscosity (the SAV family)."""

    retires: ClassVar[bool] = True
    meaningless: ClassVar[dict[str, str]] = options.NO_CONVERSION

    type: Literal["eulerian"] = "eulerian"
    viscosity: options.Viscosity = key("Artificial viscosity", options.MonaghanViscosity())
    viscosity_in_shear: Literal["reduced", "full"] = key(
        "Linear viscosity in plastic flow: `full`, which raises the flow stress, or `reduced` by the "
        "volumetric share of the strain rate (to 0.88 in a plane shock, 0.1 in shear); `reduced` by default for solids "
        "in axisymmetric cases",
        "full",
    )
    artificial_stress: options.ArtificialStress = key(
        "Artificial stress against the tensile instability", options.NoArtificialStress()
    )
    momentum_form: Literal["sigma_over_rho_squared", "product"] = key(
        "Pair stress: sigma_a/rho_a^2 + sigma_b/rho_b^2, or (sigma_a + sigma_b)/(rho_a rho_b)", "sigma_over_rho_squared"
    )
    density_form: Literal["volume", "mass"] = key(
        "Rate of density: rho_a sum m_b/rho_b u_ab . grad W, which is independent of the density of "
        "neighbours, or sum m_b u_ab . grad W, which follows the particle spacing through strong shocks; where all "
        "bodies are ideal gases `mass` unless given",
        "volume",
    )
    correction: options.Correction = key(
        "Kernel correction (Young 2021 eqs. 3-5), in the form `product`", options.NoCorrection()
    )
    density_dissipation: options.DensityDissipation = key(
        "Density dissipation at material interfaces", options.NoDensityDissipation()
    )
    conserve_angular_momentum: bool = key(
        "Whether the torque of non-central pair forces is compensated in the following step and rigid "
        "rotation causes no strain; 9 % more time a step in 2D, 36 % in 3D",
        False,
    )
    contact: options.Contact = key("Contact between bodies", options.FrictionalContact())

    @model_validator(mode="before")
    @classmethod
    def _fill_what_depends_on_correction(cls, data: object) -> object:
        return options.fill_correction(data)

    @property
    def _prevents_conservation(self) -> str:
        """Option that excludes the conservation of angular momentum; empty where there is none."""
        if self.correction.type != "none":
            return f"correction '{self.correction.type}'"
        return "contact penalty" if self.contact_algorithm else ""

    @property
    def contact_algorithm(self) -> bool:
        return isinstance(self.contact, options.PenaltyContact)

    def problems(self, case: AnyCase) -> Iterator[Problem]:
        yield from super().problems(case)
        yield from options.frictional_problems(self.contact, self.type)
        if not self.contact_algorithm:
            return
        if len(case.bodies) < 2:
            yield "formulation.contact", "there is only one body; leave it out"
        yield from options.separate_bodies_problems(case, self.smoothing_length.type, "contact is")
        yield from self._refused_with("contact penalty", "formulation.", "'monaghan'")
        if self.correction.type != "none":
            yield "formulation.correction.type", "not available with contact penalty; give 'none'"

    def _faults(self) -> Iterator[Problem]:
        if self._prevents_conservation and self.conserve_angular_momentum:
            reason = f"not available with {self._prevents_conservation}; leave it out or give false"
            yield "conserve_angular_momentum", reason
        kind = self.correction.type
        if kind == "none":
            return
        if self.momentum_form != "product":
            meaning = f"'{self.momentum_form}' has no meaning with correction '{kind}', where each side's gradient goes"
            yield "momentum_form", f"{meaning} with its own stress; leave it out or give 'product'"
        yield from self._refused_with(f"correction '{kind}'", "", "'monaghan' or 'none'")
        if self.contact_algorithm:
            yield "contact.type", f"not available with correction '{kind}'; give 'bonded'"

    def _refused_with(self, what: str, head: str, viscosity: str) -> Iterator[Problem]:
        """Yield the options, below `head`, that are not available with `what`."""
        why = f"not available with {what}"
        if self.viscosity.type not in ("none", "monaghan"):
            yield f"{head}viscosity.type", f"{why}; give {viscosity}"
        if self.density_dissipation.type != "none":
            yield f"{head}density_dissipation.type", f"{why}; give 'none'"
        if self.density_form != "volume":
            yield f"{head}density_form", f"{why}; give 'volume'"
