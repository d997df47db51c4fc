"""Neighbours in the reference configuration: found once, with the kernel and the corrections there.

Row i of the lists holds the neighbours b of particle i within the kernel's support at the start, same body
alone, padded to whole vectors with the far row. For each stands

    slope = V0_b (dW/dR) / R        shape = V0_b W

so that a gradient is V0_b g_ab = A_a slope (X_a - X_b) + B_a shape, with A and B of particle a:

    none      A = I,    B = 0
    gradient  A = K,    B = 0,                  K = [sum_b V0_b grad W (x) (X_b - X_a)]^-1
    mixed     A = K/S,  B = - K grad S / S^2,   S = sum_b V0_b W, the particle itself included,
              K as above of grad W / S - W grad S / S^2

(Young 2021 eqs. 3-5). A particle whose K has no sound inverse keeps the plain gradient.
F_a = F0_a + sum_b (x_b - x_a) (x) V0_b g_ab, where F0 makes F the identity at the start.
"""

from __future__ import annotations

import numpy as np

from hvisph.core.errors import RunError
from hvisph.core.jit import prange, specialise
from hvisph.sph import cells, traversal
from hvisph.sph.kernels import Kernel
from hvisph.sph.kernels.kernel import scale

CORRECTIONS = ("none", "gradient", "mixed")
CHUNK = 256
# A neighbourhood whose moment matrix has less than this share of a round one's determinant keeps the
# plain gradient: a particle with one or two neighbours, or a string of them.
SINGULAR = 0.05
# Pairs at the very rim of the support are left out: there round-off would decide, with a kernel of zero.
RIM = 1.0 - 1e-9


def _collect(near, n, rows, i, constants, out):
    """Write the list of neighbours into row `i` of `out`, its length first."""
    out[i, 0] = n
    for k in range(n):
        out[i, k + np.uint64(1)] = near[k]


def _fill(position, volume, starts, near, ih, slopes, shapes):
    """Compute slope and shape of every entry; entries of the far row stay zero."""
    far = np.uint32(position.shape[0])
    count = np.uint64(starts.shape[0] - 1)
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        first = np.uint64(chunk) * np.uint64(CHUNK)
        for i in range(first, min(first + np.uint64(CHUNK), count)):
            for k in range(np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)])):
                if near[k] == far:
                    continue
                b = np.uint64(near[k])
                r2 = 0.0
                for f in range(np.uint64(DIM)):
                    r2 += (position[i, f] - position[b, f]) ** 2
                r = np.sqrt(r2)
                slopes[k] = volume[b] * scale(ih) * slope(r * ih) / r
                shapes[k] = volume[b] * scale(ih) * shape(r * ih) / ih


def _correct(chosen, position, volume, starts, near, ih, slopes, shapes, matrix, vector, start_gradient, first_sums,
             zeroth_sums):  # fmt: skip
    """Compute A, B, F0 and the sums of the particles `chosen`."""
    far = np.uint32(position.shape[0])
    count = np.uint64(chosen.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        first = np.uint64(chunk) * np.uint64(CHUNK)
        d = np.empty(DIM)
        sums = np.empty(DIM)
        moment = np.empty((DIM, DIM))
        g = np.empty(DIM)
        for c in range(first, min(first + np.uint64(CHUNK), count)):
            i = np.uint64(chosen[c])
            begin, end = np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)])
            shepard = volume[i] * scale(ih) * shape(0.0) / ih
            sums[:] = 0.0
            moment[:] = 0.0
            for k in range(begin, end):
                if near[k] == far:
                    continue
                b = np.uint64(near[k])
                shepard += shapes[k]
                for f in range(DIM):
                    sums[f] += slopes[k] * (position[i, f] - position[b, f])
            zeroth_sums[i] = shepard - volume[i] * scale(ih) * shape(0.0) / ih
            for f in range(DIM):
                first_sums[i, f] = sums[f]
            if not MIXED:
                shepard = 1.0
                sums[:] = 0.0
            for k in range(begin, end):
                if near[k] == far:
                    continue
                b = np.uint64(near[k])
                for f in range(DIM):
                    d[f] = position[i, f] - position[b, f]
                for f in range(DIM):
                    part = slopes[k] * d[f] / shepard - shapes[k] * sums[f] / (shepard * shepard)
                    for e in range(DIM):
                        moment[f, e] -= part * d[e]
            trace = 0.0
            for f in range(DIM):
                trace += moment[f, f] / DIM
            determinant = moment[0, 0]
            if DIM == 2:
                determinant = moment[0, 0] * moment[1, 1] - moment[0, 1] * moment[1, 0]
            if DIM == 3:
                determinant = (
                    moment[0, 0] * (moment[1, 1] * moment[2, 2] - moment[1, 2] * moment[2, 1])
                    - moment[0, 1] * (moment[1, 0] * moment[2, 2] - moment[1, 2] * moment[2, 0])
                    + moment[0, 2] * (moment[1, 0] * moment[2, 1] - moment[1, 1] * moment[2, 0])
                )
            for f in range(DIM):
                vector[i, f] = 0.0
                for e in range(DIM):
                    matrix[i, f, e] = 1.0 if f == e else 0.0
            if CORRECTED and determinant > SINGULAR * abs(trace) ** DIM and trace > 0.0:
                inverse = np.linalg.inv(moment)
                for f in range(DIM):
                    for e in range(DIM):
                        matrix[i, f, e] = inverse[f, e] / shepard
                        vector[i, f] -= inverse[f, e] * sums[e] / (shepard * shepard)
            for f in range(DIM):
                for e in range(DIM):
                    start_gradient[i, f, e] = 1.0 if f == e else 0.0
            for k in range(begin, end):
                if near[k] == far:
                    continue
                b = np.uint64(near[k])
                for f in range(DIM):
                    d[f] = position[i, f] - position[b, f]
                for f in range(DIM):
                    g[f] = vector[i, f] * shapes[k]
                    for e in range(DIM):
                        g[f] += matrix[i, f, e] * slopes[k] * d[e]
                for f in range(DIM):
                    for e in range(DIM):
                        start_gradient[i, f, e] += d[f] * g[e]


def _touching(starts, near, chosen, found):
    """Find which particles have a chosen one in their list."""
    count = np.uint64(found.shape[0])
    for chunk in prange((count + np.uint64(CHUNK - 1)) // np.uint64(CHUNK)):
        first = np.uint64(chunk) * np.uint64(CHUNK)
        for i in range(first, min(first + np.uint64(CHUNK), count)):
            for k in range(np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)])):
                if chosen[near[k]]:
                    found[i] = True
                    break


class Reference:
    """Lists of reference neighbours with their kernels.

    Parameters
    ----------
    position
        Reference positions (n, dim) [m], those of images at symmetry planes behind the n of particles.
    volume
        Reference volumes (n,) [m^dim], likewise.
    body
        Bodies, likewise.
    count
        Number of particles, images not counted.
    kernel, h
        Kernel, and its smoothing length [m].
    correction
        ``none``, ``gradient`` or ``mixed``.

    Attributes
    ----------
    starts, near, slopes, shapes
        The lists: entries of row i stand from starts[i] to starts[i + 1]; the far row has number n.
    matrix, vector, start_gradient
        A (count, dim, dim), B (count, dim) and F0 (count, dim, dim).
    first_sums, zeroth_sums
        Sums over each list of slope (X_a - X_b), (count, dim), and of shape, (count,).
    """

    def __init__(self, position: np.ndarray, volume: np.ndarray, body: np.ndarray, count: int, kernel: Kernel,
                 h: float, correction: str):  # fmt: skip
        self.position, self.volume = np.ascontiguousarray(position), np.ascontiguousarray(volume)
        self.count, self.dim, self.h = count, position.shape[1], h
        dim = self.dim
        lists = _lists(self.position, body, count, kernel.reach * h * RIM)
        lengths = np.array([len(one) for one in lists], np.uint64)
        padded = (lengths + np.uint64(7)) // np.uint64(8) * np.uint64(8)
        self.starts = np.zeros(count + 1, np.uint64)
        np.cumsum(padded, out=self.starts[1:])
        self.near = np.full(int(self.starts[-1]), len(position), np.uint32)
        for first, one in zip(self.starts[:-1].astype(np.int64), lists, strict=True):
            self.near[first : first + len(one)] = one
        self.slopes, self.shapes = np.zeros(len(self.near)), np.zeros(len(self.near))
        self.matrix, self.vector = np.zeros((count, dim, dim)), np.zeros((count, dim))
        self.start_gradient = np.zeros((count, dim, dim))
        self.first_sums, self.zeroth_sums = np.zeros((count, dim)), np.zeros(count)
        bound = {
            "DIM": dim,
            "shape": kernel.shape,
            "scale": specialise(scale, DIM=dim, NORM=kernel.norm(dim)),
        }
        specialise(_fill, parallel=True, slope=kernel.slope, **bound)(
            self.position, self.volume, self.starts, self.near, 1.0 / h, self.slopes, self.shapes
        )
        self._correct = specialise(_correct, parallel=True, MIXED=int(correction == "mixed"),
                                   CORRECTED=int(correction != "none"), **bound)  # fmt: skip
        self._update_corrections(np.arange(count))

    def _update_corrections(self, chosen: np.ndarray) -> None:
        self._correct(chosen.astype(np.uint64), self.position, self.volume, self.starts, self.near, 1.0 / self.h,
                      self.slopes, self.shapes, self.matrix, self.vector, self.start_gradient,
                      self.first_sums, self.zeroth_sums)  # fmt: skip

    def neighbours_of(self, chosen: np.ndarray) -> np.ndarray:
        """Return which particles have one of `chosen` (n,) among their reference neighbours (count,), bool."""
        found = np.zeros(self.count, bool)
        specialise(_touching, parallel=True)(self.starts, self.near, np.append(chosen, False), found)
        return found

    def remove(self, chosen: np.ndarray) -> None:
        """Take the particles `chosen` (n,), bool, out of all lists, empty their own, and correct what remains."""
        affected = np.flatnonzero(self.neighbours_of(chosen) | chosen[: self.count])
        gone = np.append(chosen, False)
        for i in affected:
            row = slice(int(self.starts[i]), int(self.starts[i + 1]))
            drop = gone[self.near[row]] | gone[i]
            self.near[row][drop] = len(self.position)
            self.slopes[row][drop] = 0.0
            self.shapes[row][drop] = 0.0
        self._update_corrections(affected)


def _lists(position: np.ndarray, body: np.ndarray, count: int, reach: float) -> list[np.ndarray]:
    """Return the neighbours within `reach` [m] in the same body, in rising order, of the first `count` particles."""
    dim = position.shape[1]
    lists: list[np.ndarray] = [np.zeros(0, np.uint32)] * count
    collect = specialise(_collect)
    sweep = specialise(traversal.sweep, parallel=True, DIM=dim, H=dim, law=collect)
    for number in np.unique(body):
        members = np.flatnonzero(body == number)
        n = len(members)
        rows, found = np.zeros((n, 8)), np.zeros((n + 1, 8))
        rows[:, :dim], rows[:, dim] = position[members], 1.0
        found[n, :dim], found[n, dim] = traversal.FAR, 1.0
        columns = np.zeros((dim + 1, n + 8))
        order, place, cell = (np.zeros(n, np.uint32) for _ in range(3))
        grid = cells.Grid.around(rows[:, :dim], reach)
        cells.sort(grid, rows, dim, cell, order, place, found[:n], columns, dim)
        nx, ny, nz = (np.uint64(c) for c in grid.shape)
        capacity = 64 * 4 ** (dim - 1)
        while True:
            out = np.zeros((n, capacity + 9), np.uint32)
            overflow = np.zeros(-(-n // traversal.CHUNK), np.uint64)
            sweep(found, columns, np.uint64(n), grid.starts, 1.0 / grid.edge, nx, ny, nz, reach, np.zeros(1),
                  np.uint64(capacity), out, overflow)  # fmt: skip
            needed = int(overflow.max(initial=0))
            if needed == 0:
                break
            if needed > 100_000:
                raise RunError("a particle has more than 100000 reference neighbours")
            capacity = needed + 8
        for k in range(n):
            i = members[order[k]]
            if i < count:
                near = out[k, 1 : 1 + out[k, 0]]
                lists[i] = np.sort(members[order[near[near < n]]]).astype(np.uint32)
    return lists
