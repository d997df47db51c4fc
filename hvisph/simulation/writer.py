"""Snapshots of a run: from the state to HDF5 and VTU files in its folder."""

from __future__ import annotations

from typing import Any

import numpy as np

from hvisph.formulations.diagnose import diagnose
from hvisph.measure.scene import reference
from hvisph.output import names
from hvisph.output.folder import RunFolder
from hvisph.output.hdf5 import write_hdf5
from hvisph.output.snapshot import Snapshot
from hvisph.output.vtu import write_pvd, write_vtu
from hvisph.simulation.build import Setup

# Fields of the state that files hold; those that only the integrator needs stay out.
STATE_FIELDS = ("position", "velocity", "mass", "density", "internal_energy", "smoothing_length", "deviator",
                "plastic_strain", "damage")  # fmt: skip


class SnapshotWriter:
    """Writes numbered snapshots in the formats that the case asks for.

    Parameters
    ----------
    folder
        The run's folder.
    setup
        The run.
    formats
        ``hdf5`` and ``vtu``.
    metadata
        What every snapshot says beside its particles.
    """

    def __init__(self, folder: RunFolder, setup: Setup, formats: tuple[str, ...], metadata: dict[str, Any]):
        self.folder, self.setup, self.formats = folder, setup, formats
        self.metadata = metadata
        self.series: list[tuple[float, str]] = []

    def snapshot(self, time: float, step: int) -> Snapshot:
        """Return the state as it stands, ordered by the particles' permanent numbers."""
        particles, stepper = self.setup.particles, self.setup.stepper
        order = np.argsort(particles.id)
        fields = {name: particles[name][order] for name in STATE_FIELDS}
        for name, values in diagnose(particles, stepper.table, stepper.models).items():
            fields[name] = values[order]
        return Snapshot(time, step, particles.dim, fields, particles.body[order].astype(np.int64),
                        particles.material[order].astype(np.int64), particles.id[order].astype(np.int64),
                        self.setup.bodies, self.setup.materials, dict(self.metadata))  # fmt: skip

    def first(self, time: float, step: int) -> Snapshot:
        """Write the start, and keep what later snapshots need of it to be measured alone."""
        start = self.snapshot(time, step)
        self.metadata.update(reference(start))
        start.metadata.update(self.metadata)
        self.write(start, 0)
        return start

    def write(self, snapshot: Snapshot, number: int | str) -> None:
        """Write a snapshot under its number, or one with a name of its own, in every format."""
        if "hdf5" in self.formats or isinstance(number, str):
            write_hdf5(self.folder.snapshot_path(number), snapshot)
        if "vtu" in self.formats and not isinstance(number, str):
            path = self.folder.vtu_path(number)
            write_vtu(path, snapshot)
            self.series.append((snapshot.time, f"{names.VTU}/{path.name}"))
            write_pvd(self.folder.path / names.SERIES, self.series)
