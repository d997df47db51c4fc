"""A ladder of plates: the thickness, in depths of the crater in a thick one, at which they spall and are perforated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hvisph.validation.value import Judge, Key, Shot, Value, measure_of
from hvisph.verification.ran import vectors

THICK = "thick"
REAR = 0.5  # of the thickness: failure behind it is spall
FEWEST = 0.002  # of the plate's mass: less is a few particles


def _states(shot: Shot) -> tuple[float, bool, bool, bool]:
    """Return thickness [m], and whether the plate has failed inside, lost a spall, was perforated."""
    layer = shot.ran.summary["layers"][0]["measures"]
    start, end = shot.ran.first, shot.ran.last
    own = start.body == 1
    x = vectors(start, "position")[own, 0]
    thickness = float(np.ptp(x) + shot.ran.dx)
    rear = start.id[own][x > x.min() + REAR * thickness]
    there = np.isin(end.id, rear)
    mass = end.fields["mass"]
    failed = mass[there & (end.fields["damage"] >= 1.0)].sum() > FEWEST * mass[end.body == 1].sum()
    perforated = (measure_of(layer, "perforated").value or 0.0) > 0.5
    detached = perforated or (measure_of(layer, "spall_mass").value or 0.0) > FEWEST * mass[end.body == 1].sum()
    return thickness, bool(failed or detached), bool(detached), perforated


def _together(shots: Sequence[Shot]) -> dict[str, dict[Key, Value]]:
    thick = next((shot for shot in shots if shot.name == THICK), None)
    plates = sorted(_states(shot) for shot in shots if shot.name != THICK)
    if thick is None or not plates:
        return {}
    depth = measure_of(thick.ran.summary["layers"][0]["measures"], "crater_depth")
    values: dict[Key, Value] = {("crater_depth", None): depth}
    for number, name in enumerate(("onset", "detached_at", "perforated_at"), 1):
        values[name, None] = _threshold(plates, number, depth.value)
    return {"ladder": values}


def _threshold(plates: Sequence[tuple[Any, ...]], number: int, depth: float | None) -> Value:
    thick = [one[0] for one in plates if one[number]]
    thin = [one[0] for one in plates if not one[number]]
    if not depth or not thick or not thin:
        return Value(None, None, "no plate" if not thick else "every plate")
    low, high = max(thick), min((t for t in thin if t > max(thick)), default=None)
    if high is None:
        return Value(None, None, "every plate up to the thickest")
    return Value(0.5 * (low + high) / depth, 0.5 * (high - low) / depth)


def _curves(shots: Sequence[Shot]) -> dict[str, Any]:
    return {"plates": [list(_states(shot)) for shot in shots if shot.name != THICK]}


JUDGE = Judge(
    {"onset": "thickness over crater depth, onset", "detached_at": "the same, detached",
     "perforated_at": "the same, perforated", "crater_depth": "crater depth, thick plate"},
    together=_together, curves=_curves,
)  # fmt: skip
