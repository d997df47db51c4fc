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
    own = end.body == 1
    sound = np.flatnonzero(own & (end.fields["damage"] < FAILED))
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
    found = {
        "largest_fragment": float(pieces.max() / mass[own].sum()),
        "largest_speed": float(speeds[largest]),
        "largest_place": float(np.linalg.norm(first[rows].mean(axis=0) - centre)) / radius,
    }
    many = np.bincount(label) >= FEWEST
    if many.sum() > 2:
        found["speed_power"] = float(np.polyfit(np.log(pieces[many]), np.log(speeds[many]), 1)[0])
    return found


def _together(shots: Sequence[Shot]) -> dict[str, dict[Key, Value]]:
    found = [_fragments(shot) for shot in shots]
    values: dict[Key, Value] = {}
    for name in QUANTITIES:
        known = np.array([values_of_shot[name] for values_of_shot in found if name in values_of_shot])
        if len(known):
            error = float(known.std(ddof=1) / np.sqrt(len(known))) if len(known) > 1 else None
            values[name, None] = Value(float(known.mean()), error)
    return {"basalt": values} if shots else {}


def _curves(shots: Sequence[Shot]) -> dict[str, Any]:
    return {shot.name: _fragments(shot) for shot in shots}


QUANTITIES = {
    "largest_fragment": "largest fragment over target",
    "largest_speed": "its speed",
    "speed_power": "power of speed over mass of fragments",
}
EVALUATOR = Evaluator(QUANTITIES, together=_together, curves=_curves)
