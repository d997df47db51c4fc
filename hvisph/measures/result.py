"""One measured number with its unit, its uncertainty and, where it has no meaning, the reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


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
        Half-width in `unit` within which the number is known at this resolution.
    time
        When a peak was reached [s]; None for what belongs to a snapshot's own time.
    reason
        Why `value` is None.
    spacing, support
        Resolution behind a length: dx [m] and the kernel's reach [m].
    """

    value: float | None
    unit: str
    uncertainty: float | None = None
    time: float | None = None
    reason: str = ""
    spacing: float | None = None
    support: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the plain form for JSON; optional entries appear only where they say something."""
        plain: dict[str, Any] = {"value": self.value, "unit": self.unit, "uncertainty": self.uncertainty}
        if self.time is not None:
            plain["time"] = self.time
        if self.reason:
            plain["reason"] = self.reason
        if self.spacing is not None:
            plain["resolution"] = {"spacing": self.spacing, "support": self.support}
        return plain


def meaningless(unit: str, reason: str) -> Result:
    """Return the result of a measure that has no meaning here."""
    return Result(value=None, unit=unit, reason=reason)
