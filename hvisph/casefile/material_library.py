"""The material library: one YAML file a material, every number with its source."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from hvisph.case.materials import Material
from hvisph.casefile.problems import raise_all, translate
from hvisph.casefile.reading import read_yaml
from hvisph.casefile.yaml_text import Document
from hvisph.core.errors import CaseError, nearest

_FOLDER = Path(__file__).resolve().parents[1] / "case" / "library"


def material_names() -> list[str]:
    """Return the names of all materials of the library, sorted."""
    return sorted(path.stem for path in _FOLDER.glob("*.yaml"))


@lru_cache(maxsize=256)
def load_material(name: str) -> Material:
    """Return the library's material called `name`.

    Raises
    ------
    CaseError
        If the library has none of that name.
    """
    document = _document(name)
    try:
        return Material.model_validate(document.value)
    except ValidationError as error:
        raise_all(translate(error, Material, document.value, document.places))
        raise


def library() -> dict[str, Material]:
    """Return all materials of the library by name."""
    return {name: load_material(name) for name in material_names()}


def library_values(name: str) -> dict[str, Any]:
    """Return the library's material called `name` as plain values, for settings that change it."""
    return _document(name).value


def _document(name: str) -> Document:
    names = material_names()
    if name not in names:
        shown = name if len(name) <= 64 else f"{name[:64]}..."
        raise CaseError(f"unknown '{shown}'{nearest(name[:64], names)}")
    document = read_yaml(_FOLDER / f"{name}.yaml")
    document.value = {"name": name} | document.value
    return document
