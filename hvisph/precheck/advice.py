"""Advice on a case before its run."""

import math
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

import numpy as np

from hvisph.case.bodies import Body
from hvisph.case.case import Case, has_thin_body
from hvisph.case.formulations.options import PenaltyContact
from hvisph.case.formulations.riemann import following, is_foam
from hvisph.case.output import COURANT, COURANT_OF
from hvisph.core.catalogues import KINEMATICS
from hvisph.core.errors import locate
from hvisph.core.text import recommend
from hvisph.precheck.impact_pair import body_boxes, hugoniot_warnings, impact_pair
from hvisph.precheck.material_advice import MATERIAL_CONDITIONS
from hvisph.precheck.regime import (
    BALLISTIC,
    ELASTIC,
    POINTED,
    SHOCK,
    Condition,
    Facts,
    Found,
    Rule,
    Values,
    material_of_body,
)
from hvisph.setup.formulations import contact_of
from hvisph.setup.materials import material_of
from hvisph.setup.shapes import shape_of
from hvisph.sph.kernels import KERNELS

# Particles across a projectile from which on it shears out plugs in time, up to which contact SPH slows it, and that
# resolve the band.
BAND, COARSE, RESOLVED_BAND = 60.0, 24.0, 80.0
# Length over width of a rod, particles across from which on it erodes as it should, and speeds up to which it matters
# [m/s]: measured with 25 mm of `tungsten-alloy-wnife`, 5 mm across, in `steel-4340`, axisymmetric.
SLENDER, EVEN, ERODING = 3.0, 20.0, 2500.0
WIDE = 1.5  # smoothing length over spacing from which on the foot of a bar in 3D holds together
FEWEST_IN_WALL = 3.0  # particles across a wall of a mesh
SHEET = 0.2  # wall over least extent of a mesh, below which a body is of sheet; a solid ball has a third
# Speed over sound speed below which, over many crossings, bodies vibrate rather than carry shocks.
SLOW, CROSSINGS = 0.01, 20.0
# The same for bodies that never yield: balls of 11 particles across rebound with 0.2 of their speed in contact SPH at
# 5 m/s and with half of it at 50, by Total Lagrangian kernels with 0.987.
BOUNCING = 0.1
STRONG = 0.3  # particle velocity over sound speed beyond which density that is not of the spacing is off by 2 %
LONGEST_STEP = COURANT_OF["riemann"]  # Courant number up to which contact SPH was verified


def _receding(facts: Facts) -> Found:
    """Bodies that move but do not approach each other."""
    if not facts.is_motionless or not facts.moving:
        return False
    name, row = facts.moving[0], "; in a row the first body stands at x < 0 and meets the next flying towards +x"
    return {"name": name, "row": row if facts.bodies[name].position is None else ""}


def _below_the_surface(facts: Facts) -> Found:
    """Bodies that all lie within the sphere of the gravity, as a target does whose centre was left out."""
    field, dim = facts.case.gravity, facts.case.dim
    if field is None or field.type != "sphere":
        return False
    corners = np.abs(np.array(body_boxes(facts.case)[0])[:, :, :dim] - np.array(field.centre or [0.0] * dim))
    reach = float(np.sqrt((corners.max(axis=1) ** 2).sum(axis=1)).max())
    return reach < field.radius and {"reach": reach, "radius": field.radius}


def _slow(facts: Facts) -> Found:
    """Bodies that vibrate, bend or spin: kernels in the current configuration damp that."""
    case, impact = facts.case, facts.regime
    if facts.is_motionless or facts.scheme not in ("riemann", "eulerian") or impact.strength is None:
        return False
    if facts.scheme == "riemann" and facts.model.variant == "elastic":
        return False
    fastest = max(math.dist(body.velocity, (0.0,) * case.dim) for body in facts.bodies.values())
    slowest = min(material_of_body(body).bulk_sound_speed for body in facts.bodies.values())
    # some shapes know their size only where they stand
    size = max((size for body in facts.bodies.values() for size in body.shape.extent()), default=math.inf)
    slow = BOUNCING if math.isinf(impact.strength) else SLOW
    if not (_stress(facts) < ELASTIC * impact.strength and fastest < slow * slowest):
        return False
    loss = "" if facts.model.conserve_angular_momentum else " and loses spin"
    crossings = case.duration * slowest / size
    takes_elastic = facts.scheme == "riemann" and facts.model.variant == "corrected" and not facts.gases
    takes_elastic = takes_elastic and not KINEMATICS[case.kinematics].axisymmetric
    remedy = {"instead": "total_lagrangian", "setting": "formulation={type: total_lagrangian}"}
    if takes_elastic:
        remedy = {"instead": "variant: elastic, or total_lagrangian", "setting": "formulation.variant=elastic"}
    return crossings > CROSSINGS and {"scheme": facts.scheme, "lost": loss, "crossings": crossings} | remedy


def _shallow_contact(facts: Facts) -> Found:
    """Balls whose elastic contact is less than a spacing deep: the outermost layer of a square lattice is flat.

    Hertz: depth d = (15 m v^2/(16 E* R^(1/2)))^(2/5), E* of both sides. The layer is a punch of radius (R dx)^(1/2) and
    stiffness 2 E* (R dx)^(1/2), whose largest force is 1.1 (dx/d)^(1/4) of Hertz's.
    """
    pair, impact = facts.impact_pair, facts.regime
    if pair is None or impact.strength is None or not 0.0 < impact.pressure < ELASTIC * impact.strength:
        return False
    for name, partner in ((pair.first, pair.second), (pair.second, pair.first)):
        ball, sides = facts.bodies[name], [facts.bodies[n] for n in (name, partner)]
        if ball.shape.type != "sphere" or ball.arrangement == "relaxed" or facts.case.drawing_dimensions != 3:
            continue
        compliance = sum(_compliance(body) for body in sides if body.rigid is None)
        radius, dx = 0.5 * ball.shape.diameter, ball.spacing(facts.case)
        mass = 4.0 / 3.0 * math.pi * radius**3 * material_of_body(ball).density
        if not 0.0 < compliance < math.inf:
            continue
        depth = (15.0 / 16.0 * mass * impact.velocity**2 * compliance / math.sqrt(radius)) ** 0.4
        if depth < dx:
            return {"name": name, "depth": depth / dx, "excess": 1.1 * (dx / depth) ** 0.25, "fits": depth}
    return False


def _compliance(body: Body) -> float:
    """Return (1 - nu^2)/E of a body [1/Pa]; inf of liquids."""
    material = material_of_body(body)
    bulk = material.density * material.bulk_sound_speed**2
    shear = 0.75 * (material.density * material.longitudinal_sound_speed**2 - bulk)
    return (3.0 * bulk + 4.0 * shear) / (4.0 * shear * (3.0 * bulk + shear)) if shear > 1e-9 * bulk else math.inf


def _yielding(facts: Facts) -> Found:
    """Impacts above the elastic limit by the variant for elastic bodies."""
    if facts.scheme != "riemann" or facts.model.variant != "elastic":
        return False
    pressure, strength = _stress(facts), facts.regime.strength or 0.0
    return pressure >= ELASTIC * strength and {"pressure": 1e-9 * pressure, "strength": 1e-9 * strength}


def _stress(facts: Facts) -> float:
    """Return the impact pressure [Pa]; a clamp stops its body as an impact does."""
    stresses = [facts.regime.pressure]
    for body in facts.bodies.values() if facts.case.clamped else ():
        material = material_of_body(body)
        stresses.append(math.hypot(*body.velocity) * material.density_at_rest * material.bulk_sound_speed)
    return max(stresses)


def _fixed_smoothing_length(facts: Facts) -> Found:
    """Gases and foams whose smoothing length does not follow their density."""
    if facts.scheme not in ("riemann", "eulerian") or facts.model.smoothing_length.type != "fixed":
        return False
    corrected = facts.scheme == "riemann" and facts.model.variant == "corrected"
    names = facts.gases or ", ".join(name for name, body in facts.bodies.items() if corrected and is_foam(body))
    keys = ", ".join(
        f"{key}: {value}" for key, value in following(facts.bodies.values(), facts.case.kinematics).items()
    )
    return {"bodies": names, "wanted": f"{{{keys}}}"} if names else False


def _initial_overlap(facts: Facts) -> Found:
    """Bodies placed nearer than a spacing, between which repulsion starts with stored energy."""
    contact = getattr(facts.model, "contact", None)
    if contact is None or contact.type != "penalty" or facts.scheme != "eulerian":
        return False
    close_bodies = [
        name
        for name, body in list(facts.bodies.items())[1:]
        if body.position is None and body.gap < 0.5 * facts.case.resolution
    ]
    return [{"name": name, "gap": facts.case.resolution} for name in close_bodies[:1]]


def _eroding(facts: Facts) -> Found:
    """Rods that erode in thick metal, with few particles across; slow pointed cores do not erode."""
    pair, speed = facts.impact_pair, facts.regime.velocity
    if pair is None or facts.scheme != "riemann" or facts.dim == 1 or speed >= ERODING:
        return False
    if facts.nose in POINTED and speed < BALLISTIC:
        return False
    rod, target = (facts.bodies[name].shape.extent() for name in (pair.first, pair.second))
    if facts.overload < SHOCK or not rod or not target or not min(rod[1:]) > 0.0:
        return False
    width = max(rod[1:])
    eroding = rod[0] > SLENDER * width and target[0] > width and width < EVEN * facts.case.resolution
    return eroding and {"finer": width / EVEN}


def _thin_walls(facts: Facts) -> Iterator[Values]:
    """Meshes of sheet that the spacing does not resolve; of shapes with sizes these are refused."""
    for name, body in facts.bodies.items():
        if body.shape.type != "mesh":
            continue
        with locate(f"bodies.{name}"):
            shape, dx = shape_of(body.shape, facts.case.drawing_dimensions), body.spacing(facts.case)
        wall = getattr(shape, "thickness", math.inf)
        if wall < min(FEWEST_IN_WALL * dx, SHEET * min(shape.extent())):
            yield {"name": name, "wall": 1e3 * wall, "count": wall / dx, "finer": 1e3 * wall / FEWEST_IN_WALL}


def _courant_number(facts: Facts) -> Found:
    """Return a Courant number above the one that contact SPH was verified with."""
    time, largest = facts.case.time, COURANT if has_thin_body(facts.case) else LONGEST_STEP
    return facts.scheme == "riemann" and time.step is None and time.cfl > largest and {"cfl": time.cfl, "most": largest}


FORMULATION_CONDITIONS: dict[str, Condition] = {
    "motionless": lambda f: f.is_motionless and not f.moving,
    "receding": _receding,
    "below_the_surface": _below_the_surface,
    "slow": _slow,
    "shallow_contact": _shallow_contact,
    "yielding": _yielding,
    "courant_number": _courant_number,
    "original_in_shocks": lambda f: (
        f.scheme == "riemann" and f.model.variant == "original" and f.strength_of_shock > STRONG / 2
    ),
    "volume_form_in_shocks": lambda f: (
        f.scheme == "eulerian" and f.model.density_form == "volume" and f.strength_of_shock > 1.5 * STRONG
    ),
    "reference_kernels_in_shocks": lambda f: f.scheme == "total_lagrangian" and f.overload > SHOCK,
    "lattice_two_rings": lambda f: (
        {"name": name}
        for name, body in f.bodies.items()
        if f.overload >= SHOCK and body.arrangement == "lattice_two_rings"
    ),
    "sphere_in_standard_sph": lambda f: (
        f.scheme == "eulerian"
        and f.dim == 3
        and f.overload >= SHOCK
        and any(body.shape.type == "sphere" for body in f.bodies.values())
    ),
    "gas_with_reference_kernels": lambda f: (
        f.gases != "" and f.scheme in ("total_lagrangian", "adaptive") and {"gases": f.gases}
    ),
    "fixed_smoothing_length": _fixed_smoothing_length,
    "volume_form_of_gas": lambda f: (
        f.gases != ""
        and f.scheme == "eulerian"
        and f.model.correction.type == "none"
        and f.model.density_form == "volume"
        and all(body.material.eos.type == "ideal_gas" for body in f.bodies.values())
    ),
    "initial_overlap": _initial_overlap,
    # a limit came out 8 % too high with 60 particles across and by more than 12 % with 40
    "narrow_band": lambda f: (
        (bool(f.plug_damage) and f.flat and f.across < BAND) and {"finer": f.case.resolution * f.across / RESOLVED_BAND}
    ),
    "no_softening": lambda f: [{"name": name} for name, damage in f.plug_damage.items() if not damage.softening][:1],
    # a flat steel core at 850 m/s leaves 10 mm of aluminium at 616 m/s at 8 particles across, at 648 at 12, for 680
    "coarse_plug": lambda f: bool(f.plug_damage) and f.flat and f.scheme == "riemann" and f.across < COARSE,
    "eroding": _eroding,
    "thick_foot": lambda f: (
        (
            f.dim == 3
            and f.scheme == "riemann"
            and f.model.h_over_dx < WIDE
            and f.impact_pair is None
            and f.overload > SHOCK
        )
        and {"wide": WIDE}
    ),
    "thin_walls": _thin_walls,
}
FEWEST_ACROSS = 5  # particles across a body, below which its waves and its bending are not resolved
# Ratio of the time steps by contact and by material below which a warning is given.
SHARE = 0.5


@cache
def rules() -> list[Rule]:
    """Return all rules in the order of their advice."""
    texts = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    conditions = FORMULATION_CONDITIONS | MATERIAL_CONDITIONS
    return [Rule(condition, **texts[name]) for name, condition in conditions.items()]


def advice(case: Case) -> list[str]:
    """Return advice on formulation, contact, smoothing length, spacing and material."""
    facts = Facts(case)
    texts = [rule.texts(facts) for rule in rules()]
    return [*texts[0], *texts[1], *hugoniot_warnings(case), *(text for rule in texts[2:] for text in rule)]


def sparse(counts: Mapping[str, int], resolution: float) -> list[str]:
    """Return which bodies have too few particles across, from the numbers by name at a spacing `resolution` [m]."""
    return [
        recommend(
            f"bodies.{name}: {count} particles across do not resolve its waves and its bending; {FEWEST_ACROSS} are "
            "few, 10 show what matters: give a finer resolution",
            f"resolution={0.1 * max(count, 1) * resolution:.3g}",
        )
        for name, count in counts.items()
        if count < FEWEST_ACROSS
    ]


def tears(case: Case) -> str:
    """Return the solids without a damage model that an impact puts under tension; empty for none."""
    if Facts(case).overload < 1.0:
        return ""
    names = [
        name
        for name, body in case.bodies.items()
        if body.material.strength.type not in ("none", "fabric") and body.material.damage.type == "none"
    ]
    if not names:
        return ""
    return (
        f"release waves cause tension up to the impact pressure; without a damage model ({', '.join(names)}) "
        "separation depends on the particle lattice"
    )


def contact_warnings(case: Case) -> list[str]:
    """Return warnings about the contact between the impact pair."""
    model = getattr(case.formulation, "contact", None)
    is_penalty = isinstance(model, PenaltyContact) or getattr(model, "stiffness", None) is not None
    if not is_penalty or len(case.bodies) < 2:
        return []
    contact, kernel = contact_of(model), KERNELS[case.formulation.kernel]
    pair = impact_pair(case)
    bodies = list(case.bodies.values())[:2] if pair is None else [case.bodies[pair.first], case.bodies[pair.second]]
    materials = [material_of(body.material, body.internal_energy) for body in bodies]
    dx, dim = case.resolution, case.dim
    stiffness = min(contact.of_material(m.density, m.bulk_sound_speed, dx, dim) for m in materials)
    pressure = contact.carried_over_stiffness(kernel, case.formulation.h_over_dx, dim) * stiffness
    if not contact.stores_energy:
        pressure *= dx**dim
    warnings = []
    if pair is not None:
        # acoustic: below the shock's pressure, so that a warning is never in vain
        z1, z2 = (m.density * m.bulk_sound_speed for m in materials)
        expected = pair.velocity * z1 * z2 / (z1 + z2)
        if expected > pressure:
            words = (
                f"formulation.contact: carries about {pressure:.3g} Pa, and the impact brings {expected:.3g} Pa: the "
                f"bodies may pass through each other; give it a higher stiffness"
            )
            warnings.append(recommend(words, _times(model, 1.01 * expected / pressure)))
    for material in materials:
        stiff = contact.closer(kernel, case.formulation.h_over_dx, dim, dx)
        omega2 = 2.0 * stiffness * stiff / material.density
        share = 2.0 / np.sqrt(omega2) * material.longitudinal_sound_speed / case.smoothing_length
        if share < SHARE:
            words = (
                f"formulation.contact: limits the step to about {share:.2g} of what '{material.name}' allows; give it "
                "a lower stiffness, or accept as many more steps"
            )
            warnings.append(recommend(words, _times(model, 0.99 * (share / SHARE) ** 2)))
            break
    return warnings


def _times(model: object, factor: float) -> str:
    """Return the setting of the stiffness with `factor` times its value."""
    key = "stiffness" if getattr(model, "absolute_stiffness", None) is None else "absolute_stiffness"
    return f"formulation.contact.{key}={factor * getattr(model, key):.3g}"
