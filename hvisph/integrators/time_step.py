"""Time-step criteria, and detection of values that are not finite.

    signal        h / (c_l + 1.2 alpha c + 1.2 beta max|mu|)        Monaghan 1989, `VISCOUS_SIGNAL`
    acceleration  sqrt(h / |a|)

None depends on the frame. The smallest over all particles, times the case's cfl, limits the step.
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np

from hvisph.compiler.jit import specialise
from hvisph.compiler.parallel_for import chunk_loop

NAMES = ("signal", "acceleration")
CHUNK = 256
NO_PARTICLE, NOT_FINITE = 0xFFFFFFFF, 2
VISCOUS_SIGNAL = 1.2  # weight of the artificial viscosity in the signal speed [-]


@dataclass
class Limit:
    """Limit of the step: time [s], criterion, particle (index), and unrounded value for comparison."""

    dt: float
    criterion: str
    particle: int
    unrounded: float = 0.0  # decides between particles with equal rounded limits


def _limits_of(lengths, signals, rates, place, viscous, s):
    """Return h over the signal speed [s], (h/|a|)^2 [s^4], and a sum of the rates, which is NaN where one is."""
    k = np.uint64(place[s])
    h = lengths[s]
    a2 = 0.0
    for f in range(np.uint64(DIM)):
        a2 += rates[k, f] * rates[k, f]
    rate_sum = a2 + signals[s]
    for f in range(np.uint64(DIM), np.uint64(DIM + 2 + DIM * DIM)):
        rate_sum += rates[k, f]
    return h / (signals[s] + viscous * rates[k, DIM + 1]), h * h / a2, rate_sum


def _limits(chunk, count, lengths, signals, rates, place, viscous, least):
    """Find the minima of a chunk."""
    first = chunk * np.uint64(CHUNK)
    by_signal = by_acceleration = np.inf
    whole = 0.0
    for s in range(first, min(first + np.uint64(CHUNK), count)):
        signal, acceleration, rate_sum = limits_of(lengths, signals, rates, place, viscous, s)
        by_signal = signal if signal < by_signal else by_signal  # `min` would not return NaN
        by_acceleration = acceleration if acceleration < by_acceleration else by_acceleration
        whole += rate_sum
    least[chunk, 0], least[chunk, 1], least[chunk, 2] = by_signal, by_acceleration, whole


def _limiting_particle(lengths, signals, rates, place, viscous, numbers, least):
    """Return the limiting criterion (NOT_FINITE where a rate is so), its value, and the particle of smallest number."""
    chosen, count, not_finite = np.uint64(NO_PARTICLE), np.uint64(len(signals)), np.uint64(NOT_FINITE)
    by_signal = by_acceleration = np.inf
    for chunk in range(np.uint64(len(least))):
        by_signal, by_acceleration = min(by_signal, least[chunk, 0]), min(by_acceleration, least[chunk, 1])
    by_time = np.uint64(1) if sqrt(sqrt(by_acceleration)) < by_signal else np.uint64(0)
    value = by_acceleration if by_time else by_signal
    for criterion in (not_finite, by_time):  # a sum may overflow where no particle has
        for chunk in range(np.uint64(len(least))):
            # np.isfinite takes x - x for 0 where sums may be reordered
            if abs(least[chunk, 2]) < np.inf if criterion == not_finite else least[chunk, criterion] != value:
                continue
            for s in range(chunk * np.uint64(CHUNK), min((chunk + np.uint64(1)) * np.uint64(CHUNK), count)):
                signal, acceleration, rate_sum = limits_of(lengths, signals, rates, place, viscous, s)
                limits = (acceleration if criterion else signal) == value
                if criterion == not_finite:
                    limits = not abs(rate_sum) < np.inf
                if limits and (chosen == np.uint64(NO_PARTICLE) or numbers[s] < numbers[chosen]):
                    chosen = s
        if chosen != np.uint64(NO_PARTICLE):
            return criterion, value, chosen
    return by_time, value, chosen


class Criteria:
    """Time-step criteria for `count` particles, with Courant number `cfl` and factor `viscous` 1.2 beta of max|mu|."""

    def __init__(self, dim: int, count: int, cfl: float, viscous: float):
        self.cfl, self.viscous = cfl, viscous
        limits_of = specialise(_limits_of, DIM=dim)
        self._loop = chunk_loop(specialise(_limits, limits_of=limits_of), CHUNK, short=True)
        self._find_limiting = specialise(_limiting_particle, parallel=False, limits_of=limits_of)
        self.resize(count)

    def resize(self, count: int) -> None:
        """Allocate arrays for `count` particles."""
        self._least = np.empty((-(-count // CHUNK), 3))

    def limit(self, lengths: np.ndarray, signals: np.ndarray, rates: np.ndarray, place: np.ndarray,
              numbers: np.ndarray) -> Limit:  # fmt: skip
        """Return the limit of the next step, of the particle of smallest number among equals.

        `signals` (n,) are signal speeds without viscosity [m/s]; `rates` are in cell order, row `place`.
        The criterion is ``not_finite`` where a rate is not finite.
        """
        arguments = (lengths, signals, rates, place, self.viscous)
        self._loop(len(signals), *arguments, self._least)
        kind, value, particle = self._find_limiting(*arguments, numbers, self._least)
        if kind == NOT_FINITE:
            return Limit(0.0, "not_finite", particle)
        return Limit(self.cfl * (sqrt(sqrt(value)) if kind else value), NAMES[kind], particle, value)
