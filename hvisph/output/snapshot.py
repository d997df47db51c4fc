"""One moment of a run, as written to and read from files: the common form of HDF5 and VTU."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from hvisph.core.fields import transform_arrays
from hvisph.core.text import Plain


@dataclass
class Snapshot:
    """All particles at one time, ordered by `id`.

    `time`, `step`: time since the start of the run [s] and number of steps done.
    `dimensions`: 1, 2 or 3.
    `fields`: arrays by the names of `hvisph.core.fields.CATALOGUE`: shape (n,) for scalars, (n, components) for others,
        with the components of the run's dimensions. SI units. Those of a running simulation, and of large files that
        are read `lazily`, are made anew whenever they are asked for.
    `body`, `material`, `id`: integer arrays of shape (n,): index into `bodies`, index into `materials`, permanent
        number.
    `bodies`, `materials`: names, in the order of the indices. The first body is the projectile, the second the target.
    `metadata`: what measures need beside the particles, as plain numbers and text: ``spacing`` (dx [m]),
        ``kinematics``, ``title``, ``units``, ``code_version``, ``case`` (the effective case, YAML text).
    """

    time: float
    step: int
    dimensions: int
    fields: Mapping[str, np.ndarray]
    body: np.ndarray
    material: np.ndarray
    id: np.ndarray
    bodies: list[str]
    materials: list[str]
    metadata: Plain = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Number of particles."""
        return len(self.id)

    @property
    def is_axisymmetric(self) -> bool:
        """Whether particles are axisymmetric about x, with the radius y."""
        return self.metadata.get("kinematics") == "axisymmetric"

    @property
    def present(self) -> list[int]:
        """Numbers of the bodies that have particles, in order."""
        return [int(body) for body in np.flatnonzero(np.bincount(self.body))]

    def part(self, chosen: np.ndarray) -> Snapshot:
        """Return the particles with the indices `chosen` alone."""
        fields = transform_arrays(self.fields, lambda _, values: values[chosen])
        return replace(self, fields=fields, body=self.body[chosen], material=self.material[chosen], id=self.id[chosen])
