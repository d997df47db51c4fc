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


def _limits(chunk, count, lengths, signals, rates, place, viscous, minima):
    """Find the minima of a chunk."""
    first = chunk * np.uint64(CHUNK)
    signal_min = acceleration_min = np.inf
    total = 0.0
    for s in range(first, min(first + np.uint64(CHUNK), count)):
        signal, acceleration, rate_sum = limits_of(lengths, signals, rates, place, viscous, s)
        signal_min = signal if signal < signal_min else signal_min  # `min` would not return NaN
        acceleration_min = acceleration if acceleration < acceleration_min else acceleration_min
        total += rate_sum
    minima[chunk, 0], minima[chunk, 1], minima[chunk, 2] = signal_min, acceleration_min, total


def _limiting_particle(lengths, signals, rates, place, viscous, numbers, minima):
    """Return the limiting criterion (NOT_FINITE where a rate is so), its value, and the particle of smallest number."""
    index, count, not_finite = np.uint64(NO_PARTICLE), np.uint64(len(signals)), np.uint64(NOT_FINITE)
    signal_min = acceleration_min = np.inf
    for chunk in range(np.uint64(len(minima))):
        signal_min, acceleration_min = min(signal_min, minima[chunk, 0]), min(acceleration_min, minima[chunk, 1])
    kind = np.uint64(1) if sqrt(sqrt(acceleration_min)) < signal_min else np.uint64(0)
    value = acceleration_min if kind else signal_min
    for criterion in (not_finite, kind):  # a sum may overflow where no particle has
        for chunk in range(np.uint64(len(minima))):
            # np.isfinite takes x - x for 0 where sums may be reordered
            if abs(minima[chunk, 2]) < np.inf if criterion == not_finite else minima[chunk, criterion] != value:
                continue
            for s in range(chunk * np.uint64(CHUNK), min((chunk + np.uint64(1)) * np.uint64(CHUNK), count)):
                signal, acceleration, rate_sum = limits_of(lengths, signals, rates, place, viscous, s)
                is_limit = (acceleration if criterion else signal) == value
                if criterion == not_finite:
                    is_limit = not abs(rate_sum) < np.inf
                if is_limit and (index == np.uint64(NO_PARTICLE) or numbers[s] < numbers[index]):
                    index = s
        if index != np.uint64(NO_PARTICLE):
            return criterion, value, index
    return kind, value, index


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
        self._minima = np.empty((-(-count // CHUNK), 3))

    def limit(self, lengths: np.ndarray, signals: np.ndarray, rates: np.ndarray, place: np.ndarray,
              numbers: np.ndarray) -> Limit:  # fmt: skip
        """Return the limit of the next step, of the particle of smallest number among equals.

        `signals` (n,) are signal speeds without viscosity [m/s]; `rates` are in cell order, row `place`.
        The criterion is ``not_finite`` where a rate is not finite.
        """
        arguments = (lengths, signals, rates, place, self.viscous)
        self._loop(len(signals), *arguments, self._minima)
        kind, value, particle = self._find_limiting(*arguments, numbers, self._minima)
        if kind == NOT_FINITE:
            return Limit(0.0, "not_finite", particle)
        return Limit(self.cfl * (sqrt(sqrt(value)) if kind else value), NAMES[kind], particle, value)
