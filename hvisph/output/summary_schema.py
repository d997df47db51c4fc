"""What a `summary.json` must look like to be read: kinds of values, as `schemas/summary.schema.json` has them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

STATUSES = ("done", "failed", "interrupted")


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < float("inf")


def _number_or_none(value: object) -> bool:
    return value is None or _number(value)


def _count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 2**63


def _text(value: object) -> bool:
    return isinstance(value, str)


def _is(*allowed: object) -> Callable[[Any], bool]:
    return lambda value: any(value is one or (isinstance(value, str) and value == one) for one in allowed)


_MEASURE = {"value": _number_or_none, "unit": _text, "uncertainty": _number_or_none}
_EXPECTED = {"name": _text, "value": _number_or_none, "expected": _number, "tolerance": _number, "source": _text,
             "passed": _is(True, False)}  # fmt: skip
_PLAIN = {"title": _text, "status": _is(*STATUSES), "end_time": _number, "particles": _count, "steps": _count,
          "threads": _count, "wall_seconds": _number, "microseconds_per_particle_step": _number_or_none}  # fmt: skip


def misfit(summary: object) -> str:
    """Return which part of `summary` is missing or of another kind than hvisph writes; empty where it fits."""
    if not isinstance(summary, dict):
        return "it is not a summary"
    text = _misfit(summary, _PLAIN, "")
    if text:
        return text
    failure, measures, drifts, expected = (summary.get(k) for k in ("failure", "measures", "conservation", "expected"))
    told = failure is None or (isinstance(failure, dict) and _text(failure.get("message")))
    if "failure" not in summary or not told:
        return "its failure is missing or has no message"
    if not isinstance(measures, dict) or not isinstance(drifts, dict) or not isinstance(expected, list):
        return "it lacks measures, conservation or expected"
    for name, entry in measures.items():
        text = text or _misfit(entry, _MEASURE, f"measures.{name}.") or _misfit_of_options(entry, f"measures.{name}.")
    for index, entry in enumerate(expected):
        text = text or _misfit(entry, _EXPECTED, f"expected.{index}.")
    odd = [name for name, value in drifts.items() if not _number_or_none(value)]
    return text or (f"its conservation.{odd[0]} is no number" if odd else "")


def _misfit(value: object, kinds: Mapping[str, Callable[[Any], bool]], path: str) -> str:
    if not isinstance(value, dict):
        return f"its {path.rstrip('.')} has no keys"
    for name, fits in kinds.items():
        if name not in value or not fits(value[name]):
            return f"its {path}{name} is missing or of the wrong kind"
    return ""


def _misfit_of_options(entry: dict[str, Any], path: str) -> str:
    if not _number_or_none(entry.get("time")) or not _text(entry.get("reason", "")):
        return f"its {path}time or reason is of the wrong kind"
    resolution = entry.get("resolution")
    if resolution is None:
        return ""
    return _misfit(resolution, {"spacing": _number, "support": _number_or_none}, f"{path}resolution.")
