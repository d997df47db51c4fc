"""Brittle targets broken by a sphere: the largest fragment and the speeds of all, as means over random seeds.

Fragments are particles of the target that have not failed, linked at 2 dx. The place of the largest tells its kind: a
core is left about the centre of the target, a shell behind it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from hvisph_validation.quantity import Evaluator, Key, Shot, Value

from hvisph.measures.fragments import connected_groups
from hvisph.verification.problem import vectors

FAILED = 1.0  # damage at which a particle belongs to no fragment
FEWEST = 5  # particles of a fragment whose speed counts


def _fragments(shot: Shot) -> dict[str, float]:
    """Return share, speed [m/s] and place of the largest fragment, and the power p of speed ~ mass^p over all.

    The speed is that in the laboratory, as a film shows it; the place is the distance of its centre at the start from
    the centre of the target, over the radius.
    """
    end, start = shot.ran.last, shot.ran.first
    of_target = end.body == 1
    sound = np.flatnonzero(of_target & (end.fields["damage"] < FAILED))
    if not len(sound):
        return {"largest_fragment": 0.0}
    position, velocity, mass = vectors(end, "position"), vectors(end, "velocity"), end.fields["mass"]
    label = connected_groups(position[sound], shot.ran.dx)
    pieces = np.bincount(label, weights=mass[sound])
    momenta = np.array([np.bincount(label, weights=mass[sound] * component) for component in velocity[sound].T])
    speeds, largest = np.linalg.norm(momenta / pieces, axis=0), int(pieces.argmax())
    before = np.argsort(start.id)
    rows = before[np.searchsorted(start.id[before], end.id[sound[label == largest]])]
    target, first = start.body == 1, vectors(start, "position")
    centre = np.average(first[target], axis=0, weights=start.fields["mass"][target])
    radius = float(np.linalg.norm(first[target] - centre, axis=1).max())
    values = {
        "largest_fragment": float(pieces.max() / mass[of_target].sum()),
        "largest_speed": float(speeds[largest]),
        "largest_place": float(np.linalg.norm(first[rows].mean(axis=0) - centre)) / radius,
    }
    large = np.bincount(label) >= FEWEST
    if large.sum() > 2:
        values["speed_power"] = float(np.polyfit(np.log(pieces[large]), np.log(speeds[large]), 1)[0])
    return values


def _together(shots: Sequence[Shot]) -> dict[str, dict[Key, Value]]:
    fragments = [_fragments(shot) for shot in shots]
    values: dict[Key, Value] = {}
    for name in QUANTITIES:
        numbers = np.array([values_of_shot[name] for values_of_shot in fragments if name in values_of_shot])
        if len(numbers):
            error = float(numbers.std(ddof=1) / np.sqrt(len(numbers))) if len(numbers) > 1 else None
            values[name, None] = Value(float(numbers.mean()), error)
    return {"basalt": values} if shots else {}


def _curves(shots: Sequence[Shot]) -> dict[str, Any]:
    return {shot.name: _fragments(shot) for shot in shots}


QUANTITIES = {
    "largest_fragment": "largest fragment over target",
    "largest_speed": "its speed",
    "speed_power": "power of speed over mass of fragments",
}
EVALUATOR = Evaluator(QUANTITIES, together=_together, curves=_curves)
