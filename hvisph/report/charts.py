"""What a page draws of a history, and the moments worth a look."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hvisph.pictures.inline import chart


def history_charts(history: Mapping[str, np.ndarray], unitless: bool) -> tuple[list[Any], list[Any]]:
    """Return charts of what was measured over time, and of the run's health."""
    time = np.asarray(history["time"], float)
    if len(time) < 2:
        return [], []
    giga = 1.0 if unitless else 1e-9
    measured = []
    pressures = {"centre_pressure": "at the projectile's centre", "axis_pressure_min": "lowest on the shot line"}
    there = {label: _column(history, name) * giga for name, label in pressures.items() if name in history}
    if there:
        measured.append(chart(time, there, "pressure" if unitless else "pressure [GPa]", "Pressures", unitless))
    health = []
    energies = energy_columns(history)
    if energies:
        unit = "energy" if unitless else "energy [kJ]"
        lines = {words(name): _column(history, name) * (1.0 if unitless else 1e-3) for name in energies}
        health.append(chart(time, lines, unit, "Energies by kind", unitless))
    if "energy_drift" in history:
        drift = _column(history, "energy_drift") * 100.0
        health.append(chart(time, {"drift": drift}, "drift [%]", "Drift of the total energy", unitless))
    if "dt" in history:
        step = _column(history, "dt") * (1.0 if unitless else 1e9)
        health.append(chart(time[1:], {"step": step[1:]}, "step" if unitless else "step [ns]", "Time step", unitless))
    return measured, health


def energy_columns(history: Mapping[str, np.ndarray]) -> list[str]:
    """Return the columns of the history that are energies."""
    return [name for name in history if name.endswith(("_energy", "_work", "_heat")) or name == "energy"]


def words(name: str) -> str:
    """Return a column's name in words."""
    return name.replace("_", " ")


def _column(history: Mapping[str, np.ndarray], name: str) -> np.ndarray:
    try:
        return np.asarray(history[name], float)
    except ValueError:  # empty cells
        return np.array([float(cell) if cell else np.nan for cell in history[name]])


def moments(history: Mapping[str, np.ndarray], end: float, measures: Mapping[str, Any]) -> list[tuple[str, float]]:
    """Return the moments of a run that are worth a look, by name, in order of time [s]."""
    marks: list[tuple[str, float]] = [("begin", 0.0)]
    for name, label in (("centre_pressure_peak", "peak pressure"), ("perforated", "perforation")):
        time = measures.get(name, {}).get("time")
        if isinstance(time, int | float) and 0.0 < time < end:
            marks.append((label, float(time)))
    return [*sorted(marks, key=lambda one: one[1]), ("end", end)]


def criteria(history: Mapping[str, np.ndarray]) -> Sequence[tuple[str, float]]:
    """Return what limited the step, and its share of the steps recorded."""
    if "criterion" not in history:
        return []
    names, counts = np.unique(np.asarray(history["criterion"], str), return_counts=True)
    order = np.argsort(-counts)
    return [(str(names[k]), float(counts[k] / counts.sum())) for k in order]
