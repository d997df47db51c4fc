"""What earlier moments tell of the layers: when each was perforated, and how the projectile was as it passed.

Both are found by halving among the snapshots. A layer is passed at the first of them in which half of the projectile's
mass is behind the layer's rear face.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hvisph.core.measure_catalogue import LAYER_CATALOGUE
from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.lengths import length_of
from hvisph.measures.result import Result, meaningless
from hvisph.measures.target.impulse import is_struck, mean_pressure
from hvisph.measures.target.perforation import YES, is_behind
from hvisph.measures.target.targets import LayerMeasures, state_of

HALF = 0.5  # share of the mass below which the largest piece does not stand for the projectile
PASSAGE = ("passage_time", "passage_velocity", "passage_largest_share", "passage_length")


@dataclass(frozen=True)
class Moment:
    """One moment as far as it tells of the layers.

    Parameters
    ----------
    time
        [s].
    passed
        Whether half of the projectile's mass is behind each layer, in the order along the shot line.
    struck
        Whether what flies at each of them has reached it.
    state
        Whether a layer, by its number, is perforated: found when it is asked for, since that takes long.
    projectile
        By name of `PASSAGE`, without the time, likewise.
    """

    time: float
    passed: tuple[bool, ...] = ()
    struck: tuple[bool, ...] = ()
    state: Callable[[int], str] = field(default=lambda _: "", compare=False)
    projectile: Callable[[], dict[str, Result]] = field(default=dict, compare=False)


def moment_of(scene: Scene, again: Callable[[], Scene] | None = None) -> Moment:
    """Return what a moment tells.

    Parameters
    ----------
    scene
        The moment.
    again
        Makes it anew for what takes long, so that it need not be held; held unless given.
    """
    time, count = scene.now.time, len(scene.layers)
    plates = [scene.plate(body) for body in scene.layers]
    known = scene.now.dimensions > 1 and {"velocity", "mass"} <= scene.now.fields.keys()
    mass = scene.now.fields["mass"] * scene.is_projectile if known else np.zeros(1)
    anew = again or (lambda: scene)
    if not mass.sum() > 0.0:
        return Moment(time, (False,) * count, (False,) * count, lambda number: state_of(anew(), number))
    passed = tuple(plate is not None and is_behind(scene, plate) for plate in plates)
    struck = tuple(plate is not None and is_struck(scene, plate) for plate in plates)
    return Moment(time, passed, struck, lambda number: state_of(anew(), number), lambda: _projectile(anew()))


def with_history(layers: Sequence[LayerMeasures], count: int, moment: Callable[[int], Moment]
                 ) -> tuple[LayerMeasures, ...]:  # fmt: skip
    """Return the layers with the times at which they were perforated, and the projectile at its passages.

    Parameters
    ----------
    layers
        Measured at the last of the snapshots.
    count
        Number of snapshots up to it.
    moment
        What the snapshot of an index tells.
    """
    known: dict[int, Moment] = {}

    def at(index: int) -> Moment:
        if index not in known:
            known[index] = moment(index)
        return known[index]

    def last(number: int) -> Callable[[int], bool]:
        return lambda index: index == count - 1 or at(index).state(number) == YES

    timed = []
    for number, layer in enumerate(layers):
        results = dict(layer.results)
        opened = _first(count, last(number)) if layer.state == YES else None
        if opened is not None:
            results["perforation_time"] = _between(at(opened - 1).time, at(opened).time)
        if layer.state == YES or layer.opening:
            passed = _first(count, lambda index, number=number: at(index).passed[number])  # type: ignore[misc]
            if passed is not None:
                results |= at(passed).projectile()
                results["passage_time"] = _between(at(passed - 1).time, at(passed).time)
            elif count > 1:
                reason = "half of the projectile's mass is not behind it yet"
                results |= {name: meaningless(results[name].unit, reason) for name in PASSAGE}
        if count > 1 and results["struck_diameter"].value is not None:
            first = _first(count, lambda index, number=number: at(index).struck[number])  # type: ignore[misc]
            since = at(0).time if first is None else 0.5 * (at(first - 1).time + at(first).time)
            impulse = results["impulse"]
            results["mean_pressure"] = mean_pressure(impulse, results["struck_diameter"],
                                                     at(count - 1).time - since, impulse.unit)  # fmt: skip
        timed.append(replace(layer, results={name: results[name] for name in LAYER_CATALOGUE}))
    return tuple(timed)


def _first(count: int, holds: Callable[[int], bool]) -> int | None:
    """Return the first index for which something holds that holds from then on; None where it has always or never."""
    before, after = 0, count - 1
    if count < 2 or holds(before) or not holds(after):
        return None
    while after - before > 1:
        middle = (before + after) // 2
        before, after = (before, middle) if holds(middle) else (middle, after)
    return after


def _between(early: float, late: float) -> Result:
    return Result(0.5 * (early + late), "s", 0.5 * (late - early))


def _projectile(scene: Scene) -> dict[str, Result]:
    mass = scene.now.fields["mass"] * scene.is_projectile
    largest = scene.shot_groups.heaviest
    share = largest.mass / (scene.shot_mass or float(mass.sum()))
    axial = scene.now.fields["velocity"][:, 0]
    length = length_of(scene, scene.position[largest.particles, 0])
    broken = f"the projectile's largest piece holds {100.0 * share:.2g} % of its mass"
    state = {
        "passage_velocity": Result(float(mass @ axial / mass.sum()), "m/s"),
        "passage_largest_share": Result(share, ""),
        "passage_length": Result(length, "m", scene.spacing, spacing=scene.spacing, support=scene.support)
        if share >= HALF else meaningless("m", broken),
    }  # fmt: skip
    return {name: result.finite() for name, result in state.items()}
