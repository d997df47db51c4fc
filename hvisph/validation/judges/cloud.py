"""A sphere through a plate: the hole, and the shape of the cloud behind it."""

from __future__ import annotations

from hvisph.validation.value import Judge, Key, Shot, Value, measure_of


def _each(shot: Shot) -> dict[Key, Value]:
    layer = shot.ran.summary["layers"][0]["measures"]
    cloud = shot.ran.summary["cloud"]["measures"]
    length, width = measure_of(cloud, "cloud_length"), measure_of(cloud, "cloud_width")
    found: dict[Key, Value] = {
        ("hole_diameter", None): measure_of(layer, "hole_diameter"),
        ("hole_diameter_clear", None): measure_of(layer, "hole_diameter_clear"),
    }
    if length.value is None or not width.value:
        found["cloud_ratio", None] = Value(None, None, length.reason or width.reason)
    else:
        found["cloud_ratio", None] = Value(length.value / width.value)
    return found


JUDGE = Judge(
    {
        "hole_diameter": "hole in the plate",
        "hole_diameter_clear": "hole, lip to lip",
        "cloud_ratio": "cloud, length over width",
    },
    _each,
)
