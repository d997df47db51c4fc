"""Bodies that stand in each other: particles of two bodies closer than a lattice's widest hole.

A point inside a cubic lattice of spacing dx is never farther than dx sqrt(dim) / 2 from a node, the
distance of a cell's centre, while touching bodies keep their particles dx apart. The limit lies
between the two: half a spacing alone would miss bodies whose lattices stand in each other's holes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

# Share added to the hole's radius: rings and packed lattices have holes up to 1 % wider.
MARGIN = 0.02


@dataclass(frozen=True)
class Overlap:
    """Two bodies that overlap, with the closest pair of particles as the evidence.

    Parameters
    ----------
    bodies
        Indices of the two bodies.
    particles
        Indices of the closest pair, one from each body.
    distance
        Distance of that pair [m].
    count
        Number of the first body's particles that lie too close to the second body.
    """

    bodies: tuple[int, int]
    particles: tuple[int, int]
    distance: float
    count: int


def overlaps(
    positions: np.ndarray, bodies: Sequence[int] | np.ndarray, spacing: float | Sequence[float]
) -> list[Overlap]:
    """Return the pairs of bodies with particles closer than 1.02 sqrt(dim) / 2 dx to each other.

    Parameters
    ----------
    positions
        Particle centres, shape (n, dim) [m].
    bodies
        Body index of each particle, shape (n,).
    spacing
        Least particle spacing, one for all or one a body number [m]; dx is the mean of the two bodies'.

    Returns
    -------
    list of Overlap
        Empty when no bodies overlap. Only particles where the bodies' bounding boxes meet are
        compared, so bodies in a row cost next to nothing.
    """
    hole = (1 + MARGIN) * math.sqrt(positions.shape[1]) / 2
    belongs = np.asarray(bodies)
    members = {int(body): np.flatnonzero(belongs == body) for body in np.unique(belongs)}
    boxes = {body: (positions[i].min(axis=0), positions[i].max(axis=0)) for body, i in members.items()}
    pairs = []
    for first, second in combinations(members, 2):
        reach = hole * (spacing if isinstance(spacing, int | float) else (spacing[first] + spacing[second]) / 2)
        low = np.maximum(boxes[first][0], boxes[second][0]) - reach
        high = np.minimum(boxes[first][1], boxes[second][1]) + reach
        if (low > high).any():
            continue
        near = [
            index[((positions[index] >= low) & (positions[index] <= high)).all(axis=1)]
            for index in (members[first], members[second])
        ]
        overlap = _closest(positions, near[0], near[1], reach, (first, second))
        if overlap is not None:
            pairs.append(overlap)
    return pairs


def _closest(
    positions: np.ndarray, first: np.ndarray, second: np.ndarray, reach: float, bodies: tuple[int, int]
) -> Overlap | None:
    if len(first) == 0 or len(second) == 0:
        return None
    # loaded here: scipy.spatial takes 0.2 s to import, and bodies in a row never come this far
    from scipy.spatial import cKDTree

    tree = cKDTree(positions[second], balanced_tree=False, compact_nodes=False)
    distance, partner = tree.query(positions[first], distance_upper_bound=reach)
    close = np.isfinite(distance)
    if not close.any():
        return None
    best = int(np.argmin(distance))
    return Overlap(bodies, (int(first[best]), int(second[partner[best]])), float(distance[best]), int(close.sum()))
