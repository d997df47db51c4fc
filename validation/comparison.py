"""Measured beside computed, and what is asked of all shots of a quantity together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import isfinite, sqrt
from typing import Any

from hvisph_validation.experiment_set import Asked

from .experiments import UNITS, Measured
from .quantity import Key, Value


@dataclass(frozen=True)
class Compared:
    """One measured number beside the computed one, both in the unit of the measured.

    Parameters
    ----------
    measured
        The measured number.
    computed, uncertainty
        The computed one; None where the run gave none, with the `reason`.
    reason
        Why there is none.
    ratio
        Of a verdict: diameter over that of the limit curve.
    """

    measured: Measured
    computed: float | None
    uncertainty: float | None = None
    reason: str = ""
    ratio: float | None = None

    @property
    def off(self) -> float | None:
        """Difference, as a share of the measured value; of a verdict 0 where right and 1 where wrong."""
        if self.computed is None or not isfinite(self.computed):
            return None
        if self.is_verdict:
            return float((self.computed > 0.5) != (self.measured.value > 0.5))
        return (self.computed - self.measured.value) / abs(self.measured.value)

    @property
    def is_verdict(self) -> bool:
        """Whether yes or no was measured, not a number."""
        return self.measured.quantity in VERDICTS

    def as_dict(self) -> dict[str, Any]:
        """Return the plain form for JSON."""
        rest = {key: value for key, value in asdict(self).items() if key != "measured"}
        return asdict(self.measured) | rest | {"off": self.off}

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Compared:
        """Return what `as_dict` was made from."""
        own = ("computed", "uncertainty", "reason", "ratio")
        measured = Measured(**{k: v for k, v in plain.items() if k not in (*own, "off")})
        return cls(measured, **{k: plain[k] for k in own})


PENDING = ("waiting", "running", "interrupted")  # what has not ended says nothing yet
VERDICTS = ("perforated", "spalled", "detached")


def compared(measured: Sequence[Measured], computed: Mapping[str, Mapping[Key, Value]], why: Mapping[str, str]
             ) -> Iterator[Compared]:  # fmt: skip
    """Yield every measured number beside the computed one.

    Parameters
    ----------
    measured
        All that was measured of the set.
    computed
        Computed values by shot.
    why
        Why shots have none, by shot.
    """
    for one in measured:
        value = computed.get(one.shot, {}).get((one.quantity, one.at))
        if value is None:
            yield Compared(one, None, reason=why.get(one.shot, "not computed"))
            continue
        unit = UNITS[one.unit]
        number = None if value.value is None else value.value / unit
        spread = None if value.uncertainty is None else value.uncertainty / unit
        yield Compared(one, number, spread, value.reason, value.ratio)


@dataclass(frozen=True)
class Verdict:
    """How all shots of one quantity together do.

    Parameters
    ----------
    quantity, unit
        Of what.
    shots
        How many shots count, and how many of them have a value.
    mean, worst, worst_shot, bias, scatter
        Of the differences as shares: mean size, largest size and where, mean, standard deviation; None without values.
    right
        Of verdicts: share on the right side.
    farthest
        Of verdicts that are wrong: the largest distance from the limit curve in diameter; None where all are right.
    weak, strong
        Of verdicts that are wrong: how many failed that held, and how many held that failed.
    of_curve
        Of verdicts: share that the limit curve has right of the same shots; None where it knows none.
    passed
        Whether all are within their tolerances; None without any, or where shots are not computed yet and none failed.
    """

    quantity: str
    unit: str
    shots: tuple[int, int]
    mean: float | None = None
    worst: float | None = None
    worst_shot: str = ""
    bias: float | None = None
    scatter: float | None = None
    right: float | None = None
    farthest: float | None = None
    weak: int = 0
    strong: int = 0
    of_curve: float | None = None
    passed: bool | None = None


def verdicts(rows: Sequence[Compared], asked: Mapping[str, Asked]) -> list[Verdict]:
    """Return how every quantity does, in the order of the set; shots without a value fail what is asked of them."""
    names = dict.fromkeys(row.measured.quantity for row in rows if row.measured.judged)
    return [_verdict(name, [row for row in rows if row.measured.judged and row.measured.quantity == name],
                     asked.get(name)) for name in names]  # fmt: skip


def _verdict(name: str, rows: Sequence[Compared], asked: Asked | None) -> Verdict:
    pending = any(row.reason in PENDING for row in rows)
    everything, rows = rows, [row for row in rows if row.reason not in PENDING]
    known = [(row.off, row) for row in rows if row.off is not None]
    shots = (len({row.measured.shot for row in everything}), len({row.measured.shot for _, row in known}))
    unit = everything[0].measured.unit
    if not known:
        return Verdict(name, unit, shots, passed=False if asked and not pending else None)
    offs = [off for off, _ in known]
    if rows[0].is_verdict:
        wrong = [row.ratio for off, row in known if off > 0.5 and row.ratio is not None]
        right = 1.0 - sum(offs) / len(rows) - (len(rows) - len(known)) / len(rows)
        farthest = max((abs(ratio - 1.0) for ratio in wrong), default=None)
        passed = None if asked is None or pending else (
            _at_least(right, asked.right) and _at_most(farthest or 0.0, asked.wrong_within))  # fmt: skip
        weak = sum(off > 0.5 and row.measured.value < 0.5 for off, row in known)
        curve = [(row.ratio > 1.0) == (row.measured.value > 0.5) for row in rows if row.ratio is not None]
        return Verdict(name, unit, shots, right=right, farthest=farthest, weak=weak, strong=int(sum(offs)) - weak,
                       of_curve=sum(curve) / len(curve) if curve else None, passed=passed)  # fmt: skip
    mean, bias = sum(map(abs, offs)) / len(offs), sum(offs) / len(offs)
    scatter = sqrt(sum((off - bias) ** 2 for off in offs) / (len(offs) - 1)) if len(offs) > 1 else None
    worst, shot = max((abs(off), row.measured.shot) for off, row in known)
    passed = None
    if asked is not None:  # what is still to come may mend a mean, and no shot that has failed
        passed = (
            len(known) == len(rows) and _at_most(worst, asked.worst) and all(_inside(row, asked) for _, row in known)
        )
        passed = None if passed and pending else passed and _at_most(mean, asked.mean)
    return Verdict(name, unit, shots, mean, worst, shot, bias, scatter, passed=passed)


def _inside(row: Compared, asked: Asked) -> bool:
    assert row.computed is not None
    if asked.between is not None and not asked.between[0] <= row.computed <= asked.between[1]:
        return False
    return asked.within is None or abs(row.computed - row.measured.value) <= asked.within


def _at_most(value: float, most: float | None) -> bool:
    return most is None or value <= most


def _at_least(value: float, least: float | None) -> bool:
    return least is None or value >= least
