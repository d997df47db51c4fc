"""One measured number with its unit, its uncertainty and, where it has no meaning, the reason."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

SETTLED = 0.02  # of a value: it stands still where it swings by less
# Of the whole: per area in 1D and per depth in 2D.
MASS_UNITS = {1: "kg/m^2", 2: "kg/m", 3: "kg"}
MOMENTUM_UNITS = {1: "N s/m^2", 2: "N s/m", 3: "N s"}
ENERGY_UNITS = {1: "J/m^2", 2: "J/m", 3: "J"}


@dataclass(frozen=True)
class Result:
    """A measured number in SI, or the reason why there is none.

    Parameters
    ----------
    value
        The number in `unit`; None where the measure has no meaning, and then `reason` says why.
    unit
        SI unit; empty for plain numbers.
    uncertainty
        Half-width in `unit` within which the number is known: of all kinds together.
    time
        When a peak was reached [s]; None for what belongs to a snapshot's own time.
    reason
        Why `value` is None.
    spacing, support
        Resolution behind a length: dx [m] and the kernel's reach [m].
    swing
        The part of the uncertainty that is the number's own swing over the last tenth of the run; None where that is
        not known.
    """

    value: float | None
    unit: str
    uncertainty: float | None = None
    time: float | None = None
    reason: str = ""
    spacing: float | None = None
    support: float | None = None
    swing: float | None = None

    @property
    def by_kind(self) -> dict[str, float]:
        """The uncertainty by kind, in `unit`.

        ``spacing`` is what the distance of particles leaves open of a length, with the scatter of what a mean was
        taken over; ``scatter`` that of other numbers; ``swing`` how far the number moved lately.
        """
        extras = {} if self.swing is None else {"swing": self.swing}
        if self.uncertainty is not None:
            rest = float(np.sqrt(max(self.uncertainty**2 - (self.swing or 0.0) ** 2, 0.0)))
            if rest > 0.0 or self.swing is None:
                extras["scatter" if self.spacing is None else "spacing"] = rest
        return extras

    @property
    def settled(self) -> bool:
        """Whether the number stands still: it swings by no more than its other uncertainty, or by 2 % of itself."""
        if self.value is None or self.swing is None:
            return True
        rest = max((size for kind, size in self.by_kind.items() if kind != "swing"), default=0.0)
        return self.swing <= max(rest, SETTLED * abs(self.value))

    def swinging(self, swing: float) -> Result:
        """Return the result with a swing as a further part of its uncertainty."""
        rest = self.uncertainty or 0.0
        return replace(self, uncertainty=float(np.hypot(rest, swing)), swing=swing)

    def finite(self) -> Result:
        """Return the result itself, or the reason why there is none where its value is not finite."""
        if self.value is None or np.isfinite(self.value):
            return self
        return meaningless(self.unit, "its value is not finite")

    def as_dict(self) -> dict[str, Any]:
        """Return the plain form for JSON; optional entries appear only where they say something."""
        plain: dict[str, Any] = {"value": self.value, "unit": self.unit, "uncertainty": self.uncertainty}
        if self.by_kind:
            plain["uncertainty_by"] = self.by_kind
        if not self.settled:
            plain["settled"] = False
        if self.time is not None:
            plain["time"] = self.time
        if self.reason:
            plain["reason"] = self.reason
        if self.spacing is not None:
            plain["resolution"] = {"spacing": self.spacing, "support": self.support}
        return plain

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Result:
        """Return what `as_dict` was made from."""
        at = plain.get("resolution", {})
        return cls(plain["value"], plain["unit"], plain["uncertainty"], plain.get("time"), plain.get("reason", ""),
                   at.get("spacing"), at.get("support"), plain.get("uncertainty_by", {}).get("swing"))  # fmt: skip


def meaningless(unit: str, reason: str) -> Result:
    """Return the result of a measure that has no meaning here."""
    return Result(value=None, unit=unit, reason=reason)
