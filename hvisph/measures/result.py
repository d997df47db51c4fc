"""A measured number with its unit, its uncertainty and, where it is undefined, the reason."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

SETTLED = 0.02  # relative change over the last tenth of the run below which a number is settled
MASS_UNITS = {1: "kg/m^2", 2: "kg/m", 3: "kg"}  # per area in 1D and per depth in 2D


class UndefinedMeasureError(Exception):
    """A measure is undefined here; the message is the reason."""


@dataclass(frozen=True)
class Result:
    """A measured number in SI, or the reason why there is none.

    Parameters
    ----------
    value
        The number in `unit`; None where the measure is undefined, and then `reason` says why.
    unit
        SI unit; empty for plain numbers.
    scatter
        Half-width by the sample that the number was taken from; None where that is not known.
    time
        Time of a peak [s]; None for what belongs to a snapshot's own time.
    reason
        Why `value` is None.
    spacing, support
        Resolution of a length: dx [m], by which two edges together are uncertain, and the kernel's reach [m].
    discretization
        Estimated error of the particle spacing of other numbers.
    swing
        Half of the range of the number over the last tenth of the run; None where that is not known.
    note
        What qualifies the number.
    final
        Whether the state that it describes has come to rest.
    variants
        The same quantity by further definitions, the first being this one.
    """

    value: float | None
    unit: str = ""
    scatter: float | None = None
    time: float | None = None
    reason: str = ""
    spacing: float | None = None
    support: float | None = None
    discretization: float | None = None
    swing: float | None = None
    note: str = ""
    final: bool = True
    variants: Mapping[str, Result] = field(default_factory=dict)

    @property
    def uncertainty_by(self) -> dict[str, float]:
        """The uncertainty by kind, in `unit`: ``spacing``, ``discretization``, ``scatter`` and ``swing``."""
        spacing = self.spacing if self.unit == "m" else None
        kinds = {"spacing": spacing, "discretization": self.discretization, "scatter": self.scatter,
                 "swing": self.swing}  # fmt: skip
        return {kind: size for kind, size in kinds.items() if size is not None and self.value is not None}

    @property
    def uncertainty(self) -> float | None:
        """Half-width in `unit` within which the number is known at one resolution: of all kinds together."""
        kinds = self.uncertainty_by
        return float(np.sqrt(sum(size**2 for size in kinds.values()))) if kinds else None

    @property
    def settled(self) -> bool:
        """Whether the number stands still: it moves by no more than spacing and scatter, or 2 % of itself."""
        if self.value is None or self.swing is None:
            return self.final
        kinds = self.uncertainty_by
        rest = float(np.hypot(kinds.get("spacing", 0.0), kinds.get("scatter", 0.0)))
        return self.final and self.swing <= max(rest, SETTLED * abs(self.value))

    def as_dict(self) -> dict[str, Any]:
        """Return the plain form for JSON; optional entries appear only where they say something."""
        plain: dict[str, Any] = {"value": self.value, "unit": self.unit, "uncertainty": self.uncertainty}
        if self.uncertainty_by:
            plain["uncertainty_by"] = self.uncertainty_by
        if not self.settled:
            plain["settled"] = False
        if self.spacing is not None:
            plain["resolution"] = {"spacing": self.spacing, "support": self.support}
        plain |= {key: getattr(self, key) for key in ("time", "reason", "note") if getattr(self, key) not in (None, "")}
        if self.variants:
            plain["variants"] = {name: one.as_dict() for name, one in self.variants.items()}
        return plain

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Result:
        """Return the result with the plain form `plain`."""
        at, kinds = plain.get("resolution", {}), plain.get("uncertainty_by", {})
        result = cls(
            plain["value"], plain["unit"], kinds.get("scatter", None if kinds else plain.get("uncertainty")),
            plain.get("time"), plain.get("reason", ""), at.get("spacing"), at.get("support"),
            kinds.get("discretization"), kinds.get("swing"), plain.get("note", ""),
            variants={name: cls.from_dict(one) for name, one in plain.get("variants", {}).items()},
        )  # fmt: skip
        return replace(result, final=plain.get("settled", True) or not result.settled)


def undefined_result(unit: str, reason: str) -> Result:
    """Return the result of a measure that is undefined."""
    return Result(None, unit, reason=reason)


def weighted_quantile(values: np.ndarray, weights: np.ndarray, share: float) -> float:
    """Return the value that `share` of the weight does not exceed: the same for a part and its mirrored whole."""
    order = np.argsort(values, kind="stable")
    cumulated = np.cumsum(weights[order])
    at = int(np.searchsorted(cumulated, share * cumulated[-1] * (1.0 - 1e-9)))
    return float(values[order[min(at, len(order) - 1)]])
