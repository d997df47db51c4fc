"""Craters in thick targets."""

from __future__ import annotations

from hvisph_validation.quantity import Evaluator, Key, Shot, Value, measure_of


def _each(shot: Shot) -> dict[Key, Value]:
    layer = shot.ran.summary["layers"][0]["measures"]
    return {(name, None): measure_of(layer, name) for name in ("crater_depth", "crater_outer_diameter")}


EVALUATOR = Evaluator({"crater_depth": "crater depth", "crater_outer_diameter": "crater diameter"}, _each)
