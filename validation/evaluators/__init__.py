"""What draws the measured quantities from the runs of a set, by the name that the set gives."""

from __future__ import annotations

from importlib import import_module

from hvisph_validation.quantity import Judge


def judge_of(name: str) -> Judge:
    """Return the judge of a set; `hvisph_validation.experiment_set.JudgeName` has the names."""
    judge: Judge = import_module(f"hvisph_validation.evaluators.{name}").JUDGE
    return judge
