"""Linear least squares of a few coefficients, in plain Python: this room knows no arrays."""

from __future__ import annotations

from collections.abc import Sequence


def fitted(columns: Sequence[Sequence[float]], values: Sequence[float]) -> list[float]:
    """Return the coefficients of columns whose sum is nearest to the values, by Gram-Schmidt."""
    units: list[list[float]] = []
    triangle: list[list[float]] = []
    for column in columns:
        rest, row = list(column), []
        for unit in units:
            share = sum(a * b for a, b in zip(unit, rest, strict=True))
            rest = [b - share * a for a, b in zip(unit, rest, strict=True)]
            row.append(share)
        length = sum(b * b for b in rest) ** 0.5
        units.append([b / length for b in rest])
        triangle.append([*row, length])
    found = [0.0] * len(columns)
    for k in reversed(range(len(columns))):
        share = sum(a * b for a, b in zip(units[k], values, strict=True))
        later = sum(found[j] * triangle[j][k] for j in range(k + 1, len(columns)))
        found[k] = (share - later) / triangle[k][k]
    return found
