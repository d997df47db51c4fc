"""Formulations of a case as schemes with their parameters."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hvisph.case.case import Case
from hvisph.case.formulations import options
from hvisph.core.catalogues import KINEMATICS
from hvisph.core.errors import HvisphError
from hvisph.core.text import Plain
from hvisph.exact.hugoniot import impedance_match
from hvisph.materials.material_table import Material
from hvisph.schemes.protocol import AnyFormulation, Smoothing
from hvisph.schemes.riemann.scheme import Riemann
from hvisph.schemes.standard import options as standard
from hvisph.schemes.standard.scheme import Eulerian
from hvisph.schemes.total_lagrangian.scheme import TotalLagrangian
from hvisph.sph.contact.penalty_contact import Pressing
from hvisph.sph.contact.repulsion import Bonded, Contact
from hvisph.sph.kernels import KERNELS
from hvisph.sph.terms.limiters import LIMITERS


def formulation_of(case: Case) -> AnyFormulation:
    """Return the scheme of a case's formulation."""
    model: Any = case.formulation
    length = model.smoothing_length
    shared: Plain = {
        "kernel": KERNELS[model.kernel],
        "h_over_dx": model.h_over_dx,
        "smoothing": Smoothing(True, length.min_over_initial, length.max_over_initial)
        if length.type == "variable"
        else Smoothing(),
    }
    kinematics = KINEMATICS[case.kinematics]
    axisymmetric: Plain = {"axisymmetric": kinematics.axisymmetric}
    turns = kinematics.dim > 1 and not kinematics.axisymmetric
    if model.type in ("total_lagrangian", "adaptive") or model.contact_algorithm:
        return _composite(model, case)
    match model.type:
        case "eulerian":
            return Eulerian(
                **shared,
                viscosity=VISCOSITIES[model.viscosity.type](model.viscosity),
                artificial_stress=_artificial_stress(model.artificial_stress),
                dissipation=standard.DensityDissipation(getattr(model.density_dissipation, "alpha", 0.0)),
                correction=_correction(model.correction),
                product=model.momentum_form == "product",
                mass_form=model.density_form == "mass",
                shears=model.viscosity_in_shear == "reduced",
                single=model.precision == "single",
                angular_momentum=turns and model.conserve_angular_momentum,
                **axisymmetric,
                **_frictional(model, case),
            )
        case "riemann":
            return Riemann(
                **shared,
                reconstruction=LIMITERS[model.reconstruction],
                corrected_variant=model.variant != "original",
                adjoint=model.variant == "elastic",
                single=model.precision == "single",
                tension_stabilized=model.tension_stabilization,
                angular_momentum=turns and model.conserve_angular_momentum,
                self_contact=model.contact.type == "frictional" and model.contact.self_contact == "all",
                **axisymmetric,
                **_frictional(model, case),
            )
        case "projection":
            from hvisph.schemes.projection.stepper import Projection

            return Projection(
                **shared,
                original_gradient=model.pressure_gradient == "original",
                min_support=model.min_support,
                body_force=model.body_force,
                pressure_average=model.pressure_average,
            )
    raise ValueError(model.type)


def _frictional(model: Any, case: Case) -> Plain:
    """Return the options of frictional contact between bodies, or within a single one."""
    contact = model.contact
    if contact.type != "frictional" or (len(case.bodies) < 2 and contact.self_contact in (None, "none")):
        return {}
    return {"has_contact": True, "friction": contact.friction, "fragment_contact": contact.self_contact != "none"}


def _correction(model: options.Correction) -> standard.KernelCorrection:
    if model.type == "none":
        return standard.PLAIN_GRADIENT
    assert model.factor is not None
    return standard.KernelCorrection(
        model.type != "gradient", model.type != "shepard", model.factor, model.limiter == "components"
    )


VISCOSITIES: dict[str, Callable[[Any], standard.MonaghanViscosity]] = {
    "none": lambda _: standard.NO_VISCOSITY,
    "monaghan": lambda model: standard.MonaghanViscosity(model.alpha, model.beta),
    "balsara": lambda model: standard.BalsaraViscosity(model.alpha, model.beta),
    "morris_monaghan": lambda model: standard.MorrisMonaghanViscosity(
        share_minimum=model.alpha_min, share_decay=model.decay
    ),
}


def _artificial_stress(model: options.ArtificialStress) -> standard.GrayArtificialStress:
    return standard.NO_ARTIFICIAL_STRESS if model.type == "none" else standard.GrayArtificialStress(model.eps, model.n)


def contact_of(model: Any) -> Pressing | Contact:
    """Return the repulsion or penalty of a case's contact."""
    if model.type == "frictional":
        return Pressing(model.stiffness or 1.0, friction=model.friction, self_contact=model.self_contact != "none")
    return Contact(model.stiffness, model.exponent, model.absolute_stiffness)


def _composite(model: Any, case: Case) -> TotalLagrangian:
    """Return the scheme of Total Lagrangian, adaptive, or Eulerian bodies in contact."""
    from hvisph.schemes.adaptive.state import Conversion
    from hvisph.schemes.total_lagrangian.scheme import TotalLagrangian

    shared: Plain = {
        "kernel": KERNELS[model.kernel],
        "h_over_dx": model.h_over_dx,
        "viscosity": VISCOSITIES[model.viscosity.type](model.viscosity),
        "artificial_stress": _artificial_stress(model.artificial_stress),
        "contact": contact_of(model.contact) if model.contact_algorithm else Bonded(),
        "axisymmetric": KINEMATICS[case.kinematics].axisymmetric,
        "courant": case.time.cfl,
    }
    if model.type == "eulerian":
        return TotalLagrangian(
            **shared, product=model.momentum_form == "product", shears=model.viscosity_in_shear == "reduced"
        )
    limits = getattr(model, "conversion", None)
    kinds = [body.formulation or model.type for body in case.bodies.values()]
    return TotalLagrangian(
        **shared,
        stress_at_interface=model.artificial_stress_at_interface == "both",
        correction=standard.KernelCorrection(model.correction == "mixed", model.correction != "none"),
        spatial_correction=_correction(model.spatial_correction),
        printed_viscosity=model.viscosity_gradient == "reference",
        hourglass=model.hourglass,
        secant=model.hourglass_stiffness == "secant",
        shears=model.viscosity_in_shear == "reduced",
        failed_leave=model.failed_particles != "retained",
        keeps_volume=model.failed_particles != "removed_renormalized",
        renew_strain=model.reference_update_strain,
        conversion=Conversion()
        if limits is None
        else Conversion(
            strain=limits.strain,
            damage=limits.damage,
            neighbours=limits.neighbours,
            bodies=tuple(number for number, kernel in enumerate(kinds) if kernel == "adaptive"),
            fallback=limits.fallback,
            fallback_strain=limits.fallback_strain,
            fallback_damage=limits.fallback_damage,
        ),
    )


def impact_pressure(projectile: Material, target: Material, speed: float) -> float:
    """Return the pressure [Pa] of a flat impact at `speed` [m/s]; unknown shock relations are c0 + 1.5 u."""
    if speed <= 0.0:
        return 0.0
    try:
        return float(impedance_match(projectile, target, speed).pressure)
    except (HvisphError, ArithmeticError, ValueError):
        u = 0.5 * speed
        return max(m.density_at_rest * (m.bulk_sound_speed + 1.5 * u) * u for m in (projectile, target))


def expected_pressure(materials: Sequence[Material], velocities: Sequence[np.ndarray]) -> float:
    """Return the largest pressure [Pa] of impacts between bodies, from materials and mean velocities [m/s]."""
    speeds: dict[tuple[int, int], float] = {}
    distinct = list(dict.fromkeys(materials))
    kinds = [distinct.index(material) for material in materials]
    for a, b in itertools.combinations(range(len(materials)), 2):
        pair = (min(kinds[a], kinds[b]), max(kinds[a], kinds[b]))
        speeds[pair] = max(speeds.get(pair, 0.0), float(np.linalg.norm(velocities[a] - velocities[b])))
    return max((impact_pressure(distinct[a], distinct[b], speed) for (a, b), speed in speeds.items()), default=0.0)


def stiff_enough(formulation: Any, stated: Any, materials: Sequence[Material], velocities: Sequence[np.ndarray]) -> Any:
    """Return a formulation with a contact stiffness for the impact pressure, unless the case has `stated` one."""
    contact: Any = getattr(formulation, "contact", None)
    if not getattr(contact, "stores_energy", False) or stated.stiffness is not None:
        return formulation
    return replace(formulation, contact=replace(contact, expected=expected_pressure(materials, velocities)))
