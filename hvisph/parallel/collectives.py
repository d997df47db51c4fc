"""Collective operations over the particles of all processes: sums, extremes, look-up by number, step limit.

Every method is called by all processes together. A single process needs no communication.
"""

from dataclasses import dataclass
from math import fsum
from typing import TypeVar

import numpy as np

from hvisph.compiler.exact_sum import exact_parts, exact_sum
from hvisph.core.particles import Particles
from hvisph.integrators.time_step import NAMES, Limit
from hvisph.schemes.protocol import AnyStepper

from . import parallel_output
from .world import SingleProcess

T = TypeVar("T")
# Criteria of the step and of failures, exchanged as their indices.
COLLAPSED = "collapsed"
CRITERIA = (*NAMES, "not_finite", COLLAPSED, "hourglass", "contact", "inverted", "passed_through", "rigid_body")


@dataclass
class GlobalLimit:
    """Limit of the step over all processes: step [s], criterion, particle (-1 for none) and its body, requests.

    `stop` is the signal that stops the run, 0 for none; `checkpoint` is true when one is due.
    """

    dt: float
    criterion: str
    number: int
    body: int
    stop: int
    checkpoint: bool


@dataclass
class ParticleReport:
    """Reported particle: permanent number, body, position [m], density [kg/m^3], energy [J/kg]."""

    number: int
    body: int
    position: list[float]
    density: float
    energy: float


class Collectives:
    """Collective operations over `count` particles, of which `stepper` has those of this process."""

    def __init__(self, stepper: AnyStepper, count: int):
        self._stepper, self.count = stepper, count
        self.world: SingleProcess = SingleProcess()
        self._row_table: np.ndarray | None = None
        self._sorted_numbers = np.zeros(0, np.uint32)

    @property
    def _is_parallel(self) -> bool:
        return self.world.size > 1

    @property
    def uses_slabs(self) -> bool:
        """Whether output is too large for one process and is written slab by slab."""
        return self._is_parallel and self.count > parallel_output.MOST_GATHERED

    def gather_numbers(self, mask: np.ndarray) -> np.ndarray:
        """Return the permanent numbers of the particles in `mask` (n,), bool, of all processes."""
        numbers = self._stepper.particles.id[mask].astype(np.int64)
        return np.concatenate(self.world.gather_objects(numbers))

    def total(self, counts: np.ndarray) -> np.ndarray:
        """Return the sums of integers over all processes."""
        return self.world.total(counts)

    def exact_sum(self, terms: np.ndarray) -> float:
        """Return the sum of `terms` (n,) over all processes, rounded once."""
        if not self._is_parallel:
            return exact_sum(terms)
        return fsum(part for parts in self.world.gather_objects(exact_parts(terms)) for part in parts)

    def get_maxima(self, *values: float) -> np.ndarray:
        """Return the maximum of each value over all processes."""
        return self.world.get_maxima(np.array(values))

    def gather_values(self, numbers: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return `values` (n, ...) of particles by their permanent numbers, bit by bit."""
        rows = self.find_rows(numbers)
        if not self._is_parallel:
            return values[rows]
        mask = rows >= 0
        bits = np.zeros((len(numbers), *values.shape[1:]), np.int64)
        is_64_bit = values.dtype.itemsize == 8
        bits[mask] = values[rows[mask]].view(np.int64) if is_64_bit else values[rows[mask]]
        sums = self.world.total(bits)
        return sums.view(values.dtype) if is_64_bit else sums.astype(values.dtype)

    def first_of(self, local_value: T | None) -> T:
        """Return the value of the first process that has one."""
        return next(value for value in self.world.gather_objects(local_value) if value is not None)

    def find_rows(self, numbers: np.ndarray) -> np.ndarray:
        """Return the rows of particles by their permanent numbers, -1 for those of other processes."""
        local_numbers = self._stepper.particles.id
        if not self._is_parallel:
            if self._row_table is None:
                self._row_table = np.empty(len(local_numbers), np.int32)
                self._row_table[local_numbers] = np.arange(len(local_numbers), dtype=np.int32)
            return np.asarray(self._row_table[numbers])
        if self._row_table is None:
            self._row_table = np.argsort(local_numbers)
            self._sorted_numbers = local_numbers[self._row_table]
        if not len(local_numbers):
            return np.full(len(numbers), -1)
        positions = np.minimum(np.searchsorted(self._sorted_numbers, numbers), len(local_numbers) - 1)
        return np.where(self._sorted_numbers[positions] == numbers, self._row_table[positions], -1)

    def note_reordering(self) -> None:
        """Discard the look-up table after particles were reordered."""
        self._row_table = None

    def worst(self, score: np.ndarray) -> ParticleReport | None:
        """Return the particle of the largest score (n,), the least number of equals; NaN counts, -inf does not."""
        particles = self._stepper.particles
        score = np.where(np.isnan(score), np.inf, score)
        candidate: tuple[float, int, ParticleReport] | None = None
        if len(score) and score.max() > -np.inf:
            rows = np.flatnonzero(score == score.max())
            row = int(rows[particles.id[rows].argmin()])
            candidate = (-float(score[row]), int(particles.id[row]), self._report(row))
        reports = [report for report in self.world.gather_objects(candidate) if report is not None]
        return min(reports, key=lambda report: report[:2])[2] if reports else None

    def look_up(self, number: int) -> ParticleReport:
        """Return a particle by its permanent number."""
        row = int(self.find_rows(np.array([number]))[0])
        return self.first_of(self._report(row) if row >= 0 else None)

    def _report(self, row: int) -> ParticleReport:
        particles = self._stepper.particles
        return ParticleReport(
            int(particles.id[row]),
            int(particles.body[row]),
            [float(x) for x in particles["position"][row]],
            float(particles["density"][row]),
            float(particles["internal_energy"][row]),
        )

    def reduce_limit(self, limit: Limit, stop: int, checkpoint: bool) -> GlobalLimit:
        """Return the limit of the step over all processes."""
        particles = self._stepper.particles
        number, body = -1, -1
        if 0 <= limit.particle < particles.count:
            number, body = int(particles.id[limit.particle]), int(particles.body[limit.particle])
        if not self._is_parallel:
            return GlobalLimit(limit.dt, limit.criterion, number, body, stop, checkpoint)
        index = CRITERIA.index(limit.criterion)
        values = np.array([limit.dt, index, number, body, stop, float(checkpoint), limit.unrounded])
        table = self.world.gather_all(values)
        # a failure stops all; of equal steps the first criterion and the smallest number count
        first = int(np.lexsort((table[:, 2], table[:, 6], table[:, 1], table[:, 0]))[0])
        dt, criterion, number, body = table[first, :4].tolist()
        return GlobalLimit(
            dt, CRITERIA[int(criterion)], int(number), int(body), int(table[:, 4].max()), bool(table[0, 5])
        )

    def scatter_rows(self, rows: np.ndarray | None) -> np.ndarray:
        """Distribute `rows` (count, ...) of the first process, by permanent number, to the owners of the particles."""
        numbers = self._stepper.particles.id
        if not self._is_parallel:
            assert rows is not None
            return np.asarray(rows[numbers])
        all_numbers = self.world.gather_rows(numbers)
        ends = np.cumsum(self.world.gather_all(np.array([len(numbers)]))[:, 0])
        return self.world.scatter_rows(rows, np.split(all_numbers, ends[:-1]) if self.world.first else None)

    def gather_rows(self, values: np.ndarray) -> np.ndarray:
        """Return the rows of all processes in order of rank on the first process; empty on the others."""
        return self.world.gather_rows(values)

    def gather_particles(self, particles: Particles, *arrays: np.ndarray) -> tuple[Particles, list[np.ndarray]] | None:
        """Return all particles and the rows of `arrays` on the first process, without copies of its own; else None."""
        tags, data = self.gather_rows(particles.tags), self.gather_rows(particles.data)
        rows = [self.gather_rows(values) for values in arrays]
        if not self.world.first:
            return None
        result = particles.like(0)
        result.data, result.tags = data, tags
        return result, rows
