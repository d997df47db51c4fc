"""Texts of `hvisph help` on the keys of the case file, from the models; `tools/case_schema.py` makes pages of them."""

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from hvisph.case.case import Case
from hvisph.case.units import NUMBER
from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.core.measure_catalogue import CATALOGUE

from .model_fields import Spot, keys_of, spot_of, walk
from .spellings import renamed_key


def explain(path: str) -> str:
    """Describe the allowed values at a dotted path of the case file.

    `path`: such as ``time.cfl``, ``bodies.target.shape`` or ``bodies.shape`` for that of any body,
        ``bodies.shape.disc`` for one of its types; a body or a list entry may have any name, and
        ``formulation.viscosity`` is looked up in every alternative that has it.
    Raises `CaseError` if nothing can stand there; names the nearest key.
    """
    keys = _insert_body_name([key for key in path.split(".") if key])
    for depth, key in enumerate(keys):
        if walk(Case, keys[: depth + 1]) is None:
            above = walk(Case, keys[:depth])
            if above is not None and key in above.models:  # `eos.jwl`, `formulation.riemann.variant`
                tail = keys[depth + 1 :]
                return explain(".".join([*keys[:depth], *tail])) if tail else _of_type(keys, above.models[key])
            allowed = keys_of(above) if above else []
            renamed = renamed_key(tuple(keys[: depth + 1]), allowed)
            raise CaseError(renamed or f"unknown key{suggest_nearest(key, allowed)}", where=".".join(keys[: depth + 1]))
    spot = walk(Case, keys)
    lines = [".".join(keys) or "case", *_spot_lines(keys[-1] if keys else "", spot)] if spot else []
    if len(keys) == 2 and keys[0] == "measures" and keys[1] in CATALOGUE:
        measure = CATALOGUE[keys[1]]
        lines.append(f"  {measure.meaning}{f' [{measure.unit}]' if measure.unit else ''}")
    return "\n".join(lines)


def _of_type(keys: list[str], model: type[BaseModel]) -> str:
    lines = [f"{'.'.join(keys[:-1])}: {{type: {keys[-1]}}}", f"  {(model.__doc__ or '').strip().splitlines()[0]}"]
    for name, info in model.model_fields.items():
        if name != "type":
            default = "required" if info.is_required() else f"default: {default_text(name, info).replace('`', '')}"
            lines.append(f"  {name}: {info.description or ''} ({default})".replace("`", ""))
    return "\n".join(lines)


def _insert_body_name(keys: list[str]) -> list[str]:
    """Return a path with NAME where the name of a body was left out, as in ``bodies.shape``."""
    for depth in range(1, len(keys)):
        spot = walk(Case, keys[:depth])
        if spot is None or not spot.named or spot.item is None:
            continue
        longer = [*keys[:depth], "NAME", *keys[depth:]]
        if keys[depth] in keys_of(spot_of(spot.item)) and walk(Case, longer) is not None:
            return longer
    return keys


def _spot_lines(name: str, spot: Spot) -> list[str]:
    lines = []
    if spot.info is not None:
        lines.append(f"  {spot.info.description}")
        lines.append(f"  value: {value_text(spot).replace(chr(92), '').replace('`', '')}")
        lines.append(f"  default: {default_text(name, spot.info).replace('`', '')}")
    for tag, model in spot.models.items():
        summary = (model.__doc__ or "").strip().splitlines()[0]
        lines.append(f"  {tag}: {summary}" if tag else f"  {summary}")
        lines.append(f"    keys: {', '.join(key for key in model.model_fields if key != 'type') or 'none'}")
    return lines


_FORMS = {"string": "text", "number": "number", "object": "block", "array": "list", "boolean": "`true`, `false`"}
DERIVED = {"arrangement": "by dimensions", "cfl": "by formulation", "velocity": "at rest", "measures": "all that apply"}


def value_text(spot: Spot) -> str:
    """Describe the allowed values at `spot`."""
    if spot.info is not None and spot.info.annotation in (bool, bool | None):
        return "`true` \\| `false`"
    if spot.quantity is not None:
        dimension = spot.quantity.dimension
        noun = "number" if dimension is NUMBER else dimension.name.split(" ", 1)[1]
        unit = f" [{dimension.unit}]" if dimension.unit else ""
        limits = spot.quantity.range_text()
        return f"{noun}{unit}{', ' + limits if limits else ''}"
    if spot.choices and spot.item is None:
        return " \\| ".join(f"`{choice}`" for choice in spot.choices)
    if spot.tagged:
        return "block, `type`: " + " \\| ".join(f"`{name}`" for name in spot.models)
    if spot.models:
        return " or ".join([*(_FORMS[form] for form in spot.short), "block"])
    if spot.row:
        return f"[{'; '.join(value_text(spot_of(item)) for item in spot.row)}]"
    if spot.item is not None:
        prefix = "named entries, each: " if spot.named else "list of: "
        return prefix + value_text(spot_of(spot.item))
    return "whole number" if spot.integer else "text"


def default_text(name: str, info: FieldInfo) -> str:
    """Return the default of the field `name` in words."""
    if info.is_required():
        return "required"
    default: object = info.default
    if name in DERIVED:
        return DERIVED[name]
    if default is PydanticUndefined or default is None or default == ():
        return "none"
    if isinstance(default, BaseModel):
        tag = getattr(default, "type", None)
        return f"`{tag}`" if tag else "see below"
    if isinstance(default, tuple):
        return "[" + ", ".join(_scalar(item) for item in default) + "]"
    return f"`{_scalar(default)}`" if default != "" else "empty"


def _scalar(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)
