"""Temperatures of projectile and target."""

from __future__ import annotations

import numpy as np

from hvisph.measures.frame.measurement_frame import Scene

from .registry import Outcome, Outcomes, measures
from .result import UndefinedMeasureError, weighted_quantile

MOST = 0.999  # mass fraction that does not exceed the maximum


@measures("run", "projectile_temperature", "target_temperature", "temperature_max")
def temperatures(scene: Scene) -> Outcomes:
    """Return mass-mean temperatures of the projectile and of all layers, and the maximum of both [K]."""
    fields = scene.now.fields
    if not {"temperature", "mass"} <= fields.keys():
        raise UndefinedMeasureError("no material has a heat capacity")
    layers = np.isin(scene.now.body, scene.layers)

    def value(rows: np.ndarray, maximum: bool = False) -> Outcome:
        known = rows & np.isfinite(fields["temperature"])
        if not known.any():
            return "its material has no heat capacity" if rows.any() else "there is no layer"
        own, weights = fields["temperature"][known], fields["mass"][known]
        return weighted_quantile(own, weights, MOST) if maximum else float(np.average(own, weights=weights))

    return {"projectile_temperature": value(scene.is_projectile), "target_temperature": value(layers),
            "temperature_max": value(scene.is_projectile | layers, maximum=True)}  # fmt: skip
