"""One place of the case file, explained."""

from __future__ import annotations

from hvisph.case.case import Case
from hvisph.casefile.describe import Spot, keys_of, walk
from hvisph.casefile.wording import default_text, value_text
from hvisph.core.errors import CaseError, nearest


def explain(path: str) -> str:
    """Return what may stand at a dotted path of the case file, as text for people.

    Parameters
    ----------
    path
        Such as ``time.cfl`` or ``bodies.target.shape``; a body or a list entry may have any
        name, and ``formulation.viscosity`` is looked up in every alternative that has it.

    Raises
    ------
    CaseError
        If nothing can stand there; names the nearest key.
    """
    keys = [key for key in path.split(".") if key]
    for depth, key in enumerate(keys):
        if walk(Case, keys[: depth + 1]) is None:
            above = walk(Case, keys[:depth])
            allowed = keys_of(above) if above else []
            raise CaseError(f"unknown key{nearest(key, allowed)}", where=".".join(keys[: depth + 1]))
    spot = walk(Case, keys)
    lines = [".".join(keys) or "case", *_about(keys[-1] if keys else "", spot)] if spot else []
    return "\n".join(lines)


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
