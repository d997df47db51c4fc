"""Formulation and symmetry planes of the case stored in a snapshot."""

from __future__ import annotations

from hvisph.core.errors import CaseError
from hvisph.core.text import Plain

from .document import parse


def _case(text: object) -> Plain:
    if not isinstance(text, str):
        return {}
    try:
        case = parse(text, "case").value
    except CaseError:
        return {}
    return case if isinstance(case, dict) else {}


def formulation(text: object) -> str:
    """Return the name of the formulation; empty where the text does not tell."""
    chosen = _case(text).get("formulation")
    return str(chosen.get("type", "")) if isinstance(chosen, dict) else ""


def symmetry_axes(text: object) -> tuple[int, ...]:
    """Return the axes whose coordinate plane is a mirror of the model; none where the text does not tell."""
    planes = _case(text).get("symmetry")
    axes = [plane.get("axis") for plane in planes if isinstance(plane, dict)] if isinstance(planes, list) else []
    return tuple("xyz".index(axis) for axis in axes if axis in ("x", "y", "z"))
