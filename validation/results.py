"""Results of a set at one resolution, stored as JSON for pages and later runs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hvisph import __version__
from hvisph.core.errors import OutputError
from hvisph.output import atomic_write

from .comparison import Compared


@dataclass(frozen=True)
class SetResult:
    """A set in one form.

    `name`, `across`: name of the set, and number of particles across.
    `rows`: measured beside computed numbers.
    `shots`: state of every run: status, message, number of particles, wall seconds.
    `curves`: curves of pictures by name: lists of numbers in the units of the set.
    """

    name: str
    across: float
    rows: Sequence[Compared]
    shots: Mapping[str, Mapping[str, Any]]
    curves: Mapping[str, Any] = field(default_factory=dict)

    @property
    def seconds(self) -> float:
        """Wall time of all runs [s]."""
        return float(sum(shot.get("wall_seconds") or 0.0 for shot in self.shots.values()))

    def as_dict(self) -> dict[str, Any]:
        """Return the plain form for JSON."""
        return {
            "set": self.name,
            "across": self.across,
            "version": __version__,
            "shots": {name: dict(shot) for name, shot in self.shots.items()},
            "rows": [row.as_dict() for row in self.rows],
            "curves": dict(self.curves),
        }


def file_of(folder: Path, name: str, across: float) -> Path:
    """Return the file of a set's results at so many particles across."""
    return folder / f"{name}.{across:g}.json"


def store(result: SetResult, folder: Path) -> Path:
    """Write a set's results into a folder and return the file."""
    path = file_of(folder, result.name, result.across)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot write {folder}: {atomic_write.reason(error)}") from error
    atomic_write.write_text(path, json.dumps(_rounded(result.as_dict()), indent=1, ensure_ascii=False) + "\n")
    return path


def stored(folder: Path, name: str, across: float) -> SetResult | None:
    """Return a set's results from a folder; None where there are none."""
    path = file_of(folder, name, across)
    if not path.is_file():
        return None
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        rows = [Compared.from_dict(row) for row in content["rows"]]
        return SetResult(content["set"], content["across"], rows, content["shots"], content["curves"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise OutputError(f"{path} cannot be read: {error}") from error


def _rounded(value: object) -> Any:
    """Return plain data with numbers rounded to six digits."""
    if isinstance(value, float):
        return float(f"{value:.6g}")
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    return [_rounded(item) for item in value] if isinstance(value, list) else value
