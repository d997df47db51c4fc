"""Ghost rows behind a process's own: images at planes of symmetry, and rows of other processes.

Copies are appended before rows are sorted, and brought up to date after a pass that wrote into rows. Nothing is
summed for them: their own particle, or the process that has it, does that.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from .particle_layout import RowLayout
from .symmetry_planes import Images, Plane, image_numbers, mirror, with_images


class Copies(Protocol):
    """Ghost rows of particles elsewhere."""

    def append(self, rows: np.ndarray, numbers: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Return rows (n, width) and numbers (n,) with those of all ghost rows within `reach` [m]."""

    def refresh(self, sorted_rows: np.ndarray, place: np.ndarray) -> None:
        """Bring the copies among sorted rows up to date; `place` is the sorted place of each row."""


class Halo(Copies, Protocol):
    """Rows of other processes."""

    def anywhere(self, here: bool) -> bool:
        """Return whether a condition holds on any process."""

    def total(self, counts: np.ndarray) -> np.ndarray:
        """Return the sums of integers over all processes."""

    def get_maxima(self, values: np.ndarray) -> np.ndarray:
        """Return the maximum of each float over all processes."""

    def stand_for(self, chosen: np.ndarray) -> None:
        """Declare the rows given to `append` as those `chosen` of more rows, for `exchange_again`."""

    def exchange_again(self, values: np.ndarray) -> np.ndarray:
        """Return `values` (n, ...) of the rows received by the last `append`."""


class ImageCopies:
    """Images of all rows at planes of symmetry, including rows of other processes."""

    def __init__(self, planes: tuple[Plane, ...], layout: RowLayout):
        self._planes, self._layout = planes, layout
        self._made: list[Images] = []

    def append(self, rows: np.ndarray, numbers: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Return rows (n, width) and numbers (n,) with those of all ghost rows within `reach` [m]."""
        rows, self._made = with_images(rows, self._planes, self._layout, reach)
        return rows, image_numbers(numbers, self._made)

    def refresh(self, sorted_rows: np.ndarray, place: np.ndarray) -> None:
        """Mirror the rows anew."""
        for images in self._made:
            target = place[images.first : images.first + len(images.source)]
            sorted_rows[target] = mirror(sorted_rows[place[images.source]], images.plane, self._layout)


class FixedCopies:
    """Ghost rows of a reference configuration, found once: rows of other processes, then images of all."""

    def __init__(self, planes: tuple[Plane, ...], dim: int):
        self._planes = planes
        self.layout = RowLayout(dim, (("x", "vector"), ("number", "scalar")))
        self.halo: Halo | None = None

    def find(self, position: np.ndarray, numbers: np.ndarray, reach: float,
             alone: np.ndarray) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """Find the ghost rows of reference positions; return positions (m, dim) [m] and numbers (m,) with theirs.

        `alone` (n,), bool, marks particles without neighbours.
        """
        dim, count = self.layout.dim, len(position)
        if self.halo is not None:
            meeting = np.flatnonzero(~alone)
            rows = np.zeros((len(meeting), self.layout.width))
            rows[:, :dim] = position[meeting]
            rows, with_others = self.halo.append(rows, numbers[meeting], reach)
            self.halo.stand_for(meeting)
            position = np.concatenate([position, rows[len(meeting) :, :dim]])
            numbers = np.concatenate([numbers, with_others[len(meeting) :]])
        self._others = slice(count, len(position))
        head = np.column_stack([position, np.arange(len(position))])
        extended, self._images = with_images(head, self._planes, self.layout, reach)
        self._origin = extended[len(position) :, dim].astype(np.int64)
        return extended[:, :dim], image_numbers(numbers, self._images)

    def extend_rows(self, values: np.ndarray) -> np.ndarray:
        """Return the `values` (n, ...) of the own rows followed by those of all ghost rows, not mirrored."""
        if self.halo is not None:
            values = np.concatenate([values, self.halo.exchange_again(values)])
        return np.concatenate([values, values[self._origin]]) if len(self._origin) else values

    def refresh(self, rows: np.ndarray, layout: RowLayout, slots: slice) -> None:
        """Bring copies among `rows` up to date: of others the `slots`, images as a whole with the place X0."""
        if self.halo is not None:
            rows[self._others, slots] = self.halo.exchange_again(rows[: self._others.start, slots])
        at = layout.slots()["X0"]
        for images in self._images:
            made = mirror(rows[images.source], images.plane, layout)
            made[:, at + images.plane.axis] += 2.0 * images.plane.at
            rows[images.first : images.first + len(images.source)] = made
