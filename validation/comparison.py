"""Measured beside computed values, and verdicts on all shots of a quantity together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import isfinite, sqrt
from typing import Any

from hvisph_validation.experiment_set import Criteria

from .experiments import UNITS, Measured
from .quantity import Key, Value


@dataclass(frozen=True)
class Compared:
    """One measured number beside the computed one, both in the unit of the measured.

    `measured`: measured number.
    `computed`, `uncertainty`: computed number and its uncertainty; None where the run gave none.
    `reason`: why there is none.
    `ratio`: of a verdict: diameter over that of the limit curve.
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
        content = {key: value for key, value in asdict(self).items() if key != "measured"}
        return asdict(self.measured) | content | {"off": self.off}

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Compared:
        """Return what `as_dict` was made from."""
        computed_keys = ("computed", "uncertainty", "reason", "ratio")
        measured = Measured(**{k: v for k, v in plain.items() if k not in (*computed_keys, "off")})
        return cls(measured, **{k: plain[k] for k in computed_keys})


PENDING = ("waiting", "running", "interrupted")  # states of runs that have not ended
VERDICTS = ("perforated", "spalled", "detached")


def compared(measured: Sequence[Measured], computed: Mapping[str, Mapping[Key, Value]], why: Mapping[str, str]
             ) -> Iterator[Compared]:  # fmt: skip
    """Yield every measured number beside the computed one.

    `measured`: measured numbers of the set.
    `computed`: computed values by shot.
    `why`: by shot, why it has no values.
    """
    for entry in measured:
        value = computed.get(entry.shot, {}).get((entry.quantity, entry.at))
        if value is None:
            yield Compared(entry, None, reason=why.get(entry.shot, "not computed"))
            continue
        unit = UNITS[entry.unit]
        number = None if value.value is None else value.value / unit
        spread = None if value.uncertainty is None else value.uncertainty / unit
        yield Compared(entry, number, spread, value.reason, value.ratio)


@dataclass(frozen=True)
class Verdict:
    """How all shots of one quantity together do.

    `quantity`, `unit`: quantity and its unit.
    `shots`: number of judged shots, and of those with a value.
    `mean`, `worst`, `worst_shot`, `bias`, `scatter`: of the differences as shares: mean magnitude, largest magnitude
      and its shot, mean, standard deviation; None without values.
    `right`: of verdicts: share on the right side.
    `farthest`: of verdicts that are wrong: the largest distance from the limit curve in diameter; None where all are
      right.
    `weak`, `strong`: numbers of wrong verdicts: targets that fail but held, and that hold but failed.
    `of_curve`: of verdicts: share of the same shots that the limit curve predicts; None where it predicts none.
    `passed`: whether all criteria are met; None without criteria, or while shots are pending and none has failed.
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


def verdicts(rows: Sequence[Compared], criteria: Mapping[str, Criteria]) -> list[Verdict]:
    """Return the verdict on every quantity, in the order of the set; shots without a value fail their criteria."""
    names = dict.fromkeys(row.measured.quantity for row in rows if row.measured.judged)
    return [_verdict(name, [row for row in rows if row.measured.judged and row.measured.quantity == name],
                     criteria.get(name)) for name in names]  # fmt: skip


def _verdict(name: str, rows: Sequence[Compared], criteria: Criteria | None) -> Verdict:
    pending = any(row.reason in PENDING for row in rows)
    everything, rows = rows, [row for row in rows if row.reason not in PENDING]
    pairs = [(row.off, row) for row in rows if row.off is not None]
    shots = (len({row.measured.shot for row in everything}), len({row.measured.shot for _, row in pairs}))
    unit = everything[0].measured.unit
    if not pairs:
        return Verdict(name, unit, shots, passed=False if criteria and not pending else None)
    offs = [off for off, _ in pairs]
    if rows[0].is_verdict:
        wrong = [row.ratio for off, row in pairs if off > 0.5 and row.ratio is not None]
        right = 1.0 - sum(offs) / len(rows) - (len(rows) - len(pairs)) / len(rows)
        farthest = max((abs(ratio - 1.0) for ratio in wrong), default=None)
        passed = None if criteria is None or pending else (
            right >= (criteria.right or 0.0) and _at_most(farthest or 0.0, criteria.wrong_within))  # fmt: skip
        weak = sum(off > 0.5 and row.measured.value < 0.5 for off, row in pairs)
        curve = [(row.ratio > 1.0) == (row.measured.value > 0.5) for row in rows if row.ratio is not None]
        return Verdict(name, unit, shots, right=right, farthest=farthest, weak=weak, strong=int(sum(offs)) - weak,
                       of_curve=sum(curve) / len(curve) if curve else None, passed=passed)  # fmt: skip
    mean, bias = sum(map(abs, offs)) / len(offs), sum(offs) / len(offs)
    scatter = sqrt(sum((off - bias) ** 2 for off in offs) / (len(offs) - 1)) if len(offs) > 1 else None
    worst, shot = max((abs(off), row.measured.shot) for off, row in pairs)
    passed = None
    if criteria is not None:  # pending shots may improve a mean, but not a shot that has failed
        passed = len(pairs) == len(rows) and _at_most(worst, criteria.worst)
        passed = passed and all(_inside(row, criteria) for _, row in pairs)
        passed = None if passed and pending else passed and _at_most(mean, criteria.mean)
    return Verdict(name, unit, shots, mean, worst, shot, bias, scatter, passed=passed)


def _inside(row: Compared, criteria: Criteria) -> bool:
    assert row.computed is not None
    if criteria.between is not None and not criteria.between[0] <= row.computed <= criteria.between[1]:
        return False
    return criteria.within is None or abs(row.computed - row.measured.value) <= criteria.within


def _at_most(value: float, limit: float | None) -> bool:
    return limit is None or value <= limit
