"""Craters in rock and peak pressures of a strengthless sphere, or of a cylinder with a flat face, on its like.

Peak pressures are medians of the target's particles within three tenths of the sphere's radius R of the place of
contact, and for spheres the power n with which they fall with the distance along the shot line between 1.5 and 3 R.
"""

from __future__ import annotations

import numpy as np
from hvisph_validation.quantity import Evaluator, Key, Shot, Value, measure_of

from hvisph.verification.problem import vectors

CONTACT = 0.3  # radii within which the contact is flat
NEAR, FAR = 1.5, 3.0  # radii between which the power is fitted
ASIDE = 0.5  # radii about the shot line


def _each(shot: Shot) -> dict[Key, Value]:
    if shot.name.startswith(("al", "flat")):
        return _pressures(shot)
    results = shot.ran.summary["layers"][0]["measures"]
    names = {"depth": "crater_depth", "diameter": "crater_outer_diameter", "volume": "crater_volume"}
    return {(name, None): measure_of(results[measure]["variants"], "emptied") for name, measure in names.items()}


def _pressures(shot: Shot) -> dict[Key, Value]:
    first, last = shot.ran.first, shot.ran.last
    radius = 0.5 * shot.ran.case.bodies["projectile"].shape.diameter
    target = first.body == 1
    place = vectors(first, "position")[target][np.argsort(first.id[target])]
    rows = np.flatnonzero(last.body == 1)
    rows = rows[np.argsort(last.id[rows])]
    peak = last.fields["peak_pressure"][rows]
    place = place[np.isin(np.sort(first.id[target]), last.id[rows])]
    distance = np.sqrt((place**2).sum(axis=1))
    contact = distance < CONTACT * radius
    value = {("contact", None): Value(float(np.median(peak[contact])))}
    if shot.name.startswith("flat"):
        return value
    on_axis = (distance > NEAR * radius) & (distance < FAR * radius) & (np.abs(place[:, 1]) < ASIDE * radius)
    power, _ = np.polyfit(np.log(distance[on_axis]), np.log(peak[on_axis]), 1)
    return value | {("power", None): Value(-float(power))}


EVALUATOR = Evaluator(
    {"depth": "crater depth", "diameter": "crater diameter", "volume": "crater volume", "contact": "contact pressure",
     "power": "power of the pressure over distance"},
    _each,
)  # fmt: skip
