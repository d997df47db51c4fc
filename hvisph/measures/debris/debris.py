"""The fragments of every body: groups of particles linked at 2 dx, their roles, shares and mass distribution."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.target.plug import FEWEST, plug_of

from .fragments import Fragment, Fragments

ALIKE = 1e-9  # masses that differ by less, relatively, are one mass: round-off of their sums


@dataclass(frozen=True)
class BodyFragments:
    """The fragments of one body at one moment; they can be iterated over.

    Parameters
    ----------
    body
        Name of the body.
    fragments
        All connected groups, single particles among them, the one with most particles first.
    roles
        What each of them is: ``main body`` for the one with most particles; in the target ``attached`` for
        further groups that hold something of the rim, and ``plug``; empty for all others.
    """

    body: str
    fragments: Fragments
    roles: tuple[str, ...]

    def __iter__(self) -> Iterator[Fragment]:
        return iter(self.fragments)

    def __len__(self) -> int:
        return len(self.fragments)

    @cached_property
    def masses(self) -> np.ndarray:
        """Mass of each fragment [kg; kg/m in 2D, kg/m^2 in 1D]; NaN where the snapshot has none."""
        return self.fragments.masses

    @cached_property
    def counts(self) -> np.ndarray:
        """Number of particles of each fragment."""
        return self.fragments.groups.counts

    @property
    def mass(self) -> float:
        """Mass of the body, as far as it has not been retired."""
        return float(self.masses.sum())

    def number(self, fewest: int = FEWEST) -> int:
        """Return how many fragments have `fewest` particles or more."""
        return int((self.counts >= fewest).sum())

    def share(self, chosen: np.ndarray | Sequence[int]) -> float:
        """Return the share of the body's mass in the fragments `chosen` (mask or indices); NaN without masses."""
        return float(self.masses[chosen].sum() / self.mass) if self.mass > 0.0 else float("nan")

    @cached_property
    def distribution(self) -> MassDistribution:
        """Cumulative mass distribution of all fragments."""
        masses = -np.sort(-self.masses)
        if not np.isfinite(masses).all() or not self.mass > 0.0:
            return MassDistribution(np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros(0))
        last = np.append(np.flatnonzero(masses[1:] < masses[:-1] * (1.0 - ALIKE)), len(masses) - 1)
        return MassDistribution(masses[last], last + 1, np.cumsum(masses)[last] / self.mass)

    def as_dict(self, fewest: int = FEWEST) -> dict[str, Any]:
        """Return the plain form for JSON: SI, null for what the snapshot does not tell.

        Fragments of fewer than `fewest` particles are summed up under `smaller`.
        """
        single, small = self.counts == 1, self.counts < fewest
        listed = [
            {
                "role": role,
                "particles": fragment.count,
                "mass": _plain(fragment.mass),
                "mass_share": _plain(self.share([index])),
                "velocity": _plain(fragment.velocity),
                "speed": _plain(fragment.speed),
                "centre": _plain(fragment.centre),
                "extent": _plain(fragment.extent),
            }
            for index, (fragment, role) in enumerate(zip(self.fragments, self.roles, strict=True))
            if fragment.count >= fewest
        ]
        return {
            "body": self.body,
            "number": len(self),
            "mass": _plain(self.mass),
            "largest_mass_share": _plain(self.share([0])),
            "single_particles": {"number": int(single.sum()), "mass": _plain(float(self.masses[single].sum()))},
            "fragments": listed,
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
    """How many fragments are at least as heavy as a mass, and which share of the body's mass they hold.

    Parameters
    ----------
    mass
        The masses that occur, the largest first.
    number, share
        For each of them: fragments of this mass or more, and their share of the mass.
    """

    mass: np.ndarray
    number: np.ndarray
    share: np.ndarray

    def at(self, mass: float) -> tuple[int, float] | None:
        """Return number and share of the fragments of `mass` or more; None where the distribution is not known."""
        if len(self.mass) == 0:
            return None
        last = int((self.mass >= mass * (1.0 - ALIKE)).sum()) - 1
        return (int(self.number[last]), float(self.share[last])) if last >= 0 else (0, 0.0)

    def as_dict(self) -> dict[str, Any]:
        """Return the plain form for JSON."""
        return {
            "mass": self.mass.tolist(),
            "number_at_least": self.number.tolist(),
            "mass_share_at_least": self.share.tolist(),
        }


def debris(scene: Scene) -> tuple[BodyFragments, ...]:
    """Return the fragments of every body that has particles, in the order of bodies.

    Centres and velocities are in the case's axes, extents along the shot line and across it.
    """
    pieces = []
    for body in scene.now.present:
        fragments = scene.fragments(body)
        roles = _roles(scene, body, fragments)
        elsewhere = scene.shot.turned or scene.shot.drift
        own = replace(fragments, back=scene.shot.told(scene.now.time)) if elsewhere else fragments
        name = scene.now.bodies[body] if body < len(scene.now.bodies) else f"body {body}"
        pieces.append(BodyFragments(name, own, roles))
    return tuple(pieces)


def _roles(scene: Scene, body: int, fragments: Fragments) -> tuple[str, ...]:
    roles = [""] * len(fragments)
    if body == scene.target:
        roles = ["attached" if holds else "" for holds in scene.attached(body)]
        plug = plug_of(scene)
        if plug is not None:
            roles[plug] = "plug"
    if roles[0] != "plug":
        roles[0] = "main body"
    return tuple(roles)


def _plain(value: float | np.ndarray) -> Any:
    if isinstance(value, np.ndarray):
        return [_plain(float(part)) for part in value]
    return value if np.isfinite(value) else None
