"""The answer in one line: which layers are perforated."""

from __future__ import annotations

from collections.abc import Sequence

from hvisph.core.measure_catalogue import look_of
from hvisph.measures.target.perforation import NOT_YET, YES
from hvisph.measures.target.targets import LayerMeasures


def answer(layers: Sequence[LayerMeasures], unitless: bool = False) -> str:
    """Return which layers are perforated, in the order along the shot line; empty where that has no meaning."""
    return "; ".join(_one(layer, unitless) for layer in layers if layer.state or layer.opening)


def _one(layer: LayerMeasures, unitless: bool) -> str:
    if layer.opening:
        return f"{layer.body}: open from the start, without a new way through"
    if layer.state == NOT_YET:
        return f"{layer.body}: not perforated yet"
    if layer.state != YES:
        return f"{layer.body}: not perforated"
    time = layer.results["perforation_time"]
    if time.value is None:
        return f"{layer.body}: perforated"
    look = look_of("perforation_time", "s", unitless)
    value, spread = (f"{look.factor * figure:.3g}" for figure in (time.value, time.uncertainty or 0.0))
    return f"{layer.body}: perforated at {value} ± {spread} {look.unit}".rstrip()
