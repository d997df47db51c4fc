"""Results of a set from the folders of its sweeps."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import count
from pathlib import Path
from typing import Any

from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.output import file_names
from hvisph.sweeps.driver import begin
from hvisph.sweeps.folder import Row, SweepFolder, rows
from hvisph.verification.problem import Ran

from .comparison import PENDING, compared
from .evaluators import evaluator_of
from .experiments import SHOT, Experiments, Form
from .quantity import Shot
from .results import SetResult

FOLDER = Path("validation")


def folders(experiments: Experiments, form: Form, across: float | None = None, out: Path | None = None,
            there: bool = False) -> dict[str, SweepFolder]:  # fmt: skip
    """Return the folders of a set's sweeps, begun where they were not.

    `experiments`: the set.
    `form`, `across`: resolution: a form, or particles across in its place.
    `out`: where the folders of all sets are; ``validation`` unless given.
    `there`: whether only folders are wanted that were begun before.
    Raises `CaseError` for anything wrong with a case, before anything runs, where a folder holds other cases of that
    name, and where nothing was begun of what is wanted as it was.
    """
    where = (out or FOLDER) / f"{experiments.name}-{experiments.particles(form, across):g}"
    if there:
        folders = {name: SweepFolder(where / name) for name in experiments.sweeps(form, across)}
        if not any(folder.exists for folder in folders.values()):
            number = experiments.particles(form, across)
            raise CaseError(f"nothing of {experiments.name} with {number:g} particles across was begun in {where}: "
                            f"compute it without --table, or name its folder by --out", where="--table")  # fmt: skip
        return {name: folder for name, folder in folders.items() if folder.exists}
    return {name: begin(sweep, where / name) for name, sweep in experiments.sweeps(form, across).items()}


def result(experiments: Experiments, across: float, sweeps: dict[str, SweepFolder]) -> SetResult:
    """Return measured beside computed of all that has been computed so far."""
    evaluator = evaluator_of(experiments.model.evaluator)
    standing: dict[str, dict[str, Any]] = {}
    shots: list[Shot] = []
    for name, folder in sweeps.items():
        for row in rows(folder, folder.members()):
            shot = str(row["values"].get(SHOT, name))
            standing[_unlike(shot, standing)] = _short(row)
            if row["status"] == "done":
                shots.append(_shot(shot, row, experiments))
    computed = evaluator.computed(shots)
    why = {
        name: run["status"] if run["status"] in PENDING else run["message"] or run["status"]
        for name, run in standing.items()
        if run["status"] != "done"
    }
    curves = evaluator.curves(shots) if evaluator.curves is not None else {}
    return SetResult(experiments.name, across, list(compared(experiments.measured, computed, why)), standing, curves)


def _shot(name: str, row: Row, experiments: Experiments) -> Shot:
    folder = Path(row["folder"])
    summary = json.loads((folder / file_names.SUMMARY).read_text(encoding="utf-8"))
    measured = [entry for entry in experiments.measured if entry.shot == name]
    return Shot(name, row["values"], Ran(load_case(folder / file_names.CASE), folder, summary), measured)


def _short(row: Row) -> dict[str, Any]:
    return {key: row[key] for key in ("status", "message", "wall_seconds")}


def _unlike(name: str, taken_names: Sequence[str] | dict[str, Any]) -> str:
    """Return a name that is not among those known: a bisection has several runs of one shot."""
    names = (f"{name} ({number})" for number in count(2))
    return name if name not in taken_names else next(candidate for candidate in names if candidate not in taken_names)
