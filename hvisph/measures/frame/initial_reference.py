"""A run's start as all of its moments need it: found once, since most of what it takes to measure one is the same."""

from __future__ import annotations

from collections.abc import Callable

from hvisph.measures.debris.groups import Neighbours
from hvisph.output.snapshot import Snapshot

from .boundary_rim import Rim
from .impact_geometry import Shot, shot_of, spacing_of


class Begun:
    """What is known of a run's first snapshot.

    Parameters
    ----------
    start
        The snapshot as its file holds it.
    """

    def __init__(self, start: Snapshot):
        self.start = start
        self.neighbours = Neighbours(start, spacing_of(start))
        self._shots: dict[int, Shot] = {}
        self._seen: tuple[Shot, Snapshot] | None = None
        self._rims: dict[int, Rim] = {}

    def shot(self, now: Snapshot) -> Shot:
        """Return the shot that a snapshot is a moment of; only how many bodies that has can differ."""
        bodies = max(len(now.bodies), int(now.body.max(initial=-1)) + 1)
        if bodies not in self._shots:
            self._shots[bodies] = shot_of(self.start, now)
        return self._shots[bodies]

    def seen(self, shot: Shot) -> Snapshot:
        """Return the start of the whole model in the axes of the shot, which is the same at all moments."""
        if self._seen is None or self._seen[0] != shot:
            self._seen = (shot, shot.seen(self.start))
        return self._seen[1]

    def rim(self, body: int, find: Callable[[int], Rim]) -> Rim:
        """Return a layer's rim, which `find` finds the first time."""
        if body not in self._rims:
            self._rims[body] = find(body)
        return self._rims[body]
