"""HTML page of runs: its content from the files of their folders, and the file."""

import json
import os
from collections.abc import Sequence
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from hvisph.casefile.document import symmetry_axes
from hvisph.core.measure_catalogue import format_share, format_time
from hvisph.core.text import Plain
from hvisph.measures.fragments import FEWEST_PARTICLES
from hvisph.measures.measure import debris, measure
from hvisph.measures.measurement_frame import Scene
from hvisph.measures.result import Result
from hvisph.measures.tables import Row, body_rows, headline, rows
from hvisph.output import file_names
from hvisph.output.atomic_write import write_text
from hvisph.output.file_names import REPORT
from hvisph.output.reader import read_snapshot
from hvisph.output.snapshot import Snapshot

from . import setup_section
from .charts import colour_tables, criteria, history_charts, measured_charts, moments
from .frames import Frames, frames
from .setup_section import RunFiles

MOST_PIECES = 12
MOST_MEASURED = 1_000_000  # particles times snapshots that are measured for charts
LARGE_DRIFT = 1e-3  # of the total energy: beyond it a remark
# Mass fractions: name, limit below which it is favourable, and text.
SHARES = (
    ("negative_energy", 1e-2, "has an internal energy below zero"),
    ("failed", 2.0, "has failed"),
    ("above_melting", 2.0, "is above melting"),
    ("beyond_range", 1e-3, "is beyond its material's range"),
)


class RunReport(RunFiles):
    """Report of one run; errors as of `RunFiles`."""

    def content(self) -> Plain:
        """Return all that the page's template asks for."""
        packed = self.frames()
        measured, checked = history_charts(self.history, self.unitless) if self.history else ([], [])
        if 2 < len(self.paths) <= MOST_MEASURED / self.last.count and self.last.dimensions > 1:
            measured = [*measured_charts(measure(self.folder, at="all")), *measured]
        table = self._rows()
        defined = [row for row in table if row.value != "-" or row.passed is not None]
        status = self.summary.get("status", "unfinished")
        verdict, mood = self.verdict()
        main = []  # the measures that matter for the kind of the case
        if "measures" in self.summary:
            results = {name: Result.from_dict(entry) for name, entry in headline(self.summary).items()}
            main = rows(results, self.summary.get("expected", ()), self.unitless)
        return {
            "name": self.name,
            "verdict": verdict,
            "mood": mood,
            "main_rows": [asdict(row) for row in main or defined[:8]],
            "layers": self._layers(),
            "all_rows": [asdict(row) for row in self._rows(variants=True)],
            "bodies": body_rows(self.summary, self.unitless),
            "has_expected": any(row.passed is not None for row in table),
            "frames": packed.content,
            "remarks": packed.remarks,
            "moments": self._moments(),
            "charts": measured,
            "check_charts": checked,
            "debris": self._debris(),
            "checks": self._checks(status),
            "picture": setup_section.picture(self),
            "setup": setup_section.facts(self),
            "materials": {} if self.case is None else self.case.bodies,
            "case": self.text(file_names.CASE),
            "reproduce": setup_section.reproduce(self),
            "files": setup_section.files(self),
        }

    def frames(self) -> Frames:
        """Return the moments for the player."""
        return frames(self.paths, symmetry_axes(self.last.metadata.get("case")))

    def verdict(self) -> tuple[str, str]:
        """Return the outcome of the run in words, and whether it is good."""
        status = self.summary.get("status", "unfinished")
        moment = f"{self.last.time:.4g}" if self.unitless else _in_micro(format_time(self.last.time))
        begin = {
            "done": "ended as planned at",
            "interrupted": "was interrupted at",
            "failed": "failed at",
            "unfinished": "has not ended; shown up to",
        }
        parts = [f"The run {begin.get(status, status)} {moment}."]
        failure = self.summary.get("failure")
        if failure:
            parts.append(str(failure.get("message", "")))
        headline = self.summary.get("answer")
        if headline:
            parts.append(f"{headline[:1].upper()}{headline[1:].rstrip('.')}.")
        expected = self.summary.get("expected", [])
        if expected:
            passed = sum(bool(entry["passed"]) for entry in expected)
            parts.append(f"{passed} of {len(expected)} expectations are met.")
            missed = [row.label for row in self._rows() if row.passed is False]
            if missed:
                parts.append(f"Missed: {', '.join(missed)}.")
        is_bad = status == "failed" or any(not entry["passed"] for entry in expected)
        return " ".join(parts), "bad" if is_bad else "good" if status == "done" else ""

    def _rows(self, variants: bool = False) -> list[Row]:
        results: Plain = {name: Result.from_dict(entry) for name, entry in self.measures.items()}
        return rows(results, self.summary.get("expected", []), self.unitless, variants)

    def _layers(self) -> list[Plain]:
        """Return each layer of the target: its name, whether it is perforated, and its measures as text."""
        reports = []
        for layer in self.summary.get("layers", []):
            results: Plain = {name: Result.from_dict(entry) for name, entry in layer["measures"].items()}
            lines = [asdict(row) for row in rows(results, (), self.unitless, variants=True) if row.value != "-"]
            reports.append({"body": layer["body"], "perforated": layer["perforated"] or "-", "rows": lines})
        return reports

    def _moments(self) -> list[tuple[str, float, str]]:
        marks = moments(self.history, self.last, self.measures, self.summary.get("layers", ()))
        return [
            (name, t, f"{t:.4g}" if self.unitless else _in_micro(format_time(t, ".2f", self.last.time)))
            for name, t in marks
        ]

    def _debris(self) -> list[Plain]:
        if self.last.dimensions == 1:
            return []
        pieces = [
            (body, fragment, role)
            for body in debris(Scene.from_snapshot(self.last, read_snapshot(self.paths[0])))
            for fragment, role in zip(body.fragments, body.roles, strict=True)
            if fragment.count >= FEWEST_PARTICLES
        ]
        rows = []
        for body, fragment, role in sorted(pieces, key=lambda piece: -piece[1].count)[:MOST_PIECES]:
            velocity, speed = np.atleast_1d(fragment.velocity), fragment.speed
            angle = float(np.degrees(np.arccos(np.clip(velocity[0] / speed, -1.0, 1.0)))) if speed > 0.0 else None
            share = fragment.mass / body.mass if body.mass > 0.0 else float("nan")
            name = f"{body.body}{': ' + role if role else ''}"
            rows.append({"name": name, "particles": fragment.count, "share": share, "speed": speed, "angle": angle})
        return rows

    def _checks(self, status: str) -> list[tuple[bool, str]]:
        """Return remarks on the reliability of the run, each with whether it is favourable."""
        remarks: list[tuple[bool, str]] = [(status == "done", f"status: {status}")]
        conservation = self.summary.get("conservation") or {}
        drift = conservation.get("energy_drift")
        if drift is not None:
            remarks.append((abs(drift) < LARGE_DRIFT, f"total energy changed by {100.0 * drift:.2g} %"))
        fractions = self.summary.get("shares")
        if fractions:  # undefined fractions are left out
            parts = [(share, high, words) for name, high, words in SHARES if (share := fractions.get(name)) is not None]
            remarks += [(share < high, f"{format_share(share)} of the mass {words}") for share, high, words in parts]
        else:
            remarks += _state_remarks(self.last)
        if "void_fraction" in self.measures and self.measures["void_fraction"]["value"] is not None:
            voids = float(self.measures["void_fraction"]["value"])
            remarks.append((voids < 0.05, f"voids in the projectile: {100.0 * voids:.2g} %"))
        limits = ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in criteria(self.history)[:4])
        if limits:
            remarks.append((True, f"the step was limited by: {limits}"))
        remarks += [(False, str(text)) for text in self.summary.get("remarks", [])]
        lines = self.text(file_names.LOG).splitlines()
        warnings = [line.partition("warning: ")[2] for line in lines if "warning: " in line]
        return remarks + [(False, text) for text in dict.fromkeys(warnings)]


def _state_remarks(last: Snapshot) -> list[tuple[bool, str]]:
    """Return remarks on the last state: negative internal energies, failed share."""
    mass = last.fields.get("mass")
    if mass is None or mass.sum() <= 0.0:
        return []
    lines = []
    energy = last.fields.get("internal_energy")
    if energy is not None:
        tolerance = float(np.abs(energy).max()) * 1e-6
        share = float(mass[energy < -tolerance].sum() / mass.sum())
        lines.append((share < 1e-3, f"{format_share(share)} of the mass has a negative internal energy"))
    damage = last.fields.get("damage")
    if damage is not None and damage.any():
        lines.append((True, f"{format_share(float(mass[damage >= 1.0].sum() / mass.sum()))} of the mass has failed"))
    return lines


def _in_micro(text: str) -> str:
    """Return a text in which pages write microseconds with their own letter."""
    return text.replace(" us", " µs")


PAGE = Path(__file__).with_name("page")


@cache
def template(name: str) -> Any:
    """Return a template of the folder `page` by its file's name."""
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    return environment.from_string((PAGE / name).read_text(encoding="utf-8"))


SECTIONS = [
    ("verdict", "Result"),
    ("player", "Animation"),
    ("measures-0", "Measures"),
    ("checks-0", "Checks of the run"),
    ("setup-0", "Set-up"),
]


def report(
    runs: Sequence[str | os.PathLike[str]] | str | os.PathLike[str], path: str | os.PathLike[str] | None = None
) -> Path:
    """Write one self-contained page that shows a run, or several side by side.

    `runs`: a folder, or several, of runs, ended or not, or of another code's snapshots.
    `path`: file to write; ``report.html`` in the first run's folder unless given.
    Returns the file.
    Raises `CaseError` when there is no such run, or one holds no snapshots; `OutputError` when the file cannot be
    written.
    """
    reports = [RunReport(Path(run)) for run in ([runs] if isinstance(runs, str | os.PathLike) else runs)]
    names = [page.name for page in reports]
    for page in reports:
        if names.count(page.name) > 1:  # the folder's name as well
            page.name = f"{page.folder.resolve().parent.name}/{page.name}"
    contents = [page.content() for page in reports]
    tables = colour_tables([field["colours"] for content in contents for field in content["frames"]["fields"]])
    target = Path(path) if path is not None else reports[0].folder / REPORT
    packed = {"colours": tables, "runs": [content["frames"] for content in contents]}
    titles = {content["frames"]["title"] for content in contents}
    runs_of = "" if len(contents) == 1 else " / ".join(content["name"] for content in contents)
    title = ": ".join(part for part in (titles.pop() if len(titles) == 1 else "", runs_of) if part)
    text = template("report.html.j2").render(
        title=title or contents[0]["name"],
        sections=SECTIONS,
        runs=contents,
        differences=_differences(reports),
        linked=lambda file: quote(os.path.relpath(file, target.parent).replace(os.sep, "/")),
        # a closing tag inside a script would end it
        packed=json.dumps(packed).replace("<", "\\u003c"),
        css=(PAGE / "report.css").read_text(encoding="utf-8"),
        js=(PAGE / "viewer.js").read_text(encoding="utf-8"),
    )
    write_text(target, text)
    return target


def _differences(reports: Sequence[RunReport]) -> list[Plain]:
    """Return the measures of several runs side by side; empty for a single run."""
    if len(reports) < 2:
        return []
    tables = [{row.name: row for row in run._rows()} for run in reports]
    names = dict.fromkeys(name for table in tables for name, row in table.items() if row.value != "-")
    return [
        {
            "label": next(table[name].label for table in tables if name in table),
            "cells": [table[name].value if name in table else "-" for table in tables],
        }
        for name in names
    ]
