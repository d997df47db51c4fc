"""Rows behind a process's own: images at planes of symmetry, and rows of other processes, are two kinds of one thing.

Copies are appended before rows are sorted, and brought up to date after a pass that wrote into rows. Nothing is
summed for them: their own particle, or the process that has it, does that.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from .rows import RowLayout
from .symmetry import Images, Plane, image_numbers, mirror, with_images


class Copies(Protocol):
    """Rows that stand for particles elsewhere."""

    def append(self, rows: np.ndarray, numbers: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Return rows (n, width) and numbers (n,) with those of all copies that can meet one, `reach` [m] away."""

    def refresh(self, sorted_rows: np.ndarray, place: np.ndarray) -> None:
        """Bring the copies among sorted rows up to date; `place` is the sorted place of each row."""


class Halo(Copies, Protocol):
    """Rows of other processes."""

    def anywhere(self, here: bool) -> bool:
        """Tell whether something is so on any process: all of them ask at the same place."""


class ImageCopies:
    """The images of all rows, those of other processes included, at planes of symmetry.

    Parameters
    ----------
    planes, layout
        The planes, and the layout of the rows.
    """

    def __init__(self, planes: tuple[Plane, ...], layout: RowLayout):
        self._planes, self._layout = planes, layout
        self._made: list[Images] = []

    def append(self, rows: np.ndarray, numbers: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Return rows and numbers followed by those of the images."""
        rows, self._made = with_images(rows, self._planes, self._layout, reach)
        return rows, image_numbers(numbers, self._made)

    def refresh(self, sorted_rows: np.ndarray, place: np.ndarray) -> None:
        """Mirror the rows anew."""
        for images in self._made:
            target = place[images.first : images.first + len(images.source)]
            sorted_rows[target] = mirror(sorted_rows[place[images.source]], images.plane, self._layout)
