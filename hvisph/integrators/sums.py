"""Exact sums over the completed states, independent of the order of particles, threads and processes.

Columns: energies and momentum; plastic work, and dissipation by viscosity, Riemann fluxes and friction, of the last
step; power of slip, forces on clamped particles; largest speed and smoothing length.
"""

from collections.abc import Callable
from functools import cache
from math import sqrt

import numpy as np

from hvisph.compiler.exact_sum import LARGEST, decode_sum, exact_sum, rounding_constant, sum_unit
from hvisph.compiler.jit import CompiledFunction, specialise
from hvisph.core.particles import Particles
from hvisph.core.text import Plain

KINETIC, INTERNAL, MOMENTUM, PLASTIC, HEATING, SLIPPING, SUPPORT = 0, 1, 2, 5, 6, 7, 8
FASTEST, LONGEST = 11, 12
# Number of columns that are summed as integers, and of all columns.
COUNTED, SUMS = 11, 13
# Columns of the extremes of each chunk: largest speed squared and smoothing length, and the sum of energy magnitudes,
# in which NaN and overflow, which integers hide, remain visible.
SPEED2, LENGTH, SIZE = 0, 1, 2
# Smallest energy over M c^2 for which the units are chosen; the energy may grow to 2^11 times that.
SLOWEST = 2.0**-12


def add_chunks(integers, extremes, parts, result):
    """Add the integers of all chunks and find their extremes; these are NaN if one is."""
    for chunk in range(np.uint64(len(integers))):
        for part in range(np.uint64(2)):
            for k in range(np.uint64(COUNTED)):
                parts[part, k] += integers[chunk, part, k]
        for k in range(np.uint64(2)):
            if extremes[chunk, k] > result[k] or extremes[chunk, k] != extremes[chunk, k]:
                result[k] = extremes[chunk, k]
        result[SIZE] += extremes[chunk, SIZE]


@cache
def _add_chunks() -> CompiledFunction:
    return specialise(add_chunks, parallel=False)


class Sums:
    """Integer sums and extremes of chunks of particles.

    Mass and energy of `particles` and the largest `sound_speed` at rest [m/s] define the `units` (COLUMNS,), see
    `compiler.exact_sum`. Compiled loops write `integers` (chunks, 2, COUNTED) and `extremes` (chunks, 3), which
    `reduce` reduces over all processes; `exact` returns the sum of terms (n,) of all processes, rounded once.
    """

    reduce: Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
    exact: Callable[[np.ndarray], float]

    def __init__(self, particles: Particles, sound_speed: float, h: float, chunk: int):
        self._sound_speed, self._h, self._chunk = sound_speed, h, chunk
        self.reduce, self.exact = lambda integers, extremes: (integers, extremes), exact_sum
        self.begin(particles)
        self.resize(particles.count)

    def begin(self, particles: Particles) -> None:
        """Set the units by mass and energy of the initial state."""
        mass, sound_speed, h = particles["mass"], self._sound_speed, self._h
        total = self.exact(mass)
        energy = mass * (0.5 * (particles["velocity"] ** 2).sum(axis=1) + np.abs(particles["internal_energy"]))
        energy_unit = sum_unit(max(SLOWEST * total * sound_speed**2, self.exact(energy)))
        speed = float(np.sqrt(energy_unit / sum_unit(total)))
        power_unit = energy_unit * 2.0 ** np.ceil(np.log2(max(sound_speed, speed) / h))
        self.units = np.full(COUNTED, energy_unit)
        self.units[MOMENTUM : MOMENTUM + 3] = sum_unit(total * speed)
        self.units[SUPPORT : SUPPORT + 3] = sum_unit(power_unit / energy_unit * total * speed)
        self.units[SLIPPING] = power_unit
        self._rounders = tuple(float(rounding_constant(self.units[k])) for k in (KINETIC, MOMENTUM, SUPPORT, SLIPPING))

    def resize(self, count: int) -> None:
        """Allocate arrays for `count` particles."""
        chunks = -(-count // self._chunk)
        self.integers, self.extremes = np.zeros((chunks, 2, COUNTED), np.int64), np.zeros((chunks, 3))

    @property
    def buffers(self) -> tuple[tuple[np.ndarray, np.ndarray], tuple[float, ...]]:
        """Arguments of compiled loops: sums, extremes, and units of energy, momentum, force and power."""
        return (self.integers, self.extremes), self._rounders

    def total(self) -> np.ndarray:
        """Return the sums (SUMS,); the integer ones are NaN where a particle's energy is invalid or too large."""
        parts, extremes = np.zeros((2, COUNTED), np.int64), np.zeros(3)
        _add_chunks()(self.integers, self.extremes, parts, extremes)
        self._parts, extremes = self.reduce(parts, extremes)
        sums = np.empty(SUMS)
        sums[:COUNTED] = decode_sum(self._parts, self.units)
        fastest2, sums[LONGEST], size = extremes.tolist()
        sums[FASTEST] = sqrt(fastest2)
        if not size < LARGEST * self.units[KINETIC]:
            sums[:COUNTED] = np.nan
        self._extremes = extremes
        return sums

    def history(self) -> dict[str, np.ndarray]:
        """Return the operands of the last `total`, by name."""
        return {"whole_sums": self._parts, "extremes": self._extremes}

    def restore(self, history: Plain) -> np.ndarray:
        """Restore the operands of `history`; return the sums."""
        self.integers[...], self.extremes[...] = 0, 0.0
        if len(self.integers):
            self.integers[0], self.extremes[0] = history["whole_sums"], history["extremes"]
        return self.total()
