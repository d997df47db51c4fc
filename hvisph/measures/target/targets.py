"""Measures of every layer of the target: state, impulse and loaded area."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hvisph.core.measure_catalogue import format_of
from hvisph.measures.frame.impact_geometry import PROJECTILE
from hvisph.measures.frame.measurement_frame import Scene, memoize
from hvisph.measures.frame.target_geometry import Plate
from hvisph.measures.registry import evaluate, measures
from hvisph.measures.result import Result, UndefinedMeasureError, weighted_quantile
from hvisph.output.snapshot import Snapshot

from .perforation import NO, NOT_YET, YES, layer_state


@dataclass(frozen=True)
class LayerMeasures:
    """The measures of one layer at one moment.

    Parameters
    ----------
    body
        Name of the body.
    state
        Whether it is perforated: ``yes``, ``no`` or ``not yet``; empty where that is undefined.
    results
        By name; values in SI.
    obliquity
        Angle between the shot line and the layer's normal [rad]; None where the start is not known.
    opening
        Whether it has no state because openings of its own let the projectile through.
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
    """Return the measures of every layer, in the order along the shot line."""
    found = []
    for body in scene.layers:
        plate, state = scene.plate(body), layer_state(scene, body)
        reason = state.reason if plate is None or state.attached is None else ""
        found.append(LayerMeasures(scene.name(body), state.state, evaluate("layer", scene, plate, reason=reason),
                                   None if plate is None else plate.obliquity, state.opening))  # fmt: skip
    return tuple(found)


@measures("layer", "perforated")
def layer_perforation(scene: Scene, plate: Plate) -> float:
    """Return whether a layer is perforated: 1 or 0."""
    found = layer_state(scene, plate.body)
    if found.state not in (YES, NO):
        raise UndefinedMeasureError(f"{NOT_YET}: {found.reason}" if found.state else found.reason)
    return float(found.state == YES)


@measures("run", "perforated")
def target_perforation(scene: Scene) -> float:
    """Return whether all layers are perforated: 1 or 0."""
    states = [(scene.name(body), layer_state(scene, body)) for body in scene.layers]
    if not states:
        raise UndefinedMeasureError("there is no layer")
    if any(one.state == NO for _, one in states):
        return 0.0
    for name, one in sorted(states, key=lambda pair: pair[1].state != ""):
        if one.state != YES:
            raise UndefinedMeasureError(f"{'not yet: ' if one.state else ''}{name}: {one.reason}")
    return 1.0


def verdict(layers: Sequence[LayerMeasures], unitless: bool = False) -> str:
    """Return in one line which layers are perforated, in the order along the shot line; empty where undefined."""
    return "; ".join(_layer_verdict(layer, unitless) for layer in layers if layer.state or layer.opening)


def _layer_verdict(layer: LayerMeasures, unitless: bool) -> str:
    if layer.opening:
        return f"{layer.body}: open from the start, without a new path through it"
    if layer.state != YES:
        return f"{layer.body}: not perforated{' yet' if layer.state == NOT_YET else ''}"
    time = layer.results["perforation_time"]
    if time.value is None:
        return f"{layer.body}: perforated"
    display = format_of("perforation_time", "s", unitless)
    value, spread = (f"{display.factor * figure:.3g}" for figure in (time.value, time.uncertainty or 0.0))
    return f"{layer.body}: perforated at {value} ± {spread} {display.unit}".rstrip()


NEAR = 2.0  # [dx] before the struck face
MOST = 0.9  # mass fraction of what has arrived within the loaded diameter
LEAST = 1e-4  # share of the projectile's mass that must have arrived


@memoize
def arrived_particles(scene: Scene, plate: Plate) -> np.ndarray:
    """Return the indices of the particles of the projectile and earlier layers that have reached a layer."""
    before = scene.layers[: scene.layers.index(plate.body)]
    flying = [body for body, role in enumerate(scene.shot.roles) if role == PROJECTILE or body in before]
    reach = plate.depth(scene.position) > -NEAR * scene.spacing
    return np.flatnonzero(np.isin(scene.now.body, flying) & reach)


def is_struck(scene: Scene, plate: Plate) -> bool:
    """Return whether enough mass has reached a layer."""
    return bool(scene.now.fields["mass"][arrived_particles(scene, plate)].sum() > LEAST * scene.shot_mass)


@measures("layer", "impulse", needs=("start",))
def impulse(scene: Scene, plate: Plate) -> float:
    """Return the momentum along its normal that the layer has gained [N s]."""
    assert scene.start is not None
    return _momentum(scene.now, plate) - _momentum(scene.start, plate)


@measures("layer", "loaded_diameter")
def loaded_diameter(scene: Scene, plate: Plate) -> float:
    """Return the diameter about the shot line that holds 90 % of the mass that has arrived [m]."""
    if not is_struck(scene, plate):
        raise UndefinedMeasureError("nothing has reached the layer")
    rows = arrived_particles(scene, plate)
    across = np.sqrt((plate.in_plane(scene.position[rows]) ** 2).sum(axis=1))
    return 2.0 * weighted_quantile(across, scene.now.fields["mass"][rows], MOST) + scene.spacing


@measures("layer", "mean_pressure", needs=("start",))
def mean_pressure(scene: Scene, plate: Plate) -> float:
    """Return the pressure that gives the impulse over the loaded area and the time since the first arrival [Pa]."""
    width, timeline = loaded_diameter(scene, plate), scene.timeline
    if timeline is None:
        raise UndefinedMeasureError("a single moment does not contain the time of the first arrival")
    number = scene.layers.index(plate.body)
    first = timeline.first(lambda moment: moment.struck[number])
    since = timeline.moment(0).time if first is None else timeline.interval(first)[0]
    if not scene.now.time > since:
        raise UndefinedMeasureError("nothing has reached the layer")
    area = 0.25 * np.pi * width**2 if scene.space == 3 else width
    return float(impulse(scene, plate) / (area * (scene.now.time - since)))


def _momentum(snapshot: Snapshot, plate: Plate) -> float:
    own = snapshot.body == plate.body
    along = snapshot.fields["velocity"][own] @ np.array(plate.basis[0])
    return float((snapshot.fields["mass"][own] * along).sum())
