"""Cells of the tables that the command and the page show."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from hvisph_validation.experiment_set import Criteria

from .comparison import Compared, Verdict

CELLS = ("quantity", "", "shots", "mean error", "worst", "bias", "scatter", "tolerance")


@dataclass(frozen=True)
class Line:
    """A row of a table: one number, or all points of one outline.

    `row`: the number, or the first point.
    `off`: difference as a share; of an outline the mean of their sizes.
    `points`: how many points; 1 of a number.
    """

    row: Compared
    off: float | None
    points: int = 1


def collapsed(rows: Iterable[Compared]) -> Iterator[Line]:
    """Yield rows, with all points of an outline in one."""
    outlines: dict[tuple[str, str], list[Compared]] = {}
    for row in rows:
        if row.measured.quantity == "outline":
            outlines.setdefault((row.measured.shot, row.measured.confidence), []).append(row)
        else:
            yield Line(row, row.off)
    for points in outlines.values():
        offs = [abs(row.off) for row in points if row.off is not None]
        yield Line(points[0], sum(offs) / len(offs) if offs else None, len(points))


def row_cells(line: Line, words: Mapping[str, str]) -> tuple[str, ...]:
    """Return shot, quantity, measured, computed, how far off, and a word on doubt."""
    row, measured = line.row, line.row.measured
    name = words.get(measured.quantity, measured.quantity)
    if measured.at is not None and line.points == 1:
        name += f" at {measured.at:g}"
    doubt = "" if measured.confidence == "seen" else f"{measured.confidence}, "
    word = "" if measured.judged else f"{doubt}shown only"
    if line.points > 1:
        return measured.shot, name, f"{line.points} points", "", percent(line.off, mean=True), word
    if row.is_verdict:
        right = "-" if row.off is None else "wrong" if row.off else "right"
        ratio = f", d/dc {row.ratio:.2f}" if row.ratio is not None else ""
        return measured.shot, name, yes_no(measured.value), yes_no(row.computed, row.reason), right + ratio, word
    unit = "" if measured.unit == "-" else f" {measured.unit}"
    number = f"{measured.value:.4g}" + (f" ± {measured.scatter:.2g}" if measured.scatter else "") + unit
    computed = row.reason or "-"
    if row.computed is not None:
        computed = f"{row.computed:.4g}" + (f" ± {row.uncertainty:.2g}" if row.uncertainty else "") + unit
    return measured.shot, name, number, computed, percent(line.off), word


def verdict_cells(verdict: Verdict, criteria: Criteria | None, words: Mapping[str, str]) -> tuple[str, ...]:
    """Return the row of `CELLS` of a verdict."""
    word = "" if verdict.passed is None else "met" if verdict.passed else "MISSED"
    count = (
        f"{verdict.shots[0]}" if verdict.shots[0] == verdict.shots[1] else f"{verdict.shots[1]} of {verdict.shots[0]}"
    )
    name, required = words.get(verdict.quantity, verdict.quantity), criteria_text(criteria, verdict.unit)
    if verdict.right is not None:
        spread = "" if verdict.farthest is None else f"wrong ones within {100 * verdict.farthest:.0f} % of the curve"
        curve = "" if verdict.of_curve is None else f"the curve: {100 * verdict.of_curve:.0f} %"
        sides = f"{verdict.weak} fail that held, {verdict.strong} hold that failed"
        return name, word, count, f"{100 * verdict.right:.0f} % right", spread, sides, curve, required
    worst = percent(verdict.worst, mean=True) + (f" ({verdict.worst_shot})" if verdict.worst_shot else "")
    mean, scatter = percent(verdict.mean, mean=True), percent(verdict.scatter, mean=True)
    return name, word, count, mean, worst, percent(verdict.bias), scatter, required


def criteria_text(criteria: Criteria | None, unit: str) -> str:
    """Return the criteria of a quantity in a few words."""
    if criteria is None:
        return ""
    unit = "" if unit == "-" else f" {unit}"
    parts = [
        f"mean {percent(criteria.mean, mean=True)}" if criteria.mean is not None else "",
        f"worst {percent(criteria.worst, mean=True)}" if criteria.worst is not None else "",
        f"within {criteria.within:g}{unit}" if criteria.within is not None else "",
        f"{criteria.between[0]:g} to {criteria.between[1]:g}{unit}" if criteria.between is not None else "",
        f"{100 * criteria.right:.0f} % right" if criteria.right is not None else "",
        f"wrong ones within {100 * criteria.wrong_within:.0f} %" if criteria.wrong_within is not None else "",
    ]
    return ", ".join(filter(None, parts))


def percent(share: float | None, *, mean: bool = False) -> str:
    """Return a share in percent, with its sign unless it is a size."""
    if share is None:
        return "-"
    return f"{100 * share:.1f} %" if mean else f"{100 * share:+.1f} %"


def yes_no(value: float | None, reason: str = "") -> str:
    """Return a verdict as a word."""
    return reason or "-" if value is None else "yes" if value > 0.5 else "no"
