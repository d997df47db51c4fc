"""Pictures of computed and exact results, one for each trial."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from hvisph.visualization.curves import Curve, curves_picture

from .runner import Verdict

PLAIN = ("computed", "mean", "tip")  # labels that say nothing beside the formulation's name


def draw(verdicts: Sequence[Verdict], folder: Path) -> list[Path]:
    """Draw ``PROBLEM.TRIAL.png`` for every trial that has curves, and return the files."""
    folder.mkdir(parents=True, exist_ok=True)
    trials = dict.fromkeys((one.problem, one.trial) for one in verdicts if one.curves)
    return [_draw([one for one in verdicts if (one.problem, one.trial) == trial], folder) for trial in trials]


def file_name(problem: str, trial: str) -> str:
    """Return the name of a trial's picture."""
    plain = "".join(letter if letter.isalnum() or letter == "." else " " for letter in trial)
    return f"{problem}.{'_'.join(plain.split())}.png"


def _draw(verdicts: Sequence[Verdict], folder: Path) -> Path:
    panels: dict[str, list[Curve]] = {}
    for verdict in verdicts:
        for column, curves in verdict.curves.items():
            into = panels.setdefault(column, [])
            before = any(curve.exact for curve in into)
            for curve in curves:
                if not curve.exact:
                    more = "" if curve.label in PLAIN else f", {curve.label}"
                    into.append(replace(curve, label=f"{verdict.formulation}{more}"))
                elif not before:
                    into.append(curve)
    first = verdicts[0]
    drawn = next(one for one in verdicts if one.curves)
    path = folder / file_name(first.problem, first.trial)
    return curves_picture(panels, path, title=f"{first.problem}: {first.trial}", across=drawn.across,
                          unitless=drawn.unitless, units=drawn.units)  # fmt: skip
