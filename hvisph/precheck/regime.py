"""Regime of an impact, and the facts of a case on which advice rests."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from hvisph.case.bodies import Body
from hvisph.case.case import Case
from hvisph.case.formulations.riemann import is_gas
from hvisph.core.text import Plain, recommend
from hvisph.materials.material_table import Material
from hvisph.precheck.impact_pair import ImpactPair, impact_pair
from hvisph.setup.formulations import impact_pressure
from hvisph.setup.material_point import flow_at
from hvisph.setup.materials import material_of

# Pressure over strength below which a body stays elastic, and above which its strength matters little to the waves.
ELASTIC, SHOCK = 1.0, 10.0


@dataclass(frozen=True)
class Regime:
    """Impact regime of the first two bodies in contact, and validation record of runs of the same kind."""

    # closing velocity of the first two bodies to meet, or of one and its image [m/s]; 0 where nothing closes
    velocity: float
    pressure: float  # impact pressure, acoustic: a shock's is higher [Pa]
    # least yield stress of the bodies that have one [Pa]; None without one, infinite where all are elastic
    strength: float | None
    liquids: tuple[str, ...] = ()  # bodies of the two without strength

    @property
    def words(self) -> str:
        """The regime in a few words."""
        if self.velocity <= 0.0:
            return "no impact: no two bodies approach each other"
        if self.strength is None:
            return "shock in materials without strength"
        ratio = self.pressure / self.strength if self.strength > 0.0 else math.inf
        if ratio < ELASTIC:
            but = f" of all but {', '.join(self.liquids)}, without strength" if self.liquids else ""
            return f"elastic: the impact pressure is below the strength{but}"
        if ratio < SHOCK:
            return f"ballistic: the impact pressure is about {ratio:.2g} times the strength"
        return f"shock: the impact pressure is about {ratio:.0f} times the strength"


def regime(case: Case) -> Regime:
    """Return the regime of a case."""
    pair = impact_pair(case)
    velocity = against_wall(case) if pair is None else pair.velocity
    names = [next(iter(case.bodies))] * 2 if pair is None else [pair.first, pair.second]
    first, second = (material_of_body(case.bodies[name]) for name in names)
    z1, z2 = (m.density_at_rest * m.bulk_sound_speed for m in (first, second))
    pressure = velocity * z1 * z2 / (z1 + z2)
    if first.porosity is not None or second.porosity is not None:  # pores crush far below the speed of sound
        pressure = min(pressure, impact_pressure(first, second, velocity))
    known = [y for y in (_strength(material_of_body(body), pressure) for body in case.bodies.values()) if y is not None]
    both = zip(names, (first, second), strict=True)
    liquids = () if pair is None else tuple(name for name, one in both if one.strength.name == "none")
    return Regime(velocity, pressure, min(known, default=None), liquids)


def against_wall(case: Case) -> float:
    """Return the closing velocity of a body and its image in a plane across x that it flies at [m/s]; 0 for none."""
    body = next(iter(case.bodies.values()))
    if body.position is None:
        return 0.0
    closing = [math.copysign(2.0, p.at - body.position[0]) * body.velocity[0] for p in case.symmetry if p.axis == "x"]
    return max([0.0, *closing])


def material_of_body(body: Body) -> Material:
    """Return the initial material of a body."""
    return material_of(body.material, body.internal_energy)


def _strength(material: Material, pressure: float) -> float | None:
    """Return the yield stress, cold, slow and undamaged, under a pressure, on which that of rock depends."""
    name = material.strength.name
    if name == "none":
        return None
    return math.inf if name == "elastic" else flow_at(material, None, 0.0, 1.0, pressure)


# Validation record: the figures are those of `docs/validation.md`; a test compares them with its results.


PAGE = "docs/validation.md"
THIN = 1.0  # a plate thinner than this many diameters of the sphere is perforated with a cloud behind it
FURTHEST = 2.0  # factor of velocity beyond the shots of a set up to which its figures apply
ENOUGH = 0.75  # least particles across over those of the validation runs for which their figures apply
ALUMINIUM, METALS = (2600.0, 2900.0), (2600.0, 20_000.0)  # densities [kg/m^3]
_SIMPLE = ("von_mises", "linear_hardening", "johnson_cook", "cowper_symonds")
DUCTILE = (*_SIMPLE, "steinberg_guinan", "steinberg_lund", "zerilli_armstrong")
STIFF = 5e9  # shear modulus above which a ductile solid is a metal and no plastic [Pa]


@dataclass(frozen=True)
class Experience:
    """Differences of runs from one set of experiments."""

    what: str  # the shots
    # mean size of the differences by quantity, as shares; of verdicts the share that is right
    figures: Mapping[str, float]
    across: float  # particles across the projectile, the bar or the bumper in the runs
    velocities: tuple[float, float]  # of the slowest and the fastest shot [m/s]
    over: str = ""  # length that the particles are counted across, in words
    verdicts: bool = False  # whether the figures are of verdicts
    densities: tuple[float, float] = ALUMINIUM  # of the metals that were shot, from and to [kg/m^3]


LABELS = {"cloud_ratio": "length over width of the cloud"}
# By set of `cases/validation`.
KNOWN = {
    "taylor": Experience(
        "41 Taylor bars",
        {"length_ratio": 0.036, "foot_diameter": 0.039, "outline": 0.035},
        24,
        (100.0, 350.0),
        densities=METALS,
    ),
    "cloud": Experience(
        "a sphere through a plate at 6.2 km/s",
        {"crater_rim_diameter": 0.005, "cloud_ratio": 0.118},
        40,
        (6180.0, 6180.0),
    ),
    "shield": Experience(
        "27 Whipple shields", {"perforated": 0.815}, 8, (2600.0, 7400.0), " the bumper", verdicts=True
    ),
    "crater": Experience("craters at 7 km/s, by the equation", {"crater_depth": 0.039}, 16, (7000.0, 7000.0)),
}


def experience(case: Case, impact: Regime) -> str:
    """Return the validation record of similar experiments; empty without any."""
    name = _set_of(case, impact)
    if not name:
        return ""
    record = KNOWN[name]
    if not record.velocities[0] / FURTHEST <= impact.velocity <= record.velocities[1] * FURTHEST:
        return ""
    if not all(_is_metal(material_of_body(body), record.densities) for body in case.bodies.values()):
        return ""
    first, *targets = case.bodies.values()
    if record.verdicts:
        words = f"for {100 * next(iter(record.figures.values())):.0f} % it is right whether the rear wall fails"
        count = min(targets[0].shape.extent()) / case.resolution
    else:
        labels = {quantity: LABELS.get(quantity, quantity.replace("_", " ")) for quantity in record.figures}
        words = ", ".join(f"{labels[quantity]} {100 * error:.1f} %" for quantity, error in record.figures.items())
        words += " off on average"
        count = _width(first) / case.resolution
    text = f"{record.what}: {words}, with {record.across:g} particles across{record.over} ({PAGE})"
    if count < ENOUGH * record.across:
        text += f"; this case has {count:.2g}, too few for these figures"
    return text


def _is_metal(material: Material, densities: tuple[float, float]) -> bool:
    """Return whether a material is a metal with a density within bounds [kg/m^3]."""
    low, high = densities
    ductile = material.strength.name in DUCTILE and material.shear_modulus > STIFF
    return ductile and material.porosity is None and low <= material.density <= high


def _set_of(case: Case, impact: Regime) -> str:
    bodies = list(case.bodies.values())
    if impact.velocity <= 0.0 or impact.strength is None or case.dim == 1 or case.units != "si":
        return ""
    if len(bodies) == 1:
        return "taylor" if against_wall(case) > 0.0 and bodies[0].shape.type == "cylinder" else ""
    if len(bodies) not in (2, 3) or bodies[0].shape.type != "sphere" or not impact.words.startswith("shock"):
        return ""
    if case.kinematics not in ("three_d", "axisymmetric"):
        return ""
    sizes = bodies[1].shape.extent()
    if not sizes:  # a mesh or a combination is neither of the plates that were shot at
        return ""
    thin = min(sizes) < THIN * _width(bodies[0])
    if len(bodies) == 3:
        return "shield" if thin else ""
    return "cloud" if thin else "crater"


def _width(body: Body) -> float:
    """Return the extent of a body across the shot line [m]."""
    return float(sorted(body.shape.extent()[1:])[0])


# Impact pressure over strength above which a plate may be punched, and speeds below which it is, not burst [m/s].
PUNCHED = 2.0
BALLISTIC = 1200.0
POINTED, ROUND_NOSED = ("cone", "ogive"), ("sphere", "hollow_sphere", "disc", "annulus", "dome", "rounded_cylinder")


class Facts:
    """Properties of a case on which the conditions of rules depend."""

    def __init__(self, case: Case):
        self.case, self.bodies, self.dim = case, case.bodies, case.dim
        self.model: Any = case.formulation
        self.scheme = case.formulation.type

    @cached_property
    def regime(self) -> Regime:
        """The regime of the case."""
        return regime(self.case)

    @cached_property
    def impact_pair(self) -> ImpactPair | None:
        """First two bodies in contact."""
        return impact_pair(self.case)

    @cached_property
    def overload(self) -> float:
        """Impact pressure over strength; 0 without an impact or without strength."""
        if self.regime.velocity <= 0.0 or self.regime.strength is None:
            return 0.0
        return self.regime.pressure / self.regime.strength if self.regime.strength else math.inf

    @cached_property
    def is_motionless(self) -> bool:
        """Whether the case is at rest: no bodies approach, and there is no other load."""
        bodies = self.bodies.values()
        driven = any(body.initial_velocity or body.internal_energy or body.temperature for body in bodies)
        driven = driven or any(body.material.eos.type in ("jwl", "ideal_gas") for body in bodies)
        driven = driven or any(clamp.moves for clamp in self.case.clamped)
        loaded = self.case.loads or any(plane.velocity for plane in self.case.symmetry)
        if (
            self.regime.velocity > 0.0
            or driven
            or loaded
            or self.case.initial_loads
            or self.case.gravity
            or self.case.start
        ):
            return False
        return not self.moving or (len(bodies) > 1 and all(plane.axis != "x" for plane in self.case.symmetry))

    @cached_property
    def moving(self) -> list[str]:
        """Names of the bodies with a velocity."""
        return [name for name, body in self.bodies.items() if any(body.velocity)]

    @cached_property
    def strength_of_shock(self) -> float:
        """Particle velocity over the sound speed of the struck body; 0 without an impact."""
        if self.regime.velocity <= 0.0:
            return 0.0
        target = next(iter(self.bodies.values())) if self.impact_pair is None else self.bodies[self.impact_pair.second]
        return 0.5 * self.regime.velocity / material_of_body(target).bulk_sound_speed

    @cached_property
    def plug_damage(self) -> Plain:
        """Johnson-Cook damage of the bodies that may be punched at ballistic speed, by name."""
        targets = {name: body.material.damage for name, body in self.bodies.items() if not self._strikes(name)}
        failing = {name: damage for name, damage in targets.items() if damage.type == "johnson_cook"}
        slow = 0.0 < self.regime.velocity < BALLISTIC and len(self.bodies) > 1 and self.dim > 1
        return failing if slow and self.overload > PUNCHED and not (self.impact_pair and self.nose in POINTED) else {}

    @cached_property
    def nose(self) -> str:
        """Shape type of the projectile; empty without an impact."""
        shape: Any = self.bodies[self.impact_pair.first].shape if self.impact_pair else None
        return "" if shape is None else str(getattr(shape, "whole", shape).type)  # the outer one of a hollow shape

    def _strikes(self, name: str) -> bool:
        return self.impact_pair is not None and name == self.impact_pair.first

    @cached_property
    def flat(self) -> bool:
        """Whether the projectile is flat: a round nose pushes metal aside before the rest of a plate shears."""
        return self.nose not in ROUND_NOSED

    @cached_property
    def across(self) -> float:
        """Particles across the projectile."""
        shots = [body for name, body in self.bodies.items() if self._strikes(name)]
        return max((min(body.shape.extent()[1:], default=0.0) for body in shots), default=0.0) / self.case.resolution

    @cached_property
    def gases(self) -> str:
        """Names of the bodies that are gases or become gases."""
        return ", ".join(name for name, body in self.bodies.items() if is_gas(body))


Values = Mapping[str, object]
Found = bool | Values | Iterable[Values]
Condition = Callable[[Facts], Found]


@dataclass(frozen=True)
class Rule:
    """A piece of advice: an entry of `advice.toml` with its condition.

    The condition returns whether it applies; or the values of the sentence, or several of them where it applies several
    times. Without a setting the user has to decide.
    """

    condition: Condition
    sentence: str
    page: str = ""
    setting: str = ""

    def texts(self, facts: Facts) -> list[str]:
        """Return the advice that applies."""
        outcome = self.condition(facts)
        if isinstance(outcome, Mapping):
            outcome = [outcome]
        values = ([{}] if outcome else []) if isinstance(outcome, bool) else outcome
        page = f" (docs/{self.page}.md)" if self.page else ""
        return [recommend(self.sentence.format(**v) + page, *self._settings(facts, v)) for v in values]

    def _settings(self, facts: Facts, values: Values) -> list[str]:
        settings = self.setting.format(**values).splitlines()
        if self.setting.startswith("formulation={"):  # of one formulation for all bodies, without graded ones
            graded = "riemann" not in self.setting
            for name, body in facts.bodies.items():
                settings += [f"bodies.{name}.formulation=null"] if body.formulation else []
                settings += [f"bodies.{name}.grading=null"] if graded and body.grading else []
        return settings
