"""What the shot did to every layer: perforated or not, and when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import degrees
from typing import Any

from hvisph.core.measure_catalogue import LAYER_CATALOGUE
from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.result import Result, meaningless

from .impulse import loads
from .perforation import NO, NOT_YET, YES, Perforation, perforation
from .target_damage import marks, unit_of

OBLIQUE = 0.05  # angle from which a plate's crater and lips are no longer those along the shot line [rad]
OF_A_CRATER = ("crater_diameter", "crater_diameter_minimum")
OF_A_HOLE = ("crater_lip_to_lip", "impact_diameter", "lip_height", "lip_height_maximum")
# Measures that earlier moments tell, see `passage`.
IN_TIME = ("perforation_time", "passage_time", "passage_velocity", "passage_largest_share", "passage_length")


@dataclass(frozen=True)
class LayerMeasures:
    """The measures of one layer at one moment.

    Parameters
    ----------
    body
        Name of the body.
    state
        Whether it is perforated: ``yes``, ``no`` or ``not yet``; empty where that has no meaning.
    results
        By name; values in SI.
    obliquity
        Angle between the shot line and the layer's normal [rad]; None where the start is not known.
    opening
        Whether it has no state since openings of its own let the projectile through.
    """

    body: str
    state: str
    results: dict[str, Result] = field(default_factory=dict)
    obliquity: float | None = None
    opening: bool = False

    def as_dict(self) -> dict[str, Any]:
        """Return the plain form for JSON."""
        return {
            "body": self.body,
            "perforated": self.state or None,
            "obliquity": self.obliquity,
            "measures": {name: result.as_dict() for name, result in self.results.items()},
        }


def layer_measures(scene: Scene) -> tuple[LayerMeasures, ...]:
    """Measure every layer, in the order along the shot line."""
    return tuple(_layer(scene, body) for body in scene.layers)


def perforated(layers: Sequence[LayerMeasures]) -> Result:
    """Return whether all layers are perforated: 1 or 0, without a value while that is open."""
    if not layers:
        return meaningless("", "there is no layer")
    if any(layer.state == NO for layer in layers):
        return Result(0.0, "")
    if all(layer.state == YES for layer in layers):
        return Result(1.0, "")
    if not all(layer.state for layer in layers):
        unknown = next(layer for layer in layers if not layer.state)
        return meaningless("", f"{unknown.body}: {unknown.results['perforated'].reason}")
    stopped = next(layer for layer in layers if layer.state != YES)
    return meaningless("", f"not yet: {stopped.body}: {stopped.results['perforated'].reason.removeprefix('not yet: ')}")


def without_meaning(layers: Sequence[LayerMeasures]) -> dict[str, Result]:
    """Return the measures along the shot line that have no meaning, without a value.

    Those of a hole's lips where the first layer has no hole, and of crater and lips where it is oblique.
    """
    first = layers[0] if layers else None
    if first is not None and (first.obliquity or 0.0) > OBLIQUE:
        angle = f"{degrees(first.obliquity or 0.0):.3g} degrees"
        reason = f"'{first.body}' is oblique by {angle}: the layer's own measures are along its normal"
        return {name: meaningless("m", reason) for name in (*OF_A_CRATER, *OF_A_HOLE)}
    if first is None or first.state not in (NO, NOT_YET):
        return {}
    reason = f"'{first.body}' is not perforated{' yet' if first.state == NOT_YET else ''}: there is no hole's lip"
    return {name: meaningless("m", reason) for name in OF_A_HOLE}


def state_of(scene: Scene, number: int) -> str:
    """Return whether the layer of a number along the shot line is perforated."""
    return _perforation(scene, scene.layers[number])[0]


def _layer(scene: Scene, body: int) -> LayerMeasures:
    plate = scene.plate(body)
    state, reason, hole = _perforation(scene, body)
    name = scene.now.bodies[body] if body < len(scene.now.bodies) else f"body {body}"
    results = {"perforated": _answer(state, reason)}
    later = f"not perforated: {reason}" if state else reason
    later = "a single moment does not tell when" if state == YES else later
    results |= {one: meaningless(LAYER_CATALOGUE[one].unit, later) for one in IN_TIME}
    if hole is None or plate is None:
        results |= {
            one: meaningless(unit_of(one, scene.space), reason) for one in LAYER_CATALOGUE if one not in results
        }
    else:
        results |= marks(scene, plate, hole) | loads(scene, plate)
    return LayerMeasures(name, state, {one: results[one].finite() for one in LAYER_CATALOGUE},
                         None if plate is None else plate.obliquity, hole is not None and not state)  # fmt: skip


def _answer(state: str, reason: str) -> Result:
    if state in (YES, NO):
        return Result(float(state == YES), "")
    return meaningless("", f"{NOT_YET}: {reason}" if state else reason)


def _perforation(scene: Scene, body: int) -> tuple[str, str, Perforation | None]:
    """Return state, reason and what they follow from; an empty state where a perforation has no meaning."""
    plate = scene.plate(body)
    if scene.now.dimensions == 1:
        return "", "a perforation has no meaning in 1D", None
    if plate is None:
        return "", "a single snapshot does not tell the plate before it was struck", None
    if not {"velocity", "mass"} <= scene.now.fields.keys():
        return "", "the snapshot has no velocity or no mass", None
    hole = perforation(scene, plate)
    return hole.state, hole.reason, hole
