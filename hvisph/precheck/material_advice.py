"""Advice on materials: strength, damage, cracks, melting; conditions, each with its sentence and page."""

import math
import re
from collections.abc import Iterator
from functools import cache
from typing import Any

from hvisph.case.bodies import Body
from hvisph.case.formulations.riemann import bears_any_tension
from hvisph.casefile.material_library import library_of, load_material, material_names
from hvisph.core.catalogues import KINEMATICS
from hvisph.materials.damage.fracture_energy import largest_widths
from hvisph.materials.damage.johnson_cook import TRIAXIALITY_LIMIT
from hvisph.precheck.estimate import estimated_steps
from hvisph.precheck.impact_pair import plane_shock
from hvisph.precheck.regime import BALLISTIC, Condition, Facts, Found, Values
from hvisph.setup.formulations import formulation_of
from hvisph.setup.material_point import flow_at

from .regime import SHOCK, material_of_body

# Impact pressure up to which strength matters [Pa], and materials of the library that are liquids.
STRENGTH_MATTERS = 20e9
LIQUIDS = ("water",)
LATTICE_NOISE = 1e-6  # pressure of the disorder of a lattice at rest, over the bulk modulus
LEAST_POISSON, USUAL_POISSON = 0.1, 0.25  # of isotropic solids; and of most rock
# Softening displacements over the width of the band, between which a crack takes its energy: bars with a weak row took
# up to 2.7 times as much below the first; above the second a lattice tears before the crack has opened.
SHARPEST, WIDEST_CRACK = 0.1, 1.0
AT_ONSET = 0.1  # plastic strain at which metals begin to crack, for estimates of their strength then
WEAK, MANY_STEPS = 1e6, 20_000  # cohesion [Pa] and steps, below and above which a late stage is worth it
SOLID = ("mie_gruneisen", "us_up_table", "murnaghan", "polynomial")  # equations of state without liquid and vapour
VAPOUR = "-tillotson"  # suffix of the library's variants with liquid and vapour


def _spalling(facts: Facts) -> Found:
    """Shocked plates whose damage depends on plastic strain alone; elsewhere plates are bent and punched first."""
    shocked = facts.overload >= SHOCK and facts.regime.velocity >= BALLISTIC
    if facts.overload < 1.0 or (facts.dim > 1 and not shocked):
        return False
    names = [name for name, body in reversed(list(facts.bodies.items())[1:]) if _strain_alone(body)]
    return [{"name": name} | _spalling_like(facts.bodies[name]) for name in names[:1]]


def _spalling_like(body: Body) -> dict[str, object]:
    """Return the material of nearest density in the library with a spall strength [Pa]."""
    strengths: dict[float, dict[str, object]] = {}
    for material in map(load_material, material_names()):
        strength = getattr(material.damage, "spall_strength", None)
        if strength and material.strength.type != "none" and material.porosity is None:
            strengths[abs(math.log(material.density / body.material.density))] = {"of": material.name, "like": strength}
    return strengths[min(strengths)]


def _strain_alone(body: Body) -> bool:
    damage: Any = body.material.damage
    return damage.type == "johnson_cook" and damage.spall_strength is None and damage.pressure_cutoff is None


def _brittle(facts: Facts) -> Iterator[Values]:
    """Fits of the strain to failure that fall to zero in tension."""
    for name, body in facts.bodies.items() if facts.overload >= 1.0 else ():
        damage: Any = body.material.damage
        if damage.type != "johnson_cook" or damage.high_triaxiality == "void_growth":
            continue
        if damage.d1 < 0.0 and damage.d2 > -damage.d1 and damage.d3 < 0.0:
            end = math.log(-damage.d1 / damage.d2) / damage.d3
            if end < TRIAXIALITY_LIMIT:
                yield {"name": name, "end": end}


def _liquid(facts: Facts) -> Iterator[Values]:
    """Solids of the library without a strength, where an impact is weak enough for strength to matter."""
    if facts.regime.velocity <= 0.0 or facts.regime.pressure > STRENGTH_MATTERS or facts.case.units != "si":
        return
    library = library_of()
    for name, body in facts.bodies.items():
        model = body.material
        if model.strength.type == "none" and model.name in library.files and not model.name.startswith(LIQUIDS):
            family = re.split(r"[-0-9]", model.name)[0]
            kin = [k for k in library.names() if k.startswith(family) and library.load(k).strength.type != "none"]
            yield {
                "name": name,
                "material": model.name,
                "remedy": f"; '{kin[0]}' has one" if kin else "",
                "setting": f"bodies.{name}.material={kin[0]}" if kin else "",
            }


def _held_by_hoops(facts: Facts) -> Iterator[Values]:
    """Bodies about the axis whose tension nothing limits."""
    for name, body in facts.bodies.items() if KINEMATICS[facts.case.kinematics].axisymmetric else ():
        if bears_any_tension(body):
            yield {"name": name} | _spalling_like(body)


def _moduli_apart(facts: Facts) -> Iterator[Values]:
    """Isotropic solids whose shear modulus is too high for their bulk modulus."""
    for name, body in facts.bodies.items():
        material = material_of_body(body)
        if getattr(body.material.strength, "shear_modulus", None) is None or material.has_axes:
            continue
        bulk, shear = material.density * material.bulk_sound_speed**2, material.shear_modulus
        poisson = (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear))
        if poisson < LEAST_POISSON:
            usual = 1.5 * bulk * (1.0 - 2.0 * USUAL_POISSON) / (1.0 + USUAL_POISSON)
            limits = {"least": LEAST_POISSON, "usual": USUAL_POISSON}
            yield {"name": name, "poisson": poisson, "shear": usual, **limits}


def _weak_cohesion(facts: Facts) -> Iterator[Values]:
    """Bodies of rock whose cohesion is below the noise of the pressure of a lattice."""
    for name, body in facts.bodies.items():
        strength = body.material.strength
        if strength.type == "rock":
            material = material_of_body(body)
            bulk = [
                material.density * material.bulk_sound_speed**2,
                *(stage.bulk_modulus for stage in facts.case.late if stage.bulk_modulus),
            ]
            noise = LATTICE_NOISE * min(bulk)
            if 0.0 < strength.cohesion < noise:
                yield {"name": name, "cohesion": strength.cohesion, "least": noise, "share": LATTICE_NOISE}


def _soft_stage(facts: Facts) -> Iterator[Values]:
    """Late stages that are too soft for the strength of a body at rest: strains at yield are above a hundredth."""
    for number, stage in enumerate(facts.case.late):
        for name, body in facts.bodies.items():
            material = material_of_body(body)
            if not stage.bulk_modulus or any(body.velocity) or material.strength.name in ("none", "elastic"):
                continue
            bound = min(100.0 * flow_at(material, None, 0.0, 1.0), material.bulk_modulus)
            if stage.bulk_modulus < bound:
                yield {"number": number, "name": name, "modulus": stage.bulk_modulus, "least": bound}
                return


def _slow_crater(facts: Facts) -> Iterator[Values]:
    """Craters in weak matter, which open long after the shock has left, without a late stage."""
    case = facts.case
    if facts.regime.velocity <= 0.0 or case.late or case.edges or case.kinematics == "plane_stress":
        return
    name = facts.impact_pair.second if facts.impact_pair else ""
    if facts.scheme not in ("riemann", "eulerian") or name not in facts.bodies:
        return
    strength, steps = facts.bodies[name].material.strength, estimated_steps(case)
    weak = strength.type == "none" or (strength.type == "rock" and strength.cohesion < WEAK)
    if weak and steps > MANY_STEPS:
        yield {"steps": steps}


def _cracks(facts: Facts) -> Iterator[tuple[str, float, float, float]]:
    """Return body, width of its bands, l_max and w_f [m] of bodies with a fracture energy.

    The flow stress at onset is that at a strain of `AT_ONSET`, slow and cold; the tension is the spall strength or the
    cut-off, else the mean stress of uniaxial tension. w_f is that of flow; of what never yields, that of tension.
    """
    for name, body in facts.bodies.items():
        damage: Any = body.material.damage
        material = material_of_body(body)
        if material.fracture is None:
            continue
        energy, shear = material.fracture.energy, material.shear_modulus
        flow = 0.0 if body.material.strength.type == "elastic" else flow_at(material, None, AT_ONSET, 1.0)
        if damage.type == "principal_stress":
            flow, tension = damage.tensile_strength, damage.tensile_strength
        else:
            cut = getattr(damage, "pressure", None) or getattr(damage, "pressure_cutoff", None) or 0.0
            tension = getattr(damage, "spall_strength", None) or -cut or flow / 3.0
        modulus = material.density * material.bulk_sound_speed**2 + 4.0 * shear / 3.0
        width = body.spacing(facts.case) * getattr(formulation_of(facts.case), "band_spacings", 1.0)
        yield name, width, largest_widths(energy, flow, tension, shear, modulus), 2.0 * energy / (flow or tension)


def _too_wide(facts: Facts) -> Iterator[Values]:
    """Bands that would snap back, or take more than the energy of their crack."""
    for name, width, stable, opening in _cracks(facts):
        widest = min(stable, opening / SHARPEST)
        if width <= widest:
            continue
        spacing = facts.bodies[name].resolution
        finer = widest * (spacing or facts.case.resolution) / width
        left = 100.0 * math.sqrt(stable / width)
        effect = f"its strength falls to {left:.2g} %" if width > stable else "cracks may take three times their energy"
        yield {
            "name": name,
            "width": 1e3 * width,
            "stable": 1e3 * stable,
            "opening": 1e3 * opening,
            "effect": effect,
            "of": f"bodies.{name}." if spacing else "",
            "finer": math.floor(1e6 * finer) if finer > 1e-6 else 1e6 * finer,
        }


def _too_narrow(facts: Facts) -> Iterator[Values]:
    """Bands narrower than the displacement over which they soften."""
    for name, width, _, opening in _cracks(facts):
        if width < WIDEST_CRACK * opening:
            spacing = facts.bodies[name].resolution
            yield {
                "name": name,
                "width": 1e3 * width,
                "opening": 1e3 * opening,
                "of": f"bodies.{name}." if spacing else "",
                "coarser": math.ceil(1e6 * opening * (spacing or facts.case.resolution) / width),
            }


def _molten(facts: Facts) -> Iterator[Values]:
    """Bodies whose first shock leaves them molten, with an equation of state that has no liquid and no vapour."""
    pair, shock = facts.impact_pair, plane_shock(facts.case)[0]
    if pair is None or shock is None:
        return
    names = library_of().files
    for name, state in ((pair.first, shock.projectile), (pair.second, shock.target)):
        body = facts.bodies[name]
        material, model = material_of_body(body), body.material
        melts = material.melting_point
        if model.eos.type not in SOLID or material.porosity is not None or material.total_energy or melts == math.inf:
            continue
        hot = material.released_temperature(state.density, state.energy)
        if hot > melts:
            vapour = f"{model.name}{VAPOUR}"
            exists = vapour in names
            yield {
                "name": name,
                "eos": model.eos.type,
                "shock": 1e-9 * state.pressure,
                "hot": hot,
                "melts": melts,
                "remedy": f"take {vapour}" if exists else "`tillotson` and `table` have both",
                "setting": f"bodies.{name}.material={vapour}" if exists else "",
            }


def _vaporised(facts: Facts, followed: bool) -> Iterator[Values]:
    """Yield the bodies that receive more energy than vaporisation takes; debris and an equal mass take v^2/8 each.

    Materials with a vapour phase (`followed`) need a smoothing length that follows density. Those without one are
    composites and porous materials; `_molten` covers the others. Their energy of vaporisation is that of the library's
    vapour of nearest density.
    """
    heat = facts.regime.velocity**2 / 8.0
    if followed and (facts.scheme not in ("riemann", "eulerian") or facts.model.smoothing_length.type != "fixed"):
        return
    for name, body in facts.bodies.items() if facts.case.units == "si" and facts.impact_pair else ():
        material, eos = body.material, body.material.eos
        substitute = material.name
        if eos.type == "tillotson" and followed:
            limit = eos.vaporization_energy
        elif eos.type in SOLID and not followed and (material.porosity or material_of_body(body).has_axes):
            substitute = min(_vapours(), key=lambda n: abs(math.log(_vapours()[n][0] / material.density)))
            limit = _vapours()[substitute][1]
        else:
            continue
        if heat > limit:
            yield {
                "name": name,
                "eos": eos.type,
                "heat": 1e-6 * heat,
                "limit": 1e-6 * limit,
                "like": substitute,
                "wanted": "{type: variable, min_over_initial: 1, max_over_initial: 2.5}",
            }


@cache
def _vapours() -> dict[str, tuple[float, float]]:
    """Return density [kg/m^3] and energy of complete vaporisation [J/kg] of the library's variants with a vapour."""
    variants = [load_material(name) for name in library_of().files if name.endswith(VAPOUR)]
    return {m.name: (m.density, m.eos.vaporization_energy) for m in variants if m.eos.type == "tillotson"}


_IN_ORDER = (_brittle, _spalling, _liquid, _held_by_hoops, _moduli_apart)
_LATER = (_too_wide, _too_narrow, _weak_cohesion, _soft_stage, _slow_crater, _molten)
MATERIAL_CONDITIONS: dict[str, Condition] = {condition.__name__[1:]: condition for condition in (*_IN_ORDER, *_LATER)}
MATERIAL_CONDITIONS |= {
    "no_vapour": lambda facts: _vaporised(facts, followed=False),
    "vapour_beyond_reach": lambda facts: list(_vaporised(facts, followed=True))[:1],
}
