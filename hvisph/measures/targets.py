"""Measures of every layer of the target: state, times of perforation and exit, impulse and loaded area."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from hvisph.core.measure_catalogue import format_of
from hvisph.core.text import Plain
from hvisph.output.snapshot import Snapshot

from .impact_geometry import PROJECTILE
from .lengths import length_of
from .measurement_frame import Scene, memoize
from .perforation import NO, NOT_YET, YES, is_behind, layer_state
from .residual_projectile import LEAST_SHARE, outer_momentum
from .result import (
    Outcomes,
    Result,
    UndefinedMeasureError,
    evaluate,
    measures,
    plain_results,
    refuse_if,
    weighted_quantile,
)
from .target_geometry import Plate


@dataclass(frozen=True)
class LayerMeasures:
    """The measures of one layer at one moment."""

    body: str  # name of the body
    state: str  # whether it is perforated: ``yes``, ``no`` or ``not yet``; empty where that is undefined
    results: dict[str, Result] = field(default_factory=dict)  # by name; values in SI
    # angle between the shot line and the layer's normal [rad]; None where the start is not known
    obliquity: float | None = None
    opening: bool = False  # whether it has no state because its initial openings let the projectile through

    def as_dict(self) -> Plain:
        """Return the plain form for JSON."""
        return {
            "body": self.body,
            "perforated": self.state or None,
            "obliquity": self.obliquity,
            "measures": plain_results(self.results),
        }


def layer_measures(scene: Scene) -> tuple[LayerMeasures, ...]:
    """Return the measures of every layer, in the order along the shot line."""
    layers = []
    for body in scene.layers:
        plate, state = scene.plate(body), layer_state(scene, body)
        reason = state.reason if plate is None or state.attached is None else ""
        results = evaluate("layer", scene, *([] if plate is None else [plate]), reason=reason)
        obliquity = None if plate is None else plate.obliquity
        layers.append(LayerMeasures(scene.name(body), state.state, results, obliquity, state.opening))
    return tuple(layers)


@measures("layer", "perforated")
def layer_perforation(scene: Scene, plate: Plate) -> float:
    """Return whether a layer is perforated: 1 or 0."""
    state = layer_state(scene, plate.body)
    refuse_if(state.state not in (YES, NO), f"{NOT_YET}: {state.reason}" if state.state else state.reason)
    return float(state.state == YES)


@measures("run", "perforated")
def target_perforation(scene: Scene) -> float:
    """Return whether all layers are perforated: 1 or 0."""
    states = [(scene.name(body), layer_state(scene, body)) for body in scene.layers]
    refuse_if(not states, "there is no layer")
    if any(state.state == NO for _, state in states):
        return 0.0
    for name, state in sorted(states, key=lambda pair: pair[1].state != ""):
        refuse_if(state.state != YES, f"{'not yet: ' if state.state else ''}{name}: {state.reason}")
    return 1.0


def perforation_text(layers: Sequence[LayerMeasures], unitless: bool = False) -> str:
    """Return a line that states which layers are perforated, in order along the shot line; empty where undefined."""
    defined = (layer for layer in layers if layer.state or layer.opening)
    return "; ".join(f"{layer.body}: {_layer_text(layer, unitless)}" for layer in defined)


def _layer_text(layer: LayerMeasures, unitless: bool) -> str:
    if layer.opening:
        return "open from the start, without a new path through it"
    time, mass = layer.results["perforation_time"], layer.results.get("spall_mass")
    if layer.state == YES and time.value is not None:
        display = format_of("perforation_time", "s", unitless)
        value, spread = (f"{display.factor * figure:.3g}" for figure in (time.value, time.uncertainty or 0.0))
        return f"perforated at {value} ± {spread} {display.unit}".rstrip()
    if layer.state == YES:
        return "perforated"
    text = f"not perforated{' yet' if layer.state == NOT_YET else ''}"
    if mass is None or not mass.value:  # spall, by which a wall fails as by a hole
        return text
    display = format_of("spall_mass", mass.unit, unitless)
    return f"{text}, {display.factor * mass.value:.2g} {display.unit}".rstrip() + " of spall behind it"


ARRIVAL_DISTANCE = 2.0  # [dx] in front of the struck face, from which on a particle has arrived
LOADED_MASS_SHARE = 0.9  # fraction of the arrived mass within the loaded diameter
LEAST_MASS_SHARE = 1e-4  # share of the projectile's mass that must have arrived


@memoize
def arrived_particles(scene: Scene, plate: Plate) -> np.ndarray:
    """Return the indices of the particles of the projectile and earlier layers that have reached a layer."""
    before = scene.layers[: scene.layers.index(plate.body)]
    flying = [body for body, role in enumerate(scene.shot.roles) if role == PROJECTILE or body in before]
    reach = plate.depth(scene.position) > -ARRIVAL_DISTANCE * scene.spacing
    return np.flatnonzero(np.isin(scene.state.body, flying) & reach)


def is_struck(scene: Scene, plate: Plate) -> bool:
    """Return whether enough mass has reached a layer."""
    return bool(scene.state.fields["mass"][arrived_particles(scene, plate)].sum() > LEAST_MASS_SHARE * scene.shot_mass)


@measures("layer", "impulse", needs=("start",))
def impulse(scene: Scene, plate: Plate) -> float:
    """Return the momentum along its normal that the layer has gained [N s]; of a single one less the outer part."""
    assert scene.start is not None
    outer = outer_momentum(scene, np.array(plate.basis[0])) if len(scene.layers) == 1 else 0.0
    return _momentum(scene.state, plate) - _momentum(scene.start, plate) - outer


@measures("layer", "loaded_diameter")
def loaded_diameter(scene: Scene, plate: Plate) -> float:
    """Return the diameter about the shot line that holds 90 % of the mass that has arrived [m]."""
    refuse_if(not is_struck(scene, plate), "nothing has reached the layer")
    rows = arrived_particles(scene, plate)
    radius = np.sqrt((plate.in_plane(scene.position[rows]) ** 2).sum(axis=1))
    return 2.0 * weighted_quantile(radius, scene.state.fields["mass"][rows], LOADED_MASS_SHARE) + scene.spacing


@measures("layer", "mean_pressure", needs=("start",))
def mean_pressure(scene: Scene, plate: Plate) -> float:
    """Return the pressure that gives the impulse over the loaded area and the time since the first arrival [Pa]."""
    width, timeline = loaded_diameter(scene, plate), scene.timeline
    if timeline is None:
        raise UndefinedMeasureError("a single moment does not contain the time of the first arrival")
    number = scene.layers.index(plate.body)
    first = timeline.first(lambda moment: moment.struck[number])
    arrival = timeline.moment(0).time if first is None else timeline.interval(first)[0]
    refuse_if(not scene.state.time > arrival, "nothing has reached the layer")
    area = 0.25 * np.pi * width**2 if scene.space == 3 else width
    return float(impulse(scene, plate) / (area * (scene.state.time - arrival)))


def _momentum(snapshot: Snapshot, plate: Plate) -> float:
    layer = snapshot.body == plate.body
    velocity = snapshot.fields["velocity"][layer] @ np.array(plate.basis[0])
    return float((snapshot.fields["mass"][layer] * velocity).sum())


class Moment:
    """State of the layers at one snapshot; `scene` returns the scene of the snapshot, which is not kept."""

    def __init__(self, scene: Callable[[], Scene]):
        self.scene = scene
        current = scene()
        self.time = current.state.time
        defined = current.state.dimensions > 1 and current.has_motion
        defined = defined and float(current.state.fields["mass"][current.is_projectile].sum()) > 0.0
        plates = [current.plate(body) if defined else None for body in current.layers]
        self.passed = tuple(plate is not None and is_behind(current, plate) for plate in plates)
        self.struck = tuple(plate is not None and is_struck(current, plate) for plate in plates)
        self._states: dict[int, str] = {}
        self.craters: dict[int, Any] = {}  # of layers, where all moments are measured

    def state(self, body: int) -> str:
        """Return whether a layer is perforated."""
        if body not in self._states:
            self._states[body] = layer_state(self.scene(), body).state
        return self._states[body]

    @cached_property
    def exit(self) -> Outcomes:
        """Velocity, mass fraction of the heaviest fragment and its length, by name of the measure."""
        scene = self.scene()
        mass = scene.state.fields["mass"] * scene.is_projectile
        largest = scene.shot_groups.heaviest
        share = largest.mass / scene.shot_mass
        length = length_of(scene, scene.position[largest.particles, 0])
        broken = f"the projectile's heaviest fragment holds {100.0 * share:.2g} % of its mass"
        return {
            "exit_velocity": float(mass @ scene.state.fields["velocity"][:, 0] / mass.sum()),
            "exit_mass_fraction": share,
            "exit_length": length if share >= LEAST_SHARE else broken,
        }


@dataclass
class Timeline:
    """The snapshots of a run up to a moment, each loaded when it is needed."""

    load: Callable[[int], Scene]  # returns the scene of a snapshot by its number
    count: int  # number of snapshots up to the moment
    known: dict[int, Moment] = field(default_factory=dict)  # moments that have been loaded
    series: bool = False  # whether all moments of the run are measured

    def moment(self, number: int) -> Moment:
        """Return a moment by its number."""
        if number not in self.known:
            self.known[number] = Moment(lambda: self.load(number))
        return self.known[number]

    def first(self, condition: Callable[[Moment], bool]) -> int | None:
        """Return the first moment from which on a condition holds; None where it has always held or never."""
        before, after = 0, self.count - 1
        if self.count < 2 or condition(self.moment(before)) or not condition(self.moment(after)):
            return None
        while after - before > 1:
            middle = (before + after) // 2
            before, after = (before, middle) if condition(self.moment(middle)) else (middle, after)
        return after

    def interval(self, number: int) -> tuple[float, float]:
        """Return the middle of the time between a moment and the one before, and half of it [s]."""
        begin, end = self.moment(number - 1).time, self.moment(number).time
        return 0.5 * (begin + end), 0.5 * (end - begin)


@measures("layer", "perforation_time")
def perforation_time(scene: Scene, plate: Plate) -> Result:
    """Return the time at which a layer was perforated [s], to half the interval of the snapshots."""
    state, timeline = layer_state(scene, plate.body), scene.timeline
    refuse_if(state.state != YES, f"not perforated: {state.reason}" if state.state else state.reason)
    opened = None if timeline is None else timeline.first(lambda moment: moment.state(plate.body) == YES)
    if timeline is None or opened is None:
        raise UndefinedMeasureError("a single moment does not contain the time")
    time, spread = timeline.interval(opened)
    return Result(time, scatter=spread)


@measures("layer", "exit_time", "exit_velocity", "exit_mass_fraction", "exit_length")
def exit_of_the_projectile(scene: Scene, plate: Plate) -> Outcomes:
    """Return the time [s] at which half of the projectile's mass was behind a layer, and its state at that moment."""
    state, timeline = layer_state(scene, plate.body), scene.timeline
    if state.state != YES and not state.opening:
        raise UndefinedMeasureError(f"not perforated: {state.reason}")
    if timeline is None:
        raise UndefinedMeasureError("a single moment does not contain the time")
    number = scene.layers.index(plate.body)
    passed = timeline.first(lambda moment: moment.passed[number])
    if passed is None:
        raise UndefinedMeasureError("half of the projectile's mass is not behind it yet")
    time, spread = timeline.interval(passed)
    return {"exit_time": Result(time, scatter=spread)} | dict(timeline.moment(passed).exit)
