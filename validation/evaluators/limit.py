"""Ballistic limits: the middle of the bracket that a bisection leaves; residual velocities beside those recalled."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from hvisph_validation.quantity import Evaluator, Key, Shot, Value

from hvisph.sweeps.statistics import bracket

WIDEST = 0.1  # of the limit: half the width of a bracket that tells it


def _speeds(shots: Sequence[Shot]) -> dict[str, list[tuple[float, bool, float]]]:
    """Return by shot velocities [m/s], whether they went through, and residual velocities, in the order of velocity.

    The residual velocity of a projectile that stays is 0, that of one still in its hole its mean velocity.
    """
    speeds: dict[str, list[tuple[float, bool, float]]] = {}
    for shot in shots:
        through = shot.measure("perforated").value
        if through is not None:
            speed = max(body.velocity[0] for body in shot.ran.case.bodies.values())
            residual_speed = 0.0
            if through > 0.5:
                residual = shot.measure("residual_velocity").value
                residual_speed = float(shot.ran.mean_velocity(0)[0]) if residual is None else residual
            speeds.setdefault(shot.name, []).append((float(speed), through > 0.5, residual_speed))
    return {name: sorted(points, key=lambda point: point[0]) for name, points in speeds.items()}


def _together(shots: Sequence[Shot]) -> dict[str, dict[Key, Value]]:
    values: dict[str, dict[Key, Value]] = {}
    for name, points in _speeds(shots).items():
        limits = bracket([speed for speed, _, _ in points], [yes for _, yes, _ in points])
        if limits.below is None or limits.above is None:
            side = "every" if limits.below is None else "no"
            values[name] = {("ballistic_limit", None): Value(None, None, f"{side} shot went through")}
            continue
        middle, half = 0.5 * (limits.below + limits.above), 0.5 * abs(limits.above - limits.below)
        if half > WIDEST * middle:  # the middle of a wide bracket is no limit, however near it comes
            reason = f"between {limits.below:g} and {limits.above:g} m/s"
            values[name] = {("ballistic_limit", None): Value(None, None, reason)}
            continue
        values[name] = {("ballistic_limit", None): Value(middle, half)}
        pairs = [(speed, residual) for speed, through, residual in points if through]
        speed, residual = np.array(pairs, dtype=float).T
        places = {entry.at for shot in shots if shot.name == name for entry in shot.measured if entry.at is not None}
        for at in places:
            if speed.min() <= at <= speed.max():
                values[name]["residual_velocity", at] = Value(float(np.interp(at, speed, residual)))
    return values


def _curves(shots: Sequence[Shot]) -> dict[str, Any]:
    return {name: [[speed, residual] for speed, _, residual in points] for name, points in _speeds(shots).items()}


EVALUATOR = Evaluator(
    {"ballistic_limit": "ballistic limit", "residual_velocity": "residual velocity"}, together=_together, curves=_curves
)
