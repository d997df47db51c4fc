"""A run that has ended, as figures are drawn from it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from hvisph.case.case import Case
from hvisph.output.reader import list_snapshots, read_history, read_snapshot
from hvisph.output.snapshot import Snapshot


@dataclass
class Ran:
    """A run's case, folder and summary; files are read when asked for."""

    case: Case
    folder: Path
    summary: dict[str, Any]

    @cached_property
    def snapshots(self) -> list[Snapshot]:
        """All snapshots, in order of time."""
        return [read_snapshot(path) for path in list_snapshots(self.folder)]

    @property
    def first(self) -> Snapshot:
        """The start."""
        return self.snapshots[0]

    @property
    def last(self) -> Snapshot:
        """The end."""
        return self.snapshots[-1]

    @cached_property
    def history(self) -> dict[str, np.ndarray]:
        """Columns of the history."""
        return read_history(self.folder)

    @property
    def dx(self) -> float:
        """Particle spacing at the start [m]."""
        return float(self.case.resolution)

    @property
    def drift(self) -> float:
        """Change of momentum over all momentum at the start; 0 where nothing moved."""
        return float(self.summary["conservation"]["momentum_drift"] or 0.0)

    def momentum(self, body: int, snapshot: Snapshot | None = None) -> np.ndarray:
        """Return the momentum of a body, shape (dim,) [kg m/s]."""
        at = snapshot or self.last
        own = at.body == body
        return np.atleast_1d((at.fields["mass"][own, None] * vectors(at, "velocity")[own]).sum(axis=0))

    def mean_velocity(self, body: int, snapshot: Snapshot | None = None) -> np.ndarray:
        """Return the velocity of a body's centre of mass, shape (dim,) [m/s]."""
        at = snapshot or self.last
        return self.momentum(body, at) / at.fields["mass"][at.body == body].sum()

    def kinetic_energy(self, snapshot: Snapshot | None = None) -> float:
        """Return the kinetic energy [J]."""
        at = snapshot or self.last
        return float(0.5 * (at.fields["mass"] * (vectors(at, "velocity") ** 2).sum(axis=1)).sum())


def vectors(snapshot: Snapshot, name: str) -> np.ndarray:
    """Return a vector field, shape (n, dim), in one dimension too."""
    return snapshot.fields[name].reshape(snapshot.count, -1)


def stress_xx(snapshot: Snapshot) -> np.ndarray:
    """Return the compressive stress along x, p - S_xx, shape (n,) [Pa]."""
    return snapshot.fields["pressure"] - snapshot.fields["deviator"].reshape(snapshot.count, -1)[:, 0]
