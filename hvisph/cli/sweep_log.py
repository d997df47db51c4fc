"""Progress and results of a sweep on the terminal."""

import re
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType

from hvisph.case.sweep import Sweep
from hvisph.core.measure_catalogue import format_of, main_measures
from hvisph.core.text import Plain, format_differences, format_value
from hvisph.sweeps.driver import Driver
from hvisph.visualization.sweeps import format_value_of, result_lines, shortest_paths

from .formatting import duration, paragraph, say, table, tables

SHOT = "experiment.shot"  # names a case by itself
SHOWN_MISSES = 5  # cases whose expected values were missed, on the terminal
SHOWN_RESIDUALS = 6
SHOWN_ROWS = 60  # of the table on the terminal
WIDEST_HEAD = 24  # letters of a measure's name above a column; longer ones are abbreviated
LONG_NUMBER = re.compile(r"(-?\d+\.\d{3,})(?=$| )")


class SweepLog:
    """Progress report of a sweep."""

    def __init__(self, driver: Driver, silent: bool):
        self.driver, self.silent = driver, silent
        self.done, self.began = 0, time.monotonic()

    def __enter__(self) -> "SweepLog":
        if not self.silent:
            members = len(self.driver.members)
            workers = self.driver.workers
            amount = f"{members} case{'s' * (members > 1)}, {workers} worker{'s' * (workers > 1)}"
            say(f"{amount}, into {self.driver.folder.path}")
        return self

    def __exit__(
        self, error_type: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        sys.stdout.flush()

    def report_end(self, row: Plain) -> None:
        """Report the end of a case."""
        self.done += 1
        if self.silent:
            return
        paths = shortest_paths([*row["values"]])
        values = row["values"].get(SHOT) or ", ".join(
            f"{path} {format_value(value)}" for path, value in zip(paths, row["values"].values(), strict=True)
        )
        text = row["message"] or _format_measures(row, _main(self.driver.sweep.record, [row])[:3])
        remainder = self._left()
        say(f"{row['number']:5d}  {values}  {row['status']}  {text}{remainder}")
        sys.stdout.flush()

    def _left(self) -> str:
        standing = [(member, self.driver.folder.standing(member).status) for member in self.driver.members]
        costs_left = [member.cost for member, status in standing if status in ("waiting", "running", "interrupted")]
        if not costs_left:
            return ""
        cost_done = sum(member.cost for member, status in standing if status == "done")
        elapsed = time.monotonic() - self.began
        forecast = f", about {duration(elapsed * sum(costs_left) / cost_done)}" if cost_done else ""
        return f"  ({len(costs_left)} left{forecast})"


def _main(record: Sequence[str] | None, rows: Sequence[Plain]) -> list[str]:
    """Return the measures to show: those recorded, with or without values, or the main ones that have some."""
    if record is not None:
        return [name for name in record if any(name in row["measures"] for row in rows)]
    names = dict.fromkeys(name for row in rows for name, entry in row["measures"].items() if entry["value"] is not None)
    return main_measures([*names])


def _format_measures(row: Plain, names: Sequence[str]) -> str:
    parts = []
    for name in names:
        m = row["measures"].get(name, {})
        if name == "perforated":
            parts.append({None: "perforated or not is open", 0.0: "not perforated"}.get(m.get("value"), "perforated"))
        elif isinstance(m.get("value"), int | float):
            display = format_of(name).scale_to(abs(m["value"]))
            parts.append(f"{display.label} {format_value_of(name, m['value'], display)} {display.unit}".rstrip())
    return ", ".join(parts)


def summary(sweep: Sweep, rows: Sequence[Plain], results: Plain, path: Path) -> str:
    """Return the results of a sweep in words and tables."""
    parts = ["", paragraph(results["finding"]), ""] if results.get("finding") else [""]
    if results.get("fit"):
        return "\n".join([*parts, _fit(results["fit"], path), "", f"{len(rows)} runs: {path / 'table.csv'}"])
    if curves := [line for limit in results.get("limits", []) for line in _curves(limit)]:
        parts += [*curves, ""]
    elif lines := result_lines(results, sweep.record):
        parts += [table(lines), ""]
    if "sample" in results:
        parts += [*_slopes(results["sample"], sweep.record)]
    parts += [_rows(rows, sweep.record), ""]
    counts: dict[str, int] = {}
    for row in rows:
        counts[row["status"]] = counts.get(row["status"], 0) + 1
    missed = [f"case {row['number']}: {', '.join(row['missed'])}" for row in rows if row["missed"]]
    if missed:
        rest = f"; and {len(missed) - SHOWN_MISSES} more" if len(missed) > SHOWN_MISSES else ""
        parts += [f"not as expected: {'; '.join(missed[:SHOWN_MISSES])}{rest}", ""]
    parts.append(", ".join(f"{count} {status}" for status, count in counts.items()) + f": {path / 'table.csv'}")
    return "\n".join(parts)


def _rows(rows: Sequence[Plain], record: Sequence[str] | None) -> str:
    paths = list(dict.fromkeys(key for row in rows for key in row["values"]))
    names = _main(record, rows)
    sizes = {name: [abs(row["measures"].get(name, {}).get("value") or 0.0) for row in rows] for name in names}
    displays = {name: format_of(name).scale_to(max(sizes[name], default=0.0)) for name in names}
    heads = (display.label if len(display.label) <= WIDEST_HEAD else display.short for display in displays.values())
    head = ["", *shortest_paths(paths), "", *heads]
    units = ["", *("" for _ in paths), "", *(displays[name].unit for name in names)]
    lines = [head, units]
    values = [format_differences([row["values"].get(path) for row in rows]) for path in paths]
    for row, *settings_cells in zip(rows[:SHOWN_ROWS], *values, strict=False):
        cells = [format_value_of(name, row["measures"].get(name, {}).get("value"), displays[name]) for name in names]
        shown = [LONG_NUMBER.sub(lambda number: f"{float(number[1]):.5g}", cell) for cell in settings_cells]
        lines.append([str(row["number"]), *shown, row["status"], *cells])
    rest = f"\n  and {len(rows) - SHOWN_ROWS} more" if len(rows) > SHOWN_ROWS else ""
    return tables(lines, heads=2 + len(paths)) + rest


def _curves(verdict: Plain) -> Iterator[str]:
    """Yield the curve fitted to the shots of a limit, and correlations beside it."""
    unit = f" {verdict['unit']}" if verdict["unit"] else ""
    place = "".join(f"{path} = {format_value(value)}: " for path, value in verdict["parameters"].items())
    curve = verdict["lambert_jonas"]
    if curve:
        text = f"{place}Lambert-Jonas: {curve['limit']:.4g} m/s, a {curve['a']:.3g}, p {curve['p']:.3g}"
        yield f"{text}, off by {curve['deviation']:.3g} m/s"
    for law in verdict.get("correlations", []):
        yield f"{place}{law['name']}: {law['quantity']}: {law['value']:.0f} m/s ({law['range']})"
    if "recht_ipson" in verdict:
        values = ", ".join(
            f"{abs(shot['residual']):.0f} beside {residual:.0f} m/s at {shot['value']:.5g}{unit}"
            for shot, residual in zip(verdict["shots"], verdict["recht_ipson"]["residuals"], strict=True)
            if shot["happened"] and shot["residual"] is not None
        )
        yield f"{place}residual velocities beside Recht-Ipson's about this limit: {values}"


def _slopes(verdict: Plain, record: Sequence[str] | None) -> list[str]:
    """Return the table of sensitivities of the measures of a sample; empty where they are unknown."""
    lines = [["", "slope", "", "variance", "total Sobol", "R2", "left out"]]
    for name, statistics in verdict.items():
        linear = statistics.get("sensitivity")
        if not linear or (record is not None and name not in record):
            continue
        display = format_of(name)
        for k, (path, unit) in enumerate(linear["inputs"].items()):
            slope = f"{linear['slope'][k] * display.factor:+.3g} ± {linear['error'][k] * display.factor:.1g}"
            per = f"{display.unit or '1'} per {unit or '1'} of {shortest_paths([path])[0]}"
            shares = [f"{100.0 * linear[key][k]:.0f} %" for key in ("share", "total")]
            errors = [f"{linear['r2']:.3f}", f"{100.0 * linear['leave_one_out']:.0f} %"] if k == 0 else ["", ""]
            lines.append([display.label if k == 0 else "", slope, per, *shares, *errors])
    return [table(lines), ""] if len(lines) > 1 else []


def _fit(fit: Plain, folder: Path) -> str:
    """Return a fit's parameters, their correlation and the residuals by shot."""
    shots: dict[str, list[str]] = {}
    for datum in fit["data"]:
        at = "" if datum["at"] is None else f" at {datum['at']:g}"
        shots.setdefault(datum["shot"], []).append(f"{datum['quantity']}{at} {datum['residual']:+.2f}")
    residuals = [
        [shot, ", ".join(texts[:SHOWN_RESIDUALS]) + (" ..." if len(texts) > SHOWN_RESIDUALS else "")]
        for shot, texts in shots.items()
    ]
    parts = [
        table(result_lines({"fit": fit})),
        "",
        "residuals, (computed - measured)/scatter:",
        table(residuals),
        "",
        fit["method"],
    ]
    if "surrogates" in fit:
        worst = max(fit["surrogates"], key=lambda surface: surface["share"])
        parts.append(f"leave-one-out error of the surfaces at most {100.0 * worst['share']:.2g} % of the deviation")
    if fit["material"]:
        parts.append(f"material: {folder / fit['material']['name']}.yaml")
    return "\n".join(parts)
