"""Description of a key of the case file."""

from __future__ import annotations

from pydantic import BaseModel

from hvisph.case.case import Case
from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.core.measure_catalogue import CATALOGUE

from .field_text import default_text, value_text
from .model_fields import Spot, keys_of, spot_of, walk
from .renamed_keys import renamed_key


def explain(path: str) -> str:
    """Describe the allowed values at a dotted path of the case file.

    Parameters
    ----------
    path
        Such as ``time.cfl``, ``bodies.target.shape`` or ``bodies.shape`` for that of any body, ``bodies.shape.disc``
        for one of its types; a body or a list entry may have any name, and ``formulation.viscosity`` is looked up in
        every alternative that has it.

    Raises
    ------
    CaseError
        If nothing can stand there; names the nearest key.
    """
    keys = _insert_body_name([key for key in path.split(".") if key])
    for depth, key in enumerate(keys):
        if walk(Case, keys[: depth + 1]) is None:
            above = walk(Case, keys[:depth])
            if above is not None and key in above.models:  # `eos.jwl`, `formulation.riemann.variant`
                rest = keys[depth + 1 :]
                return explain(".".join([*keys[:depth], *rest])) if rest else _of_type(keys, above.models[key])
            allowed = keys_of(above) if above else []
            now = renamed_key(tuple(keys[: depth + 1]), allowed)
            raise CaseError(now or f"unknown key{suggest_nearest(key, allowed)}", where=".".join(keys[: depth + 1]))
    spot = walk(Case, keys)
    lines = [".".join(keys) or "case", *_about(keys[-1] if keys else "", spot)] if spot else []
    if len(keys) == 2 and keys[0] == "measures" and keys[1] in CATALOGUE:
        measure = CATALOGUE[keys[1]]
        lines.append(f"  {measure.meaning}{f' [{measure.unit}]' if measure.unit else ''}")
    return "\n".join(lines)


def _of_type(keys: list[str], model: type[BaseModel]) -> str:
    """Return what a model of some type is, and its keys, a line each."""
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


def _about(name: str, spot: Spot) -> list[str]:
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
