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
import textwrap
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

os.environ.setdefault("NUMBA_NUM_THREADS", "1")

import numpy as np

from hvisph.verification.problem import ALL, SOLIDS, Options
from hvisph.verification.runner import PROBLEMS, Verdict, default_formulation, draw, file_name, verdicts
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
    "spacings": "axisymmetric, graded to 1:2",
}
NOT_RUN = "not run"
# A variant of the default, its setting, and the problems it is for.
ELASTIC, SETTING = "elastic", ["formulation.variant=elastic"]
FOR_ELASTIC = ("cantilever", "elastic_ring", "rebound", "spinning_disc")
READABLE = {"Pa": (1e-9, "GPa"), "J/kg": (1e-3, "kJ/kg"), "m": (1e3, "mm"), "s": (1e6, "us")}
TEXT = """\
# Verification

Made by `python tools/verification.py --page`; do not edit.

`hvisph verify` lists problems with an exact solution; `hvisph verify NAME ...` runs them with every
applicable formulation and prints computed and exact values, tolerances, and pass or FAIL. The exit
code is 0 when all pass and 1 otherwise.

```sh
hvisph verify hugoniot --quick                       # coarse form, seconds
hvisph verify sod plate --formulation default        # only the default formulation
hvisph verify hugoniot --only "12 km/s" --set formulation.h_over_dx=1.4
hvisph verify bars --resolution 0.05mm --keep runs/bars --pictures pictures
```

Problems are in `hvisph/verification/problems/` (five quick ones, installed) or
`validation/problems/` (in a checkout). The table shows how many figures are within their tolerance,
and every figure that a formulation misses (**bold**): of each formulation the trial farthest from
the exact value (in parentheses). All figures and trials, with reasons for the tolerances, are in
[results.json](verification/results.json).

`blind` (`validation/blind/`) is a set of twenty problems unlike the others. Their tolerances were
written before the first run; they are run once a release and never used to change a scheme. Two
set-ups were corrected after the first run.
"""


def main() -> None:
    """Run what is asked and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", choices=[[], *PROBLEMS], help="problems; all unless given")
    parser.add_argument("--formulation", action="append", choices=(*ALL, ELASTIC), help="only this one; repeatable")
    parser.add_argument("--spacing", type=float, help="in place of the problems' own, SI")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--page", action="store_true", help="only write the page from the results")
    arguments = parser.parse_args()
    FOLDER.mkdir(exist_ok=True)
    failed: list[BaseException] = []
    if not arguments.page:
        jobs, results = {}, {}
        with ProcessPoolExecutor(arguments.jobs) as pool:
            for name in arguments.names or PROBLEMS:
                for group in _apart(name, arguments.formulation or (*ALL, ELASTIC)):
                    jobs[pool.submit(_run, name, group, arguments.spacing)] = name
            for job in as_completed(jobs):
                if (error := job.exception()) is not None:
                    failed.append(error)
                    continue
                judged = job.result()
                _store([one.as_dict() for one in judged])
                results.setdefault(jobs[job], []).extend(one for one in judged if one.trial == SHOWN.get(one.problem))
        for name, verdicts_shown in results.items():
            # a picture of one formulation must not replace that of all
            if len(verdicts_shown) > 1 or (verdicts_shown and not (FOLDER / file_name(name, SHOWN[name])).is_file()):
                draw(sorted(verdicts_shown, key=lambda one: [*ALL, ELASTIC].index(one.formulation)), FOLDER)
    _write_page(json.loads(RESULTS.read_text(encoding="utf-8")))
    if failed:  # what the others found is kept
        raise failed[0]


def _apart(name: str, formulations: Sequence[str]) -> list[list[str]]:
    """Return what runs as one piece: each formulation by itself, but where they are held against one another."""
    able = [kind for kind in formulations if kind in PROBLEMS[name].formulations]
    if ELASTIC in formulations and name in FOR_ELASTIC:
        return [*([kind] for kind in able), [ELASTIC]]
    return [able] if PROBLEMS[name].agree is not None else [[kind] for kind in able]


def _run(name: str, formulations: list[str], spacing: float | None) -> list[Verdict]:
    results = []
    settings = SETTING if formulations == [ELASTIC] else []
    real = [default_formulation()] if settings else formulations
    for verdict in verdicts(PROBLEMS[name], real, Options(spacing=spacing), settings, threads=1):
        verdict.formulation = ELASTIC if settings else verdict.formulation
        results.append(verdict)
        print(f"{name}: {verdict.trial}, {verdict.formulation}, {verdict.seconds:.0f} s", flush=True)
    return results


def _store(new: list[dict[str, Any]]) -> None:
    stored = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.is_file() else []
    keys = {(row["problem"], row["formulation"]) for row in new}
    rows = [row for row in stored if (row["problem"], row["formulation"]) not in keys] + new
    rows.sort(key=lambda row: (list(PROBLEMS).index(row["problem"]), [*ALL, ELASTIC, "all"].index(row["formulation"])))
    RESULTS.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


def _write_page(rows: list[dict[str, Any]]) -> None:
    _draw_hugoniots([row for row in rows if row["problem"] == "hugoniot"])
    lines = [TEXT, "## Results", "",
             *_table(rows, list(PROBLEMS), (*SOLIDS, ELASTIC)), *_why(), "", "## Pictures"]  # fmt: skip
    pictures = [f"![{words}](verification/{picture})" for name in PROBLEMS for picture, words in _pictures(name)]
    lines += ["", " ".join(pictures)]
    PAGE.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _table(rows: list[dict[str, Any]], names: Sequence[str], columns: Sequence[str]) -> Iterator[str]:
    """Yield a table of problems, a column each formulation."""
    yield from _header("problem, figure", "tolerance", *(f"`{name}`" for name in columns))
    for name in names:
        mine = [row for row in rows if row["problem"] == name and row["formulation"] in (*columns, "all")]
        yield _line(f"**{name}**: {PROBLEMS[name].title}", "", *(_passed(name, mine, column) for column in columns))
        yield from _figures(mine, columns)


def _pictures(name: str) -> list[tuple[str, str]]:
    files = []
    if name == "hugoniot":
        files.append(("hugoniot.png", "Aluminium on aluminium: off the jump conditions, over impact velocity"))
    if name in SHOWN:
        files.append((file_name(name, SHOWN[name]), f"{name}: {SHOWN[name]}, computed beside exact"))
    return [(file, words) for file, words in files if (FOLDER / file).is_file()]


def _passed(name: str, rows: list[dict[str, Any]], formulation: str) -> str:
    """Return how many figures of a problem are within their tolerance."""
    mine = [row for row in rows if row["formulation"] == formulation]
    figures = [figure for row in mine for figure in row["figures"]]
    failed, not_run = (sum(row["status"] == status for row in mine) for status in ("failed", "refused"))
    cell = f"{sum(figure['passed'] for figure in figures)} of {len(figures)}" if figures else ""
    cell += f"; {failed} runs stopped" if failed else ""
    cell += f"; {not_run} cannot run" if not_run else ""
    if formulation == ELASTIC and not cell:
        return ""
    return cell.lstrip("; ") or (NOT_RUN if formulation in PROBLEMS[name].formulations else "cannot")


def _why() -> list[str]:
    """Return what the words of the table mean, with the reasons why a formulation cannot run a problem."""
    cannot: dict[str, list[str]] = {}
    for name, problem in PROBLEMS.items():
        if any(solid not in problem.formulations for solid in SOLIDS):
            cannot.setdefault(problem.why_not, []).append(name)
    reasons = "; ".join(f"{', '.join(names)}: {why}" for why, names in cannot.items())
    text = f"`{NOT_RUN}`: the full form takes minutes of a core; the tests run the coarse form. `cannot`: {reasons}."
    text += " `projection` has no equation of state and runs implosion and invariance alone."
    return ["", _wrapped(f"{text} `{ELASTIC}` is `{default_formulation()}` with `variant: {ELASTIC}`.")]


def _wrapped(text: str, indent: str = "") -> str:
    """Return a paragraph in lines of the documentation's width."""
    return textwrap.fill(text, 100, subsequent_indent=indent, break_on_hyphens=False, break_long_words=False)


def _figures(rows: list[dict[str, Any]], columns: Sequence[str]) -> Iterator[str]:
    """Yield a row per figure that a formulation misses, with the worst trial of each formulation."""
    for name in dict.fromkeys(figure["name"] for row in rows for figure in row["figures"]):
        pairs = [(row, figure) for row in rows for figure in row["figures"] if figure["name"] == name]
        if all(figure["passed"] for _, figure in pairs):
            continue
        tolerances = list(dict.fromkeys(_asked(figure) for _, figure in pairs))
        cells = [_worst([figure for row, figure in pairs if row["formulation"] in (kind, "all")]) for kind in columns]
        yield _line(name, tolerances[0] if len(tolerances) == 1 else f"{tolerances[0]} to {tolerances[-1]}", *cells)


def _worst(figures: list[dict[str, Any]]) -> str:
    """Return the figure that is farthest off in terms of its tolerance, and its exact value where it is no error."""
    if not figures:
        return ""
    figure = max(figures, key=_share)
    text = _number(figure["found"], figure["unit"])
    if figure["exact"] and not figure["at_most"]:
        text += f" ({_number(figure['exact'], figure['unit'])})"
    return text if figure["passed"] else f"**{text}**"


def _share(figure: dict[str, Any]) -> float:
    """Return how far a figure is off, over its tolerance."""
    if figure["found"] is None or figure["exact"] is None:
        return np.inf
    if figure["relative"] and figure["off"] is not None:
        difference = abs(figure["off"])
    else:
        difference = figure["found"] if figure["at_most"] else abs(figure["found"] - figure["exact"])
    return float(difference / figure["tolerance"]) if figure["tolerance"] else float(difference)


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
            metal, _, speed_text = row["trial"].partition(" on aluminium ")
            if row["formulation"] != formulation or metal != "aluminium" or not speed_text.endswith("1D"):
                continue
            for figure in row["figures"]:
                if figure["name"].endswith("in the target") and figure["off"] is not None:
                    point = (1e3 * float(speed_text.split()[0]), 100.0 * figure["off"])
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
