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
    """Impact regime of the first two bodies in contact."""

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
        over = self.pressure / self.strength if self.strength > 0.0 else math.inf
        if over < ELASTIC:
            but = f" of all but {', '.join(self.liquids)}, without strength" if self.liquids else ""
            return f"elastic: the impact pressure is below the strength{but}"
        if over < SHOCK:
            return f"ballistic: the impact pressure is about {over:.2g} times the strength"
        return f"shock: the impact pressure is about {over:.0f} times the strength"


def regime(case: Case) -> Regime:
    """Return the regime of a case."""
    pair = impact_pair(case)
    velocity = against_wall(case) if pair is None else pair.velocity
    names = [next(iter(case.bodies))] * 2 if pair is None else [pair.first, pair.second]
    first, second = (material_of_body(case.bodies[name]) for name in names)
    one, other = (m.density_at_rest * m.bulk_sound_speed for m in (first, second))
    pressure = velocity * one * other / (one + other)
    if first.porosity is not None or second.porosity is not None:  # pores crush far below the speed of sound
        pressure = min(pressure, impact_pressure(first, second, velocity))
    known = [y for y in (_strength(material_of_body(body), pressure) for body in case.bodies.values()) if y is not None]
    liquids = (
        ()
        if pair is None
        else tuple(name for name, one in zip(names, (first, second), strict=True) if one.strength.name == "none")
    )
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
    def kind(self) -> Regime:
        """The regime of the case."""
        return regime(self.case)

    @cached_property
    def impact_pair(self) -> ImpactPair | None:
        """First two bodies in contact."""
        return impact_pair(self.case)

    @cached_property
    def overload(self) -> float:
        """Impact pressure over strength; 0 without an impact or without strength."""
        if self.kind.velocity <= 0.0 or self.kind.strength is None:
            return 0.0
        return self.kind.pressure / self.kind.strength if self.kind.strength else math.inf

    @cached_property
    def is_motionless(self) -> bool:
        """Whether the case is at rest: no bodies approach, and there is no other load."""
        bodies = self.bodies.values()
        driven = any(body.initial_velocity or body.internal_energy or body.temperature for body in bodies)
        driven = driven or any(body.material.eos.type in ("jwl", "ideal_gas") for body in bodies)
        driven = driven or any(clamp.moves for clamp in self.case.clamped)
        pushed = self.case.loads or any(plane.velocity for plane in self.case.symmetry)
        if (
            self.kind.velocity > 0.0
            or driven
            or pushed
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
        if self.kind.velocity <= 0.0:
            return 0.0
        struck = next(iter(self.bodies.values())) if self.impact_pair is None else self.bodies[self.impact_pair.second]
        return 0.5 * self.kind.velocity / material_of_body(struck).bulk_sound_speed

    @cached_property
    def plug_damage(self) -> Plain:
        """Johnson-Cook damage of the bodies that may be punched at ballistic speed, by name."""
        struck = {name: body.material.damage for name, body in self.bodies.items() if not self._strikes(name)}
        failing = {name: damage for name, damage in struck.items() if damage.type == "johnson_cook"}
        slow = 0.0 < self.kind.velocity < BALLISTIC and len(self.bodies) > 1 and self.dim > 1
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
