"""Shields: whether the rear wall is perforated, beside the limit curves of Christiansen.

As in the data, a wall fails by a way through it or by spall that flies off its rear. One without either when the run
ends has held: runs last until the debris that matters has arrived.
"""

from __future__ import annotations

from typing import Any

from hvisph_validation.quantity import Evaluator, Key, Shot, Value, measure_of

from hvisph.case.case import Case
from hvisph.measures.correlations import correlations, critical_diameter
from hvisph.precheck.correlation_input import impact_of


def _each(shot: Shot) -> dict[Key, Value]:
    wall = shot.ran.summary["layers"][-1]
    failed = wall["perforated"] == "yes" or bool(measure_of(wall["measures"], "spall_mass").value)
    return {("perforated", None): Value(float(failed), ratio=ratio(shot.ran.case))}


def ratio(case: Case) -> float | None:
    """Return the sphere's diameter over the critical one; None for what the curve does not know."""
    impact, _ = impact_of(case)
    if impact is None or (alloy := impact.walls[-1].alloy) is None:
        return None
    if len(impact.walls) > 2:
        diameters = [
            correlation.value
            for correlation in correlations(impact)
            if correlation.quantity == "critical diameter of the sphere"
        ]
        return impact.diameter / diameters[0] if diameters else None
    bumper, wall = impact.walls
    return impact.diameter / critical_diameter(impact, bumper, wall, alloy.strength)


def _curves(shots: Any) -> dict[str, Any]:
    """Return of every shot impact velocity [km/s], diameter over the critical one, computed and measured verdict."""
    curves = {}
    for shot in shots:
        value = _each(shot)["perforated", None]
        measured = next((entry.value for entry in shot.measured if entry.quantity == "perforated"), None)
        speed = 1e-3 * max(body.velocity[0] for body in shot.ran.case.bodies.values())
        curves[shot.name] = [speed, value.ratio, value.value, measured]
    return curves


EVALUATOR = Evaluator({"perforated": "rear wall fails"}, _each, curves=_curves)
