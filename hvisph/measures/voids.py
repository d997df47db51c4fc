"""Share of voids in the projectile's main body: the measure of clumping."""

from __future__ import annotations

import numpy as np

from hvisph.measures.result import Result, meaningless
from hvisph.measures.scene import Scene

CELLS_PER_SPACING = 3  # grid dx/3
CLOSING_RADIUS = 5.0  # [dx]
MOST_CELLS = 60_000_000  # above it the distance transforms would need several GB


def void_fraction(scene: Scene) -> Result:
    """Return the share of area that the projectile's main body lacks inside its own outline.

    Discs of radius dx about the particles are drawn on a grid of dx/3. The outline is their
    morphological closing with a disc of radius 5 dx, its holes filled. Below 0.07 a body is sound.
    The uncertainty is that of the outline: half a grid cell along its edge, over its area.
    """
    if scene.now.dimensions != 2:
        return meaningless("", "the share of voids is defined in 2D only")
    position = scene.position[scene.projectile]
    cell = scene.spacing / CELLS_PER_SPACING
    if np.prod(np.ptp(position, axis=0) / cell + 40.0) > MOST_CELLS:
        return meaningless("", "the projectile's main body is too wide for a grid of dx/3")
    from scipy import ndimage

    covered = _draw_discs(position, cell, scene.spacing)
    reach = CLOSING_RADIUS * CELLS_PER_SPACING
    dilated = ndimage.distance_transform_edt(~covered) <= reach
    closed = ndimage.distance_transform_edt(dilated) > reach
    outline = ndimage.binary_fill_holes(closed | covered)
    area = int(outline.sum())
    edge = area - int(ndimage.binary_erosion(outline).sum())
    return Result(1.0 - float(covered.sum()) / area, "", 0.5 * edge / area)


def _draw_discs(position: np.ndarray, cell: float, radius: float) -> np.ndarray:
    """Grid cells whose centre is within `radius` of a particle, with a margin for the closing."""
    margin = int(CLOSING_RADIUS * CELLS_PER_SPACING) + CELLS_PER_SPACING + 3
    place = (position - position.min(axis=0)) / cell + margin
    shape = np.ceil(place.max(axis=0)).astype(int) + margin + 1
    covered = np.zeros(shape, dtype=bool)
    nearest = np.rint(place).astype(int)
    reach = int(np.ceil(radius / cell)) + 1
    steps = range(-reach, reach + 1)
    for i in steps:
        for j in steps:
            node = nearest + np.array([i, j])
            # the tolerance keeps cells that lie on a disc's edge, whatever the shift of the body
            inside = ((node - place) ** 2).sum(axis=1) <= (radius / cell) ** 2 * (1.0 + 1e-9)
            covered[node[inside, 0], node[inside, 1]] = True
    return covered
