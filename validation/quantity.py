"""Computed value, computed shot, and the evaluator of a set."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hvisph.measures.fragments import connected_groups
from hvisph.sweeps.parameters import Values
from hvisph.verification.problem import Ran, vectors

from .experiments import Measured

Key = tuple[str, float | None]  # quantity, and where


@dataclass(frozen=True)
class Value:
    """One computed number.

    `value`: in SI; None if undefined.
    `uncertainty`: half-width in SI; None if unknown.
    `reason`: why it is undefined.
    `ratio`: of a verdict: diameter over the critical one of the limit curve.
    """

    value: float | None
    uncertainty: float | None = None
    reason: str = ""
    ratio: float | None = None


@dataclass(frozen=True)
class Shot:
    """One shot that was computed.

    `name`, `values`: name and settings.
    `ran`: the run.
    `measured`: measured numbers of the shot.
    """

    name: str
    values: Values
    ran: Ran
    measured: Sequence[Measured]

    def measure(self, name: str, where: str = "measures", unit: float = 1.0) -> Value:
        """Return a measure of the run's summary."""
        return measure_of(self.ran.summary[where], name, unit)

    def sound(self, body: int) -> np.ndarray:
        """Return the indices of a body's largest connected group of intact particles at the end."""
        end = self.ran.last
        rows = np.flatnonzero((end.body == body) & (end.fields["damage"] < 1.0))
        return rows[connected_groups(vectors(end, "position")[rows], self.ran.dx) == 0]


def measure_of(measures: Mapping[str, Any], name: str, unit: float = 1.0) -> Value:
    """Return a measure of a mapping of them as stored in a summary."""
    measure = measures.get(name, {})
    if measure.get("value") is None:
        return Value(None, None, str(measure.get("reason", "not measured")))
    uncertainty = measure.get("uncertainty")
    return Value(unit * measure["value"], None if uncertainty is None else unit * uncertainty)


@dataclass(frozen=True)
class Evaluator:
    """Computation of the measured quantities from the runs of a set.

    `quantities`: name of each quantity in texts.
    `each`: returns the values of one shot.
    `together`: returns values by shot that follow from several runs.
    `curves`: returns the curves of pictures by name, as plain lists.
    """

    quantities: Mapping[str, str]
    each: Callable[[Shot], dict[Key, Value]] | None = None
    together: Callable[[Sequence[Shot]], dict[str, dict[Key, Value]]] | None = None
    curves: Callable[[Sequence[Shot]], dict[str, Any]] | None = None

    def computed(self, shots: Sequence[Shot]) -> dict[str, dict[Key, Value]]:
        """Return all values by shot."""
        values = {shot.name: self.each(shot) for shot in shots} if self.each is not None else {}
        return values | (self.together(shots) if self.together is not None else {})
