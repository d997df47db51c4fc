"""Named time-step criteria, and the watch for values that are not finite.

    signal        h / (c_l + 1.2 alpha c + 1.2 beta max|mu|)        Monaghan 1989
    acceleration  sqrt(h / |a|)

None depends on the frame. The smallest over all particles, times the case's cfl, limits the step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvisph.core.jit import prange, specialise

NAMES = ("signal", "acceleration")
CHUNK = 256


@dataclass
class Limit:
    """What limits the step: time [s], criterion, and the particle (index) that set it."""

    dt: float
    criterion: str
    particle: int


def _limits(lengths, signals, rates, place, viscous, least, where):
    count = np.uint64(len(signals))
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        first = np.uint64(chunk) * np.uint64(CHUNK)
        least_signal = least_acceleration = np.inf
        at_signal = at_acceleration = bad = np.uint64(0xFFFFFFFF)
        for s in range(first, min(first + np.uint64(CHUNK), count)):
            k = np.uint64(place[s])
            h = lengths[s]
            t = h / (signals[s] + viscous * rates[k, DIM + 1])
            if t < least_signal:
                least_signal = t
                at_signal = s
            a2 = 0.0
            for f in range(np.uint64(DIM)):
                a2 += rates[k, f] * rates[k, f]
            t = h * h / a2
            if t < least_acceleration:
                least_acceleration = t
                at_acceleration = s
            total = a2 + signals[s]
            for f in range(np.uint64(DIM), np.uint64(DIM + 2 + DIM * DIM)):
                total += rates[k, f]
            if not abs(total) < np.inf:  # np.isfinite takes x - x for 0 where sums may be reordered
                bad = s
        c = np.uint64(chunk)
        least[c, 0] = least_signal
        least[c, 1] = np.sqrt(np.sqrt(least_acceleration))
        where[c, 0] = at_signal
        where[c, 1] = at_acceleration
        where[c, 2] = bad


class Criteria:
    """Finds the step that the particles allow.

    Parameters
    ----------
    dim
        Number of dimensions.
    count
        Number of particles.
    cfl
        Share of the allowed time that a step may take.
    viscous
        Factor of max|mu| in the signal speed: 1.2 beta.
    """

    def __init__(self, dim: int, count: int, cfl: float, viscous: float):
        chunks = -(-count // CHUNK)
        self.cfl, self.viscous = cfl, viscous
        self._found = np.empty((chunks, 2))
        self._where = np.empty((chunks, 3), np.uint64)
        self._loop = specialise(_limits, parallel=True, DIM=dim)

    def limit(self, lengths: np.ndarray, signals: np.ndarray, rates: np.ndarray, place: np.ndarray) -> Limit:
        """Return what limits the next step.

        Parameters
        ----------
        lengths, signals
            Smoothing length [m] and speed of signals without viscosity [m/s], (n,).
        rates, place
            Rows of rates in cell order, and the row of each particle.

        Returns
        -------
        Limit
            With `criterion` ``not_finite`` and the particle, where a rate is not finite.
        """
        self._loop(lengths, signals, rates, place, self.viscous, self._found, self._where)
        bad = self._where[:, 2]
        if bad.min() < 0xFFFFFFFF:
            return Limit(0.0, "not_finite", int(bad.min()))
        rows = self._found.argmin(axis=0)
        times = self._found[rows, (0, 1)]
        kind = int(times.argmin())
        return Limit(self.cfl * float(times[kind]), NAMES[kind], int(self._where[rows[kind], kind]))
