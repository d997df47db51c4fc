"""Evaluators of sets of experiments by name: the measured quantities from the runs."""

from __future__ import annotations

from importlib import import_module

from hvisph_validation.quantity import Evaluator


def evaluator_of(name: str) -> Evaluator:
    """Return the evaluator of a set; `hvisph_validation.experiment_set.EvaluatorName` has the names."""
    evaluator: Evaluator = import_module(f"hvisph_validation.evaluators.{name}").EVALUATOR
    return evaluator
