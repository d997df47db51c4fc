"""Final report of a run on the terminal, and the exit code."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from hvisph.cli.guard import FAILED
from hvisph.core.errors import HvisphError
from hvisph.core.measure_catalogue import format_share
from hvisph.core.text import Plain, sanitize
from hvisph.parallel import is_first

from .formatting import duration, echo_json, say, show

if TYPE_CHECKING:
    from hvisph.case.case import Case
    from hvisph.simulation.finalize import Outcome

    from .progress import Silence


def listener_for(case: Case, silent: bool) -> Silence:
    """Return the listener: a progress bar on a terminal, lines elsewhere."""
    from .progress import Lines, Live, Silence

    if silent or not is_first():
        return Silence()
    return Live(case) if sys.stdout.isatty() else Lines(case)


def conclude(
    outcome: Outcome, unitless: bool, quiet: bool, as_json: bool, report: bool = False, everything: bool = False
) -> None:
    """Print how a run ended, with `report` after writing its page, and leave the command with its exit code."""
    if not is_first():  # of several processes one speaks
        raise typer.Exit(outcome.exit_code)
    page = _page(outcome.folder) if report else None
    if as_json:
        echo_json(outcome.summary)
    elif not quiet:
        show(_results(outcome.summary, outcome.folder, unitless, everything))
        if page is not None:
            say(f"Report: {page}")
    failure = outcome.summary["failure"]
    if failure is not None:
        say(f"error: the run failed: {failure['message']}", err=True, red=True)
    if outcome.summary["status"] == "interrupted":
        say(f"stopped by {outcome.signal}; go on with: hvisph resume {outcome.folder}", err=True)
    raise typer.Exit(outcome.exit_code or (FAILED if failure is not None else 0))


@contextmanager
def interrupt_notice(folder: Path | str) -> Iterator[None]:
    """Print how to resume a run that a second Ctrl-C ends in this block."""
    try:
        yield
    except KeyboardInterrupt:
        begun = any(Path(folder).glob("checkpoint/*.h5")) and not (Path(folder) / "summary.json").exists()
        if begun and is_first():
            say(f"stopped before it was summed up; go on with: hvisph resume {folder}", err=True)
        raise


def _page(folder: Path) -> Path | None:
    """Write and return the report of a run; None, with a warning, where it cannot be written."""
    from hvisph.visualization.html.report import report

    try:
        return report([folder])
    except HvisphError as error:
        say(f"warning: no report: {error}", err=True)
        return None


SHARES = {
    "failed": "failed",
    "above_melting": "above melting",
    "beyond_range": "beyond the range of its material",
    "negative_energy": "with negative energy",
}
MOST_BODIES = 8  # in the table of bodies


def _health(summary: Plain) -> str:
    """Return drifts of conserved quantities and mass fractions in one line."""
    drifts = [
        f"{name.replace('_', ' ')} {value:.1e}"
        for name, value in summary["conservation"].items()
        if value is not None and name.endswith("drift")
    ]
    shares = summary.get("shares") or {}
    parts = [f"{format_share(shares[name])} {word}" for name, word in SHARES.items() if shares.get(name)]
    mass = f"; of the mass: {', '.join(parts)}" if parts else ""
    return f"Health: {', '.join(drifts)}{mass}"


def _unsettled(summary: Plain) -> str:
    """Return how many measures still change at the end; empty if none does."""
    sections = [summary, *(summary.get("layers") or []), summary.get("projectile") or {}, summary.get("cloud") or {}]
    values = [
        one for section in sections for one in (section.get("measures") or {}).values() if one["value"] is not None
    ]
    changing = sum(one.get("settled") is False for one in values)
    return f"{changing} of {len(values)} measures still change: run longer" if changing else ""


def _results(summary: Plain, folder: Path, unitless: bool, everything: bool) -> str:
    from hvisph.measures.tables import headline

    from .results_table import bodies_table, results_table

    pace = summary["microseconds_per_particle_step"]
    cost = f", {pace:.3f} us per particle-step" if pace is not None else ""
    state = {"done": "Done", "failed": "Failed", "interrupted": "Interrupted"}[summary["status"]]
    lines = ["", *([summary["answer"], ""] if summary["answer"] else [])]
    if everything:
        lines += _all_results(summary, unitless)
    else:
        expected = [entry | {"source": ""} for entry in summary["expected"]]
        lines += [results_table(headline(summary), expected, unitless), ""]
        if not (summary.get("layers") or len(summary["bodies"]) > MOST_BODIES):
            lines += [bodies_table(summary, unitless), ""]
        lines += [_health(summary), *filter(None, [_unsettled(summary)])]
    lines.append(
        f"{state} after {summary['steps']} steps in {duration(summary['wall_seconds'])} "
        f"on {summary['threads']} thread{'s' if summary['threads'] > 1 else ''}{cost}: {sanitize(folder)}"
    )
    if not everything:
        lines.append(f"All measures: hvisph measure {sanitize(folder)}; a page: hvisph report {sanitize(folder)}")
    missed = [entry["name"] for entry in summary["expected"] if not entry["passed"]]
    if missed:
        lines.append(f"Not as expected: {', '.join(missed)}")
    return "\n".join(lines)


def _all_results(summary: Plain, unitless: bool) -> list[str]:
    """Return all measures, sections, bodies and correlations as text."""
    from hvisph.cli.commands.references import correlations_text

    from .results_table import bodies_table, results_table, sections_table

    drifts = {name: value for name, value in summary["conservation"].items() if value is not None}
    lines = [results_table(summary["measures"], summary["expected"], unitless, drifts), ""]
    lines += [f"{text}\n" for text in (sections_table(summary, unitless), bodies_table(summary, unitless)) if text]
    pressures = summary.get("pressures") or {}
    if pressures.get("impedance_match") and pressures.get("highest"):
        scale, unit = (1.0, "") if unitless else (1e-9, " GPa")
        highest, estimate = (scale * pressures[name] for name in ("highest", "impedance_match"))
        lines.append(
            f"Highest pressure {highest:.3g}{unit}; {estimate:.3g}{unit} by impedance matching of a flat impact"
        )
    lines.append(_health(summary))
    return [*lines, *(["", correlations_text(summary["correlations"])] if summary.get("correlations") else []), ""]
