"""Pictures of a set; none for a set of few numbers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from .picture_kinds import Off, Panel, offs_picture, outlines_picture, residual_picture, verdict_map
from .results import SetResult

FEWEST = 5  # least number of values in a picture of differences


def draw(result: SetResult, folder: Path, words: Mapping[str, str]) -> list[Path]:
    """Draw the pictures of a set, and return the files."""
    files = []
    for name, making in (("outlines", _outlines), ("all", _offs), ("map", _map), ("residual", _residual)):
        path = making(result, folder / f"{result.name}.{name}.png", words)
        if path is not None:
            files.append(path)
    return files


def _outlines(result: SetResult, path: Path, words: Mapping[str, str]) -> Path | None:
    panels = []
    for shot, line in result.curves.get("outlines", {}).items():
        data = [row.measured for row in result.rows if row.measured.quantity == "outline" and row.measured.shot == shot]
        points = [(entry.at or 0.0, entry.value) for entry in data]
        panels.append(Panel(shot, line, points, [entry.scatter or 0.0 for entry in data]))
    return outlines_picture(panels, path) if panels else None


def _offs(result: SetResult, path: Path, words: Mapping[str, str]) -> Path | None:
    rows = [row for row in result.rows if row.measured.at is None and row.measured.judged and not row.is_verdict]
    groups, names = result.curves.get("groups", {}), {}
    offs = []
    for row in rows:
        measured = row.measured
        if row.off is not None:
            names[measured.quantity] = f"{words[measured.quantity]}, measured" + (
                "" if measured.unit == "-" else f" [{measured.unit}]"
            )
            scatter = 100.0 * (measured.scatter or 0.0) / abs(measured.value)
            offs.append(Off(measured.quantity, groups.get(measured.shot, ""), measured.value, 100.0 * row.off, scatter))
    return offs_picture(offs, names, path) if len(offs) >= FEWEST else None


def _map(result: SetResult, path: Path, words: Mapping[str, str]) -> Path | None:
    if not any(row.is_verdict for row in result.rows):
        return None
    shots = [
        (speed, ratio, None if computed is None else computed > 0.5, measured > 0.5)
        for speed, ratio, computed, measured in result.curves.values()
        if ratio is not None and measured is not None
    ]
    return verdict_map(shots, path) if shots else None


def _residual(result: SetResult, path: Path, words: Mapping[str, str]) -> Path | None:
    limits = {
        row.measured.shot: row.measured.value for row in result.rows if row.measured.quantity == "ballistic_limit"
    }
    panels = []
    for shot, points in result.curves.items() if limits else ():
        data = [row.measured for row in result.rows if row.measured.shot == shot]
        recalled = [
            (entry.at, entry.value) for entry in data if entry.quantity == "residual_velocity" and entry.at is not None
        ]
        panels.append(Panel(shot, points, recalled, limit=limits.get(shot)))
    return residual_picture(panels, path) if panels else None
