"""The opening in what is attached of a layer, at depths below its struck face: diameters and area.

Edges are where the innermost attached particles are in sectors round the opening's centre, in 2D on either side of
it, less half a spacing: the material's surface. The centre is found by starting where the shot line is at that
depth and going to the centroid of what is enclosed. Sectors are about 2 dx wide at the edge and a multiple of eight
all round, so that planes of symmetry are between them; one that holds no particle has its neighbours' mean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvisph.measures.frame.target_geometry import Plate

RECENTRED = 8  # goes at the centroid
FEWEST_SECTORS, MOST_SECTORS = 8, 128
BORDER = 1e-7  # sectors; a particle so near to the border of two is in both


@dataclass(frozen=True)
class Opening:
    """An opening at one depth.

    Parameters
    ----------
    radii
        From its centre to its edge, one a sector, the first opposite to the one half-way on, shape (k,) [m].
    """

    radii: np.ndarray

    @property
    def diameters(self) -> np.ndarray:
        """Diameters in different directions, shape (k / 2,) [m]."""
        half = len(self.radii) // 2
        return np.asarray(self.radii[:half] + self.radii[half:])

    @property
    def area(self) -> float:
        """What the edge encloses [m^2]; in 3D only."""
        return float(np.pi * (self.radii**2).mean())


def opening(across: np.ndarray, centre: np.ndarray, spacing: float) -> Opening | None:
    """Return the opening about `centre` among particles; None where they do not enclose one.

    Parameters
    ----------
    across
        Their coordinates in the plane, shape (n, dim - 1) [m].
    centre
        Where to start, shape (dim - 1,) [m].
    spacing
        dx [m].
    """
    centre = np.array(centre, dtype=float)
    radii, number = np.zeros(0), FEWEST_SECTORS
    for _ in range(RECENTRED):
        radii_found = _radii(across - centre, number)
        if radii_found is None:
            return None
        radii = np.maximum(radii_found - 0.5 * spacing, 0.0)
        centre += _centroid(radii, across.shape[1])
        number = int(np.clip(np.pi * radii_found.mean() / spacing, FEWEST_SECTORS, MOST_SECTORS)) // 8 * 8
        # what is far outside the edge is no part of it
        across = across[((across - centre) ** 2).sum(axis=1) <= (2.5 * radii_found.max() + 4.0 * spacing) ** 2]
    return Opening(radii)


def openings(plate: Plate, depth: np.ndarray, across: np.ndarray, spacing: float) -> list[Opening]:
    """Return the openings at depths from the struck to the rear face, as the plate was; those that are enclosed."""
    number = max(1, round(plate.thickness / max(spacing, plate.thickness / 8.0)))
    bins = np.floor(depth * number / plate.thickness + 1e-9).astype(int)
    holes = []
    for k in range(number):
        one = opening(across[bins == k], _on_the_line(plate, (k + 0.5) / number * plate.thickness), spacing)
        if one is not None:
            holes.append(one)
    return holes


def _on_the_line(plate: Plate, depth: float) -> np.ndarray:
    """Return where the shot line is in the plane at a depth [m]."""
    basis = np.array(plate.basis)
    return np.asarray(depth * basis[1:, 0] / basis[0, 0])


def _radii(across: np.ndarray, number: int) -> np.ndarray | None:
    """Return the least distance from the origin in each of `number` sectors; None where nothing is enclosed."""
    if len(across) == 0:
        return None
    if across.shape[1] == 1:
        low, high = across[across[:, 0] < 0.0, 0], across[across[:, 0] >= 0.0, 0]
        return np.array([high.min(), -low.max()]) if len(low) and len(high) else None
    radius = np.sqrt((across**2).sum(axis=1))
    place = np.arctan2(across[:, 1], across[:, 0]) / (2.0 * np.pi) * number
    edge = np.full(number, np.inf)
    for shift in (-BORDER, BORDER):
        np.minimum.at(edge, np.floor(place + shift).astype(int) % number, radius)
    empty = ~np.isfinite(edge)
    if not empty.any():
        return edge
    beside = np.roll(edge, 1), np.roll(edge, -1)
    edge[empty] = 0.5 * (beside[0] + beside[1])[empty]
    return edge if np.isfinite(edge).all() else None


def _centroid(radii: np.ndarray, lateral: int) -> np.ndarray:
    if lateral == 1:
        return np.array([0.5 * (radii[0] - radii[1])])
    angle = 2.0 * np.pi * (np.arange(len(radii)) + 0.5) / len(radii)
    area = (radii**2).sum()
    if not area > 0.0:
        return np.zeros(2)
    return np.array([(radii**3 * np.cos(angle)).sum(), (radii**3 * np.sin(angle)).sum()]) * (2.0 / 3.0) / area
