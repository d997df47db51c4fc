"""Pictures and tables of a sweep's results: convergence, residual velocities about a limit, dependence on inputs."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.core.measure_catalogue import NumberFormat, format_of
from hvisph.core.text import PlainMapping, format_differences, last_name
from hvisph.measures.correlations import LambertJonas

from .style import new_panels, store

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, ACCENT, FAINT = "#1b4f72", "#b9770e", "#99a3a4"
MOST_PANELS = 9
PANELS = (3, (4.2, 3.2), 150)  # beside one another, their size [in] and dots per inch
MOST_GROUPS = 12  # that a legend names


def sweep_picture(
    results: Mapping[str, object],
    rows: Sequence[PlainMapping],
    path: str | os.PathLike[str],
    title: str = "",
    record: Sequence[str] | None = None,
) -> Path:
    """Draw the results of a sweep (`results.json`), or measures of its `rows` over the first varied value; store it.

    `record` names the measures to draw. Raises `CaseError` when there is nothing to draw.
    """
    figure = sweep_figure(results, rows, record)
    figure.suptitle(title)
    return store(figure, path)


def sweep_figure(results: PlainMapping, rows: Sequence[PlainMapping], record: Sequence[str] | None = None) -> Figure:
    """Return the figure of a sweep's results; raises `CaseError` without any."""
    if "limits" in results:
        return _limits(results["limits"])
    if results.get("fit"):
        return _fit_figure(results["fit"]["data"])
    if "experiment" in results:
        return _panels(results["experiment"], _against)
    for kind, draw in (("converge", _convergence), ("sample", _tornado)):
        if kind in results:
            return _panels({name: results[kind][name] for name in _choose_names(results[kind], record)}, draw)
    return _measures(rows, record)


def _choose_names(names: Iterable[str], record: Sequence[str] | None) -> list[str]:
    """Return the names to draw: those that are recorded, or all."""
    return [*names] if record is None else [name for name in record if name in names]


def _panels(verdicts: PlainMapping, draw: Any) -> Figure:
    names = list(verdicts)[:MOST_PANELS]
    if not names:
        raise CaseError("no case is done: there is nothing to draw")
    figure, axes = new_panels(len(names), *PANELS)
    for name, panel in zip(names, axes, strict=True):
        draw(panel, verdicts[name], format_of(name))
    return figure


def _label(display: NumberFormat) -> str:
    return f"{display.label} [{display.unit}]" if display.unit else display.label


def _convergence(axes: Axes, study: PlainMapping, display: NumberFormat) -> None:
    """Results over spacing, with their uncertainties, and the curve to infinite resolution."""
    h, f = np.array(study["spacings"]), np.array(study["values"]) * display.factor
    spread = [0.0 if u is None else u * display.factor for u in study["uncertainties"]]
    axes.errorbar(h, f, spread, fmt="o", color=INK, capsize=3)
    note = study["verdict"]
    if study["order"] is not None:
        limit, fine = study["extrapolated"] * display.factor, int(np.argmin(h))
        x = np.linspace(0.0, h.max(), 60)
        axes.plot(x, limit + (f[fine] - limit) * (x / h[fine]) ** study["order"], color=FAINT)
        axes.plot([0.0], [limit], "D", color=ACCENT)
        note = f"order {study['order']:.2f}, index {100 * study['index']:.2g} %"
    x_label = f"spacing [{study['spacing_unit']}]" if study.get("spacing_unit") else "spacing"
    axes.set(xlim=(0.0, None), xlabel=x_label, ylabel=_label(display))
    axes.set_title(note, fontsize=9)


def _against(axes: Axes, comparison: PlainMapping, display: NumberFormat) -> None:
    """Draw computed over measured values, with the line of equality."""
    measured, computed = (np.array(comparison[key]) * display.factor for key in ("measured", "computed"))
    low, high = min(0.0, *measured, *computed), max(*measured, *computed)
    axes.plot([low, high], [low, high], color=FAINT)
    axes.plot(measured, computed, "o", color=INK)
    unit = f" [{display.unit}]" if display.unit else ""
    axes.set(xlabel=f"measured{unit}", ylabel=f"computed{unit}")
    mean_error = "" if comparison["mean"] is None else f": {100.0 * comparison['mean']:+.2g} % in the mean"
    axes.set_title(f"{display.label}{mean_error}", fontsize=9)


def _tornado(axes: Axes, sample: PlainMapping, display: NumberFormat) -> None:
    """Change of the measure over 5 to 95 % of each input, the largest on top."""
    sensitivity = sample.get("sensitivity") or {"inputs": {}, "swing": []}
    swings = sorted(zip(sensitivity["inputs"], sensitivity["swing"], strict=True), key=lambda pair: abs(pair[1]))
    axes.barh(
        [".".join(path.split(".")[-3:]) for path, _ in swings],
        [swing * display.factor for _, swing in swings],
        color=[INK if swing >= 0.0 else ACCENT for _, swing in swings],
    )
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set_xlabel(f"change over 5 to 95 % of the input [{display.unit or '-'}]")
    spread = f"{sample['mean'] * display.factor:.4g} ± {sample['sd'] * display.factor:.2g} {display.unit}"
    axes.set_title(f"{display.label}: {spread}", fontsize=9)


def _fit_figure(data: Sequence[PlainMapping]) -> Figure:
    """Measured beside computed: by shot where there is one number each, over time or distance for curves."""
    groups: dict[tuple[str, str], list[PlainMapping]] = {}
    for datum in data:
        groups.setdefault((datum["quantity"], "" if datum["at"] is None else datum["shot"]), []).append(datum)
    figure, panels = new_panels(min(len(groups), MOST_PANELS), *PANELS)
    for axes, ((quantity, shot), rows) in zip(panels, groups.items(), strict=False):
        x = range(len(rows)) if not shot else [row["at"] for row in rows]
        measured, scatter, computed = ([row[key] for row in rows] for key in ("value", "scatter", "computed"))
        axes.errorbar(x, measured, scatter, fmt="o", color=ACCENT, capsize=2, markersize=4, label="measured")
        axes.plot(x, computed, "-" if shot else "D", color=INK, markersize=4, label="computed")
        if shot:
            axes.set_xlabel("distance from the foot [mm]" if quantity == "outline" else "time [us]")
        else:
            axes.set_xticks(x, [row["shot"] for row in rows], rotation=30, ha="right", fontsize=7)
        axes.set_ylabel(f"{format_of(quantity).label} [{rows[0]['unit'] or '-'}]")
        axes.set_title(shot, fontsize=9)
    panels[0].legend(fontsize=8)
    return figure


def _limits(verdicts: Sequence[PlainMapping]) -> Figure:
    """Shots, bracket and the fitted curve of residual velocities."""
    figure, panels = new_panels(len(verdicts), *PANELS)
    for axes, case in zip(panels, verdicts, strict=True):
        shots = case["shots"]
        stopped = [shot["value"] for shot in shots if not shot["happened"]]
        through = [shot for shot in shots if shot["happened"] and shot["residual"] is not None]
        untold = [shot["value"] for shot in shots if shot["happened"] and shot["residual"] is None]
        axes.plot(stopped, np.zeros(len(stopped)), "o", color=INK, label="no")
        axes.plot([s["value"] for s in through], [abs(s["residual"]) for s in through], "o", color=ACCENT, label="yes")
        if untold:
            axes.plot(untold, np.zeros(len(untold)), "|", markersize=14, color=ACCENT, label="yes, not through yet")
        if case["below"] is not None and case["above"] is not None:
            axes.axvspan(*sorted((case["below"], case["above"])), color=FAINT, alpha=0.3)
        curve = case["lambert_jonas"]
        if curve:
            x = np.linspace(curve["limit"], max(s["value"] for s in shots) * _to_si(case["unit"]), 200)
            axes.plot(x / _to_si(case["unit"]), LambertJonas(**curve).residual(x), color=FAINT)
        if "recht_ipson" in case:
            axes.plot([s["value"] for s in shots], case["recht_ipson"]["residuals"], "--", c=FAINT, label="Recht-Ipson")
        for correlation in case.get("correlations", []):
            axes.axvline(correlation["value"] / _to_si(case["unit"]), color=FAINT, ls=":", label=correlation["name"])
        axes.set(xlabel=f"{case['path']} [{case['unit'] or 'SI'}]", ylabel="residual velocity [m/s]")
        axes.legend(title="went through", fontsize=8)
        axes.set_title(", ".join(f"{path} = {value}" for path, value in case["parameters"].items()), fontsize=9)
    return figure


def _to_si(unit: str) -> float:
    return 1000.0 if unit in ("km/s", "mm/us") else 1.0


def _measures(rows: Sequence[PlainMapping], record: Sequence[str] | None) -> Figure:
    """Measures over the first value that varies, in as many colours as the others have values."""
    from matplotlib import colormaps

    ended = [row for row in rows if row["status"] == "done"]
    defined = dict.fromkeys(
        k for row in ended for k, result in row["measures"].items() if isinstance(result["value"], int | float)
    )
    names = _choose_names(defined, record)[:MOST_PANELS]
    if not names:
        raise CaseError("no case is done: there is nothing to draw")
    paths = list(ended[0]["values"])
    texts = list(zip(*(format_differences([row["values"].get(path) for row in ended]) for path in paths), strict=True))
    varied = [k for k, cells in enumerate(zip(*texts, strict=True)) if len(set(cells)) > 1] or [0]
    first, *further_columns = varied
    groups: dict[str, list[int]] = {}
    for k, cells in enumerate(texts):
        groups.setdefault(", ".join(f"{last_name(paths[j])} {cells[j]}" for j in further_columns), []).append(k)
    x, ticks, label = _places([cells[first] for cells in texts], paths[first])
    figure, panels = new_panels(len(names), *PANELS)
    for name, axes in zip(names, panels, strict=True):
        display = format_of(name)
        for number, (group, members) in enumerate(groups.items()):
            colour = INK if len(groups) == 1 else colormaps["viridis"](0.85 * number / (len(groups) - 1))
            values = {k: ended[k]["measures"].get(name, {}).get("value") for k in members}
            valued = sorted((k for k in members if isinstance(values[k], int | float)), key=x.__getitem__)
            axes.plot(
                [x[k] for k in valued],
                [values[k] * display.factor for k in valued],
                "o-" if len(groups) > 1 else "o",
                color=colour,
                label=group,
                linewidth=1,
            )
        if ticks:
            axes.set_xticks(range(len(ticks)), ticks, rotation=30, ha="right", fontsize=7)
        if name == "perforated":
            axes.set_yticks([0, 1], ["no", "yes"])
        axes.set(xlabel=label, ylabel=_label(display))
    if 1 < len(groups) <= MOST_GROUPS:
        panels[0].legend(fontsize=7)
    return figure


def _places(cells: Sequence[str], path: str) -> tuple[list[float], list[str], str]:
    """Return places along an axis, names of its ticks and its label: numbers of one unit, or a tick each."""
    parts = [cell.partition(" ") for cell in cells]
    if len({unit for _, _, unit in parts}) == 1:
        with suppress(ValueError):
            unit = f" [{parts[0][2]}]" if parts[0][2] else ""
            return [float(number) for number, _, _ in parts], [], f"{path}{unit}"
    ticks = list(dict.fromkeys(cells))
    return [float(ticks.index(cell)) for cell in cells], ticks, path


def result_lines(results: PlainMapping, record: Sequence[str] | None = None) -> list[list[str]]:
    """Return the results of a sweep by measure, or of a fit by parameter, as text: heads, then rows.

    `results` is the content of ``results.json``, `record` the measures to list, all unless given. A sweep that only
    varies something has no lines.
    """
    if results.get("fit"):
        return _fit_lines(results["fit"])
    kinds = {
        "converge": (["", "unit", "finest", "order", "extrapolated", "index", ""], _convergence_cells),
        "sample": (["", "unit", "mean", "sd", "5 %", "50 %", "95 %"], _sample_cells),
        "experiment": (["against the experiment", "shots", "mean", "worst"], _difference_cells),
    }
    for section, (heads, cells) in kinds.items():
        if section in results:
            names = [name for name in results[section] if record is None or name in record or section == "experiment"]
            return [heads, *([format_of(name).label, *cells(name, results[section][name])] for name in names)]
    return []


def _convergence_cells(name: str, study: PlainMapping) -> list[str]:
    display = format_of(name)
    finest = study["values"][study["spacings"].index(min(study["spacings"]))]
    if name == "perforated":
        return ["", format_value_of(name, finest, display), "-", "-", "-", study["verdict"]]
    order = "-" if study["order"] is None else f"{study['order']:.2f}"
    limit = "-" if study["extrapolated"] is None else f"{study['extrapolated'] * display.factor:.4g}"
    index = "-" if study["index"] is None else f"{100 * study['index']:.2g} %"
    return [display.unit, f"{finest * display.factor:.4g}", order, limit, index, study["verdict"]]


def _sample_cells(name: str, sample: PlainMapping) -> list[str]:
    display = format_of(name)
    return [display.unit, *(f"{sample[key] * display.factor:.4g}" for key in ("mean", "sd", "p5", "p50", "p95"))]


def _difference_cells(name: str, comparison: PlainMapping) -> list[str]:
    differences = ["-" if comparison[key] is None else f"{100.0 * comparison[key]:+.2g} %" for key in ("mean", "worst")]
    return [str(len(comparison["cases"])), *differences]


def _fit_lines(fit: PlainMapping) -> list[list[str]]:
    """Return the parameters of a fit with their intervals and correlations."""
    lines = [["", "", "95 %", "", *shortest_paths([*fit["parameters"]])]]
    for (path, parameter), row in zip(fit["parameters"].items(), fit["correlation"], strict=True):
        doubt = "" if parameter["determined"] else "not determined by the data"
        value, *interval = (f"{number:.4g}" for number in (parameter["value"], *parameter["interval"]))
        lines.append([path, f"{value} {parameter['unit']}", " to ".join(interval), doubt, *(f"{r:+.2f}" for r in row)])
    return lines


def shortest_paths(paths: Sequence[str]) -> list[str]:
    """Return paths by as many of their last parts as distinguish them, a number with its key."""
    labels = []
    for path in paths:
        parts = path.split(".")
        ends = [".".join(parts[-k:]) for k in range(1, len(parts) + 1) if not parts[-k].isdigit() or k == len(parts)]
        unique = (end for end in ends if not any(f".{path_}".endswith(f".{end}") for path_ in paths if path_ != path))
        labels.append(next(unique, path))
    return labels


def format_value_of(name: str, value: float | bool | None, display: NumberFormat) -> str:
    """Return a measure's value as a cell of a table, in the unit of `display`."""
    if value is None:
        return "-"
    if isinstance(value, bool) or name == "perforated":
        return "yes" if value else "no"
    number = float(value) * display.factor
    return f"{number:.4g}" if display.decimals < 0 else f"{number:.{display.decimals}f}"
