"""A ladder of plates: the thickness, in depths of the crater in a thick one, at which they spall and are perforated.

The crater reaches to the intact metal. Whether failed metal still lines it is accidental: with the lining the same
crater is 5.1 mm deep at seven particles across and 7.5 mm at ten, without it 7.5 mm at both.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from hvisph_validation.quantity import Evaluator, Key, Shot, Value, measure_of

from hvisph.measures.fragments import FEWEST_PARTICLES
from hvisph.sweeps.statistics import bracket
from hvisph.verification.problem import vectors

THICK = "thick"
REAR = 0.5  # of the thickness: failure behind it is spall
AXIS = 2.0  # spacings from the axis within which the bottom of a crater is sought


def _states(shot: Shot) -> tuple[float, bool, bool, bool]:
    """Return thickness [m], and whether the plate has failed inside, lost a spall, was perforated."""
    layer = shot.ran.summary["layers"][0]["measures"]
    start, end = shot.ran.first, shot.ran.last
    plate = start.body == 1
    x = vectors(start, "position")[plate, 0]
    thickness = float(np.ptp(x) + shot.ran.dx)
    rear = start.id[plate][x > x.min() + REAR * thickness]
    at_rear = np.isin(end.id, rear)
    failed = (at_rear & (end.fields["damage"] >= 1.0)).sum() >= FEWEST_PARTICLES
    perforated = (measure_of(layer, "perforated").value or 0.0) > 0.5
    detached = perforated or bool(measure_of(layer, "spall_mass").value)
    return thickness, bool(failed or detached), bool(detached), perforated


def _together(shots: Sequence[Shot]) -> dict[str, dict[Key, Value]]:
    thick = next((shot for shot in shots if shot.name == THICK), None)
    plates = sorted(_states(shot) for shot in shots if shot.name != THICK)
    if thick is None or not plates:
        return {}
    depth = _depth(thick)
    values: dict[Key, Value] = {("crater_depth", None): depth}
    for number, name in enumerate(("onset", "detached_at", "perforated_at"), 1):
        values[name, None] = _threshold(plates, number, depth.value)
    return {"ladder": values}


def _depth(shot: Shot) -> Value:
    """Return the depth of the sound metal below the struck face, on the axis."""
    start, end, dx = shot.ran.first, shot.ran.last, shot.ran.dx
    face = vectors(start, "position")[start.body == 1, 0].min() - 0.5 * dx
    block = vectors(end, "position")[shot.sound(1)]
    bottom = block[block[:, 1] < AXIS * dx, 0]
    if not bottom.size:
        return Value(None, None, "no sound metal is left on the axis")
    return Value(float(bottom.min() - 0.5 * dx - face), dx)


def _threshold(plates: Sequence[tuple[Any, ...]], number: int, depth: float | None) -> Value:
    """Return the thickness below which it happens, over the depth; where plates are mixed the middle of the zone."""
    limits = bracket([-plate[0] for plate in plates], [plate[number] for plate in plates])
    if not depth or limits.below is None or limits.above is None:
        return Value(None, None, "no plate" if limits.above is None else "every plate")
    return Value(-0.5 * (limits.below + limits.above) / depth, 0.5 * abs(limits.above - limits.below) / depth)


def _curves(shots: Sequence[Shot]) -> dict[str, Any]:
    return {"plates": [list(_states(shot)) for shot in shots if shot.name != THICK]}


EVALUATOR = Evaluator(
    {"onset": "thickness over crater depth, onset", "detached_at": "the same, detached",
     "perforated_at": "the same, perforated", "crater_depth": "crater depth, thick plate"},
    together=_together, curves=_curves,
)  # fmt: skip
