"""The page of validation: a table of all sets, then each set with its results and pictures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

from hvisph.core.errors import OutputError
from hvisph.output import atomic_write

from .comparison import Compared, Verdict, verdicts
from .evaluators import evaluator_of
from .experiments import Experiments, experiment_names
from .pictures import draw
from .results import SetResult, store, stored
from .table_cells import CELLS, percent, verdict_cells

# Order on the page: sets with well-known materials first.
ORDER = (
    *("j2", "taylor", "taylor_hot", "taylor_4340", "taylor_damage", "melt", "cloud", "shield", "shield_oblique"),
    *("shield_scaled", "shield_stuffed", "panel", "perforation", "spall", "crater", "basalt", "planetary"),
)
TEXT = """\
# Validation

Published experiments, computed with formulation, materials and resolution chosen before any comparison and equal
within a set; no constant is fitted to them. Models are axisymmetric with the default formulation unless the set
states otherwise. Where a choice was changed after a first look, the set says so. An error is computed minus measured,
over measured; the table gives the mean of its absolute values, the worst one, the mean with sign (bias) and the
standard deviation (scatter). "8 across" means 8 particles across bar, sphere or bumper. Recalled means cited
from memory, because the source could not be opened; recalled measurements have no tolerance.

{verdicts}

This page is made by `hvisph validate --page docs/validation.md`; do not edit it. All numbers are in the JSON files
in `docs/validation/`. A set is a folder of `cases/validation`: a case, `shots.csv` with the differences,
`measured.csv` with measured values, scatter, source and reliability, `set.yaml` with choices and tolerances. The
commands need a checkout installed with `pip install -e .`.

```sh
hvisph validate taylor shield            # computes sets; the same command continues after an interruption
hvisph validate taylor --table           # measured and computed values, errors
```
"""


def write_page(path: Path, fresh: Sequence[SetResult]) -> Path:
    """Write the page, with results and pictures in the folder of its name; what is not fresh is read from there.

    `path`: the page, a Markdown file.
    `fresh`: results just computed: they replace those of the same set at the same number of particles across.
    """
    folder = path.with_suffix("")
    for result in fresh:
        store(result, folder)
    names = experiment_names()
    sets = [Experiments(name) for name in (*ORDER, *(name for name in names if name not in ORDER)) if name in names]
    stored_results = [(experiments, _best(experiments, folder)) for experiments in sets]
    lines = _header(("set", *CELLS))
    for experiments, best in stored_results:
        lines += _summary(experiments, best)
    text = "\n\n".join(part if part.startswith(("```", "#")) else wrapped(part) for part in TEXT.split("\n\n"))
    parts = [text.format(verdicts="\n".join(lines)).rstrip()]
    parts += ["\n".join(_section(experiments, best, folder)) for experiments, best in stored_results]
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot write {path.parent}: {atomic_write.reason(error)}") from error
    atomic_write.write_text(path, "\n\n".join(parts) + "\n")
    return path


def _best(experiments: Experiments, folder: Path) -> SetResult | None:
    """Return a set's results at its full resolution, or at the second one where that is all there is."""
    results = (stored(folder, experiments.name, experiments.particles(form)) for form in ("full", "second"))
    return next(filter(None, results), None)


def _summary(experiments: Experiments, result: SetResult | None) -> Iterator[str]:
    link = f"[{experiments.name}](#{_anchor(experiments)})"
    words = evaluator_of(experiments.model.evaluator).quantities
    if result is None:
        for name in experiments.model.required or ("",):
            yield _line((link, words.get(name, name), "not computed yet", *[""] * (len(CELLS) - 2)))
        return
    for verdict in verdicts(result.rows, experiments.model.required):
        yield _line((link, *_cells(verdict, experiments)))
    if not any(row.measured.judged for row in result.rows):
        yield _line((link, ", ".join(words.values()), *[""] * (len(CELLS) - 1)))


def _missed(experiments: Experiments, result: SetResult) -> str:
    """Return the quantities beyond their tolerance, with reasons."""
    words = evaluator_of(experiments.model.evaluator).quantities
    verdict_list, why = verdicts(result.rows, experiments.model.required), experiments.model.why
    missed = [verdict.quantity for verdict in verdict_list if verdict.passed is False]
    reasons = {name: why.get(name, "why is not known.").strip() for name in missed}
    return " ".join(f"**Missed**, {words.get(name, name)}: {reason}" for name, reason in reasons.items())


def _cells(verdict: Verdict, experiments: Experiments) -> tuple[str, ...]:
    words = evaluator_of(experiments.model.evaluator).quantities
    name, word, *cells = verdict_cells(verdict, experiments.model.required.get(verdict.quantity), words)
    return name, f"**{word}**" if word == "MISSED" else word, *cells


def _anchor(experiments: Experiments) -> str:
    return "".join(c for c in experiments.model.title.lower() if c.isalnum() or c in " -").replace(" ", "-")


def _section(experiments: Experiments, result: SetResult | None, folder: Path) -> Iterator[str]:
    model = experiments.model
    yield f"## {model.title}"
    yield ""
    yield wrapped(f"`{experiments.name}`. {model.shows} {model.set_up} {model.substitutes or ''}")
    note = "Not computed yet."
    if result is not None:
        note = f"{_missed(experiments, result)} {_resolutions(experiments, result, folder)}"
    for text in f"{(model.found or '').strip()} {note}".split("\n"):
        if text.strip():
            yield ""
            yield wrapped(text)
    if result is None:
        return
    words = evaluator_of(model.evaluator).quantities
    pictures = [f"![{model.title}: {picture.stem.rpartition('.')[2]}]({folder.name}/{picture.name})"
                for picture in draw(result, folder, words)]  # fmt: skip
    if pictures:
        yield from ("", " ".join(pictures))
    failed = [f"{name} ({_status(shot)})" for name, shot in result.shots.items() if shot["status"] != "done"]
    if failed:
        yield ""
        yield wrapped(f"Runs without a result: {', '.join(failed)}.")


def _status(shot: Mapping[str, Any]) -> str:
    """Return why a run has no result."""
    if shot["status"] == "waiting":
        return "not computed"
    return ", ".join(part for part in (shot["status"], shot["message"]) if part)


def _resolutions(experiments: Experiments, result: SetResult, folder: Path) -> str:
    """Return resolution, wall time and the change with the second resolution."""
    number = experiments.particles("second")
    coarse = None if result.across == number else stored(folder, experiments.name, number)
    text = f"With {result.across:g} particles across the set takes {result.seconds / 60.0:.1f} minutes on one core."
    if coarse is None:
        return text
    coarse_rows = {_key(row): row for row in coarse.rows}
    words = evaluator_of(experiments.model.evaluator).quantities
    changes: dict[str, list[float]] = {}
    verdict_changes = 0
    for row in result.rows:
        match = coarse_rows.get(_key(row))
        if match is None or row.computed is None or match.computed is None:
            continue
        if row.is_verdict:
            verdict_changes += (row.computed > 0.5) != (match.computed > 0.5)
            changes.setdefault(row.measured.quantity, [])
        elif row.computed:
            changes.setdefault(row.measured.quantity, []).append(abs(match.computed / row.computed - 1.0))
    changes_text = [f"{words.get(name, name)} {percent(sum(changed) / len(changed), mean=True)}" if changed
            else f"{verdict_changes} predictions" for name, changed in changes.items()]  # fmt: skip
    return f"{text} Mean change with {number:g} across: {', '.join(changes_text)}."


def _key(row: Compared) -> tuple[str, str, float | None, str]:
    measured = row.measured
    return measured.shot, measured.quantity, measured.at, measured.source


def wrapped(text: str) -> str:
    """Return a paragraph in lines of the documentation's width."""
    return fill(" ".join(text.split()), 100, break_on_hyphens=False, break_long_words=False)


def _header(names: Sequence[str]) -> list[str]:
    return [_line(names), _line(["---"] * len(names))]


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
