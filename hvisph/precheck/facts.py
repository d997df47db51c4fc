"""Facts of a case that advice depends on, and the form of a piece of advice."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from hvisph.case.formulations.riemann import is_gas
from hvisph.core.text import Plain, recommend

from .impact_pair import ImpactPair, impact_pair
from .regime import Regime, material_of_body, regime

if TYPE_CHECKING:
    from hvisph.case.case import Case

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
        """Type of the shape of what strikes; empty without an impact."""
        return shape_type(self.bodies[self.impact_pair.first].shape) if self.impact_pair else ""

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


def shape_type(shape: Any) -> str:
    """Return the type of a shape, or of the outer shape of a hollow one."""
    return str(getattr(shape, "whole", shape).type)


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
