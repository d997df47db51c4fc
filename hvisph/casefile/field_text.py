"""Text of allowed and default values of a field."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from hvisph.case.dimensions import NUMBER

from .model_fields import Spot, spot_of

_FORMS = {"string": "text", "number": "number", "object": "block"}
DERIVED = {
    "arrangement": "by dimensions",
    "velocity": "at rest",
    "measures": "all that apply",
}


def value_text(spot: Spot) -> str:
    """Describe the allowed values at `spot`."""
    if spot.info is not None and spot.info.annotation in (bool, bool | None):
        return "`true` \\| `false`"
    if spot.quantity is not None:
        dimension = spot.quantity.dimension
        kind = "number" if dimension is NUMBER else dimension.name.split(" ", 1)[1]
        unit = f" [{dimension.unit}]" if dimension.unit else ""
        limits = spot.quantity.range_text()
        return f"{kind}{unit}{', ' + limits if limits else ''}"
    if spot.choices and spot.item is None:
        return " \\| ".join(f"`{choice}`" for choice in spot.choices)
    if spot.tagged:
        return "block, `type`: " + " \\| ".join(f"`{name}`" for name in spot.models)
    if spot.models:
        return " or ".join([*(_FORMS[form] for form in spot.short), "block"])
    if spot.item is not None:
        kind = "named entries, each: " if spot.named else "list of: "
        return kind + value_text(spot_of(spot.item))
    return "whole number" if spot.integer else "text"


def default_text(name: str, info: FieldInfo) -> str:
    """Return the default of the field `name` in words."""
    if info.is_required():
        return "required"
    default: Any = info.default
    if name in DERIVED:
        return DERIVED[name]
    if default is PydanticUndefined or default is None or default == ():
        return "none"
    if isinstance(default, BaseModel):
        kind = getattr(default, "type", None)
        return f"`{kind}`" if kind else "see below"
    if isinstance(default, tuple):
        return "[" + ", ".join(_scalar(item) for item in default) + "]"
    return f"`{_scalar(default)}`" if default != "" else "empty"


def _scalar(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)
