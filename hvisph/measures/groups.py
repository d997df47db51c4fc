"""Connected groups of particles: main bodies and fragments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hvisph.output.snapshot import Snapshot

LINK = 2.0  # particles nearer than this many spacings belong together
NEAR = 1.3  # spacings within which nearly all neighbours of sound matter are linked already, at few pairs each
ALIKE = 1.2  # spacings of a body that differ by no more than this factor are one


class Neighbours:
    """Pairs that were neighbours at a run's start: most still are, and searching them is most of the work.

    Parameters
    ----------
    start
        The run's first snapshot.
    spacing
        dx [m].
    """

    def __init__(self, start: Snapshot, spacing: float):
        self._start, self._spacing = start, spacing
        self._pairs: dict[tuple[int, ...], np.ndarray] = {}

    def pairs(self, bodies: tuple[int, ...], number: np.ndarray) -> np.ndarray | None:
        """Return pairs of indices (m, 2) among particles of `bodies` with the numbers (n,); None where others began."""
        own = np.flatnonzero(np.isin(self._start.body, bodies))
        if not np.array_equal(self._start.id[own], number):
            return None
        if bodies not in self._pairs:
            self._pairs[bodies] = _near(self._start.fields["position"][own], NEAR * self._spacing)
        return self._pairs[bodies]


def connected_groups(position: np.ndarray, spacing: float | np.ndarray, link: float = LINK,
                     likely: np.ndarray | None = None) -> np.ndarray:  # fmt: skip
    """Return the number of the group that each particle belongs to, the largest group being 0.

    Parameters
    ----------
    position
        Shape (n, dim) [m].
    spacing
        dx [m], or of every particle its own (n,); two particles are linked by the mean of theirs.
    link
        Linking distance in spacings.
    likely
        Pairs of indices (m, 2) that are likely to be near each other, such as the start's; sought unless given.

    Returns
    -------
    numpy.ndarray
        Shape (n,). Groups are what is linked at `link` spacings; they are ordered by their number of
        particles, and where that is the same by their first particle.
    """
    if len(position) == 0:
        return np.zeros(0, dtype=np.int64)
    position = position.reshape(len(position), -1)
    if isinstance(spacing, np.ndarray):
        return _by_size(_linked_unlike(position, spacing, link))
    # what is near is joined first; only what is then still apart needs the search that yields many pairs
    pairs = (
        _near(position, NEAR * spacing) if likely is None or link <= NEAR else _still(position, likely, NEAR * spacing)
    )
    labels = _components(len(position), pairs[:, 0], pairs[:, 1])
    if link > NEAR:
        apart = np.flatnonzero(labels != np.bincount(labels).argmax())
        labels = _joined(position, labels, apart, link * spacing)
    return _by_size(labels)


def _near(position: np.ndarray, reach: float) -> np.ndarray:
    """Return the pairs of particles nearer than `reach` to each other, shape (m, 2)."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(position.reshape(len(position), -1)).query_pairs(reach, output_type="ndarray")
    return np.asarray(pairs.astype(np.int32))


def _still(position: np.ndarray, pairs: np.ndarray, reach: float) -> np.ndarray:
    """Return those of the pairs that are nearer than `reach` to each other."""
    apart = position[pairs[:, 0]]
    apart -= position[pairs[:, 1]]
    return np.asarray(pairs[np.einsum("ij,ij->i", apart, apart) <= reach * reach])


def _linked_unlike(position: np.ndarray, spacing: np.ndarray, link: float) -> np.ndarray:
    """Return the connected components of particles of unlike `spacing` (n,) [m]."""
    count = len(position)
    labels = _components(count, *_pairs(position, spacing, np.arange(count), min(NEAR, link)))
    if link > NEAR:
        apart = np.flatnonzero(labels != np.bincount(labels).argmax())
        one, other = _pairs(position, spacing, apart, link)
        labels = _components(int(labels.max()) + 1, labels[one], labels[other])[labels]
    return labels


def _pairs(position: np.ndarray, spacing: np.ndarray, chosen: np.ndarray, link: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs of the particles `chosen` with any, nearer than `link` times the mean of their spacings.

    They are sought by classes of like spacing, so that no coarse reach is searched among fine particles only.
    """
    from scipy.spatial import cKDTree

    classes = np.floor(np.log(spacing / spacing.min()) / np.log(ALIKE)).astype(np.int64)
    own, rows = classes[chosen], {k: np.flatnonzero(classes == k) for k in np.unique(classes)}
    trees = {k: cKDTree(position[members]) for k, members in rows.items()}
    kept_pairs: list[tuple[np.ndarray, np.ndarray]] = []
    for k in np.unique(own):
        mine = chosen[own == k]
        tree = cKDTree(position[mine])
        for other, members in rows.items():
            reach = 0.5 * link * float(spacing[mine].max() + spacing[members].max())
            near = tree.sparse_distance_matrix(trees[other], reach, output_type="ndarray")
            one, two = mine[near["i"]], members[near["j"]]
            kept = near["v"] <= 0.5 * link * (spacing[one] + spacing[two])
            kept_pairs.append((one[kept], two[kept]))
    if not kept_pairs:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    return np.concatenate([one for one, _ in kept_pairs]), np.concatenate([two for _, two in kept_pairs])


def _joined(position: np.ndarray, labels: np.ndarray, apart: np.ndarray, reach: float) -> np.ndarray:
    """Return the components `labels` joined where particles of two are nearer than `reach`.

    Of any two, one at least is among the particles `apart`, which are not in the largest component.
    """
    from scipy.spatial import cKDTree

    if len(apart) == 0:
        return labels
    # a hair more than the reach: the pairs themselves decide
    near = cKDTree(position[apart]).query(position, distance_upper_bound=reach * (1.0 + 1e-9))[0] < np.inf
    rows = np.flatnonzero(near)
    pairs = rows[cKDTree(position[rows]).query_pairs(reach, output_type="ndarray")]
    return _components(int(labels.max()) + 1, labels[pairs[:, 0]], labels[pairs[:, 1]])[labels]


def _components(count: int, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(one), dtype=np.int8), (one, other)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def _by_size(labels: np.ndarray) -> np.ndarray:
    """Return the same groups numbered by their size, and where that is the same by their first particle."""
    sizes = np.bincount(labels)
    _, first = np.unique(labels, return_index=True)
    rank = np.empty(len(sizes), dtype=np.int64)
    rank[np.lexsort((first, -sizes))] = np.arange(len(sizes))
    return rank[labels]


def main_body(position: np.ndarray, spacing: float | np.ndarray, link: float = LINK) -> np.ndarray:
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
        Mass [kg; kg/m in 2D, kg/m^2 in 1D]; NaN where the snapshot has none.
    centre, velocity
        Mass means, shape (dim,) [m], [m/s]; NaN where the snapshot has no velocity. Without masses every
        particle counts alike.
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

    @property
    def speed(self) -> float:
        """Magnitude of the velocity [m/s]."""
        return float(np.sqrt((self.velocity**2).sum()))


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
    return grouped(snapshot, members, labels, body)


def grouped(snapshot: Snapshot, members: np.ndarray, labels: np.ndarray, body: int) -> list[Fragment]:
    """Return the fragments that particles fall into, the one with most particles first.

    Parameters
    ----------
    snapshot
        The moment to look at.
    members
        Indices of particles, shape (n,).
    labels
        Number of the group of each of them, from 0 on without gaps, shape (n,).
    body
        Index of the body to name.
    """
    if len(members) == 0:
        return []
    labels = _by_size(labels)
    by_group = members[np.argsort(labels, kind="stable")]
    counts = np.bincount(labels)
    starts = np.cumsum(counts) - counts
    position = snapshot.fields["position"][by_group].reshape(len(members), -1)
    velocity = np.full_like(position, np.nan)
    if "velocity" in snapshot.fields:
        velocity = snapshot.fields["velocity"][by_group].reshape(position.shape)
    weight, mass = np.ones(len(members)), np.full(len(counts), np.nan)
    if "mass" in snapshot.fields:
        weight = snapshot.fields["mass"][by_group]
        mass = np.add.reduceat(weight, starts)
    whole = np.add.reduceat(weight, starts)[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):  # groups without mass have no mean
        centre = np.add.reduceat(weight[:, None] * position, starts) / whole
        mean = np.add.reduceat(weight[:, None] * velocity, starts) / whole
    extent = np.maximum.reduceat(position, starts) - np.minimum.reduceat(position, starts)
    return [
        Fragment(body, int(counts[k]), float(mass[k]), centre[k], mean[k], extent[k], particles)
        for k, particles in enumerate(np.split(by_group, starts[1:]))
    ]
