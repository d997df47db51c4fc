"""Comparison of measures with the values that a case expects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

from hvisph.core.errors import CaseError, suggest_nearest

from .result import Result


class Expectations(Protocol):
    """Names and expectations: a mapping, or the part of a case that holds them."""

    def items(self) -> Iterable[tuple[str, Any]]:
        """Return pairs of a measure's name and its expectation."""


def compare(results: Mapping[str, Result | float | None], expected: Expectations) -> list[dict[str, Any]]:
    """Compare measures with expected values.

    Parameters
    ----------
    results
        Measured results by name; other figures of the run, such as its energy drift, as plain numbers.
    expected
        By the same names: mappings or objects with `value`, `tolerance` (half-width, the same unit)
        and, optionally, `source`. SI units.

    Returns
    -------
    list of dict
        One entry per expectation, in its order: `name`, `value` (None where the measure has no
        meaning), `expected`, `tolerance`, `source`, `passed`. A value on the limit passes.

    Raises
    ------
    CaseError
        When an expectation names no measure.
    """
    rows = []
    for name, entry in expected.items():
        if name not in results:
            raise CaseError(f"unknown measure '{name}'{suggest_nearest(name, list(results))}", where=f"expected.{name}")
        result = results[name]
        value = result.value if isinstance(result, Result) else result
        target, tolerance = float(_get(entry, "value")), float(_get(entry, "tolerance"))
        rows.append(
            {
                "name": name,
                "value": value,
                "expected": target,
                "tolerance": tolerance,
                "source": str(_get(entry, "source", "") or ""),
                "passed": within(value, target, tolerance),
            }
        )
    return rows


def within(value: float | None, expected: float, tolerance: float) -> bool:
    """Whether a measured value is as expected; what has no value is not.

    What was written in decimals may sit on the limit, so a few ulp beyond it pass.
    """
    slack = 1e-12 * (abs(expected) + tolerance)
    return value is not None and abs(value - expected) <= tolerance + slack


def _get(entry: Any, name: str, default: Any = None) -> Any:
    return entry.get(name, default) if isinstance(entry, Mapping) else getattr(entry, name, default)
