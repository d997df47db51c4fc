"""What bodies have broken into: connected groups of particles, and the masses and velocities of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, overload

import numpy as np

from .groups import LINK, by_size, connected_groups

if TYPE_CHECKING:
    from hvisph.output.snapshot import Snapshot


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


@dataclass(frozen=True)
class Groups:
    """The connected groups of a body, the one with most particles first.

    Parameters
    ----------
    rows
        Indices of particles (n,), those of a group side by side.
    starts
        Where each group begins in them, shape (groups,).
    """

    rows: np.ndarray
    starts: np.ndarray

    @classmethod
    def of(cls, members: np.ndarray, labels: np.ndarray) -> Groups:
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

    def holding(self, chosen: np.ndarray) -> np.ndarray:
        """Return whether each group holds any of the particles `chosen`, a mask over the snapshot's."""
        return np.logical_or.reduceat(chosen[self.rows], self.starts) if len(self) else np.zeros(0, bool)

    def joined(self, chosen: np.ndarray) -> np.ndarray:
        """Return the indices of the particles of the groups `chosen` (a mask), group after group."""
        return self.rows[np.repeat(chosen, self.counts)]


@dataclass(frozen=True)
class Fragments(Sequence[Fragment]):
    """The fragments of a body, the one with most particles first, each made when it is asked for: there may be many.

    Parameters
    ----------
    body, groups
        Index of the body, and what it has broken into.
    masses, centres, velocities, extents
        Of each of them, as in `Fragment`.
    back
        Makes the centre and the velocity of one, in the axes of a shot, those of the case.
    """

    body: int
    groups: Groups
    masses: np.ndarray
    centres: np.ndarray
    velocities: np.ndarray
    extents: np.ndarray
    back: Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]] | None = None

    @classmethod
    def of(cls, snapshot: Snapshot, groups: Groups, body: int) -> Fragments:
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
        whole = np.add.reduceat(weight, starts)[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):  # groups without mass have no mean
            centre = np.add.reduceat(weight[:, None] * position, starts) / whole
            mean = np.add.reduceat(weight[:, None] * velocity, starts) / whole
        extent = np.maximum.reduceat(position, starts) - np.minimum.reduceat(position, starts)
        return cls(body, groups, mass, centre, mean, extent)

    def __len__(self) -> int:
        return len(self.groups)

    @property
    def heaviest(self) -> Fragment:
        """The one of most mass, which need not be that of most particles: those of rings and graded bodies differ."""
        most = self.masses.max()  # of those as heavy, but for rounding, the one of most particles
        return self[int(np.argmax(self.masses >= (1.0 - 1e-9) * most))]

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
        return Fragment(self.body, int(self.groups.counts[k]), float(self.masses[k]), centre, velocity,
                        self.extents[k], self.groups.particles(k))  # fmt: skip


def fragments(snapshot: Snapshot, body: int, spacing: float, link: float = LINK) -> Fragments:
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
    return Fragments.of(snapshot, Groups.of(members, labels), body)
