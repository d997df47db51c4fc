"""Snapshots of a run: from the state to VTKHDF and VTU files in its folder."""

from __future__ import annotations

import time as wall
from typing import TYPE_CHECKING, Any

import numpy as np

from hvisph import __version__
from hvisph.core.errors import OutputError
from hvisph.core.particles import FLAGS, RETIRED, Particles
from hvisph.formulations.diagnose import diagnose
from hvisph.measures.scene import reference
from hvisph.output import names
from hvisph.output.atomic import reason
from hvisph.output.folder import RunFolder
from hvisph.output.hdf5 import write_hdf5
from hvisph.output.snapshot import Snapshot
from hvisph.output.time_series import write_time_series
from hvisph.output.vtu import write_pvd, write_vtu
from hvisph.simulation.build import Setup
from hvisph.simulation.peaks import Peaks

if TYPE_CHECKING:
    from hvisph.case.case import Case

# Fields of the state that files hold; those that only the integrator needs stay out.
STATE_FIELDS = ("position", "velocity", "mass", "density", "internal_energy", "smoothing_length", "deviator",
                "plastic_strain", "damage", "kernel_type")  # fmt: skip
MOST_TIME = 0.02  # share of a run's wall time that its series may take while it goes on


class SnapshotWriter:
    """Writes numbered snapshots in the formats that the case asks for.

    Parameters
    ----------
    folder
        The run's folder.
    setup
        The run.
    case, text
        The case and its effective text.
    """

    def __init__(self, folder: RunFolder, setup: Setup, case: Case, text: str):
        self.folder, self.setup, self.formats = folder, setup, case.output.formats
        self.metadata: dict[str, Any] = {
            "spacing": case.resolution, "h_over_dx": case.formulation.h_over_dx,
            "kernel_reach": case.formulation.support_over_h, "kinematics": case.kinematics, "title": case.title,
            "units": case.units, "code_version": __version__, "case": text,
        }  # fmt: skip
        self.metadata["shot"] = {
            "roles": [body.role for body in case.bodies.values()],
            "planes": [{"axis": "xyz"[plane.axis], "at": plane.at} for plane in setup.planes],
        }
        if case.witness is not None:
            self.metadata["witness"] = case.witness.x
        self.series: list[tuple[float, str]] = []
        self.peaks = Peaks(setup)
        self._start: np.ndarray | None = None  # positions by permanent number
        self._series_due = 0.0

    def snapshot(self, time: float, step: int, particles: Particles | None = None) -> Snapshot | None:
        """Return the state as it stands, or another state of the run, ordered by the particles' permanent numbers.

        Of several processes the first has it, the others have none.
        """
        stepper = self.setup.stepper
        whole = self.setup.share.whole(particles or self.setup.particles, self.peaks.highest)
        if whole is None:
            return None
        particles, (highest,) = whole
        order = np.flatnonzero(particles.tags[:, FLAGS] & RETIRED == 0)
        fields = {name: particles[name][order] for name in STATE_FIELDS if name in particles.names}
        for name, values in diagnose(particles, stepper.table, stepper.models).items():
            fields[name] = values[order]
        number = particles.id[order]
        if self._start is None:
            self._start = np.zeros((int(number.max()) + 1, particles.dim))
            self._start[number] = fields["position"]
        fields["displacement"] = fields["position"] - self._start[number]
        fields["peak_pressure"] = np.maximum(highest[order], fields["pressure"])
        fields["failed"] = (fields["damage"] >= 1.0).astype(np.uint8)
        return Snapshot(time, step, particles.dim, fields, particles.body[order].astype(np.int64),
                        particles.material[order].astype(np.int64), particles.id[order].astype(np.int64),
                        self.setup.bodies, self.setup.materials, dict(self.metadata))  # fmt: skip

    def start(self) -> Snapshot:
        """Return the start, and keep what later snapshots need of it to be measured alone."""
        start = self.snapshot(0.0, 0)
        assert start is not None  # all processes begin with the whole
        surfaces = {
            name: {
                "axis": int(np.abs(normal).argmax()),
                "sign": float(normal.sum()),
                "impedance": _impedance(start, number),
            }
            for name, (number, normal) in self.setup.gauges.surfaces.items()
        }
        self.metadata.update(reference(start) | ({"surfaces": surfaces} if surfaces else {}))
        start.metadata.update(self.metadata)
        return start

    def forget_after(self, number: int) -> None:
        """Delete the snapshots after `number` and that of a failure: a run that went back makes them again."""
        path = self.folder.path
        try:
            for path in names.own_files(self.folder.path):
                stale = path.stem == names.POST_MORTEM or (path.stem.isdecimal() and int(path.stem) > number)
                if path.parent.name in (names.SNAPSHOTS, names.VTU) and stale and names.is_plain(path):
                    path.unlink()
        except OSError as error:
            raise OutputError(f"cannot delete {path}: {reason(error)}") from error

    def write_series(self) -> None:
        """Write the series of all snapshots so far; the next one is due after a while, the longer this one took."""
        if "hdf5" in self.formats:
            began = wall.monotonic()
            write_time_series(self.folder.path)
            now = wall.monotonic()
            self._series_due = now + (now - began) / MOST_TIME

    def write(self, snapshot: Snapshot, number: int | str) -> None:
        """Write a snapshot under its number, or one with a name of its own, in every format."""
        if "hdf5" in self.formats or isinstance(number, str):
            write_hdf5(self.folder.snapshot_path(number), snapshot)
            if wall.monotonic() > self._series_due:
                self.write_series()
        if "vtu" in self.formats and not isinstance(number, str):
            path = self.folder.vtu_path(number)
            write_vtu(path, snapshot)
            entry = f"{names.VTU}/{path.name}"
            self.series[:] = [one for one in self.series if one[1] != entry]
            self.series.append((snapshot.time, entry))
            write_pvd(self.folder.path / names.SERIES, self.series)


def _impedance(start: Snapshot, number: int) -> float:
    """Return density times bulk sound speed [Pa s/m] of a particle at the start."""
    row = int(np.flatnonzero(start.id == number)[0])
    return float(start.fields["density"][row] * start.fields["sound_speed"][row])
