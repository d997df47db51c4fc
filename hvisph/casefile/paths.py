"""Folders of bundled cases and schemas, in a wheel or the source tree."""

from __future__ import annotations

from pathlib import Path

SET = "set.yaml"  # describes a set of experiments; it is no case
_PACKAGE = Path(__file__).resolve().parents[1]


def data_folder(name: str) -> Path:
    """Return the folder of bundled data called `name`, ``cases`` or ``schemas``."""
    installed = _PACKAGE / "_data" / name
    return installed if installed.is_dir() else _PACKAGE.parent / name


def bundled_cases() -> dict[str, Path]:
    """Return the bundled cases: name, such as ``al_al`` or ``published/al_al/sav1``, to file."""
    folder = data_folder("cases")
    files = (path for path in sorted(folder.rglob("*.yaml")) if path.name != SET)
    return {path.relative_to(folder).with_suffix("").as_posix(): path for path in files}
