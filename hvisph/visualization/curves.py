"""Pictures of curves: gauge histories and profiles with exact solutions."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.core.fields import CATALOGUE, field_of
from hvisph.core.measure_catalogue import axis_unit
from hvisph.output.reader import read_history

from .history import store

# Units that read better than SI's own: unit, its label, how many of it in the SI unit.
READABLE = {"Pa": ("GPa", 1e-9), "s": ("us", 1e6), "m": ("mm", 1e3), "J/kg": ("kJ/kg", 1e-3)}
SIZED = ("s", "m")  # of which the unit goes by what is shown
# Of what runs along an axis.
AXES = {"x": "m", "time": "s"}
STYLES = ("-", "--", ":")  # of the curves beyond the colours
COLOURS = ("#1b4f72", "#b9770e", "#1e8449", "#922b21", "#6c3483", "#117a65", "#515a5a")
EXACT = "#111111"


@dataclass(frozen=True)
class Curve:
    """One line of a picture.

    Parameters
    ----------
    label
        For the legend; empty for none.
    x, y
        Points, in SI.
    exact
        Whether it is the exact solution, drawn thin and black.
    marked
        Whether its points are marked: where they are few, or stand alone between gaps (NaN).
    """

    label: str
    x: np.ndarray
    y: np.ndarray
    exact: bool = False
    marked: bool = False


def curves_picture(
    panels: Mapping[str, Sequence[Curve]],
    path: str | os.PathLike[str],
    *,
    title: str = "",
    across: str = "time",
    unitless: bool = False,
    units: Mapping[str, str] | None = None,
    legends: Literal["below", "beside"] = "below",
) -> Path:
    """Draw panels below one another and store them.

    Parameters
    ----------
    panels
        Curves by the name of their column, such as ``velocity_x``.
    path
        File to write; its ending tells the format.
    title
        Above the picture.
    across
        ``time`` or ``x``: what runs along the axis.
    unitless
        Whether the case is non-dimensional.
    units
        SI units of panels that are not named after a field.
    legends
        One below the picture, for panels of the same curves, or one beside each panel.

    Raises
    ------
    CaseError
        Where there is nothing to draw.
    """
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    if not panels:
        raise CaseError("there is nothing to draw")
    beside = legends == "beside"
    figure = Figure(figsize=(9.5 if beside else 7.5, 1.2 + 2.4 * len(panels)), dpi=110, layout="constrained")
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    x_label, x_scale = label_and_scale(
        across, unitless, shown=[curve.x for curves in panels.values() for curve in curves]
    )
    numbers: dict[str, int] = {}  # of the colours; below one another, panels show a label in the same one
    shown: dict[str, Any] = {}
    for axis, (column, curves) in zip(axes, panels.items(), strict=True):
        given = (units or {}).get(column)
        y_label, y_scale = label_and_scale(column, unitless, given, [curve.y for curve in curves])
        if beside:
            numbers = {}
        for curve in curves:
            style: dict[str, Any] = {"color": EXACT, "lw": 0.8, "ls": "--", "zorder": 3}
            if not curve.exact:
                colour = numbers.setdefault(curve.label, len(numbers))
                style = {"color": COLOURS[colour % len(COLOURS)], "lw": 1.4}
                style |= {"ls": STYLES[colour // len(COLOURS) % len(STYLES)]}
                if curve.marked:  # thinner one by one: what is covered can still be seen
                    style |= {"lw": max(1.0, 2.6 - 0.4 * colour), "marker": "o", "ms": max(2.5, 5.0 - 0.6 * colour)}
            (line,) = axis.plot(x_scale * curve.x, y_scale * curve.y, label=curve.label or "_", **style)
            if curve.label:
                shown.setdefault(curve.label, line)
        axis.set_ylabel(y_label)
        axis.grid(alpha=0.25, lw=0.5)
        if column == "number":
            axis.yaxis.set_major_locator(MaxNLocator(integer=True))
        if beside:
            axis.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8, frameon=False)
    axes[-1].set_xlabel(x_label)
    if not beside:
        # as many beside one another as the picture's 110 characters hold
        columns = max(1, min(len(shown), 7, 110 // (8 + max(map(len, shown), default=0))))
        figure.legend(list(shown.values()), list(shown), loc="outside lower center", ncols=columns, fontsize=8)
    figure.suptitle(title, fontsize=9)
    return store(figure, path)


def gauge_panels(
    run: str | os.PathLike[str],
    exact: Mapping[str, tuple[np.ndarray, np.ndarray]] | None = None,
    prefix: str = "",
) -> dict[str, list[Curve]]:
    """Return the panels of a run's gauges: one a field, one curve a gauge.

    Parameters
    ----------
    run
        Folder of the run.
    exact
        Times [s] and values of exact gauges, by their column.
    prefix
        Before the gauges' names in the legend.

    Raises
    ------
    CaseError
        Where the history holds no gauge.
    OutputError
        Where there is no history.
    """
    history = read_history(Path(run))
    panels: dict[str, list[Curve]] = {}
    for name, values in history.items():
        if not name.startswith("gauge."):
            continue
        _, gauge, column = name.split(".", 2)
        seen = np.isfinite(values)
        panels.setdefault(column, []).append(Curve(prefix + gauge, history["time"][seen], values[seen]))
        if exact and name in exact:
            first = not any(curve.exact for curve in panels[column])
            panels[column].append(Curve("exact" if first else "", *exact[name], exact=True))
    if not panels:
        raise CaseError("the run has no gauges; give the case some under `gauges`")
    return panels


def steps(times: np.ndarray, values: np.ndarray, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of a curve that holds each value from its time on, up to `end`."""
    corners = np.append(np.repeat(times, 2)[1:], end)
    return corners, np.repeat(values, 2)


def label_and_scale(column: str, unitless: bool, given: str | None = None,
                    shown: Sequence[np.ndarray] = ()) -> tuple[str, float]:  # fmt: skip
    """Return a column's name with the unit that it is shown in, and how many of that are one of SI's.

    `given` is its unit in SI, where it is not named after a field; `shown` what is drawn, by which lengths and times
    have the unit that suits them.

    Raises
    ------
    ValueError
        For a column without a unit: nobody is to take metres for a plain number.
    """
    unit = AXES.get(column) if given is None else given
    if unit is None:
        if column not in CATALOGUE and column.rpartition("_")[0] not in CATALOGUE:
            raise ValueError(f"{column!r} is no field: give its unit")
        unit = field_of(column).unit
    name = column.replace("_", " ")
    if unitless:
        return name, 1.0
    kind = unit
    unit, scale = READABLE.get(kind, (kind or "-", 1.0))
    ends = [float(abs(values[np.isfinite(values)]).max(initial=0.0)) for values in shown]
    if kind in SIZED and any(ends):
        unit, scale = axis_unit(unit, ends)
    return f"{name} [{unit}]", scale
