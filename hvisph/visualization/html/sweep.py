"""HTML page of a sweep: results, sortable table, pictures of the final states and links to the runs."""

import csv
import json
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from hvisph.casefile.document import read_yaml, symmetry_axes
from hvisph.core.errors import CaseError, OutputError
from hvisph.core.text import Plain
from hvisph.output.atomic_write import write_text
from hvisph.output.file_names import REPORT
from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.output.snapshot import Snapshot
from hvisph.visualization.particles import Look, Moment, thumbnail, usual_view
from hvisph.visualization.style import field_of
from hvisph.visualization.sweeps import result_lines, sweep_figure

from .charts import embed_figure, embedded_pixels
from .report import PAGE, template
from .report import report as run_report

MOST, WIDTH = 60, 220  # pictures, pixels across
SHARE = 0.995  # of the particles are not faster than the scale's end


def multiples(folders: Sequence[Path]) -> dict[Path, str]:
    """Return pictures of the first `MOST` last states, coloured by speed, as addresses that hold them; not of 1D."""
    kept = [folder for folder in folders if _last(folder) is not None][:MOST]
    states = map(_last, kept)  # one at a time
    fastest = max((float(np.quantile(field_of(state, "speed"), SHARE)) for state in states if state), default=0.0)
    return {folder: _last_state(folder, max(fastest, 1e-30)) for folder in kept}


def _last(folder: Path) -> Snapshot | None:
    try:
        files = list_snapshots(folder)
        state = read_snapshot(files[-1]) if files else None
    except OutputError:
        return None
    return state if state is not None and state.dimensions > 1 else None


def _last_state(folder: Path, fastest: float) -> str:
    state = _last(folder)
    assert state is not None
    moment = Moment(state, symmetry_axes(state.metadata.get("case")))
    return embedded_pixels(thumbnail(moment, Look(view=usual_view(moment)), (0.0, fastest), WIDTH))


TABLE, RESULTS = "table.csv", "results.json"


def is_sweep(path: str | os.PathLike[str]) -> bool:
    """Return whether a folder is that of a sweep."""
    return (Path(path) / TABLE).is_file() and (Path(path) / RESULTS).is_file()


def sweep_report(
    folder: str | os.PathLike[str], path: str | os.PathLike[str] | None = None, *, each: bool = False
) -> Path:
    """Write the page of a sweep: ``report.html`` in its folder unless `path` is given; with `each`, every run's first.

    Raises `OutputError` when its table or its results cannot be read, or the page cannot be written.
    """
    home = Path(folder)
    results, heads, rows = _results(home), *_table(home)
    title = _title(home) or f"Sweep {home.resolve().name}"
    if each:
        for row in rows:
            with suppress(OutputError, CaseError):  # it keeps a summary only, or has not been run
                run_report([_run(home, row)])
    said_heads, *said_rows = result_lines(results) or [[]]
    svg = ""  # where there is nothing to draw
    with suppress(CaseError):
        svg = embed_figure(sweep_figure(results, _plain(rows)), "What the sweep says")
    text = template("sweep.html.j2").render(
        title=title,
        css=(PAGE / "report.css").read_text(encoding="utf-8"),
        results=results,
        failures=results.get("failures", []),
        said_heads=said_heads,
        said_rows=said_rows,
        svg=svg,
        heads=heads,
        rows=[_row(home, heads, row) for row in rows],
        pictures=_pictures(home, rows),
    )
    target = Path(path) if path is not None else home / REPORT
    write_text(target, text)
    return target


def _results(home: Path) -> Plain:
    try:
        return dict(json.loads((home / RESULTS).read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise OutputError(f"cannot read {home / RESULTS}: {error}") from error


def _table(home: Path) -> tuple[list[str], list[dict[str, str]]]:
    """Return heads and rows of the table, without uncertainties, and the folder in place of its path."""
    try:
        with (home / TABLE).open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise OutputError(f"cannot read {home / TABLE}: {error}") from error
    heads = [head for head in (rows[0] if rows else {}) if not head.startswith("± ") and head != "folder"]
    return [head for head in heads if any(row[head] for row in rows)], rows


def _plain(rows: Sequence[Mapping[str, str]]) -> list[Plain]:
    """Return rows of the table as the picture takes them."""
    cells = []
    for row in rows:
        names = list(row)
        measures = {}
        for head in names[: names.index("energy_drift")]:
            if f"± {head}" in row and row[head]:
                words = {"True": 1.0, "False": 0.0}
                value = words[row[head]] if row[head] in words else float(row[head])
                measures[head.partition(" [")[0]] = {"value": value}
        values = {head: row[head] for head in names[1 : names.index("status")]}
        cells.append({"values": values, "status": row["status"], "measures": measures})
    return cells


def _title(home: Path) -> str:
    """Return the sweep's title, or that of its case; empty where there is none."""
    for name in ("sweep.yaml", "base.yaml"):
        with suppress(CaseError, AttributeError):
            title = str(read_yaml(home / name).value.get("title", ""))
            if title:
                return title
    return ""


def _run(home: Path, row: Mapping[str, str]) -> Path:
    """Return the folder of a row's run: inside the sweep's, wherever that lies now."""
    inside = home / "runs" / Path(row["folder"]).name
    return inside if inside.is_dir() else Path(row["folder"])


def _pictures(home: Path, rows: Sequence[Mapping[str, str]]) -> list[dict[str, str]]:
    """Return small pictures of the last states of the runs, with the varied settings and links to their pages."""
    if not rows:
        return []
    names = list(rows[0])
    varied = [name for name in names[1 : names.index("status")] if len({row[name] for row in rows}) > 1]
    shown = multiples([_run(home, row) for row in rows])
    captions = []
    for row in rows:
        run = _run(home, row)
        if run in shown:
            values = ", ".join(_short("", row[name]) for name in varied)
            link = os.path.relpath(run / REPORT, home) if (run / REPORT).is_file() else ""
            captions.append({"image": shown[run], "text": f"{row['number']}: {values}", "link": link})
    return captions


def _row(home: Path, heads: Sequence[str], row: Mapping[str, str]) -> Plain:
    page = _run(home, row) / REPORT
    link = os.path.relpath(page, home) if page.is_file() else ""
    return {"link": link, "cells": [{"text": _short(head, row[head]), "sort": row[head]} for head in heads]}


def _short(head: str, cell: str) -> str:
    """Return a cell with as many digits as a reader wants."""
    if head in ("number", "status", "message"):
        return cell
    try:
        return f"{float(cell):.5g}"
    except ValueError:
        return cell
