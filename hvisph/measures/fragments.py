"""Connected groups of particles, and fragments of every body: roles, mass fractions and mass distribution."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import overload

import numpy as np
import scipy

from hvisph.core.text import Plain
from hvisph.output.snapshot import Snapshot

LINK_DISTANCE = 2.0  # [dx] below which particles are connected
NEAREST_LINK = 1.3  # [dx] within which most neighbours of intact material are found, with few pairs each
EQUAL_SPACING = 1.2  # largest ratio of spacings of a body that count as equal


def connected_groups(position: np.ndarray, spacing: float | np.ndarray, link: float = LINK_DISTANCE) -> np.ndarray:
    """Return the group of each particle (n,): particles linked at `link` spacings, the mean of both [m].

    Groups are numbered by size, and by their first particle where that is the same; the largest is 0.
    """
    if len(position) == 0:
        return np.zeros(0, dtype=np.int64)
    position = position.reshape(len(position), -1)
    spacing = np.broadcast_to(np.asarray(spacing, float), len(position))
    classes = np.floor(np.log(spacing / spacing.min()) / np.log(EQUAL_SPACING))
    members = [np.flatnonzero(classes == k) for k in np.unique(classes)]
    trees = [scipy.spatial.cKDTree(position[rows], balanced_tree=False, compact_nodes=False) for rows in members]
    reaches = [min(NEAREST_LINK, link) * spacing[rows].min() for rows in members]
    links = [
        rows[tree.query_pairs(reach, output_type="ndarray")]
        for rows, tree, reach in zip(members, trees, reaches, strict=True)
    ]
    labels = _components(len(position), np.concatenate(links))
    # of all other links one end is outside the largest group; coarse reaches are not searched among fine particles
    outside = labels != np.bincount(labels).argmax()
    links = [np.zeros((0, 2), np.int64)]
    for outer in filter(len, (rows[outside[rows]] for rows in members)):
        tree = scipy.spatial.cKDTree(position[outer])
        for rows, inner in zip(members, trees, strict=True):
            reach = 0.5 * link * float(spacing[outer].max() + spacing[rows].max())
            pairs = tree.sparse_distance_matrix(inner, reach, output_type="ndarray")
            ends = np.column_stack([outer[pairs["i"]], rows[pairs["j"]]])
            links.append(ends[pairs["v"] <= 0.5 * link * spacing[ends].sum(axis=1)])
    labels = _components(int(labels.max()) + 1, labels[np.concatenate(links)])[labels]
    return by_size(labels)


def _components(count: int, pairs: np.ndarray) -> np.ndarray:
    """Return the number of the connected component of each of `count` nodes, from pairs of them (m, 2)."""
    graph = scipy.sparse.coo_array((np.ones(len(pairs), dtype=np.int8), tuple(pairs.T)), shape=(count, count))
    return np.asarray(scipy.sparse.csgraph.connected_components(graph, directed=False)[1])


def by_size(labels: np.ndarray) -> np.ndarray:
    """Return the same groups numbered by their size, and where that is the same by their first particle."""
    sizes = np.bincount(labels)
    first, rank = np.empty((2, len(sizes)), dtype=np.int64)
    first[labels[::-1]] = np.arange(len(labels))[::-1]  # the last that is assigned remains
    rank[np.lexsort((first, -sizes))] = np.arange(len(sizes))
    return rank[labels]


def main_body(position: np.ndarray, spacing: float | np.ndarray) -> np.ndarray:
    """Return the indices of the particles of the largest group linked at `LINK_DISTANCE` spacings."""
    return np.flatnonzero(connected_groups(position, spacing) == 0)


FEWEST_PARTICLES = 5  # particles of a fragment that is counted and listed
EQUAL_MASS = 1e-9  # relative difference below which masses are equal, above the round-off of their sums


@dataclass(frozen=True)
class Fragment:
    """A connected group of particles of one body."""

    body: int  # index of the body
    count: int  # number of particles
    mass: float  # mass [kg; kg/m in 2D, kg/m^2 in 1D]; NaN where the snapshot has none
    # mass means, shape (dim,) [m], [m/s]; NaN where the snapshot has no velocity. Without masses every particle counts
    # alike
    centre: np.ndarray
    velocity: np.ndarray
    extent: np.ndarray  # largest less smallest coordinate of its particles along each axis, shape (dim,) [m]
    particles: np.ndarray  # their indices in the snapshot

    @property
    def speed(self) -> float:
        """Magnitude of the velocity [m/s]."""
        return float(np.sqrt((self.velocity**2).sum()))


@dataclass(frozen=True)
class Groups:
    """The connected groups of a body, the largest first: indices of particles group by group, and where each begins."""

    rows: np.ndarray
    starts: np.ndarray

    @classmethod
    def from_labels(cls, members: np.ndarray, labels: np.ndarray) -> "Groups":
        """Return the groups of particles `members` (n,) by the number (n,) of the group of each, without gaps."""
        if len(members) == 0:
            return cls(members, np.zeros(0, dtype=np.int64))
        labels = by_size(labels)
        counts = np.bincount(labels)
        return cls(members[np.argsort(labels, kind="stable")], np.cumsum(counts) - counts)

    def __len__(self) -> int:
        return len(self.starts)

    @cached_property
    def counts(self) -> np.ndarray:
        """Number of particles of each group."""
        return np.diff(np.append(self.starts, len(self.rows)))

    def particles(self, number: int) -> np.ndarray:
        """Return the indices of the particles of a group."""
        return self.rows[self.starts[number] : self.starts[number] + self.counts[number]]

    def contain(self, mask: np.ndarray) -> np.ndarray:
        """Return whether each group holds any particle of a `mask` over those of the snapshot."""
        return np.logical_or.reduceat(mask[self.rows], self.starts) if len(self) else np.zeros(0, bool)

    def particles_of(self, mask: np.ndarray) -> np.ndarray:
        """Return the indices of the particles of the groups of a `mask`, group after group."""
        return self.rows[np.repeat(mask, self.counts)]


@dataclass(frozen=True)
class Fragments(Sequence[Fragment]):
    """The fragments of a body, the one with most particles first, each made on access, with their properties as arrays.

    `back` transforms centre and velocity of a fragment from the axes of the shot to those of the case.
    """

    body: int
    groups: Groups
    masses: np.ndarray
    centres: np.ndarray
    velocities: np.ndarray
    extents: np.ndarray
    back: Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]] | None = None

    @classmethod
    def from_groups(cls, snapshot: Snapshot, groups: Groups, body: int) -> "Fragments":
        """Return the fragments that groups of a snapshot's particles are."""
        rows, starts = groups.rows, groups.starts
        if not len(groups):
            none = np.zeros((0, snapshot.dimensions))
            return cls(body, groups, np.zeros(0), none, none, none)
        position = snapshot.fields["position"][rows].reshape(len(rows), -1)
        velocity = np.full_like(position, np.nan)
        if "velocity" in snapshot.fields:
            velocity = snapshot.fields["velocity"][rows].reshape(position.shape)
        weight, mass = np.ones(len(rows)), np.full(len(groups), np.nan)
        if "mass" in snapshot.fields:
            weight = snapshot.fields["mass"][rows]
            mass = np.add.reduceat(weight, starts)
        total = np.add.reduceat(weight, starts)[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):  # groups without mass have no mean
            centre = np.add.reduceat(weight[:, None] * position, starts) / total
            mean = np.add.reduceat(weight[:, None] * velocity, starts) / total
        extent = np.maximum.reduceat(position, starts) - np.minimum.reduceat(position, starts)
        return cls(body, groups, mass, centre, mean, extent)

    def __len__(self) -> int:
        return len(self.groups)

    @property
    def heaviest(self) -> Fragment:
        """The heaviest fragment; one of lighter particles may have more of them in axisymmetric and graded bodies."""
        largest_mass = self.masses.max()  # of those as heavy, but for rounding, the one of most particles
        return self[int(np.argmax(self.masses >= (1.0 - 1e-9) * largest_mass))]

    @overload
    def __getitem__(self, number: int) -> Fragment: ...
    @overload
    def __getitem__(self, number: slice) -> list[Fragment]: ...
    def __getitem__(self, number: int | slice) -> Fragment | list[Fragment]:
        if isinstance(number, slice):
            return [self[k] for k in range(*number.indices(len(self)))]
        k = range(len(self))[number]
        centre, velocity = self.centres[k], self.velocities[k]
        if self.back is not None:
            centre, velocity = self.back(centre, velocity)
        return Fragment(
            self.body,
            int(self.groups.counts[k]),
            float(self.masses[k]),
            centre,
            velocity,
            self.extents[k],
            self.groups.particles(k),
        )


@dataclass(frozen=True)
class BodyFragments:
    """The fragments of one body at one moment; they can be iterated over."""

    body: str  # name of the body
    fragments: Fragments  # all connected groups, single particles among them, the one with most particles first
    # kind of each: ``main body`` for the one with most particles; in the target ``attached`` for further groups
    # that hold something of the rim, and ``plug``; empty for all others
    roles: tuple[str, ...]

    def __iter__(self) -> Iterator[Fragment]:
        return iter(self.fragments)

    def __len__(self) -> int:
        return len(self.fragments)

    @property
    def masses(self) -> np.ndarray:
        """Mass of each fragment [kg; kg/m in 2D, kg/m^2 in 1D]; NaN where the snapshot has none."""
        return self.fragments.masses

    @property
    def counts(self) -> np.ndarray:
        """Number of particles of each fragment."""
        return self.fragments.groups.counts

    @property
    def mass(self) -> float:
        """Mass of the body, as far as it has not been retired."""
        return float(self.masses.sum())

    def number(self, fewest: int = FEWEST_PARTICLES) -> int:
        """Return how many fragments have `fewest` particles or more."""
        return int((self.counts >= fewest).sum())

    def share(self, rows: np.ndarray | Sequence[int]) -> float:
        """Return the share of the body's mass in the fragments `rows` (mask or indices); NaN without masses."""
        return float(self.masses[rows].sum() / self.mass) if self.mass > 0.0 else float("nan")

    @cached_property
    def distribution(self) -> "MassDistribution":
        """Cumulative mass distribution of all fragments."""
        masses = -np.sort(-self.masses)
        if not np.isfinite(masses).all() or not self.mass > 0.0:
            return MassDistribution(np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros(0))
        last = np.append(np.flatnonzero(masses[1:] < masses[:-1] * (1.0 - EQUAL_MASS)), len(masses) - 1)
        return MassDistribution(masses[last], last + 1, np.cumsum(masses)[last] / self.mass)

    def as_dict(self, fewest: int = FEWEST_PARTICLES) -> Plain:
        """Return the plain form for JSON; fragments below `fewest` particles are summed up under `smaller`."""
        single, small = self.counts == 1, self.counts < fewest
        entries = []
        for index, (fragment, role) in enumerate(zip(self.fragments, self.roles, strict=True)):
            if fragment.count >= fewest:
                entry = {"role": role, "particles": fragment.count, "mass": _plain(fragment.mass)}
                entry["mass_share"] = _plain(self.share([index]))
                kinds = ("velocity", "speed", "centre", "extent")
                entries.append(entry | {name: _plain(getattr(fragment, name)) for name in kinds})
        return {
            "body": self.body,
            "number": len(self),
            "mass": _plain(self.mass),
            "largest_mass_share": _plain(self.share([0])),
            "single_particles": {"number": int(single.sum()), "mass": _plain(float(self.masses[single].sum()))},
            "fragments": entries,
            "smaller": {
                "below_particles": fewest,
                "number": int(small.sum()),
                "particles": int(self.counts[small].sum()),
                "mass": _plain(float(self.masses[small].sum())),
                "mass_share": _plain(self.share(small)),
            },
            "mass_distribution": self.distribution.as_dict(),
        }


@dataclass(frozen=True)
class MassDistribution:
    """Cumulative mass distribution: masses, the largest first, and number and mass fraction of fragments above each."""

    mass: np.ndarray
    number: np.ndarray
    share: np.ndarray

    def at_mass(self, mass: float) -> tuple[int, float] | None:
        """Return number and share of the fragments of `mass` or more; None where the distribution is not known."""
        if len(self.mass) == 0:
            return None
        last = int((self.mass >= mass * (1.0 - EQUAL_MASS)).sum()) - 1
        return (int(self.number[last]), float(self.share[last])) if last >= 0 else (0, 0.0)

    def as_dict(self) -> Plain:
        """Return the plain form for JSON."""
        names = {"mass": self.mass, "number_at_least": self.number, "mass_share_at_least": self.share}
        return {name: values.tolist() for name, values in names.items()}


def _plain(value: float | np.ndarray) -> float | list[object] | None:
    if isinstance(value, np.ndarray):
        return [_plain(float(part)) for part in value]
    return value if np.isfinite(value) else None
