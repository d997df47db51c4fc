"""Neighbours in the reference configuration, with kernels and kernel corrections there.

Row i of the lists contains the neighbours b of particle i within the initial kernel support, of the same body, padded
to whole vectors with the far row. For each neighbour

    slope = V0_b (dW/dR) (X_a - X_b) / R        shape = V0_b W

are stored by a code, the index in a table of distinct values: a lattice has few, and shorter lists are read faster. X_a
- X_b is rounded to multiples of 1e-12 h, so that round-off creates no new values, and the slope of b to a is exactly
minus that of a to b.

A gradient is V0_b g_ab = A_a slope + B_a shape, with A and B of particle a:

    none      A = I,    B = 0
    gradient  A = K,    B = 0,                  K = [sum_b V0_b grad W (x) (X_b - X_a)]^-1
    mixed     A = K/S,  B = - K grad S / S^2,   S = sum_b V0_b W, the particle itself included,
              K as above of grad W / S - W grad S / S^2

(Young 2021 eqs. 3-5). A particle with a singular matrix has the plain gradient. F0_a = 1 - sum_b (X_b - X_a) (x) V0_b
g_ab is the error of the gradient of the identity.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from hvisph.compiler.jit import CompiledFunction, bind, specialise
from hvisph.compiler.parallel_for import particle_loop
from hvisph.compiler.tensors import (
    add,
    dot,
    dot_rows,
    identity,
    multiply,
    no_gradient,
    no_vector,
    outer,
    put,
    row_vector,
    subtract,
)
from hvisph.sph.kernels import Kernel, scale
from hvisph.sph.terms.shape_matrix import sound_inverse

from . import cells, traversal

CORRECTIONS = ("none", "gradient", "mixed")
CHUNK = 256
# Pairs at the rim of the support, where round-off would decide and the kernel is zero, are left out.
RIM = 1.0 - 1e-9
# Unit of distances over h, larger than the round-off in a lattice of a thousand spacings.
FINEST = 2.0**-40
# Kernels that occur at least COMMON times among PORTION particles are tabulated, up to MOST_CODES (first-level cache),
# of up to so many volumes and steps along an axis; every other entry has a row of its own.
COMMON, PORTION, MOST_CODES, MOST_VOLUMES, MOST_STEPS = 8, 1024, 1024, 64, 4096
OWN_ROW = 0xFFFFFFFF


def _count(indices, n, rows, i, constants, out):
    """Count the neighbours of sorted particle `i` (pair law)."""
    lengths, order, members = out
    s, count = members[order[i]], np.uint64(0)
    if s < np.uint32(lengths.shape[0]):
        for k in range(n):
            count += np.uint64(indices[k] != np.uint32(order.shape[0]))
        lengths[s] = count


def _enter(indices, n, rows, i, constants, out):
    """List the neighbours of sorted particle `i` in order of their numbers (pair law)."""
    entries, starts, order, members = out
    s, one = np.uint64(members[order[i]]), np.uint64(1)
    if s + one < np.uint64(starts.shape[0]):
        begin = end = np.uint64(starts[s])
        for k in range(n):
            if indices[k] != np.uint32(order.shape[0]):
                number, slot = order[indices[k]], end
                while slot > begin and entries[slot - one] > number:
                    entries[slot] = entries[slot - one]
                    slot -= one
                entries[slot] = number
                end += one
        for k in range(begin, end):
            entries[k] = members[entries[k]]


def _measure(k, first, position, lists, ih, separations):
    """Find the separations of the entries of particle `first` + k over h, in units of `FINEST`; 0 of the far row."""
    starts, indices = lists
    i, far = np.uint64(first + k), np.uint32(position.shape[0])
    for entry in range(np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)])):
        if indices[entry] != far:
            d = subtract(row_vector(position, i, 0, DIM), row_vector(position, np.uint64(indices[entry]), 0, DIM))
            put(separations, np.uint64(entry - starts[np.uint64(first)]), 0, multiply(ih / FINEST, d))


def _fill(k, separations, volume, ih, kernels):
    """Compute slope and shape of neighbours from volumes and separations over h; zero at no distance."""
    d = row_vector(separations, k, 0, DIM)
    r = np.sqrt(dot(d, d))
    if r > 0.0:
        put(kernels, k, 0, multiply(volume[k] * scale(ih) * slope(r) / r, d))
        kernels[k, DIM] = volume[k] * scale(ih) * shape(r) / ih


def _correct(c, particles, position, volume, lists, ih, corrections, sums, hourglass_sums):
    """Compute A, B, F0 and the sums of the `particles`."""
    starts, indices, codes, kernels = lists
    all_a, all_b, all_f0 = corrections
    first_sums, zeroth_sums = sums
    far = np.uint32(position.shape[0])
    i = np.uint64(particles[c])
    x = row_vector(position, i, 0, DIM)
    begin, end = np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)])
    shape_sum, slope_sum, stiffness = 0.0, no_vector(DIM), 0.0
    for k in range(begin, end):
        if indices[k] != far:
            d = subtract(x, row_vector(position, np.uint64(indices[k]), 0, DIM))
            shape_sum += kernels[codes[k], DIM]
            stiffness += kernels[codes[k], DIM] / dot(d, d)
            slope_sum = add(slope_sum, row_vector(kernels, codes[k], 0, DIM))
    zeroth_sums[i], hourglass_sums[i] = shape_sum, stiffness
    put(first_sums, i, 0, slope_sum)
    inverse_s, shift = 1.0, no_vector(DIM)
    if MIXED:
        inverse_s = 1.0 / (shape_sum + volume[i] * scale(ih) * shape(0.0) / ih)
        shift = multiply(-inverse_s * inverse_s, slope_sum)
    moment = no_gradient(DIM)
    for k in range(begin, end):
        if indices[k] != far:
            d = subtract(x, row_vector(position, np.uint64(indices[k]), 0, DIM))
            g = add(multiply(inverse_s, row_vector(kernels, codes[k], 0, DIM)), multiply(kernels[codes[k], DIM], shift))
            moment = subtract(moment, outer(g, d))
    a, regular = sound_inverse(moment)
    if CORRECTED and regular:
        a, b = multiply(inverse_s, a), dot_rows(a, shift)
    else:
        a, b = identity(a), no_vector(DIM)
    f0 = identity(a)
    for k in range(begin, end):
        if indices[k] != far:
            d = subtract(x, row_vector(position, np.uint64(indices[k]), 0, DIM))
            g = dot_rows(a, row_vector(kernels, codes[k], 0, DIM))
            f0 = add(f0, outer(d, add(multiply(kernels[codes[k], DIM], b), g)))
    put(all_a, i, 0, a)
    put(all_b, i, 0, b)
    put(all_f0, i, 0, f0)


def _mark_neighbours(i, starts, indices, mask, result):
    """Find which particles have a chosen one in their list."""
    for k in range(np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)])):
        if mask[indices[k]]:
            result[i] = True
            break


class Reference:
    """Lists of reference neighbours with their kernels.

    `position`: reference positions (n, dim) [m]; rows of other processes and images at symmetry planes come last.
    `volume`: reference volumes (n,) [m^dim], likewise.
    `body`, `numbers`: bodies and numbers, each once, likewise: in the order of the numbers neighbours are listed.
    `count`: number of particles that get a list.
    `kernel`, `h`: kernel, and its smoothing length [m].
    `shepard`, `gradient`: whether the kernel is divided by its own sum, and whether its gradient is exact for linear
    fields.
    It holds:
    `starts`, `indices`, `codes`: the lists: entries of row i are those from starts[i] to starts[i + 1]; the far row has
    number n and code 0.
    `kernels`: slope and, behind it, shape of each code (codes + 1, dim + 1).
    `matrix`, `vector`, `start_gradient`: A (count, dim, dim), B (count, dim) and F0 (count, dim, dim).
    `first_sums`, `zeroth_sums`: sums over each list of slopes (count, dim) and of shapes (count,).
    `hourglass_sums`: sums over each list of shape/|X_a - X_b|^2 (count,) [1/m^2], the stiffness of hourglass control.
    """

    def __init__(self, position: np.ndarray, volume: np.ndarray, body: np.ndarray, numbers: np.ndarray, count: int,
                 kernel: Kernel, h: float, shepard: bool, gradient: bool):  # fmt: skip
        self.position, self.volume = np.ascontiguousarray(position), np.ascontiguousarray(volume)
        self.count, self.dim, self.h = count, position.shape[1], h
        dim = self.dim
        self.starts, self.indices = _lists(self.position, body, numbers, count, kernel.reach * h * RIM)
        self.matrix, self.vector = np.zeros((count, dim, dim)), np.zeros((count, dim))
        self.start_gradient = np.zeros((count, dim, dim))
        self.first_sums, self.zeroth_sums, self.hourglass_sums = (
            np.zeros((count, dim)),
            np.zeros(count),
            np.zeros(count),
        )
        self.corrections = self.matrix.reshape(count, -1), self.vector, self.start_gradient.reshape(count, -1)
        self.sums = self.first_sums, self.zeroth_sums
        bindings = {
            "DIM": dim,
            "shape": kernel.shape,
            "slope": kernel.slope,
            "MIXED": int(shepard),
            "CORRECTED": int(gradient),
            "scale": specialise(scale, DIM=dim, NORM=kernel.norm(dim)),
        }
        self._tabulate(particle_loop(bind(_measure, {}, bindings)), particle_loop(bind(_fill, {}, bindings)))
        self.lists = self.starts, self.indices, self.codes, self.kernels  # arguments of compiled loops, by row
        self._correct = particle_loop(bind(_correct, {}, bindings))
        self._update_corrections(np.arange(count))

    def _tabulate(self, measure: CompiledFunction, fill: CompiledFunction) -> None:
        """Find the code of each entry and its kernel; code 0 is no neighbour."""
        dim, volume = self.dim, np.append(self.volume, 0.0)  # the far row has none
        volumes, steps, kinds = _CommonValues(MOST_VOLUMES), _CommonValues(MOST_STEPS), _CommonValues(MOST_CODES)
        self.codes = np.empty(len(self.indices), np.uint32)

        def portions() -> Iterator[tuple[slice, np.ndarray]]:
            for first in range(0, self.count, PORTION):
                count = min(PORTION, self.count - first)
                part = slice(int(self.starts[first]), int(self.starts[first + count]))
                separations = np.zeros((part.stop - part.start, dim))
                measure(count, first, self.position, (self.starts, self.indices), 1.0 / self.h, separations)
                yield part, np.rint(separations)

        for part, separations in portions():
            keys = volumes.number(volume[self.indices[part]])
            for axis in range(dim):
                number = steps.number(np.where(keys < 0, 0.0, separations[:, axis]))
                keys = np.where((keys < 0) | (number < 0), -1, keys * MOST_STEPS + number)
            codes = kinds.number(np.where(keys < 0, 0, keys))
            self.codes[part] = np.where((keys < 0) | (codes < 0), OWN_ROW, codes)
        n_codes, unique = len(kinds.values), self.codes == OWN_ROW
        self.codes[unique] = n_codes + np.arange(unique.sum())
        # a row more, for rows are read in pairs of numbers
        self.kernels = np.zeros((n_codes + int(unique.sum()) + 1, dim + 1))
        keys, separations = kinds.values.astype(np.int64), np.empty((n_codes, dim))
        for axis in reversed(range(dim)):
            keys, number = np.divmod(keys, MOST_STEPS)
            separations[:, axis] = steps.values[number]
        fill(n_codes, separations * FINEST, volumes.values[keys], 1.0 / self.h, self.kernels)
        for part, separations in portions() if unique.any() else ():
            mask = unique[part]
            if mask.any():
                rows = self.kernels[self.codes[part][mask][0] :]
                fill(
                    int(mask.sum()),
                    separations[mask] * FINEST,
                    volume[self.indices[part][mask]],
                    1.0 / self.h,
                    rows,
                )

    def _update_corrections(self, indices: np.ndarray) -> None:
        self._correct(len(indices), indices.astype(np.uint64), self.position, self.volume, self.lists, 1.0 / self.h,
                      self.corrections, self.sums, self.hourglass_sums)  # fmt: skip

    def neighbours_of(self, mask: np.ndarray) -> np.ndarray:
        """Return which particles have one of `mask` (n,) among their reference neighbours (count,), bool."""
        result = np.zeros(self.count, bool)
        particle_loop(specialise(_mark_neighbours))(
            self.count, self.starts, self.indices, np.append(mask, False), result
        )
        return result

    def remove(self, mask: np.ndarray) -> None:
        """Remove the particles in `mask` (n,), bool, from all lists, and update the corrections."""
        indices = np.flatnonzero(self.neighbours_of(mask) | mask[: self.count])
        extended = np.append(mask, False)
        for i in indices:
            row = slice(int(self.starts[i]), int(self.starts[i + 1]))
            drop = extended[self.indices[row]] | extended[i]
            self.indices[row][drop] = len(self.position)
            self.codes[row][drop] = 0
        self._update_corrections(indices)


class _CommonValues:
    """Up to `capacity` common values, numbered in order of appearance; 0 is the first."""

    def __init__(self, capacity: int) -> None:
        self._capacity, self.values = capacity, np.zeros(1)
        self._sorted, self._numbers = self.values, np.zeros(1, np.int64)

    def number(self, values: np.ndarray) -> np.ndarray:
        """Return the numbers of `values` (n,), -1 for values without one."""
        numbers = self._look_up(values)
        indices = np.flatnonzero(numbers < 0)
        additions, counts = np.unique(values[indices], return_counts=True)
        additions = additions[counts >= COMMON][: self._capacity - len(self.values)]
        if len(additions):
            self.values = np.append(self.values, additions)
            self._numbers = np.argsort(self.values)
            self._sorted = self.values[self._numbers]
            numbers[indices] = self._look_up(values[indices])
        return numbers

    def _look_up(self, values: np.ndarray) -> np.ndarray:
        places = np.minimum(np.searchsorted(self._sorted, values), len(self.values) - 1)
        return np.where(self._sorted[places] == values, self._numbers[places], -1)


def _lists(
    position: np.ndarray, body: np.ndarray, numbers: np.ndarray, count: int, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """List for the first `count` particles those within `reach` [m] in the same body, in the order of `numbers`.

    Returns where each list starts in the second array, and its end last; all lists, filled up to whole vectors of
    eight.
    """
    starts, lengths = np.zeros(count + 1, np.uint64), np.zeros(count, np.uint64)
    rows = [np.flatnonzero(body == number) for number in np.unique(body)]
    members = [indices[np.argsort(numbers[indices])].astype(np.uint32) for indices in rows]
    sorted_bodies = [_SortedBody(position, indices, reach) for indices in members]
    for sorted_body in sorted_bodies:
        sorted_body.run(_count, (lengths, sorted_body.order, sorted_body.members))
    np.cumsum((lengths + np.uint64(7)) // np.uint64(8) * np.uint64(8), out=starts[1:])
    entries = np.full(int(starts[-1]), len(position), np.uint32)
    for sorted_body in sorted_bodies:
        sorted_body.run(_enter, (entries, starts, sorted_body.order, sorted_body.members))
    return starts, entries


class _SortedBody:
    """Particles of a body in cells, for pair laws; `members` are their indices in the order listed."""

    def __init__(self, position: np.ndarray, members: np.ndarray, reach: float):
        (n, self._dim), self._reach, self.members = (len(members), position.shape[1]), reach, members
        dim = self._dim
        rows, self._rows = np.zeros((n, dim + 1)), np.zeros((n + 1, dim + 1))
        rows[:, :dim], rows[:, dim] = position[members], 1.0
        self._rows[n, :dim], self._rows[n, dim] = traversal.FAR, 1.0
        self._columns = np.zeros((dim + 1, n + 8))
        self.order, place, cell = (np.zeros(n, np.uint32) for _ in range(3))
        self._grid = cells.Grid.from_positions(rows[:, :dim], reach)
        cells.sort(self._grid, rows, np.arange(n, dtype=np.uint64), dim, cell, self.order, place, self._rows[:n],
                   self._columns, dim)  # fmt: skip
        self._capacity = 64 * 4 ** (dim - 1)

    def run(self, law: Any, out: Any) -> None:
        """Run a pair law over all particles."""
        n, sweep = len(self.members), traversal.loop(self._dim, specialise(law))
        arguments = sweep, self._rows, self._columns, self.order, (n, n), self._grid, self._reach, np.zeros(1)
        self._capacity = traversal.complete_sweep(*arguments, self._capacity, lambda capacity: out)
