"""Impact regime of the first two bodies in contact.

The impact pressure of the two against their strength tells whether waves stay elastic, plastic strains decide, or a
shock does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hvisph.setup.impact_pressure import impact_pressure

from .impact_pair import meeting

if TYPE_CHECKING:
    from hvisph.case.bodies import Body
    from hvisph.case.case import Case
    from hvisph.materials.material_table import Material

# Pressure over strength below which a body stays elastic, and above which its strength matters little to the waves.
ELASTIC, SHOCK = 1.0, 10.0


@dataclass(frozen=True)
class Regime:
    """Impact regime of the first two bodies in contact.

    Parameters
    ----------
    velocity
        Closing velocity of the first two bodies to meet, or of one and its image [m/s]; 0 where nothing closes.
    pressure
        Impact pressure, acoustic: a shock's is higher [Pa].
    strength
        Least yield stress of the bodies that have one [Pa]; None without one, infinite where all are elastic.
    liquids
        Those of the two that have none.
    """

    velocity: float
    pressure: float
    strength: float | None
    liquids: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """The regime in a few words."""
        if self.velocity <= 0.0:
            return "no two bodies close: no impact"
        if self.strength is None:
            return "shock in materials without strength"
        over = self.pressure / self.strength if self.strength > 0.0 else math.inf
        if over < ELASTIC:
            but = f" of all but {', '.join(self.liquids)}, without strength" if self.liquids else ""
            return f"elastic: the impact pressure is below the strength{but}"
        if over < SHOCK:
            return f"ballistic: the impact pressure is about {over:.2g} times the strength, plastic flow decides"
        return f"shock: the impact pressure is about {over:.0f} times the strength"


def regime(case: Case) -> Regime:
    """Return the regime of a case."""
    met = meeting(case)
    velocity = against_wall(case) if met is None else met.velocity
    names = [next(iter(case.bodies))] * 2 if met is None else [met.first, met.second]
    first, second = (material_of_body(case.bodies[name]) for name in names)
    one, other = (m.density_at_rest * m.bulk_sound_speed for m in (first, second))
    pressure = velocity * one * other / (one + other)
    if first.porosity is not None or second.porosity is not None:  # pores crush far below the speed of sound
        pressure = min(pressure, impact_pressure(first, second, velocity))
    known = [y for y in (_strength(material_of_body(body), pressure) for body in case.bodies.values()) if y is not None]
    liquids = () if met is None else tuple(name for name, one in zip(names, (first, second), strict=True)
                                           if one.strength.name == "none")  # fmt: skip
    return Regime(velocity, pressure, min(known, default=None), liquids)


def against_wall(case: Case) -> float:
    """Return the closing velocity of a body and its image in a plane across x that it flies at [m/s]; 0 for none."""
    body = next(iter(case.bodies.values()))
    if body.position is None:
        return 0.0
    closing = [
        math.copysign(2.0, plane.at - body.position[0]) * body.velocity[0]
        for plane in case.symmetry
        if plane.axis == "x"
    ]
    return max([0.0, *closing])


def material_of_body(body: Body) -> Material:
    """Return the material of a body as it begins."""
    from hvisph.setup.materials import material_of

    return material_of(body.material, body.internal_energy)


def _strength(material: Material, pressure: float) -> float | None:
    """Return what a material yields at, cold, slow and undamaged, under a pressure: rock bears more under more."""
    from hvisph.setup.material_point import flow_at

    name = material.strength.name
    if name == "none":
        return None
    return math.inf if name == "elastic" else flow_at(material, None, 0.0, 1.0, pressure)
