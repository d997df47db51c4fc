"""Pictures of curves: gauges and profiles, panels of a material, measures over time, loads on a witness plane."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.core.fields import CATALOGUE, field_of
from hvisph.core.measure_catalogue import axis_unit, format_of
from hvisph.core.text import Plain
from hvisph.measures.debris import Cloud
from hvisph.measures.fragments import FEWEST_PARTICLES
from hvisph.measures.measure import Measures
from hvisph.measures.tables import columns, moments
from hvisph.output.reader import read_history

from .style import new_figure, new_panels, store

# Units that read better than SI's own: unit, its label, how many of it in the SI unit.
READABLE = {"Pa": ("GPa", 1e-9), "s": ("us", 1e6), "m": ("mm", 1e3), "J/kg": ("kJ/kg", 1e-3)}
SIZED = ("s", "m")  # whose unit follows the shown values
AXES = {"x": "m", "r": "m", "time": "s"}  # of what runs along an axis
STYLES = ("-", "--", ":")  # of the curves beyond the colours
COLOURS = ("#1b4f72", "#b9770e", "#1e8449", "#922b21", "#6c3483", "#117a65", "#515a5a")
EXACT = "#111111"


@dataclass(frozen=True)
class Curve:
    """One line of a picture."""

    label: str  # for the legend; empty for none
    # points, in SI
    x: np.ndarray
    y: np.ndarray
    exact: bool = False  # whether it is the exact solution, drawn thin and black
    marked: bool = False  # whether its points are marked: where they are few, or stand alone between gaps (NaN)


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

    `panels`: curves by the name of their column, such as ``velocity_x``.
    `across`: ``time``, ``x`` or ``r``: what runs along the axis.
    `units`: SI units of panels that are not named after a field.
    `legends`: one below the picture, for panels of the same curves, or one beside each panel.
    Raises `CaseError` where there is nothing to draw.
    """
    from matplotlib.ticker import MaxNLocator

    if not panels:
        raise CaseError("there is nothing to draw")
    legend_each = legends == "beside"
    figure = new_figure((9.5 if legend_each else 7.5, 1.2 + 2.4 * len(panels)))
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    x_label, x_scale = label_and_scale(across, unitless, shown=[c.x for curves in panels.values() for c in curves])
    numbers: dict[str, int] = {}  # of the colours; below one another, panels show a label in the same one
    lines: Plain = {}
    for axis, (column, curves) in zip(axes, panels.items(), strict=True):
        unit = (units or {}).get(column)
        y_label, y_scale = label_and_scale(column, unitless, unit, [curve.y for curve in curves])
        if legend_each:
            numbers = {}
        for curve in curves:
            style: Plain = {"color": EXACT, "lw": 0.8, "ls": "--", "zorder": 3}
            if not curve.exact:
                colour = numbers.setdefault(curve.label, len(numbers))
                style = {"color": COLOURS[colour % len(COLOURS)], "lw": 1.4}
                style |= {"ls": STYLES[colour // len(COLOURS) % len(STYLES)]}
                if curve.marked:  # thinner one by one: covered curves can still be seen
                    style |= {"lw": max(1.0, 2.6 - 0.4 * colour), "marker": "o", "ms": max(2.5, 5.0 - 0.6 * colour)}
            (line,) = axis.plot(x_scale * curve.x, y_scale * curve.y, label=curve.label or "_", **style)
            if curve.label:
                lines.setdefault(curve.label, line)
        axis.set_ylabel(y_label)
        axis.grid(alpha=0.25, lw=0.5)
        if column == "number":
            axis.yaxis.set_major_locator(MaxNLocator(integer=True))
        if legend_each:
            axis.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8, frameon=False)
    axes[-1].set_xlabel(x_label)
    if not legend_each:
        # as many beside one another as the picture's 110 characters hold
        columns = max(1, min(len(lines), 7, 110 // (8 + max(map(len, lines), default=0))))
        figure.legend(list(lines.values()), list(lines), loc="outside lower center", ncols=columns, fontsize=8)
    figure.suptitle(title, fontsize=9)
    return store(figure, path)


def gauge_panels(
    run: str | os.PathLike[str], exact: Mapping[str, tuple[np.ndarray, np.ndarray]] | None = None, prefix: str = ""
) -> dict[str, list[Curve]]:
    """Return the panels of a run's gauges, `prefix` before their names: one a field, one curve a gauge.

    `exact` has times [s] and values by column. Raises `CaseError` without gauges, `OutputError` without a history.
    """
    history = read_history(Path(run))
    panels: dict[str, list[Curve]] = {}
    for name, values in history.items():
        if not name.startswith("gauge."):
            continue
        _, gauge, column = name.split(".", 2)
        valid = np.isfinite(values)
        panels.setdefault(column, []).append(Curve(prefix + gauge, history["time"][valid], values[valid]))
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


def label_and_scale(
    column: str, unitless: bool, given: str | None = None, shown: Sequence[np.ndarray] = ()
) -> tuple[str, float]:
    """Return a column's name with the unit that it is shown in, and how many of that are one of SI's.

    `given` is its unit in SI, where it is not named after a field; `shown` the drawn values, by which lengths and times
    have the unit that suits them. Raises `ValueError` for a column without a unit: metres are no plain number.
    """
    unit = AXES.get(column) if given is None else given
    if unit is None:
        if column not in CATALOGUE and column.rpartition("_")[0] not in CATALOGUE:
            raise ValueError(f"{column!r} is no field: give its unit")
        unit = field_of(column).unit
    name = column.replace("_", " ")
    if unitless:
        return name, 1.0
    si_unit = unit
    unit, scale = READABLE.get(si_unit, (si_unit or "-", 1.0))
    ends = [float(abs(values[np.isfinite(values)]).max(initial=0.0)) for values in shown]
    if si_unit in SIZED and any(ends):
        unit, scale = axis_unit(unit, ends)
    return f"{name} [{unit}]", scale


@dataclass
class Panel:
    """Curves over one axis."""

    # labels of the axes, with units
    across: str
    up: str
    curves: list[tuple[str, np.ndarray, np.ndarray]] = field(default_factory=list)  # label, x and y of each
    points: np.ndarray | None = None  # measured points (n, 2)


def panels_picture(panels: Sequence[Panel], path: str | os.PathLike[str], title: str = "") -> Path:
    """Draw panels beside and below one another and store them. Raises `CaseError` where there is nothing to draw."""
    drawable = [panel for panel in panels if panel.curves]
    if not drawable:
        raise CaseError("there is nothing to draw")
    figure, axes = new_panels(len(drawable), 2, (5.0, 3.4))
    for axis, panel in zip(axes, drawable, strict=True):
        for number, (label, x, y) in enumerate(panel.curves):
            style = STYLES[number // len(COLOURS) % len(STYLES)]
            axis.plot(x, y, color=COLOURS[number % len(COLOURS)], ls=style, lw=1.4, label=label)
        if panel.points is not None:
            axis.plot(panel.points[:, 0], panel.points[:, 1], "ko", ms=3, label="measured")
        axis.set(xlabel=panel.across, ylabel=panel.up)
        axis.grid(alpha=0.25, lw=0.5)
        axis.legend(fontsize=7, frameon=False)
    figure.suptitle(title, fontsize=9)
    return store(figure, path)


# Panels of the picture in their order, and their SI units.
KINDS = {
    "length": "m",
    "length, plug and lip": "m",
    "velocity": "m/s",
    "pressure": "Pa",
    "temperature": "K",
    "mass": "kg",
    "momentum": "N s",
    "ratio": "",
    "number": "",
}
# Columns of the fragments that are drawn, with their labels.
FRAGMENT_COLUMNS = {
    "number": f"fragments of {FEWEST_PARTICLES} particles or more",
    "largest_mass_share": "mass share of the largest",
    "largest_velocity_x": "largest, axial velocity",
}
PLUG_AND_LIP = ("plug_width", "plug_thickness", "impact_diameter", "lip_height", "lip_height_max")


def series_picture(measured: Measures, path: str | os.PathLike[str]) -> Path:
    """Draw the measures over time and store the picture: a panel each kind of quantity.

    Of the fragments it shows how many there are, the largest one's share of the mass, and its axial velocity. Raises
    `CaseError` where there is one moment only.
    """
    series = moments(measured)
    if len(series) < 2:
        raise CaseError("one moment makes no history; give the folder of a run with two snapshots or more")
    time = np.array([moment.time for moment in series])
    panels: dict[str, list[Curve]] = {quantity: [] for quantity in KINDS}
    units = dict(KINDS)
    for name, column in columns(measured).items():
        column_name = name.rpartition(".")[2] if name.startswith("fragments.") else ""  # variants are in the CSV file
        if np.isfinite(column.values).any() and (column_name in FRAGMENT_COLUMNS or "." not in name):
            quantity = _panel_kind(name, column.unit)
            units[quantity] = column.unit
            panels[quantity].append(Curve(_column_label(name), time, column.values, marked=True))
    panels = {quantity: curves for quantity, curves in panels.items() if curves}
    return curves_picture(panels, path, title=measured.title, unitless=measured.unitless, units=units, legends="beside")


def _panel_kind(name: str, unit: str) -> str:
    if name == "target_fragments" or name.endswith(".number"):
        return "number"
    if unit == "m" and name in PLUG_AND_LIP:
        return "length, plug and lip"
    return next(kind for kind, si in KINDS.items() if si in (unit, unit.removesuffix("/m"), unit.removesuffix("/m^2")))


def _column_label(name: str) -> str:
    if not name.startswith("fragments."):
        return format_of(name).label
    body, _, column = name.removeprefix("fragments.").rpartition(".")
    return f"{body}: {FRAGMENT_COLUMNS[column]}"


CELLS = 60  # of the map, each way
WIDE = 0.99  # share of the mass that the map shows


def witness_picture(cloud: Cloud, path: str | os.PathLike[str], title: str = "") -> Path:
    """Draw the loads on a cloud's witness plane; raises `CaseError` without a plane, or an arrival."""
    arrivals = cloud.arrivals
    if arrivals is None or len(arrivals.when) == 0:
        reason = next((result.reason for result in cloud.results.values() if result.reason), "no particle flies there")
        raise CaseError(f"no witness plane receives anything: {reason}")
    flat = arrivals.where.shape[1] == 1
    figure = new_figure((5.2 if flat else 10.0, 4.2))
    axes = figure.subplots(1, 1 if flat else 2, squeeze=False)[0]
    if not flat:
        reach = float(np.sort(arrivals.radius)[int(WIDE * (len(arrivals.radius) - 1))])
        edges = np.linspace(-reach, reach, CELLS + 1)
        sums = np.histogram2d(arrivals.where[:, 0], arrivals.where[:, 1], edges, weights=arrivals.momentum)[0]
        area = float(edges[1] - edges[0]) ** 2
        loads_map = np.ma.masked_less_equal(sums.T / area, 0.0)
        mesh = axes[0].pcolormesh(edges * 1e3, edges * 1e3, loads_map, cmap="viridis")
        figure.colorbar(mesh, ax=axes[0], label="areal momentum [Pa s]")
        axes[0].set(aspect="equal", xlabel="y from the shot line [mm]", ylabel="z from the shot line [mm]")
    loads = cloud.witness
    radius = np.array([0.0, *loads["radius"]]) * 1e3
    left_axes = axes[-1]
    left_axes.stairs(loads["areal_momentum"], radius, color=COLOURS[0], lw=1.4, label="areal momentum")
    left_axes.set_xlabel("radius [mm]" if not flat else "distance from the shot line [mm]")
    left_axes.set_ylabel("areal momentum [Pa s]", color=COLOURS[0])
    right_axes = left_axes.twinx()
    right_axes.stairs(np.array(loads["pressure"]) * 1e-6, radius, color=COLOURS[1], lw=1.2, label="mean pressure")
    right_axes.set_ylabel("mean pressure while it arrives [MPa]", color=COLOURS[1])
    left_axes.grid(alpha=0.25, lw=0.5)
    arrives = f"x = {arrivals.x * 1e3:g} mm, {loads['first'] * 1e6:.3g} to {loads['last'] * 1e6:.3g} us"
    figure.suptitle(f"{title}: {arrives}" if title else arrives, fontsize=9)
    return store(figure, path)
