"""Folders of cases: bundled ones, in a wheel or the source tree, and those that override a common `base.yaml`."""

import os
from pathlib import Path

from hvisph.core.errors import CaseError

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


BASE = "base"  # stem of the file that holds what the others share; it is no row
ENDINGS = (".yaml", ".yml")


def case_folder(source: str | os.PathLike[str]) -> Path | None:
    """Return the folder that `source` names: a path, or a bundled one as ``published/al_al``; else None."""
    path = Path(source)
    try:
        if path.is_dir():
            return path
        if path.is_absolute() or ".." in path.parts or path == Path():
            return None
        # as named in the source tree, or as cases are: cases/published/al_al, published/al_al
        bundled = data_folder("cases").joinpath(*path.parts[path.parts[0] == "cases" :])
        return bundled if bundled.is_dir() else None
    except (OSError, ValueError):
        return None


def cases_in(folder: Path) -> dict[str, Path]:
    """Return the cases of a folder, name to file, in the order of names; `base.yaml` is none of them."""
    files = (path for path in folder.iterdir() if path.suffix in ENDINGS and path.stem != BASE)
    return {path.stem: path for path in sorted(files) if not path.name.startswith(".")}


def bundled_name(path: Path) -> str | None:
    """Return the name of the bundled case that is stored at `path`; None for any other file."""
    target = path.resolve()
    return next((name for name, file in bundled_cases().items() if file.resolve() == target), None)


def run_name(source: str | os.PathLike[str]) -> str:
    """Return the name of the folder that a case runs in unless set otherwise: that of its file, without the ending.

    Raises `CaseError` when the file's name makes no name for a folder, as that of ``...yaml`` does not.
    """
    name = Path(source).stem
    if name in ("", ".", ".."):
        raise CaseError(f"'{source}' gives the run's folder no name; name one with --out", where="--out")
    return name
