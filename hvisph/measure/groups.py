"""Connected groups of particles: main bodies and fragments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hvisph.output.snapshot import Snapshot

LINK = 2.0  # particles nearer than this many spacings belong together


def connected_groups(position: np.ndarray, spacing: float, link: float = LINK) -> np.ndarray:
    """Return the number of the group that each particle belongs to, the largest group being 0.

    Parameters
    ----------
    position
        Shape (n, dim) [m].
    spacing
        dx [m].
    link
        Linking distance in spacings.

    Returns
    -------
    numpy.ndarray
        Shape (n,). Groups are what is linked at `link` spacings; they are ordered by their number of
        particles, and where that is the same by their first particle.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    count = len(position)
    if count == 0:
        return np.zeros(0, dtype=np.int64)
    pairs = cKDTree(position).query_pairs(link * spacing, output_type="ndarray")
    links = np.ones(len(pairs), dtype=np.int8)
    graph = coo_array((links, (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    number, labels = connected_components(graph, directed=False)
    sizes = np.bincount(labels, minlength=number)
    _, first = np.unique(labels, return_index=True)
    order = np.lexsort((first, -sizes))
    rank = np.empty(number, dtype=np.int64)
    rank[order] = np.arange(number)
    return rank[labels]


def main_body(position: np.ndarray, spacing: float, link: float = LINK) -> np.ndarray:
    """Return the indices of the particles of the largest group linked at `link` spacings."""
    return np.flatnonzero(connected_groups(position, spacing, link) == 0)


@dataclass(frozen=True)
class Fragment:
    """A connected group of particles of one body.

    Parameters
    ----------
    body
        Index of the body.
    count
        Number of particles.
    mass
        Mass [kg; kg/m in 2D, kg/m^2 in 1D].
    centre, velocity
        Mass means, shape (dim,) [m], [m/s].
    extent
        Largest less smallest coordinate of its particles along each axis, shape (dim,) [m].
    particles
        Their indices in the snapshot.
    """

    body: int
    count: int
    mass: float
    centre: np.ndarray
    velocity: np.ndarray
    extent: np.ndarray
    particles: np.ndarray


def fragments(snapshot: Snapshot, body: int, spacing: float, link: float = LINK) -> list[Fragment]:
    """Return the connected groups of one body, the one with most particles first.

    Parameters
    ----------
    snapshot
        The moment to look at.
    body
        Index of the body.
    spacing
        dx [m].
    link
        Linking distance in spacings.
    """
    members = np.flatnonzero(snapshot.body == body)
    labels = connected_groups(snapshot.fields["position"][members], spacing, link)
    by_group = np.argsort(labels, kind="stable")
    ends = np.flatnonzero(np.diff(labels[by_group])) + 1
    return [_fragment(snapshot, body, members[group]) for group in np.split(by_group, ends) if len(group)]


def _fragment(snapshot: Snapshot, body: int, particles: np.ndarray) -> Fragment:
    position = snapshot.fields["position"][particles]
    velocity = snapshot.fields["velocity"][particles]
    mass = snapshot.fields["mass"][particles]
    return Fragment(
        body=body,
        count=len(particles),
        mass=float(mass.sum()),
        centre=np.average(position, axis=0, weights=mass),
        velocity=np.average(velocity, axis=0, weights=mass),
        extent=np.ptp(position, axis=0),
        particles=particles,
    )
