"""Bars against a rigid wall, the plane x = 0: length, foot, outline.

The surface is that of the outermost rings at the start, half a spacing outside their centres; lengths reach half a
spacing beyond the last ring. A bar is its largest piece of sound metal: what has failed creeps off along the wall, and
nobody would have measured it. What moved by less than the scatter of a diameter (1 %) counts as undeformed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from hvisph_validation.experiments import GROUP
from hvisph_validation.quantity import Evaluator, Key, Shot, Value

from hvisph.verification.problem import vectors

UNDEFORMED = 0.01  # of the diameter: what a micrometer on a turned bar tells


def outline(shot: Shot) -> tuple[np.ndarray, np.ndarray]:
    """Return distance from the wall and radius of the surface at the end, in the order of the distance [m]."""
    start, end = shot.ran.first, shot.ran.last
    first, last = vectors(start, "position"), vectors(end, "position")
    half = 0.5 * shot.ran.dx
    outer = start.id[first[:, 1] > first[:, 1].max() - half]
    sound = shot.sound(0)
    surface = last[sound[np.isin(end.id[sound], outer)]]
    order = np.argsort(surface[:, 0])
    return surface[order, 0], surface[order, 1] + half


def _each(shot: Shot) -> dict[Key, Value]:
    dx = shot.ran.dx
    z, r = outline(shot)
    first, last = vectors(shot.ran.first, "position"), vectors(shot.ran.last, "position")
    length, start = last[shot.sound(0), 0].max() + 0.5 * dx, first[:, 0].max() + 0.5 * dx
    radius = first[:, 1].max() + 0.5 * dx
    foot = float(r[z < max(dx, z[0] + 0.5 * dx)].max())
    deformed = z[r > radius * (1.0 + UNDEFORMED)]
    values: dict[Key, Value] = {
        ("length_ratio", None): Value(float(length / start), 0.5 * dx / start),
        ("final_length", None): Value(float(length), 0.5 * dx),
        ("foot_diameter", None): Value(2.0 * foot, dx),
        ("foot_radius", None): Value(foot, 0.5 * dx),
        ("diameter_at_fifth", None): Value(2.0 * float(np.interp(0.2 * start, z, r)), dx),
        ("rear_length", None): Value(float(length - deformed.max()) if len(deformed) else float(length), dx),
    }
    for entry in shot.measured:
        if entry.quantity == "outline" and entry.at is not None:
            place = 1e-3 * entry.at
            values["outline", entry.at] = Value(foot if place == 0.0 else float(np.interp(place, z, r)), 0.5 * dx)
    return values


def _curves(shots: Sequence[Shot]) -> dict[str, Any]:
    """Return the groups of the shots, and the outlines of those whose outline was measured [mm]."""
    outlined = [shot for shot in shots if any(entry.quantity == "outline" for entry in shot.measured)]
    return {
        "groups": {shot.name: str(shot.values[GROUP]) for shot in shots if GROUP in shot.values},
        "outlines": {shot.name: [[1e3 * float(x) for x in point] for point in zip(*outline(shot), strict=True)]
                     for shot in outlined},
    }  # fmt: skip


EVALUATOR = Evaluator(
    {
        "length_ratio": "final length over initial",
        "final_length": "final length",
        "foot_diameter": "foot diameter",
        "foot_radius": "foot radius",
        "diameter_at_fifth": "diameter at 0.2 L0",
        "rear_length": "undeformed length",
        "outline": "outline",
    },
    _each,
    curves=_curves,
)
