"""A sphere through a plate: the hole, and the shape of the cloud behind it.

The crater's rim diameter is the mean of the hole without lips and the diameter from lip to lip, as the paper gives it.
"""

from __future__ import annotations

from hvisph_validation.quantity import Evaluator, Key, Shot, Value, measure_of


def _each(shot: Shot) -> dict[Key, Value]:
    layer = shot.ran.summary["layers"][0]["measures"]
    cloud = shot.ran.summary["cloud"]["measures"]
    length, width = measure_of(cloud, "cloud_length"), measure_of(cloud, "cloud_width")
    values: dict[Key, Value] = {
        ("hole_diameter", None): measure_of(layer, "hole_diameter"),
        ("lip_to_lip", None): measure_of(shot.ran.summary["measures"], "crater_lip_diameter"),
    }
    hole, lips = values["hole_diameter", None], values["lip_to_lip", None]
    if hole.value is not None and lips.value is not None:
        values["crater_rim_diameter", None] = Value(0.5 * (hole.value + lips.value), hole.uncertainty)
    if length.value is None or not width.value:
        values["cloud_ratio", None] = Value(None, None, length.reason or width.reason)
    else:
        values["cloud_ratio", None] = Value(length.value / width.value)
    return values


EVALUATOR = Evaluator(
    {
        "crater_rim_diameter": "crater",
        "hole_diameter": "hole without lips",
        "lip_to_lip": "hole, lip to lip",
        "cloud_ratio": "cloud, length over width",
    },
    _each,
)
