"""Where a flat impact melts: velocities at which what is released has the heat of its melting point, solid and molten.

Released matter bears no pressure: its energy is its heat. Melting begins on release where that is the heat of the solid
from room temperature to the melting point, the sum of the case's heat capacities; it is complete where the heat of
melting has been taken up as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from hvisph_validation.quantity import Evaluator, Key, Shot, Value

from hvisph.verification.problem import vectors

INNER = (0.25, 0.75)  # of the target: neither the wall-heated faces nor the free surface


def _released(shot: Shot, name: str) -> tuple[float, float]:
    """Return velocity [m/s] and the median of a field after the release."""
    snapshot = shot.ran.last
    target = snapshot.body == 1
    first = vectors(shot.ran.first, "position")[shot.ran.first.body == 1, 0]
    low, high = (first.min() + share * np.ptp(first) for share in INNER)
    inside = np.isin(snapshot.id, shot.ran.first.id[shot.ran.first.body == 1][(first > low) & (first < high)]) & target
    speed = max(body.velocity[0] for body in shot.ran.case.bodies.values())
    return float(speed), float(np.median(snapshot.fields[name][inside]))


def heats(material: Any) -> tuple[float, float]:
    """Return the heat [J/kg] of a case's material at its melting point, solid and molten."""
    points, melts = material.temperature.heat_capacities, material.temperature.melting_point
    t = np.linspace(material.strength.room_temperature, melts, 1001)
    c = np.interp(t, *np.array(points).T)
    solid = float(((c[1:] + c[:-1]) / 2 * np.diff(t)).sum())
    return solid, solid + float(material.temperature.heat_of_melting)


def _together(shots: Sequence[Shot]) -> dict[str, dict[Key, Value]]:
    if len(shots) < 2:
        return {}
    speed, heat = np.array(sorted(_released(shot, "internal_energy") for shot in shots)).T
    solid, molten = heats(shots[0].ran.case.bodies["target"].material)
    step, levels = float(np.diff(speed).max()), {"onset": solid, "completion": molten}
    return {"al-al": {(name, None): _crossing(speed, heat, level, step) for name, level in levels.items()}}


def _crossing(speed: np.ndarray, heat: np.ndarray, level: float, step: float) -> Value:
    if not heat[0] < level < heat[-1]:
        return Value(None, None, f"not between {speed[0]:g} and {speed[-1]:g} m/s")
    return Value(float(np.interp(level, heat, speed)), 0.05 * step)  # the curve is smooth: linear within a step


def _curves(shots: Sequence[Shot]) -> dict[str, Any]:
    return {"temperature": [list(point) for point in sorted(_released(shot, "temperature") for shot in shots)]}


EVALUATOR = Evaluator({"onset": "melting begins", "completion": "melting complete"}, together=_together, curves=_curves)
