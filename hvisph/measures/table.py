"""Measures as rows of text for people: centimetres or millimetres, gigapascals, per cent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hvisph.core.measure_catalogue import Look, look_of

from .result import Result

# Units of shares and angles, of which little is nothing; and what is next to nothing of any unit for people.
UNSIZED = ("", "%", "deg")
LEAST = 1e-6
_TIME = Look("time", "t", "us", 2)


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Parameters
    ----------
    name, label
        The measure's name in files, and in words.
    value, expected
        Texts with uncertainty or tolerance and unit; `value` is a dash where there is none,
        `expected` is empty where nothing is expected.
    passed
        None where nothing is expected.
    note
        When a peak was reached, where the expected value comes from, or why there is no value.
    """

    name: str
    label: str
    value: str
    expected: str = ""
    passed: bool | None = None
    note: str = ""


def rows(
    results: Mapping[str, Result | float | None],
    expected: Sequence[Mapping[str, Any]] = (),
    unitless: bool = False,
) -> list[Row]:
    """Return the table's rows in the order of `results`.

    Parameters
    ----------
    results
        Results by name, plain numbers among them.
    expected
        What `hvisph.measures.expected.compare` returned.
    unitless
        True for cases without units: numbers are shown as they are.
    """
    by_name = {entry["name"]: entry for entry in expected}
    table = []
    for name, value in results.items():
        result = value if isinstance(value, Result) else Result(value, "")
        look = look_of(name, result.unit, unitless)
        entry = by_name.get(name)
        notes = [result.reason] if result.value is None else []
        if not result.settled:
            notes.append("not settled")
        if result.time is not None:
            notes.append(f"at t = {result.time:.4g}" if unitless else f"at {_text(result.time, None, _TIME)}")
        target = ""
        if entry is not None:
            target = _shown(name, entry["expected"], entry["tolerance"], look)
            notes.append(entry["source"])
        table.append(
            Row(
                name=name,
                label=look.label,
                value=_shown(name, result.value, result.uncertainty, look),
                expected=target,
                passed=entry["passed"] if entry is not None else None,
                note="; ".join(note for note in notes if note),
            )
        )
    return table


def _shown(name: str, value: float | None, spread: float | None, look: Look) -> str:
    if name == "perforated" and value is not None:
        return "yes" if value else "no"
    return _text(value, spread, look)


def _text(value: float | None, spread: float | None, look: Look) -> str:
    if value is None:
        return "-"

    look = look.fitting(max(abs(value), abs(spread or 0.0)))
    fixed = look.decimals >= 0 and not _tiny(value, spread, look)

    def number(figure: float) -> str:
        figure *= look.factor
        text = f"{figure:.{look.decimals}f}" if fixed else f"{figure:.3g}"
        return text if float(text) else text.lstrip("-")  # what rounds to nothing has no sign

    # a spread that rounds to nothing says nothing
    shown = f" ± {number(spread)}" if spread and float(number(spread)) > 0.0 else ""
    return f"{number(value)}{shown} {look.unit}".rstrip()


def _tiny(value: float, spread: float | None, look: Look) -> bool:
    """Whether a size is too small for the digits of its kind, and known better: of dust, or of a gas."""
    last, size = 10.0**-look.decimals, abs(value) * look.factor
    known = abs(spread or 0.0) * look.factor < 0.5 * last
    return look.unit not in UNSIZED and known and LEAST < size < 10.0 * last
