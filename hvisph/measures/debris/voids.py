"""Share of voids in the projectile's main body: the measure of clumping."""

from __future__ import annotations

import numpy as np

from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.result import Result, meaningless

CELLS_PER_SPACING = 3  # grid dx/3
CLOSING_RADIUS = 5.0  # [dx]
MOST_CELLS = 60_000_000  # above it the distance transforms would need several GB


def void_fraction(scene: Scene) -> Result:
    """Return the share of area that the projectile's main body lacks inside its own outline.

    Discs of radius dx about the particles are drawn on a grid of dx/3. The outline is their
    morphological closing with a disc of radius 5 dx, its holes filled. Below 0.07 a body is sound.
    A body that was hollow at the start has as many hollows still, the largest ones: they are no voids.
    The uncertainty is that of the outline: half a grid cell along its edge, over its area.
    """
    if scene.now.dimensions != 2:
        return meaningless("", "the share of voids is defined in 2D only")
    position = scene.position[scene.projectile]
    begun = _at_the_start(scene)
    if any(np.prod(3.0 * np.ptp(x, axis=0) / scene.spacing + 40.0) > MOST_CELLS for x in (position, begun) if len(x)):
        return meaningless("", "the projectile's main body is too wide for a grid of dx/3")
    from scipy import ndimage

    outline, lacking = _lacking(position, scene.spacing)
    hollows = len(_hollows(*_lacking(begun, scene.spacing))) if len(begun) else 0
    if hollows:
        own = np.isin(ndimage.label(lacking)[0], _hollows(outline, lacking)[:hollows])
        outline, lacking = outline & ~own, lacking & ~own
    area = int(outline.sum())
    edge = area - int(ndimage.binary_erosion(outline).sum())
    return Result(float(lacking.sum()) / area, "", 0.5 * edge / area)


def _at_the_start(scene: Scene) -> np.ndarray:
    """Return where the projectile's main body was at the start (n, 2) [m]; no rows where the start is not known."""
    if scene.start is None:
        return np.empty((0, 2))
    body = np.isin(scene.start.id, scene.now.id[scene.projectile])
    return np.asarray(scene.start.fields["position"][body])


def _lacking(position: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the cells of a body's outline, and those of them that none of its particles covers."""
    from scipy import ndimage

    covered = _draw_discs(position, spacing / CELLS_PER_SPACING, spacing)
    reach = CLOSING_RADIUS * CELLS_PER_SPACING
    dilated = ndimage.distance_transform_edt(~covered) <= reach
    closed = ndimage.distance_transform_edt(dilated) > reach
    outline = ndimage.binary_fill_holes(closed | covered)
    return outline, outline & ~covered


def _hollows(outline: np.ndarray, lacking: np.ndarray) -> np.ndarray:
    """Return the numbers of connected cells that lack within the outline, as wide as dx or more, largest first."""
    from scipy import ndimage

    labels = ndimage.label(lacking)[0]
    sizes = np.bincount(labels.ravel())[1:]
    sizes[np.setdiff1d(labels[ndimage.binary_dilation(~outline)], 0) - 1] = 0
    order = np.argsort(-sizes, kind="stable")
    return 1 + order[sizes[order] >= 0.25 * np.pi * CELLS_PER_SPACING**2]


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
