"""Run the verification suite and write docs/verification.md, its pictures and its results.

    python tools/verification.py [NAME ...] [--formulation TYPE ...] [--spacing DX] [--jobs 2] [--page]

Runs all problems in their full form by all formulations, or those named, and puts what was found into
docs/verification/results.json in place of what stood there of the same problem and formulation; `--page` only
writes the page anew from there.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

os.environ.setdefault("NUMBA_NUM_THREADS", "1")

import numpy as np

from hvisph.verification.pictures import draw, file_name
from hvisph.verification.problem import ALL, Options
from hvisph.verification.problems import PROBLEMS
from hvisph.verification.runner import Verdict, default_formulation, verdicts
from hvisph.visualization.curves import Curve, curves_picture

DOCS = Path(__file__).parents[1] / "docs"
FOLDER, RESULTS, PAGE = DOCS / "verification", DOCS / "verification/results.json", DOCS / "verification.md"
# The trials whose pictures the page shows.
SHOWN = {
    "hugoniot": "steel on aluminium 6 km/s 1D",
    "plate": "Mie-Grueneisen",
    "sod": "dx 0.0025",
    "blast": "dx 0.00125",
    "noh": "planar",
    "tension": "patch, plane strain",
    "bars": "1D gap 0",
    "cantilever": "dx 0.4 mm",
    "implosion": "cylinder",
    "axisymmetric": "sphere",
    "spacings": "rings, graded to 1:2",
}
NOT_RUN = "not run"
READABLE = {"Pa": (1e-9, "GPa"), "J/kg": (1e-3, "kJ/kg"), "m": (1e3, "mm"), "s": (1e6, "us")}
MOST_ROWS = 60  # of a table; a problem with more has one row a trial
TEXT = """\
# Verification

Made by `python tools/verification.py`; do not edit.

`hvisph verify` lists problems with an exact solution; `hvisph verify NAME...` runs them by every formulation that can
and prints computed, exact, how far off, what is asked, and pass or FAIL. It ends with 0 when all is as asked, with 1
when something is not.

```sh
hvisph verify hugoniot --quick                       # coarse form, seconds
hvisph verify sod noh --formulation default          # only what a case gets that names no formulation
hvisph verify hugoniot --only "12 km/s" --set formulation.kernel=quartic_spline --set formulation.h_over_dx=1.2
hvisph verify bars --resolution 0.05mm --keep runs/bars --pictures pictures
hvisph verify --all --json > results.json            # for programs
```

`--set` lays a setting over every case, `--only` chooses trials by their names, `--resolution` another spacing,
`--seeds` the number of random starts, `--keep` keeps the runs, `--pictures` draws computed beside exact. A formulation
that cannot run a case says so and counts as neither right nor wrong. A run that stops itself fails.

A problem is one file of `hvisph/verification/problems/`: its cases, its exact solution in `hvisph/exact`, and its
figures, each with the tolerance that is asked. Coarse forms run in the tests. All figures below, with tolerances and
reasons, are in [results.json](verification/results.json).
"""


def main() -> None:
    """Run what is asked and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", choices=[[], *PROBLEMS], help="problems; all unless given")
    parser.add_argument("--formulation", action="append", choices=ALL, help="only this one; repeatable")
    parser.add_argument("--spacing", type=float, help="in place of the problems' own, SI")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--page", action="store_true", help="only write the page from the results")
    asked = parser.parse_args()
    FOLDER.mkdir(exist_ok=True)
    failed: list[BaseException] = []
    if not asked.page:
        jobs, shown = {}, {}
        with ProcessPoolExecutor(asked.jobs) as pool:
            for name in asked.names or PROBLEMS:
                for chosen in _apart(name, asked.formulation or ALL):
                    jobs[pool.submit(_run, name, chosen, asked.spacing)] = name
            for job in as_completed(jobs):
                if (error := job.exception()) is not None:
                    failed.append(error)
                    continue
                found = job.result()
                _store([one.as_dict() for one in found])
                shown.setdefault(jobs[job], []).extend(one for one in found if one.trial == SHOWN.get(one.problem))
        for name, verdicts_shown in shown.items():
            # a picture of one formulation must not replace that of all
            if len(verdicts_shown) > 1 or (verdicts_shown and not (FOLDER / file_name(name, SHOWN[name])).is_file()):
                draw(sorted(verdicts_shown, key=lambda one: ALL.index(one.formulation)), FOLDER)
    _write_page(json.loads(RESULTS.read_text(encoding="utf-8")))
    if failed:  # what the others found is kept
        raise failed[0]


def _apart(name: str, formulations: Sequence[str]) -> list[list[str]]:
    """Return what runs as one piece: each formulation by itself, but where they are held against one another."""
    able = [one for one in formulations if one in PROBLEMS[name].formulations]
    return [able] if PROBLEMS[name].agree is not None else [[one] for one in able]


def _run(name: str, formulations: list[str], spacing: float | None) -> list[Verdict]:
    found = []
    for verdict in verdicts(PROBLEMS[name], formulations, Options(spacing=spacing), threads=1):
        found.append(verdict)
        print(f"{name}: {verdict.trial}, {verdict.formulation}, {verdict.seconds:.0f} s", flush=True)
    return found


def _store(found: list[dict[str, Any]]) -> None:
    kept = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.is_file() else []
    done = {(row["problem"], row["formulation"]) for row in found}
    rows = [row for row in kept if (row["problem"], row["formulation"]) not in done] + found
    rows.sort(key=lambda row: (list(PROBLEMS).index(row["problem"]), [*ALL, "all"].index(row["formulation"])))
    RESULTS.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


def _write_page(rows: list[dict[str, Any]]) -> None:
    _draw_hugoniots([row for row in rows if row["problem"] == "hugoniot"])
    lines = [TEXT, *_summary(rows)]
    for name, problem in PROBLEMS.items():
        mine = [row for row in rows if row["problem"] == name]
        if not mine:
            continue
        lines += ["", f"## {name}", "", f"{problem.title[0].upper()}{problem.title[1:]}.", *_table(mine)]
        for picture, words in _pictures(name):
            lines += ["", f"![{words}](verification/{picture})"]
    PAGE.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _pictures(name: str) -> list[tuple[str, str]]:
    found = []
    if name == "hugoniot":
        found.append(("hugoniot.png", "Aluminium on aluminium: off the jump conditions, over impact velocity"))
    if name in SHOWN:
        found.append((file_name(name, SHOWN[name]), f"{name}: {SHOWN[name]}, computed beside exact"))
    return [(file, words) for file, words in found if (FOLDER / file).is_file()]


def _summary(rows: list[dict[str, Any]]) -> list[str]:
    """Return the table of problems by formulations: figures as asked, of all."""
    lines = ["## Figures as asked", "", f"The default formulation is `{default_formulation()}`.", "",
             *_header("problem", *(f"`{name}`" for name in ALL))]  # fmt: skip
    for name in PROBLEMS:
        cells = []
        for formulation in ALL:
            mine = [row for row in rows if (row["problem"], row["formulation"]) == (name, formulation)]
            figures = [figure for row in mine for figure in row["figures"]]
            good, failed = sum(f["passed"] for f in figures), sum(row["status"] == "failed" for row in mine)
            refused = sum(row["status"] == "refused" for row in mine)
            cell = f"{good} of {len(figures)}" if figures else ""
            cell += f"; {failed} runs stopped" if failed else ""
            cell += f"; {refused} cannot run" if refused else ""
            able = formulation in PROBLEMS[name].formulations
            cells.append(cell.lstrip("; ") or (NOT_RUN if able else "cannot"))
        lines.append(_line(f"[{name}](#{name})", *cells))
    return [*lines, *_why(rows)]


def _why(rows: list[dict[str, Any]]) -> list[str]:
    """Return why cells hold no figures: what cannot run, by reason, and what has not been run."""
    cannot: dict[str, list[str]] = {}
    for name, problem in PROBLEMS.items():
        others = [one for one in ALL if one not in problem.formulations]
        if others:
            cannot.setdefault(f"{', '.join(f'`{one}`' for one in others)}: {problem.why_not}", []).append(name)
    lines = ["", "What cannot run a problem:", "", *(f"- {why} ({', '.join(names)})" for why, names in cannot.items())]
    there = {(row["problem"], row["formulation"]) for row in rows}
    missing = {name: [f"`{one}`" for one in problem.formulations if (name, one) not in there]
               for name, problem in PROBLEMS.items()}  # fmt: skip
    if any(missing.values()):
        who = "; ".join(f"{name} by {', '.join(found)}" for name, found in missing.items() if found)
        lines += ["", f"Marked `{NOT_RUN}`, since the full form takes minutes of a core for each: {who}. Their coarse "
                  "form runs in the tests, and `hvisph verify` runs the full one."]  # fmt: skip
    return lines


def _table(rows: list[dict[str, Any]]) -> list[str]:
    names = [name for name in (*ALL, "all") if any(row["formulation"] == name for row in rows)]
    trials = list(dict.fromkeys(row["trial"] for row in rows))
    by = {(row["trial"], row["formulation"]): row for row in rows}
    figures = {trial: list(dict.fromkeys(f["name"] for row in rows if row["trial"] == trial for f in row["figures"]))
               for trial in trials}  # fmt: skip
    if sum(map(len, figures.values())) > MOST_ROWS:
        lines = ["", "The figure of each kind that is farthest off; bold where one misses.", "",
                 *_header("trial", *(f"`{name}`" for name in names))]  # fmt: skip
        return lines + [_line(trial, *(_worst(by.get((trial, name))) for name in names)) for trial in trials]
    lines = ["", *_header("trial", "figure", "exact", "asked", *(f"`{name}`" for name in names))]
    for trial in trials:
        for figure in figures[trial] or [""]:
            cells = [_cell(by.get((trial, name)), figure) for name in names]
            one = next((f for name in names for f in (by.get((trial, name)) or {"figures": []})["figures"]
                        if f["name"] == figure), None)  # fmt: skip
            exact, limit = (_number(one["exact"], one["unit"]), _asked(one)) if one else ("", "")
            lines.append(_line(trial, figure, exact, limit, *cells))
    refused = {row["formulation"]: row["message"] for row in rows if row["status"] == "refused"}
    stopped = {(row["trial"], row["formulation"]): row["message"] for row in rows if row["status"] == "failed"}
    lines += [""] if refused or stopped else []
    lines += [f"- `{name}` cannot run: {message}" for name, message in refused.items()]
    return lines + [f"- {trial}, `{name}`: {message}" for (trial, name), message in stopped.items()]


def _cell(row: dict[str, Any] | None, figure: str) -> str:
    if row is None:
        return ""
    if row["status"] != "done":
        return "cannot" if row["status"] == "refused" else "**stops**"
    found = next((f for f in row["figures"] if f["name"] == figure), None)
    if found is None:
        return ""
    text = _number(found["found"], found["unit"])
    return text if found["passed"] else f"**{text}**"


def _worst(row: dict[str, Any] | None) -> str:
    if row is None:
        return ""
    if row["status"] != "done":
        return "cannot" if row["status"] == "refused" else "**stops**"
    groups: dict[str, list[dict[str, Any]]] = {}
    for figure in row["figures"]:
        groups.setdefault(figure["name"].split()[0], []).append(figure)
    cells = []
    for name, figures in groups.items():
        worst = max(figures, key=lambda f: np.inf if f["off"] is None else abs(f["off"]))
        off = "no number" if worst["off"] is None else f"{100 * worst['off']:+.2g} %"
        text = f"{name} {off if worst['relative'] else format(worst['found'], '.3g')}"
        cells.append(text if all(f["passed"] for f in figures) else f"**{text}**")
    return ", ".join(cells)


def _asked(figure: dict[str, Any]) -> str:
    if figure["relative"]:
        return f"{100 * figure['tolerance']:.3g} %"
    return f"{'at most ' if figure['at_most'] else '+-'}{_number(figure['tolerance'], figure['unit'])}"


def _number(value: float | None, unit: str) -> str:
    if value is None:
        return "no number"
    factor, name = READABLE.get(unit, (1.0, unit))
    return f"{factor * value:.4g} {name}".rstrip()


def _draw_hugoniots(rows: list[dict[str, Any]]) -> None:
    """Draw how far stress, density and energy are off over impact velocity, aluminium on aluminium."""
    panels: dict[str, list[Curve]] = {}
    for formulation in ALL:
        found: dict[str, list[tuple[float, float]]] = {}
        for row in rows:
            metal, _, rest = row["trial"].partition(" on aluminium ")
            if row["formulation"] != formulation or metal != "aluminium" or not rest.endswith("1D"):
                continue
            for figure in row["figures"]:
                if figure["name"].endswith("in the target") and figure["off"] is not None:
                    point = (1e3 * float(rest.split()[0]), 100.0 * figure["off"])
                    found.setdefault(figure["name"].split()[0], []).append(point)
        for name, points in found.items():
            x, y = np.array(sorted(points)).T
            panels.setdefault(f"{name}, off", []).append(Curve(formulation, x, y, marked=True))
    if panels:
        units = dict.fromkeys(panels, "%")
        curves_picture(panels, FOLDER / "hugoniot.png", title="aluminium on aluminium: off the jump conditions",
                       across="velocity", units=units)  # fmt: skip


def _header(*names: str) -> list[str]:
    return [_line(*names), _line(*("---" for _ in names))]


def _line(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    main()
