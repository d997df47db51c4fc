"""Advice on a case: a table of conditions, each with its sentence and the page that has the evidence."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from hvisph.case.formulations.riemann import bears_any_tension, following, is_gas
from hvisph.case.time import COURANT_OF
from hvisph.core.catalogues import KINEMATICS
from hvisph.core.errors import CaseError
from hvisph.core.text import recommend

from .impact_pair import Meeting, meeting
from .regime import ELASTIC, SHOCK, Regime, material_of_body, regime

if TYPE_CHECKING:
    from hvisph.case.bodies import Body
    from hvisph.case.case import Case

# Impact pressure over strength above which a plate may be punched, and speeds below which it is, not burst [m/s].
PUNCHED = 2.0
BALLISTIC = 1200.0
POINTED, ROUND_NOSED = ("cone", "ogive"), ("sphere", "hollow_sphere", "disc", "annulus", "dome", "rounded_cylinder")
# Particles across a projectile from which on it shears out plugs in time, up to which contact SPH slows it, and that
# resolve the band.
BAND, COARSE, RESOLVED_BAND = 60.0, 24.0, 80.0
# Length over width of a rod, particles across from which on it erodes as it should, and speeds up to which it matters
# [m/s]: measured with 25 mm of `tungsten-alloy-wnife`, 5 mm across, in `steel-4340`, axisymmetric.
SLENDER, EVEN, ERODING = 3.0, 20.0, 2500.0
WIDE = 1.5  # smoothing length over spacing from which on the foot of a bar in 3D holds together
# Impact pressure up to which strength matters [Pa], and materials of the library that are liquids.
FELT = 20e9
LIQUIDS = ("water",)
FEWEST_IN_WALL = 3.0  # particles across a wall of a mesh
SHEET = 0.2  # wall over least extent of a mesh, below which a body is of sheet; a solid ball has a third
FEWEST_ACROSS = 5  # particles across a body, below which its waves and its bending are not resolved
# Speed over sound speed below which, over many crossings, bodies vibrate rather than carry shocks.
SLOW, CROSSINGS = 0.01, 20.0
# The same for bodies that never yield: balls of 11 particles across rebound with 0.2 of their speed in contact SPH at
# 5 m/s and with half of it at 50, by Total Lagrangian kernels with 0.987.
BOUNCING = 0.1
STRONG = 0.3  # particle velocity over sound speed beyond which density that is not of the spacing is off by 2 %
LATTICE_NOISE = 1e-6  # pressure of the disorder of a lattice at rest, over the bulk modulus
LEAST_POISSON, USUAL_POISSON = 0.1, 0.25  # of isotropic solids; and of most rock
# Softening displacements over the width of the band, between which a crack takes its energy: bars with a weak row took
# up to 2.7 times as much below the first; above the second a lattice tears before the crack has opened.
SHARPEST, WIDEST_CRACK = 0.1, 1.0
AT_ONSET = 0.1  # plastic strain at which metals begin to crack, for estimates of their strength then
SOLID = ("mie_gruneisen", "us_up_table", "murnaghan", "polynomial")  # equations of state without liquid and vapour
VAPOUR = "-tillotson"  # what names of the library's variants with liquid and vapour end with
LONGEST_STEP = COURANT_OF["riemann"]  # Courant number up to which contact SPH was verified


class Facts:
    """What the conditions of the rules depend on."""

    def __init__(self, case: Case):
        self.case, self.bodies, self.dim = case, case.bodies, case.dim
        self.model: Any = case.formulation
        self.scheme = case.formulation.type

    @cached_property
    def kind(self) -> Regime:
        """The regime of the case."""
        return regime(self.case)

    @cached_property
    def impact_pair(self) -> Meeting | None:
        """The two bodies that meet first."""
        return meeting(self.case)

    @cached_property
    def overload(self) -> float:
        """Impact pressure over strength; 0 without an impact or without strength."""
        if self.kind.velocity <= 0.0 or self.kind.strength is None:
            return 0.0
        return self.kind.pressure / self.kind.strength if self.kind.strength else math.inf

    @cached_property
    def is_motionless(self) -> bool:
        """Whether nothing will happen: no bodies close, and nothing else sets them in motion."""
        bodies = self.bodies.values()
        driven = any(body.initial_velocity or body.internal_energy or body.temperature for body in bodies)
        driven = driven or any(body.material.eos.type in ("jwl", "ideal_gas") for body in bodies)
        driven = driven or any(clamp.moves for clamp in self.case.clamped)
        if self.kind.velocity > 0.0 or driven or self.case.initial_loads or self.case.gravity or self.case.start:
            return False
        return not self.moving or (len(bodies) > 1 and all(plane.axis != "x" for plane in self.case.symmetry))

    @cached_property
    def moving(self) -> list[str]:
        """Names of the bodies with a velocity."""
        return [name for name, body in self.bodies.items() if any(body.velocity)]

    @cached_property
    def strength_of_shock(self) -> float:
        """Particle velocity over the sound speed of the struck body; 0 without an impact."""
        if self.kind.velocity <= 0.0:
            return 0.0
        struck = next(iter(self.bodies.values())) if self.impact_pair is None else self.bodies[self.impact_pair.second]
        return 0.5 * self.kind.velocity / material_of_body(struck).bulk_sound_speed

    @cached_property
    def plug_damage(self) -> dict[str, Any]:
        """Johnson-Cook damage of the bodies that may be punched at ballistic speed, by name."""
        struck = {name: body.material.damage for name, body in self.bodies.items() if not self._strikes(name)}
        failing = {name: damage for name, damage in struck.items() if damage.type == "johnson_cook"}
        slow = 0.0 < self.kind.velocity < BALLISTIC and len(self.bodies) > 1 and self.dim > 1
        return failing if slow and self.overload > PUNCHED and not (self.impact_pair and self._nose in POINTED) else {}

    @cached_property
    def _nose(self) -> str:
        return shape_type(self.bodies[self.impact_pair.first].shape) if self.impact_pair else ""

    def _strikes(self, name: str) -> bool:
        return self.impact_pair is not None and name == self.impact_pair.first

    @cached_property
    def flat(self) -> bool:
        """Whether the projectile is flat: a round nose pushes metal aside before the rest of a plate shears."""
        return self._nose not in ROUND_NOSED

    @cached_property
    def across(self) -> float:
        """Particles across the projectile."""
        shots = [body for name, body in self.bodies.items() if self._strikes(name)]
        return max((min(body.shape.extent()[1:], default=0.0) for body in shots), default=0.0) / self.case.resolution

    @cached_property
    def gases(self) -> str:
        """Names of the bodies that are gases or become gases."""
        return ", ".join(name for name, body in self.bodies.items() if is_gas(body))


def shape_type(shape: Any) -> str:
    """Return the type of a shape, or of what a hollow one is cut from."""
    return str(getattr(shape, "whole", shape).type)


Values = Mapping[str, object]
Found = bool | Values | Iterable[Values]


@dataclass(frozen=True)
class Rule:
    """A piece of advice."""

    # whether it applies; or the values of the sentence, or several of them where it applies several times
    condition: Callable[[Facts], Found]
    sentence: str  # key of the case and what to consider, with the values in braces
    page: str = ""  # page of the documentation with the evidence
    # settings that follow the recommendation, one a line, with the values in braces; empty where the user has to decide
    setting: str = ""

    def texts(self, facts: Facts) -> list[str]:
        """Return the advice that applies."""
        found = self.condition(facts)
        if isinstance(found, Mapping):
            found = [found]
        values = ([{}] if found else []) if isinstance(found, bool) else found
        page = f" (docs/{self.page}.md)" if self.page else ""
        return [recommend(self.sentence.format(**one) + page, *self._settings(facts, one)) for one in values]

    def _settings(self, facts: Facts, values: Values) -> list[str]:
        settings = self.setting.format(**values).splitlines()
        if self.setting.startswith("formulation={"):  # of one formulation for all bodies, without graded ones
            graded = "riemann" not in self.setting
            for name, body in facts.bodies.items():
                settings += [f"bodies.{name}.formulation=null"] if body.formulation else []
                settings += [f"bodies.{name}.grading=null"] if graded and body.grading else []
        return settings


def advice(case: Case) -> list[str]:
    """Return what a user should consider of formulation, contact, smoothing length, spacing and damage."""
    from .hugoniot_check import hugoniot_warnings

    facts = Facts(case)
    texts = [rule.texts(facts) for rule in RULES]
    return [*texts[0], *texts[1], *hugoniot_warnings(case), *(text for one in texts[2:] for text in one)]


def sparse(across: Mapping[str, int], resolution: float) -> list[str]:
    """Return which bodies have too few particles across, from the numbers by name at a spacing `resolution` [m]."""
    return [
        recommend(
            f"bodies.{name}: {count} particles across do not resolve its waves and its bending; {FEWEST_ACROSS} are "
            "few, 10 show what matters: give a finer resolution",
            f"resolution={0.1 * max(count, 1) * resolution:.3g}",
        )
        for name, count in across.items()
        if count < FEWEST_ACROSS
    ]


def tears(case: Case) -> str:
    """Return which solids without damage come under tension after an impact; empty where none does."""
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
        f"release waves bring tension up to the impact pressure to {', '.join(names)}, without a model of damage: "
        "where and when a lattice of particles tears is not physics"
    )


def _receding(facts: Facts) -> Found:
    """Bodies that move but do not approach each other."""
    if not facts.is_motionless or not facts.moving:
        return False
    name, row = facts.moving[0], "; in a row the first body stands at x < 0 and meets the next flying towards +x"
    return {"name": name, "row": row if facts.bodies[name].position is None else ""}


def _slow(facts: Facts) -> Found:
    """Bodies that vibrate, bend or spin: kernels in the current configuration damp that."""
    case, kind = facts.case, facts.kind
    if facts.is_motionless or facts.scheme not in ("riemann", "eulerian") or kind.strength is None:
        return False
    if facts.scheme == "riemann" and facts.model.variant == "elastic":
        return False
    fastest = max(math.dist(body.velocity, (0.0,) * case.dim) for body in facts.bodies.values())
    slowest = min(material_of_body(body).bulk_sound_speed for body in facts.bodies.values())
    # some shapes know their size only where they stand
    size = max((size for body in facts.bodies.values() for size in body.shape.extent()), default=math.inf)
    slow = BOUNCING if math.isinf(kind.strength) else SLOW
    if not (kind.pressure < ELASTIC * kind.strength and fastest < slow * slowest):
        return False
    lost = "" if facts.model.conserve_angular_momentum else " and loses spin"
    crossings = case.duration * slowest / size
    takes_elastic = facts.scheme == "riemann" and facts.model.variant == "corrected" and not facts.gases
    takes_elastic = takes_elastic and not KINEMATICS[case.kinematics].revolved
    takes = {"instead": "total_lagrangian", "setting": "formulation={type: total_lagrangian}"}
    if takes_elastic:
        takes = {"instead": "variant: elastic, or total_lagrangian", "setting": "formulation.variant=elastic"}
    return crossings > CROSSINGS and {"scheme": facts.scheme, "lost": lost, "crossings": crossings} | takes


def _yielding(facts: Facts) -> Found:
    """Impacts above the elastic limit by the variant for elastic bodies."""
    if facts.scheme != "riemann" or facts.model.variant != "elastic":
        return False
    kind = facts.kind
    strength = kind.strength or 0.0
    return kind.pressure >= ELASTIC * strength and {"pressure": 1e-9 * kind.pressure, "strength": 1e-9 * strength}


def _fixed_smoothing_length(facts: Facts) -> Found:
    """Gases whose smoothing length does not follow their density."""
    if not facts.gases or facts.scheme not in ("riemann", "eulerian") or facts.model.smoothing_length.type != "fixed":
        return False
    wanted = following(facts.bodies.values(), facts.case.kinematics)
    return {"gases": facts.gases, "wanted": "{" + ", ".join(f"{key}: {value}" for key, value in wanted.items()) + "}"}


def _initial_overlap(facts: Facts) -> Found:
    """Bodies placed nearer than a spacing, between which repulsion begins with energy of its own."""
    contact = getattr(facts.model, "contact", None)
    if contact is None or contact.type != "penalty" or facts.scheme != "eulerian":
        return False
    near = [
        name
        for name, body in list(facts.bodies.items())[1:]
        if body.position is None and body.gap < 0.5 * facts.case.resolution
    ]
    return [{"name": name, "gap": facts.case.resolution} for name in near[:1]]


def _eroding(facts: Facts) -> Found:
    """Rods that erode in thick metal, with few particles across."""
    met = facts.impact_pair
    if met is None or facts.scheme != "riemann" or facts.dim == 1 or facts.kind.velocity >= ERODING:
        return False
    rod, struck = (facts.bodies[name].shape.extent() for name in (met.first, met.second))
    if facts.overload < SHOCK or not rod or not struck or not min(rod[1:]) > 0.0:
        return False
    width = max(rod[1:])
    eroding = rod[0] > SLENDER * width and struck[0] > width and width < EVEN * facts.case.resolution
    return eroding and {"finer": width / EVEN}


def _spalling(facts: Facts) -> Found:
    """Shocked plates whose damage depends on plastic strain alone; elsewhere plates are bent and punched first."""
    shocked = facts.overload >= SHOCK and facts.kind.velocity >= BALLISTIC
    if facts.overload < 1.0 or (facts.dim > 1 and not shocked):
        return False
    names = [name for name, body in reversed(list(facts.bodies.items())[1:]) if _strain_alone(body)]
    return [{"name": name} | _spalling_like(facts.bodies[name]) for name in names[:1]]


def _spalling_like(body: Body) -> dict[str, object]:
    """Return the library's material of nearest density with a spall strength [Pa], which stands for an unknown one."""
    from hvisph.casefile.material_library import load_material, material_names

    known: dict[float, dict[str, object]] = {}
    for material in map(load_material, material_names()):
        strength = getattr(material.damage, "spall_strength", None)
        if strength and material.strength.type != "none" and material.porosity is None:
            known[abs(math.log(material.density / body.material.density))] = {"of": material.name, "like": strength}
    return known[min(known)]


def _strain_alone(body: Body) -> bool:
    damage: Any = body.material.damage
    return damage.type == "johnson_cook" and damage.spall_strength is None and damage.pressure_cutoff is None


def _brittle(facts: Facts) -> Iterator[Values]:
    """Fits of the strain to failure that fall to zero in tension."""
    from hvisph.materials.damage.johnson_cook import TRIAXIALITY_LIMIT

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
    from hvisph.casefile.material_library import library_of

    if facts.kind.velocity <= 0.0 or facts.kind.pressure > FELT or facts.case.units != "si":
        return
    library = library_of()
    for name, body in facts.bodies.items():
        model = body.material
        if model.strength.type == "none" and model.name in library.files and not model.name.startswith(LIQUIDS):
            family = re.split(r"[-0-9]", model.name)[0]
            kin = [
                one for one in library.names() if one.startswith(family) and library.load(one).strength.type != "none"
            ]
            yield {"name": name, "material": model.name, "remedy": f"; '{kin[0]}' has one" if kin else "",
                   "setting": f"bodies.{name}.material={kin[0]}" if kin else ""}  # fmt: skip


def _held_by_hoops(facts: Facts) -> Iterator[Values]:
    """Bodies about the axis whose tension nothing limits."""
    for name, body in facts.bodies.items() if KINEMATICS[facts.case.kinematics].revolved else ():
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
            yield {"name": name, "poisson": poisson, "least": LEAST_POISSON, "usual": USUAL_POISSON, "shear": usual}


def _weak_cohesion(facts: Facts) -> Iterator[Values]:
    """Bodies of rock whose cohesion is below the noise of the pressure of a lattice."""
    for name, body in facts.bodies.items():
        strength = body.material.strength
        if strength.type == "rock":
            material = material_of_body(body)
            least = LATTICE_NOISE * material.density * material.bulk_sound_speed**2
            if 0.0 < strength.cohesion < least:
                yield {"name": name, "cohesion": strength.cohesion, "least": least, "share": LATTICE_NOISE}


def _cracks(facts: Facts) -> Iterator[tuple[str, float, float, float]]:
    """Return body, width of its bands, l_max and w_f [m] of bodies with a fracture energy.

    The flow stress at onset is that at a strain of `AT_ONSET`, slow and cold; the tension is the spall strength or the
    cut-off, else the mean stress of uniaxial tension. w_f is that of flow; of what never yields, that of tension.
    """
    from hvisph.materials.damage.fracture_energy import largest_widths
    from hvisph.setup.formulations import formulation_of
    from hvisph.setup.material_point import flow_at

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
        most = min(stable, opening / SHARPEST)
        if width <= most:
            continue
        own = facts.bodies[name].resolution
        finer = most * (own or facts.case.resolution) / width
        left = 100.0 * math.sqrt(stable / width)
        effect = f"its strength falls to {left:.2g} %" if width > stable else "cracks may take three times their energy"
        yield {"name": name, "width": 1e3 * width, "stable": 1e3 * stable, "opening": 1e3 * opening, "effect": effect,
               "of": f"bodies.{name}." if own else "",
               "finer": math.floor(1e6 * finer) if finer > 1e-6 else 1e6 * finer}  # fmt: skip


def _too_narrow(facts: Facts) -> Iterator[Values]:
    """Bands narrower than the displacement over which they soften."""
    for name, width, _, opening in _cracks(facts):
        if width < WIDEST_CRACK * opening:
            own = facts.bodies[name].resolution
            yield {"name": name, "width": 1e3 * width, "opening": 1e3 * opening, "of": f"bodies.{name}." if own else "",
                   "coarser": math.ceil(1e6 * opening * (own or facts.case.resolution) / width)}  # fmt: skip


def _molten(facts: Facts) -> Iterator[Values]:
    """Bodies whose first shock leaves them molten, with an equation of state that has no liquid and no vapour."""
    from hvisph.casefile.material_library import library_of

    from .hugoniot_check import plane_shock

    met, shock = facts.impact_pair, plane_shock(facts.case)[0]
    if met is None or shock is None:
        return
    names = library_of().files
    for name, behind in ((met.first, shock.projectile), (met.second, shock.target)):
        body = facts.bodies[name]
        material, model = material_of_body(body), body.material
        melts = material.melting_point
        if model.eos.type not in SOLID or material.porosity is not None or material.total_energy or melts == math.inf:
            continue
        hot = material.released_temperature(behind.density, behind.energy)
        if hot > melts:
            kin = f"{model.name}{VAPOUR}"
            known = kin in names
            yield {"name": name, "eos": model.eos.type, "shock": 1e-9 * behind.pressure, "hot": hot, "melts": melts,
                   "remedy": f"take {kin}" if known else "`tillotson` and `table` have both",
                   "setting": f"bodies.{name}.material={kin}" if known else ""}  # fmt: skip


def _thin_walls(facts: Facts) -> Iterator[Values]:
    """Meshes of sheet that the spacing does not resolve; of shapes with sizes these are refused."""
    from hvisph.setup.shapes import shape_of

    for name, body in facts.bodies.items():
        if body.shape.type != "mesh":
            continue
        try:
            shape, dx = shape_of(body.shape, facts.case.drawing_dimensions), body.spacing(facts.case)
        except CaseError as error:
            raise CaseError(error.message, where=f"bodies.{name}.{error.where}") from error
        wall = getattr(shape, "thickness", math.inf)
        if wall < min(FEWEST_IN_WALL * dx, SHEET * min(shape.extent())):
            yield {"name": name, "wall": 1e3 * wall, "count": wall / dx, "finer": 1e3 * wall / FEWEST_IN_WALL}


RULES = (
    Rule(lambda f: f.is_motionless and not f.moving,
         "bodies: none has a velocity, and nothing else sets them in motion: nothing will happen"),
    Rule(_receding, "bodies.{name}.velocity: no two bodies approach each other: nothing will be struck{row}"),
    Rule(_slow,
         "formulation: the bodies stay elastic and move slowly over {crossings:.3g} crossings of their waves; "
         "'{scheme}' damps vibration and rebound{lost}; take {instead}", "verification", "{setting}"),
    Rule(_yielding,
         "formulation.variant: 'elastic' overshoots in shocks beyond the elastic limit (5 % in aluminium at 600 m/s); "
         "the impact pressure is {pressure:.3g} GPa, the least strength {strength:.3g} GPa; take 'corrected'",
         "theory/default-scheme", "formulation.variant=corrected"),
    Rule(lambda f: (f.scheme == "riemann" and f.case.time.step is None and f.case.time.cfl > LONGEST_STEP)
         and {"cfl": f.case.time.cfl, "most": LONGEST_STEP},
         "time.cfl: {cfl:g} is beyond {most:g}, up to which 'riemann' was verified; from 0.5 on yielded metal, liquids "
         "and gases stay noisy; leave it out and take the default", "verification", "time.cfl={most:g}"),
    Rule(lambda f: f.scheme == "riemann" and f.model.variant == "original" and f.strength_of_shock > STRONG / 2,
         "formulation.variant: 'original' underestimates the stress behind strong shocks, by 2 % at 3 km/s and "
         "37 % at 24 km/s in aluminium; take 'corrected'", "verification", "formulation.variant=corrected"),
    Rule(lambda f: f.scheme == "eulerian" and f.model.density_form == "volume" and f.strength_of_shock > 1.5 * STRONG,
         "formulation.density_form: 'volume' is off by up to 6 % of the stress in shocks this strong (24 km/s in "
         "aluminium); take 'mass', or the formulation riemann", "verification", "formulation.density_form=mass"),
    Rule(lambda f: f.scheme == "total_lagrangian" and f.overload > SHOCK,
         "formulation: at an impact pressure above ten times the strength strains exceed what reference kernels "
         "resolve; take riemann or adaptive, or give reference_update_strain: 0.3",
         "verification", "formulation={{type: riemann}}"),
    Rule(lambda f: ({"name": name} for name, body in f.bodies.items()
                    if f.overload >= SHOCK and body.arrangement == "lattice_two_rings"),
         "bodies.{name}.arrangement: single particles on the axis of 'lattice_two_rings' show 1.3 times the pressure "
         "of 'square' and 'rings'; take one of these, or a mean, where peaks count",
         "verification", "bodies.{name}.arrangement=rings"),
    Rule(lambda f: (f.scheme == "eulerian" and f.dim == 3 and f.overload >= SHOCK
                    and any(body.shape.type == "sphere" for body in f.bodies.values())),
         "formulation: in 3D 'eulerian' leaves single particles at the rim of the contact of a sphere at up to 1.2 "
         "times the pressure of a flat impact (riemann: 1.09); take riemann where peaks count",
         "verification", "formulation={{type: riemann}}"),
    Rule(lambda f: f.gases != "" and f.scheme in ("total_lagrangian", "adaptive") and {"gases": f.gases},
         "formulation: {gases} is a gas or becomes one, which no reference kernel follows; take riemann, or give such "
         "bodies `formulation: eulerian`", "verification", "formulation={{type: riemann}}"),
    Rule(_fixed_smoothing_length,
         "formulation.smoothing_length: fixed, and {gases} is a gas or becomes one, which expands beyond the reach of "
         "a fixed kernel; give {wanted}", "verification", "formulation.smoothing_length={wanted}"),
    Rule(lambda f: (f.gases != "" and f.scheme == "eulerian" and f.model.correction.type == "none"
                    and f.model.density_form == "volume"
                    and all(body.material.eos.type == "ideal_gas" for body in f.bodies.values())),
         "formulation.density_form: with 'volume' density and pressure of a gas are a fifth too high behind a shock "
         "that compresses it fourfold; take 'mass', or the formulation riemann",
         "verification", "formulation.density_form=mass"),
    Rule(_initial_overlap,
         "formulation.contact: 'penalty' starts loaded where bodies touch: bodies.{name} is pushed off at rest; give "
         "it a gap of {gap:g}, or take 'frictional'", "verification", "bodies.{name}.gap={gap:g}"),
    # a limit came out 8 % too high with 60 particles across and by more than 12 % with 40
    Rule(lambda f: (bool(f.plug_damage) and f.flat and f.across < BAND)
         and {"finer": f.case.resolution * f.across / RESOLVED_BAND},
         "resolution: a blunt projectile shears out a plug along a band that 80 particles across it resolve; "
         "with 40 the ballistic limit is 12 % too high; compare with an experiment",
         "validation", "resolution={finer:.3g}"),
    Rule(lambda f: [{"name": name} for name, damage in f.plug_damage.items() if not damage.softening][:1],
         "bodies.{name}.material.damage: damage does not reduce the yield stress, so that plugs leave a metal that "
         "hardens too late; give `softening`, D_c, if the damage was published with one: 0.3 of Weldox 460 E",
         "validation", "bodies.{name}.material.damage.softening=0.3"),
    # a flat steel core at 850 m/s leaves 10 mm of aluminium at 616 m/s at 8 particles across, at 648 at 12, for 680
    Rule(lambda f: bool(f.plug_damage) and f.flat and f.scheme == "riemann" and f.across < COARSE,
         "formulation: a projectile that punches a plate at this speed loses up to 10 % too much of it in 'riemann' "
         "with few particles across; take adaptive, and compare with eulerian",
         "validation", "formulation={{type: adaptive, conversion: {{damage: true}}}}"),
    Rule(_eroding,
         "resolution: a rod that erodes stops too early with few particles across it: tungsten at 1.5 km/s penetrates "
         "0.75 of its length into steel at 8 across and 0.91 at 14; compare with a finer one",
         "validation", "resolution={finer:.3g}"),
    Rule(lambda f: (f.dim == 3 and f.scheme == "riemann" and f.model.h_over_dx < WIDE and f.impact_pair is None
                    and f.overload > SHOCK) and {"wide": WIDE},
         "formulation.h_over_dx: in a foot that flattens against a wall in 3D particles separate beyond the reach of "
         "their kernels; it spreads by 9 % too much at 1.2, within 3 % at {wide:g}; give that, or take axisymmetric",
         "validation", "formulation.h_over_dx={wide:g}"),
    Rule(_brittle,
         "bodies.{name}.material.damage: the strain to failure falls to zero at a triaxiality of {end:.3g}, so that "
         "the tension of a release fails it at once; give high_triaxiality: void_growth, or damage none",
         "validation", "bodies.{name}.material.damage.high_triaxiality=void_growth"),
    Rule(_spalling,
         "bodies.{name}.material.damage: johnson_cook adds up plastic strain, of which a release makes little, so that "
         "plates spall too late; give spall_strength where spall decides, '{of}' has {like:.3g} Pa",
         "validation", "bodies.{name}.material.damage.spall_strength={like:.3g}"),
    Rule(_liquid,
         "bodies.{name}.material: the library has no strength of '{material}', a liquid here: bending, penetration and "
         "shape are those of a liquid{remedy}", setting="{setting}"),
    Rule(_held_by_hoops,
         "bodies.{name}.material: has neither damage nor a cut-off of tension, and rings do not break round the axis: "
         "a cloud of debris is held by its own hoops, and what is drawn beyond all that its equation of state bears "
         "runs away; give one, such as the spall strength of '{of}'",
         setting="bodies.{name}.material.damage={{type: pressure_cutoff, pressure: -{like:.3g}}}"),
    Rule(_moduli_apart,
         "bodies.{name}.material: shear and bulk modulus give a Poisson's ratio of {poisson:.2g}, below {least:g}, "
         "so that they are of different measurements; give the shear modulus of a ratio of {usual:g} unless both are "
         "measured",
         setting="bodies.{name}.material.strength.shear_modulus={shear:.3g}"),
    Rule(_too_wide,
         "bodies.{name}.material.damage: the bands of its cracks are {width:.3g} mm wide: {effect}; its strength is "
         "borne up to l_max = {stable:.3g} mm, and the energy is right up to ten times the displacement of "
         "{opening:.3g} mm over which it softens; give a finer resolution",
         "materials", "{of}resolution={finer:.4g} um"),
    Rule(_too_narrow,
         "bodies.{name}.material.damage: bands of {width:.3g} mm are narrower than the displacement of {opening:.3g} "
         "mm over which they soften: the lattice tears before a crack has taken its energy, 0.6 to 1 of it; give a "
         "coarser resolution", "materials", "{of}resolution={coarser:.4g} um"),
    Rule(_weak_cohesion,
         "bodies.{name}.material.strength: a cohesion of {cohesion:.3g} Pa is lost in the pressure of the lattice's "
         "disorder, {share:g} of the bulk modulus; the smallest that counts is {least:.3g} Pa", "materials"),
    Rule(_molten,
         "bodies.{name}.material.eos: after a shock of {shock:.0f} GPa and its release '{eos}' is at {hot:.0f} K, "
         "above the melting point of {melts:g} K, and has no liquid and no vapour; {remedy}",
         "materials", "{setting}"),
    Rule(_thin_walls,
         "bodies.{name}: its walls are {wall:.3g} mm thick in the mean, {count:.2g} particles: three are few, so give "
         "it a `resolution` of {finer:.3g} mm or finer", setting="bodies.{name}.resolution={finer:.3g} mm"),
)  # fmt: skip
