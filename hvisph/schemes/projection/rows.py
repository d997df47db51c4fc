"""Particle rows and neighbour list of the passes of SPH-projection."""

from __future__ import annotations

import numpy as np

from hvisph.sph.kernels import Kernel
from hvisph.sph.neighbours import traversal
from hvisph.sph.neighbours.neighbour_list import NeighbourList
from hvisph.sph.neighbours.particle_layout import aligned_zeros
from hvisph.sph.neighbours.symmetry_planes import Plane, mirror

from . import law as laws

# How far beyond the kernel's reach neighbours are listed, over h. At the published step the fastest
# particle crosses half of it in 24 steps, a little more than the run waits until it sorts the particles.
MARGIN = 0.1


class ProjectionRows:
    """Rows of one pass and of the next in two arrays, and a neighbour list for many steps.

    Behind the particles follow copies, images and the far row; `listed_at` are the positions of the list (n, dim) [m].
    """

    def __init__(self, kernel: Kernel, positions: np.ndarray, h: float, planes: tuple[Plane, ...]):
        count, dim = positions.shape
        self.list = NeighbourList(kernel, MARGIN, positions, h, planes)
        self.layouts = laws.layouts(dim)
        self.listed_at = np.zeros((0, dim))
        self._kernels = np.zeros(0)
        self._count = count
        self._make_room(count + 1)

    def _make_room(self, rows: int) -> None:
        width = max(layout.width for layout in self.layouts)
        self.pair = [aligned_zeros(rows, width) for _ in range(2)]

    @property
    def get_neighbours(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Neighbours, first and last index of each particle's, kernels of the pairs."""
        return self.list.listed, self.list.first, self.list.last, self._kernels

    def replace_rows(self, rows: np.ndarray) -> None:
        """Replace all rows (n, width) for the first pass."""
        self._count = len(rows)
        self._make_room(self._count + 1)
        self.pair[0][: self._count] = rows
        self.list.resize(self._count)

    def make_list(self, positions: np.ndarray, lengths: np.ndarray, longest: float, numbers: np.ndarray) -> None:
        """Make the neighbour list, see `NeighbourList.make`, and allocate the arrays that depend on it."""
        self.list.make(positions, lengths, longest, numbers)
        self.listed_at = np.array(positions)
        if len(self._kernels) < len(self.list.listed):
            self._kernels = np.zeros(len(self.list.listed))
        present, first = self.list.present, self.pair[0][: self._count]
        if present + 1 > len(self.pair[0]):
            self._make_room(present + present // 4 + 1)
            self.pair[0][: self._count] = first
        for rows in self.pair:
            # The far row: no neighbour of anybody, and nothing that it holds divides by zero.
            rows[present] = 1.0
            rows[present, : positions.shape[1]] = traversal.FAR

    def get_pass_rows(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the rows of pass `number`, 0 to 3, with ghost rows, and of the next pass."""
        rows, following = self.pair[number % 2], self.pair[1 - number % 2]
        layout, count, listed = self.layouts[number], self._count, self.list
        if listed.halo is not None:
            rows[count : listed.before_images, : layout.used_width] = listed.halo.exchange_again(
                rows[:count, : layout.used_width]
            )
        for images in listed.images:
            last = images.first + len(images.source)
            rows[images.first : last, : layout.width] = mirror(
                rows[images.source, : layout.width], images.plane, layout
            )
        return rows, following

    def show_nothing(self) -> None:
        """Take part in the exchanges of the four passes after an error on this process."""
        if self.list.halo is not None:
            for layout in self.layouts:
                self.list.halo.exchange_again(np.zeros((self._count, layout.used_width)))
