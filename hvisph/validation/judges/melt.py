"""Where a flat impact melts: velocities at which what is released is at its melting point, and wholly beyond it.

After the release the matter is left with e, at a temperature T (c_v and the isentrope as in the case). Melting
begins on release where T reaches the melting temperature; it is complete where the energy above it, c_v (T - T_m),
is the heat of melting, 397 kJ/kg of aluminium (handbook), which the case's temperature leaves out.

A constant c_v takes up less heat on the way to the melting point than the metal does. Beside these stand, only shown,
the velocities at which the energy left is that of the metal: 666 kJ/kg from 298.15 K to 933.45 K, by the Shomate
equation of the NIST chemistry web book for solid aluminium, and the heat of melting on top.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hvisph.validation.value import Judge, Key, Shot, Value
from hvisph.verification.ran import vectors

HEAT_OF_MELTING = 397e3  # [J/kg], aluminium
HEAT_OF_SOLID = 666e3  # [J/kg], aluminium from room temperature to its melting point
INNER = (0.25, 0.75)  # of the target: neither the wall-heated faces nor the free surface


def _released(shot: Shot) -> tuple[float, float]:
    """Return velocity [m/s] and temperature after the release [K]."""
    snapshot = shot.ran.last
    own = snapshot.body == 1
    first = vectors(shot.ran.first, "position")[shot.ran.first.body == 1, 0]
    low, high = (first.min() + share * np.ptp(first) for share in INNER)
    inside = np.isin(snapshot.id, shot.ran.first.id[shot.ran.first.body == 1][(first > low) & (first < high)]) & own
    speed = max(body.velocity[0] for body in shot.ran.case.bodies.values())
    return float(speed), float(np.median(snapshot.fields["temperature"][inside]))


def _together(shots: Sequence[Shot]) -> dict[str, dict[Key, Value]]:
    if len(shots) < 2:
        return {}
    points = sorted(_released(shot) for shot in shots)
    speed, heat = np.array(points).T
    strength: Any = shots[0].ran.case.bodies["target"].material.strength
    melts = strength.melt_temperature
    complete = melts + HEAT_OF_MELTING / strength.heat_capacity
    step = float(np.diff(speed).max())
    solid = strength.room_temperature + HEAT_OF_SOLID / strength.heat_capacity
    liquid = solid + HEAT_OF_MELTING / strength.heat_capacity
    levels = {"onset": melts, "completion": complete, "onset_by_heat": solid, "completion_by_heat": liquid}
    return {"al-al": {(name, None): _crossing(speed, heat, level, step) for name, level in levels.items()}}


def _crossing(speed: np.ndarray, heat: np.ndarray, level: float, step: float) -> Value:
    if not heat[0] < level < heat[-1]:
        return Value(None, None, f"not between {speed[0]:g} and {speed[-1]:g} m/s")
    return Value(float(np.interp(level, heat, speed)), 0.05 * step)  # the curve is smooth: linear within a step


def _curves(shots: Sequence[Shot]) -> dict[str, Any]:
    return {"temperature": [list(point) for point in sorted(_released(shot) for shot in shots)]}


JUDGE = Judge(
    {"onset": "melting begins", "completion": "melting complete",
     "onset_by_heat": "melting begins, by the metal's heat", "completion_by_heat": "melting complete, by the same"},
    together=_together, curves=_curves,
)  # fmt: skip
