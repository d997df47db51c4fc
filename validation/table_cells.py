"""Cells of the tables that the command and the page show."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from hvisph_validation.experiment_set import Asked

from .comparison import Compared, Verdict

CELLS = ("quantity", "", "shots", "mean error", "worst", "bias", "scatter", "tolerance")


@dataclass(frozen=True)
class Line:
    """A row of a table: one number, or all points of one outline.

    Parameters
    ----------
    row
        The number, or the first point.
    off
        Difference as a share; of an outline the mean of their sizes.
    points
        How many points; 1 of a number.
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
    row, one = line.row, line.row.measured
    name = words.get(one.quantity, one.quantity)
    if one.at is not None and line.points == 1:
        name += f" at {one.at:g}"
    word = "" if one.judged else f"{one.confidence}, shown only" if one.confidence != "seen" else "shown only"
    if line.points > 1:
        return one.shot, name, f"{line.points} points", "", percent(line.off, mean=True), word
    if row.is_verdict:
        right = "-" if row.off is None else "wrong" if row.off else "right"
        near = f", d/dc {row.ratio:.2f}" if row.ratio is not None else ""
        return one.shot, name, yes_no(one.value), yes_no(row.computed, row.reason), right + near, word
    unit = "" if one.unit == "-" else f" {one.unit}"
    measured = f"{one.value:.4g}" + (f" ± {one.scatter:.2g}" if one.scatter else "") + unit
    computed = row.reason or "-"
    if row.computed is not None:
        computed = f"{row.computed:.4g}" + (f" ± {row.uncertainty:.2g}" if row.uncertainty else "") + unit
    return one.shot, name, measured, computed, percent(line.off), word


def verdict_cells(one: Verdict, asked: Asked | None, words: Mapping[str, str]) -> tuple[str, ...]:
    """Return the row of `CELLS` of a verdict."""
    word = "" if one.passed is None else "met" if one.passed else "MISSED"
    count = f"{one.shots[0]}" if one.shots[0] == one.shots[1] else f"{one.shots[1]} of {one.shots[0]}"
    name = words.get(one.quantity, one.quantity)
    if one.right is not None:
        far = "" if one.farthest is None else f"wrong ones within {100 * one.farthest:.0f} % of the curve"
        curve = "" if one.of_curve is None else f"the curve: {100 * one.of_curve:.0f} %"
        sides = f"{one.weak} fail that held, {one.strong} hold that failed"
        return name, word, count, f"{100 * one.right:.0f} % right", far, sides, curve, asked_text(asked, one.unit)
    worst = percent(one.worst, mean=True) + (f" ({one.worst_shot})" if one.worst_shot else "")
    return (name, word, count, percent(one.mean, mean=True), worst, percent(one.bias), percent(one.scatter, mean=True),
            asked_text(asked, one.unit))  # fmt: skip


def asked_text(asked: Asked | None, unit: str) -> str:
    """Return what is asked of a quantity, in a few words."""
    if asked is None:
        return ""
    unit = "" if unit == "-" else f" {unit}"
    parts = [
        f"mean {percent(asked.mean, mean=True)}" if asked.mean is not None else "",
        f"worst {percent(asked.worst, mean=True)}" if asked.worst is not None else "",
        f"within {asked.within:g}{unit}" if asked.within is not None else "",
        f"{asked.between[0]:g} to {asked.between[1]:g}{unit}" if asked.between is not None else "",
        f"{100 * asked.right:.0f} % right" if asked.right is not None else "",
        f"wrong ones within {100 * asked.wrong_within:.0f} %" if asked.wrong_within is not None else "",
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
