"""Pictures of what was computed beside what is exact."""

from __future__ import annotations

from pathlib import Path

from hvisph.pictures.curves import curves_picture
from hvisph.verification.running import Verdict


def draw(verdict: Verdict, folder: Path) -> Path:
    """Draw a verdict's curves into ``PROBLEM.TRIAL.FORMULATION.png`` and return the file."""
    folder.mkdir(parents=True, exist_ok=True)
    words = (verdict.problem, verdict.trial, verdict.formulation)
    name = ".".join("_".join(word.replace("/", " ").replace("(", "").replace(")", "").split()) for word in words)
    title = f"{verdict.problem}, {verdict.trial}, {verdict.formulation}"
    return curves_picture(verdict.curves, folder / f"{name}.png", title=title, across=verdict.across)
