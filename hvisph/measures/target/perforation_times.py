"""Times of perforation and exit, by bisection among the snapshots of a run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.frame.target_geometry import Plate
from hvisph.measures.projectile.lengths import length_of
from hvisph.measures.projectile.residual_projectile import HALF
from hvisph.measures.registry import Outcomes, measures
from hvisph.measures.result import Result, UndefinedMeasureError

from .perforation import YES, is_behind, layer_state
from .targets import is_struck


class Moment:
    """State of the layers at one snapshot; `scene` returns the scene of the snapshot, which is not kept."""

    def __init__(self, scene: Callable[[], Scene]):
        self.scene = scene
        now = scene()
        self.time = now.now.time
        known = now.now.dimensions > 1 and {"velocity", "mass"} <= now.now.fields.keys()
        known = known and float(now.now.fields["mass"][now.is_projectile].sum()) > 0.0
        plates = [now.plate(body) if known else None for body in now.layers]
        self.passed = tuple(plate is not None and is_behind(now, plate) for plate in plates)
        self.struck = tuple(plate is not None and is_struck(now, plate) for plate in plates)
        self._states: dict[int, str] = {}

    def state(self, body: int) -> str:
        """Return whether a layer is perforated."""
        if body not in self._states:
            self._states[body] = layer_state(self.scene(), body).state
        return self._states[body]

    @cached_property
    def exit(self) -> Outcomes:
        """Velocity, mass fraction of the heaviest fragment and its length, by name of the measure."""
        scene = self.scene()
        mass = scene.now.fields["mass"] * scene.is_projectile
        largest = scene.shot_groups.heaviest
        share = largest.mass / scene.shot_mass
        length = length_of(scene, scene.position[largest.particles, 0])
        broken = f"the projectile's heaviest fragment holds {100.0 * share:.2g} % of its mass"
        return {
            "exit_velocity": float(mass @ scene.now.fields["velocity"][:, 0] / mass.sum()),
            "exit_mass_fraction": share,
            "exit_length": length if share >= HALF else broken,
        }


@dataclass
class Timeline:
    """The snapshots of a run up to a moment, each loaded when it is needed.

    Parameters
    ----------
    load
        Returns the scene of a snapshot by its number.
    count
        Number of snapshots up to the moment.
    known
        Those that have been loaded.
    series
        Whether all moments of the run are measured.
    """

    load: Callable[[int], Scene]
    count: int
    known: dict[int, Moment] = field(default_factory=dict)
    series: bool = False

    def moment(self, number: int) -> Moment:
        """Return a moment by its number."""
        if number not in self.known:
            self.known[number] = Moment(lambda: self.load(number))
        return self.known[number]

    def first(self, holds: Callable[[Moment], bool]) -> int | None:
        """Return the first moment from which on a condition holds; None where it has always held or never."""
        before, after = 0, self.count - 1
        if self.count < 2 or holds(self.moment(before)) or not holds(self.moment(after)):
            return None
        while after - before > 1:
            middle = (before + after) // 2
            before, after = (before, middle) if holds(self.moment(middle)) else (middle, after)
        return after

    def interval(self, number: int) -> tuple[float, float]:
        """Return the middle of the time between a moment and the one before, and half of it [s]."""
        early, late = self.moment(number - 1).time, self.moment(number).time
        return 0.5 * (early + late), 0.5 * (late - early)


@measures("layer", "perforation_time")
def perforation_time(scene: Scene, plate: Plate) -> Result:
    """Return the time at which a layer was perforated [s], as sharp as the snapshots are dense."""
    found, timeline = layer_state(scene, plate.body), scene.timeline
    if found.state != YES:
        raise UndefinedMeasureError(f"not perforated: {found.reason}" if found.state else found.reason)
    opened = None if timeline is None else timeline.first(lambda moment: moment.state(plate.body) == YES)
    if timeline is None or opened is None:
        raise UndefinedMeasureError("a single moment does not contain the time")
    time, spread = timeline.interval(opened)
    return Result(time, scatter=spread)


@measures("layer", "exit_time", "exit_velocity", "exit_mass_fraction", "exit_length")
def exit_of_the_projectile(scene: Scene, plate: Plate) -> Outcomes:
    """Return the time [s] at which half of the projectile's mass was behind a layer, and its state at that moment."""
    found, timeline = layer_state(scene, plate.body), scene.timeline
    if found.state != YES and not found.opening:
        raise UndefinedMeasureError(f"not perforated: {found.reason}")
    if timeline is None:
        raise UndefinedMeasureError("a single moment does not contain the time")
    number = scene.layers.index(plate.body)
    passed = timeline.first(lambda moment: moment.passed[number])
    if passed is None:
        raise UndefinedMeasureError("half of the projectile's mass is not behind it yet")
    time, spread = timeline.interval(passed)
    return {"exit_time": Result(time, scatter=spread)} | dict(timeline.moment(passed).exit)
