"""HTML page of a run."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import quote

from hvisph.output.atomic_write import write_text
from hvisph.output.file_names import REPORT
from hvisph.visualization.inline import colour_tables

from .content import Told

PAGE = Path(__file__).with_name("page")


@cache
def template(name: str) -> Any:
    """Return a template of the folder `page` by its file's name."""
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    return environment.from_string((PAGE / name).read_text(encoding="utf-8"))


SECTIONS = [("verdict", "Verdict"), ("player", "Player"), ("measures-0", "Measures"), ("health-0", "Health"),
            ("setup-0", "Set-up")]  # fmt: skip


def report(runs: Sequence[str | os.PathLike[str]], path: str | os.PathLike[str] | None = None) -> Path:
    """Write one self-contained page that shows a run, or several side by side.

    Parameters
    ----------
    runs
        Folders of runs, ended or not; folders of another code's snapshots.
    path
        File to write; ``report.html`` in the first run's folder unless given.

    Returns
    -------
    The file.

    Raises
    ------
    CaseError
        When there is no such run, or one holds no snapshots.
    OutputError
        When the file cannot be written.
    """
    told = [Told(Path(run)) for run in runs]
    _distinct(told)
    contents = [one.content() for one in told]
    tables = colour_tables([field["colours"] for one in contents for field in one["frames"]["fields"]])
    target = Path(path) if path is not None else told[0].folder / REPORT
    packed = {"colours": tables, "runs": [one["frames"] for one in contents]}
    titles = {one["frames"]["title"] for one in contents}
    names = "" if len(contents) == 1 else " / ".join(one["name"] for one in contents)
    title = ": ".join(part for part in (titles.pop() if len(titles) == 1 else "", names) if part)
    text = template("report.html.j2").render(
        title=title or contents[0]["name"], sections=SECTIONS, runs=contents, differences=_differences(told),
        linked=lambda file: quote(os.path.relpath(file, target.parent).replace(os.sep, "/")),
        # a closing tag inside a script would end it
        packed=json.dumps(packed).replace("<", "\\u003c"),
        css=(PAGE / "report.css").read_text(encoding="utf-8"), js=(PAGE / "viewer.js").read_text(encoding="utf-8"),
    )  # fmt: skip
    write_text(target, text)
    return target


def _distinct(told: Sequence[Told]) -> None:
    """Give runs of one name their folder's name as well."""
    names = [one.name for one in told]
    for one in told:
        if names.count(one.name) > 1:
            one.name = f"{one.folder.resolve().parent.name}/{one.name}"


def _differences(told: Sequence[Told]) -> list[dict[str, Any]]:
    """Return the measures of several runs side by side; none for a single one."""
    if len(told) < 2:
        return []
    tables = [one.row_values() for one in told]
    names = dict.fromkeys(name for table in tables for name, row in table.items() if row.value != "-")
    return [
        {"label": next(table[name].label for table in tables if name in table),
         "cells": [table[name].value if name in table else "-" for table in tables]}
        for name in names
    ]  # fmt: skip
