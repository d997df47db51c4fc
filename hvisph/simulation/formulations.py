"""From the case's formulation to the published scheme with its numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hvisph.formulations.conversion import Conversion
from hvisph.formulations.corrected import Corrected
from hvisph.formulations.eulerian import Eulerian
from hvisph.formulations.formulation import Smoothing
from hvisph.formulations.projection import Projection
from hvisph.formulations.protocol import AnyFormulation
from hvisph.formulations.riemann import Riemann
from hvisph.formulations.total_lagrangian import TotalLagrangian
from hvisph.sph.kernels import KERNELS
from hvisph.sph.laws.contact import Contact

if TYPE_CHECKING:
    from hvisph.case.case import Case


def formulation_of(case: Case) -> AnyFormulation:
    """Return the scheme that a case's formulation describes."""
    model: Any = case.formulation
    length = model.smoothing_length
    shared: dict[str, Any] = {
        "kernel": KERNELS[model.kernel],
        "h_over_dx": model.h_over_dx,
        "smoothing": Smoothing(True, length.min_over_initial, length.max_over_initial)
        if length.type == "variable"
        else Smoothing(),
    }
    if model.type in ("total_lagrangian", "adaptive") or model.parted:
        return _composite(model, case)
    match model.type:
        case "eulerian":
            shared |= _viscosity(model.viscosity) | {
                "stress_eps": model.artificial_stress.eps if model.artificial_stress.type == "gray" else 0.0,
            }
            shared["stress_exponent"] = getattr(model.artificial_stress, "n", 4)
            if model.density_dissipation.type == "zisis":
                shared["alpha_rho"] = model.density_dissipation.alpha
            shared["product"] = model.momentum_form == "product"
            shared["mass_form"] = model.density_form == "mass"
            if model.correction.type == "none":
                return Eulerian(**shared)
            return Corrected(**shared, correction=model.correction.type, factor=model.correction.factor)
        case "riemann":
            return Riemann(
                **shared,
                reconstruction=model.reconstruction,
                consistent=model.form == "consistent",
                held=model.tension == "held",
                parted=model.contact.type == "separating" and len(case.bodies) > 1,
                friction=getattr(model.contact, "friction", 0.0),
            )
        case "projection":
            return Projection(
                **shared,
                printed=model.pressure_gradient == "printed",
                guard=model.guard,
                body_force=model.body_force,
                pressure_average=model.pressure_average,
            )
    raise ValueError(model.type)


def _spatial_correction(model: Any) -> dict[str, Any]:
    return {} if model.type == "none" else {"spatial_correction": model.type, "factor": model.factor}


def _viscosity(model: Any) -> dict[str, Any]:
    """Return the coefficients of an artificial viscosity, and the shares of it that particles take."""
    match model.type:
        case "none":
            return {"alpha": 0.0, "beta": 0.0}
        case "morris_monaghan":
            return {"alpha": 1.0, "beta": 2.0, "switch": model.type, "share_minimum": model.alpha_min,
                    "share_decay": model.decay}  # fmt: skip
        case "balsara":
            return {"alpha": model.alpha, "beta": model.beta, "switch": model.type}
    return {"alpha": model.alpha, "beta": model.beta}


def _composite(model: Any, case: Case) -> TotalLagrangian:
    """Return the scheme of bodies that meet: Total Lagrangian, adaptive, or Eulerian ones in contact."""
    shared: dict[str, Any] = _viscosity(model.viscosity) | {
        "kernel": KERNELS[model.kernel],
        "h_over_dx": model.h_over_dx,
        "stress_eps": model.artificial_stress.eps if model.artificial_stress.type == "gray" else 0.0,
        "stress_exponent": getattr(model.artificial_stress, "n", 4),
        "contact": Contact(model.contact.stiffness, model.contact.exponent, model.contact.absolute_stiffness)
        if model.parted
        else None,
    }
    if model.type == "eulerian":
        return TotalLagrangian(**shared, product=model.momentum_form == "product")
    limits = getattr(model, "conversion", None)
    kinds = [body.formulation or model.type for body in case.bodies.values()]
    return TotalLagrangian(
        **shared,
        stress_at_interface=model.artificial_stress_at_interface == "both",
        correction=model.correction,
        **_spatial_correction(model.spatial_correction),
        printed_viscosity=model.viscosity_gradient == "reference",
        hourglass=model.hourglass,
        failed_leave=model.failed_particles == "leave",
        conversion=Conversion()
        if limits is None
        else Conversion(
            strain=limits.strain,
            damage=limits.damage,
            neighbours=limits.neighbours,
            bodies=tuple(number for number, kind in enumerate(kinds) if kind == "adaptive"),
            guard=limits.guard,
            guard_strain=limits.guard_strain,
        ),
    )
