"""Bodies cut by planes of symmetry, with unchanged mass.

A plane through a body must be a plane of symmetry of it, and of its particles. Particles on the far side are left out;
a row in the plane itself is split: half its mass stays, a quarter of a spacing from the plane, and
the other half is in its image. So a half, a quarter and an eighth weigh what they are called.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hvisph.core.errors import CaseError

IN_PLANE = 0.05  # [spacings]: nearer than this a particle lies in the plane
SPLIT = 0.25  # [spacings]: from the plane to what stays of a row in it
OFF = 0.02  # [spacings]: how far a particle's image may be from a particle
MOST_COMPARED = 20_000


@dataclass(frozen=True)
class Mirror:
    """A plane of symmetry."""

    axis: int  # 0, 1 or 2: the plane is normal to x, y or z
    at: float  # its coordinate [m]
    sign: float = 1.0  # 1.0 where coordinates above it are kept, -1.0 below


def crosses(low: np.ndarray, high: np.ndarray, mirror: Mirror, spacing: float) -> bool:
    """Whether the plane passes through the box from `low` to `high` rather than along its face."""
    margin = IN_PLANE * spacing
    return bool(low[mirror.axis] + margin < mirror.at < high[mirror.axis] - margin)


def cut(
    positions: np.ndarray, volumes: np.ndarray, spacing: np.ndarray, mirrors: Sequence[Mirror]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the part of a body that planes of symmetry keep.

    Parameters
    ----------
    positions, volumes, spacing
        Particles at their place, (n, dim), (n,) and (n,) [m].
    mirrors
        The planes.

    Returns
    -------
    tuple of numpy.ndarray
        Positions and volumes that are kept, and their numbers among those given.

    Raises
    ------
    CaseError
        When a plane passes through a body that is not symmetric about it.
    """
    kept = np.arange(len(positions))
    for mirror in mirrors:
        along = mirror.sign * (positions[:, mirror.axis] - mirror.at)
        near = spacing[kept]
        if (along < 0).any() and (along > 0).any():
            _require_symmetry(positions, mirror, float(near.max()))
        inside = np.abs(along) <= IN_PLANE * near
        stays = (along > 0) | inside
        positions, volumes = positions.copy(), volumes.copy()
        positions[inside, mirror.axis] = mirror.at + mirror.sign * SPLIT * near[inside]
        volumes[inside] *= 0.5
        positions, volumes, kept = positions[stays], volumes[stays], kept[stays]
    return np.ascontiguousarray(positions), volumes, kept


def _require_symmetry(positions: np.ndarray, mirror: Mirror, spacing: float) -> None:
    from scipy.spatial import cKDTree

    images = positions[:: max(1, len(positions) // MOST_COMPARED)].copy()
    images[:, mirror.axis] = 2 * mirror.at - images[:, mirror.axis]
    distance, _ = cKDTree(positions, balanced_tree=False, compact_nodes=False).query(images)
    if distance.max() > OFF * spacing:
        axis = "xyz"[mirror.axis]
        raise CaseError(
            f"the symmetry plane {axis} = {mirror.at:g} passes through this body, whose particles are not mirror "
            "images across it: put the body's middle on the plane or all of it on one side, turn it by right "
            "angles only, and use an arrangement that is symmetric (square, cubic, relaxed); or leave the plane out",
            where="symmetry",
        )
