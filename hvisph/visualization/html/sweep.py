"""HTML page of a sweep: results, sortable table, pictures of the final states and links to the runs."""

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from hvisph.casefile.document import symmetry_axes
from hvisph.core.errors import CaseError, OutputError
from hvisph.core.text import PlainMapping, format_differences
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
    drawable = [folder for folder in folders if _last(folder) is not None][:MOST]
    states = map(_last, drawable)  # one at a time
    fastest = max((float(np.quantile(field_of(state, "speed"), SHARE)) for state in states if state), default=0.0)
    return {folder: _last_state(folder, max(fastest, 1e-30)) for folder in drawable}


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


def sweep_report(
    folder: str | os.PathLike[str],
    title: str,
    results: PlainMapping,
    rows: Sequence[PlainMapping],
    table: Sequence[Sequence[object]],
    path: str | os.PathLike[str] | None = None,
    *,
    record: Sequence[str] | None = None,
    each: bool = False,
) -> Path:
    """Write the page of a sweep: ``report.html`` in its folder unless `path` is given; with `each`, every run's first.

    `results`, `rows` and `table` are those of `hvisph.sweeps`: the joint results, the cases, and their table with its
    heads; `record` names the measures to show, all unless given. Raises `OutputError` when it cannot be written.
    """
    home = Path(folder)
    if each:
        for row in rows:
            with suppress(OutputError, CaseError):  # it keeps a summary only, or has not been run
                run_report([row["folder"]])
    said_heads, *said_rows = result_lines(results, record) or [[]]
    svg = ""  # where there is nothing to draw
    with suppress(CaseError):
        svg = embed_figure(sweep_figure(results, rows, record), "What the sweep says")
    heads, *cells = table
    columns = [k for k, head in enumerate(map(str, heads)) if not head.startswith("± ") and head != "folder"]
    columns = [k for k in columns if any(row[k] not in (None, "") for row in cells)]
    text = template("sweep.html.j2").render(
        title=title,
        css=(PAGE / "report.css").read_text(encoding="utf-8"),
        results=results,
        said_heads=said_heads,
        said_rows=said_rows,
        svg=svg,
        heads=[heads[k] for k in columns],
        rows=[
            {"link": _page(home, row), "cells": [{"text": _short(line[k]), "sort": _plain(line[k])} for k in columns]}
            for row, line in zip(rows, cells, strict=True)
        ],
        pictures=_pictures(home, rows),
    )
    target = Path(path) if path is not None else home / REPORT
    write_text(target, text)
    return target


def _page(home: Path, row: PlainMapping) -> str:
    """Return the address of the page of a row's run; empty where it has none."""
    page = Path(row["folder"]) / REPORT
    return os.path.relpath(page, home) if page.is_file() else ""


def _pictures(home: Path, rows: Sequence[PlainMapping]) -> list[dict[str, str]]:
    """Return small pictures of the last states of the runs, with the varied settings and links to their pages."""
    paths = dict.fromkeys(path for row in rows for path in row["values"])
    texts = {path: format_differences([row["values"].get(path) for row in rows]) for path in paths}
    varied = [cells for cells in texts.values() if len(set(cells)) > 1]
    images = multiples([Path(row["folder"]) for row in rows])
    return [
        {
            "image": images[Path(row["folder"])],
            "text": f"{row['number']}: {', '.join(cells[k] for cells in varied)}",
            "link": _page(home, row),
        }
        for k, row in enumerate(rows)
        if Path(row["folder"]) in images
    ]


def _plain(cell: object) -> str:
    return "" if cell is None else str(cell)


def _short(cell: object) -> str:
    """Return a cell with as many digits as a reader wants."""
    return f"{cell:.5g}" if isinstance(cell, float) else _plain(cell)
