"""A figure: what a run gives, what is exact, and how far apart they may be."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any


@dataclass(frozen=True)
class Figure:
    """One number of a run beside the exact one.

    Parameters
    ----------
    name
        What it is.
    found, exact
        Computed and exact value, in `unit`.
    tolerance
        Largest difference that passes: a share of `scale`, or in `unit` where `scale` is zero.
    unit
        SI unit; empty for plain numbers.
    scale
        What the difference is measured by, positive; the size of the exact value unless given, 0 for none.
    why
        Why the tolerance is what it is.
    at_most
        Whether `found` only must not exceed `exact` by more than the tolerance.
    """

    name: str
    found: float
    exact: float
    tolerance: float
    unit: str = ""
    scale: float | None = None
    why: str = ""
    at_most: bool = False

    @property
    def off(self) -> float:
        """Difference, found - exact, over the scale, or in the unit where there is none."""
        scale = abs(self.exact) if self.scale is None else self.scale
        return (self.found - self.exact) / (scale or 1.0)

    @property
    def relative(self) -> bool:
        """Whether `off` and `tolerance` are shares."""
        return bool(abs(self.exact) if self.scale is None else self.scale)

    @property
    def passed(self) -> bool:
        """Whether the figure is as asked; a value that is not finite never is."""
        return isfinite(self.found) and (self.off if self.at_most else abs(self.off)) <= self.tolerance

    def as_dict(self) -> dict[str, Any]:
        """Return the plain form, with None for what is not finite."""
        plain = asdict(self) | {"off": self.off, "relative": self.relative, "passed": self.passed}
        return {k: None if isinstance(v, float) and not isfinite(v) else v for k, v in plain.items()}


def limit(name: str, computed: float, most: float, unit: str = "", why: str = "") -> Figure:
    """Return a figure that is at best zero and passes up to `most`."""
    return Figure(name, computed, 0.0, most, unit, 0.0, why, at_most=True)
