"""Particle rows and neighbour list of the passes of SPH-projection, and the running time mean of its pressure."""

import numpy as np

from hvisph.sph.kernels import Kernel
from hvisph.sph.neighbours import traversal
from hvisph.sph.neighbours.ghost_rows import Plane, mirror
from hvisph.sph.neighbours.neighbour_list import NeighbourList
from hvisph.sph.neighbours.particle_layout import aligned_zeros

from .law import layouts

# Distance beyond the kernel's reach up to which neighbours are listed, over h. At the published step the fastest
# particle crosses half of it in 24 steps, more than the steps between two sortings.
MARGIN = 0.1


class ProjectionRows:
    """Rows of a pass and the next, then copies, images, far row; neighbours listed at `list_positions` (n, dim) [m]."""

    def __init__(self, kernel: Kernel, positions: np.ndarray, h: float, planes: tuple[Plane, ...]):
        count, dim = positions.shape
        self.list = NeighbourList(kernel, MARGIN, positions, h, planes)
        self.layouts = layouts(dim)
        self.list_positions = np.zeros((0, dim))
        self._kernels = np.zeros(0)
        self._count = count
        self._ensure_capacity(count + 1)

    def _ensure_capacity(self, rows: int) -> None:
        width = max(layout.width for layout in self.layouts)
        self.buffers = [aligned_zeros(rows, width) for _ in range(2)]

    @property
    def neighbours(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Neighbours, first and last index of each particle's, kernels of the pairs."""
        return self.list.entries, self.list.first, self.list.last, self._kernels

    def replace_rows(self, rows: np.ndarray) -> None:
        """Replace all rows (n, width) for the first pass."""
        self._count = len(rows)
        self._ensure_capacity(self._count + 1)
        self.buffers[0][: self._count] = rows
        self.list.resize(self._count)

    def make_list(self, positions: np.ndarray, lengths: np.ndarray, h_max: float, numbers: np.ndarray) -> None:
        """Make the neighbour list, see `NeighbourList.make`, and allocate the arrays that depend on it."""
        self.list.make(positions, lengths, h_max, numbers)
        self.list_positions = np.array(positions)
        if len(self._kernels) < len(self.list.entries):
            self._kernels = np.zeros(len(self.list.entries))
        present, first = self.list.present, self.buffers[0][: self._count]
        if present + 1 > len(self.buffers[0]):
            self._ensure_capacity(present + present // 4 + 1)
            self.buffers[0][: self._count] = first
        for rows in self.buffers:
            # The far row: a neighbour of no particle, without zeros that would be divisors.
            rows[present] = 1.0
            rows[present, : positions.shape[1]] = traversal.FAR

    def get_pass_rows(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the rows of pass `number`, 0 to 3, with ghost rows, and of the next pass."""
        rows, next_rows = self.buffers[number % 2], self.buffers[1 - number % 2]
        layout, count, lists = self.layouts[number], self._count, self.list
        if lists.halo is not None:
            rows[count : lists.image_start, : layout.used_width] = lists.halo.exchange_again(
                rows[:count, : layout.used_width]
            )
        for images in lists.images:
            last = images.first + len(images.source)
            rows[images.first : last, : layout.width] = mirror(
                rows[images.source, : layout.width], images.plane, layout
            )
        return rows, next_rows

    def exchange_after_error(self) -> None:
        """Take part in the exchanges of the four passes after an error on this process."""
        if self.list.halo is not None:
            for layout in self.layouts:
                self.list.halo.exchange_again(np.zeros((self._count, layout.used_width)))


PARTS = 20  # parts of the window, which advances by whole parts


class TrailingMean:
    """Mean over the last `window` [s]; the field is zero before the run."""

    def __init__(self, count: int, window: float):
        self._part_length = window / PARTS
        self._parts = np.zeros((PARTS - 1, count))  # integrals over full parts
        self._times = np.zeros(PARTS - 1)
        self._total = np.zeros(count)  # their sum
        self._part = np.zeros(count)  # integral over the part under way
        self._time = 0.0

    def add(self, values: np.ndarray, dt: float) -> None:
        """Add `values` (n,) that applied for `dt` [s]."""
        self._part += dt * values
        self._time += dt
        # a part that ends on a step must not wait for the next by round-off
        if self._time >= self._part_length * (1.0 - 1e-9):
            self._parts[1:], self._times[1:] = self._parts[:-1].copy(), self._times[:-1].copy()
            self._parts[0], self._times[0] = self._part, self._time
            self._total = self._parts.sum(axis=0)
            self._part[:], self._time = 0.0, 0.0

    def mean(self) -> np.ndarray:
        """Return the mean of each particle (n,)."""
        time = max(float(self._times.sum()) + self._time, (PARTS - 1) * self._part_length)
        mean: np.ndarray = (self._total + self._part) / time
        return mean

    def permute(self, order: np.ndarray) -> None:
        self._parts = self._parts.take(order, axis=1)
        self._total, self._part = self._total[order], self._part[order]

    def get_carried(self) -> dict[str, np.ndarray]:
        return {"parts": self._parts.T, "part": self._part}

    def history(self) -> dict[str, np.ndarray]:
        """Return the durations of the window's intervals, by name."""
        return {"part_times": self._times, "part_time": np.array([self._time])}

    def replace_particles(self, arrays: dict[str, np.ndarray]) -> None:
        self._parts, self._part = np.ascontiguousarray(arrays["parts"].T), np.array(arrays["part"])
        self._total = self._parts.sum(axis=0)

    def restore(self, history: dict[str, np.ndarray]) -> None:
        self._times[...], self._time = history["part_times"], float(history["part_time"][0])
