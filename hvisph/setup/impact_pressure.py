"""Impact pressure by impedance matching."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hvisph.core.errors import HvisphError
from hvisph.exact.hugoniot import impedance_match
from hvisph.materials.material_table import Material


def impact_pressure(projectile: Material, target: Material, speed: float) -> float:
    """Return the pressure [Pa] at the interface of a flat impact at `speed` [m/s].

    Where the equations of state have no such shock, that of shocks whose speed is c0 + 1.5 u, at half the speed each.
    """
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
    known = list(dict.fromkeys(materials))
    kinds = [known.index(one) for one in materials]
    for a, b in itertools.combinations(range(len(materials)), 2):
        pair = (min(kinds[a], kinds[b]), max(kinds[a], kinds[b]))
        speeds[pair] = max(speeds.get(pair, 0.0), float(np.linalg.norm(velocities[a] - velocities[b])))
    return max((impact_pressure(known[a], known[b], speed) for (a, b), speed in speeds.items()), default=0.0)


def stiff_enough(formulation: Any, given: Any, materials: Sequence[Material], velocities: Sequence[np.ndarray]) -> Any:
    """Return a formulation with a contact stiffness for the impact pressure, unless the case has `given` one."""
    contact: Any = getattr(formulation, "contact", None)
    if not getattr(contact, "stores", False) or given.stiffness is not None:
        return formulation
    return replace(formulation, contact=replace(contact, expected=expected_pressure(materials, velocities)))
