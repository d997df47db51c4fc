"""How hot projectile and target are: mass means, and what all but a thousandth of the mass stay below."""

from __future__ import annotations

import numpy as np

from hvisph.measures.frame.measurement_frame import Scene

from .result import Result, meaningless
from .statistics import weighted_quantile

MOST = 0.999  # share of the mass, so that no single particle decides
NAMES = ("projectile_temperature", "target_temperature", "highest_temperature")


def temperatures(scene: Scene) -> dict[str, Result]:
    """Return mean temperatures [K] of the projectile and of all layers, and the highest of both."""
    fields = scene.now.fields
    if not {"temperature", "mass"} <= fields.keys():
        return {name: meaningless("K", "no material has a heat capacity") for name in NAMES}
    layers = np.isin(scene.now.body, scene.layers)
    chosen = (scene.is_projectile, layers, scene.is_projectile | layers)
    return {name: _of(fields["temperature"], fields["mass"], rows, name == NAMES[2])
            for name, rows in zip(NAMES, chosen, strict=True)}  # fmt: skip


def _of(temperature: np.ndarray, mass: np.ndarray, rows: np.ndarray, highest: bool) -> Result:
    known = rows & np.isfinite(temperature)
    if not known.any():
        return meaningless("K", "its material has no heat capacity" if rows.any() else "there is no layer")
    own, weights = temperature[known], mass[known]
    if highest:
        return Result(weighted_quantile(own, weights, MOST), "K")
    return Result(float(np.average(own, weights=weights)), "K")
