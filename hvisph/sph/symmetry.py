"""Symmetry planes: particles near a plane have images, packed as rows like any other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .rows import RowLayout


@dataclass(frozen=True)
class Plane:
    """A plane of symmetry.

    Parameters
    ----------
    axis
        0, 1 or 2: the plane is normal to x, y or z.
    at
        Its coordinate [m].
    """

    axis: int
    at: float


@dataclass(frozen=True)
class Images:
    """The images that one plane makes.

    Parameters
    ----------
    plane
        The plane.
    source
        Rows that are mirrored, images of earlier planes included.
    first
        Row of the first image.
    """

    plane: Plane
    source: np.ndarray
    first: int


def mirror(rows: np.ndarray, plane: Plane, layout: RowLayout) -> np.ndarray:
    """Return the mirror images of packed `rows`, of any length up to the layout's width."""
    made = rows * layout.mirror_signs(plane.axis)[: rows.shape[1]]
    made[:, plane.axis] += 2.0 * plane.at
    return made


def with_images(
    rows: np.ndarray, planes: tuple[Plane, ...], layout: RowLayout, reach: float
) -> tuple[np.ndarray, list[Images]]:
    """Return `rows` (n, width) followed by the images of all that lie within `reach` [m] of a plane."""
    made = []
    for plane in planes:
        source = np.flatnonzero(np.abs(rows[:, plane.axis] - plane.at) < reach)
        made.append(Images(plane, source, len(rows)))
        rows = np.concatenate([rows, mirror(rows[source], plane, layout)])
    return rows, made
