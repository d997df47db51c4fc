"""Snapshots of a run: from the state to VTKHDF and VTU files in its folder."""

from __future__ import annotations

import time as wall
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hvisph import __version__
from hvisph.case.output import ALWAYS, Output
from hvisph.core.derived import Derived, changed
from hvisph.core.errors import OutputError
from hvisph.core.fields import OF_STATE
from hvisph.core.particles import FLAGS, RETIRED, Particles
from hvisph.formulations.diagnose import diagnose
from hvisph.measures.scene import reference
from hvisph.output import names
from hvisph.output.atomic import reason
from hvisph.output.folder import RunFolder
from hvisph.output.hdf5 import Form, write_hdf5
from hvisph.output.snapshot import Snapshot
from hvisph.output.time_series import write_time_series
from hvisph.output.vtu import write_pvd, write_vtu
from hvisph.simulation.build import Setup
from hvisph.simulation.kernel_types import in_box
from hvisph.simulation.peaks import Peaks

if TYPE_CHECKING:
    from hvisph.case.case import Case

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
        self.folder, self.setup, self.output = folder, setup, case.output
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
        self._numbers = np.zeros(0, np.int64)  # of the particles in the first snapshot
        self._series_due = 0.0

    def snapshot(self, time: float, step: int, particles: Particles | None = None) -> Snapshot | None:
        """Return the state as it stands, or another state of the run, ordered by the particles' permanent numbers.

        Its fields are made when they are asked for, so it holds until the run goes on. Of several processes the first
        has it, the others have none.
        """
        stepper = self.setup.stepper
        whole = self.setup.share.whole(particles or self.setup.particles, self.peaks.highest)
        if whole is None:
            return None
        particles, (highest,) = whole
        order = np.argsort(particles.id)
        order = order[particles.tags[order, FLAGS] & RETIRED == 0]
        number = particles.id[order].astype(np.int64)
        if self._start is None:
            self._start = np.zeros((int(number.max()) + 1, particles.dim))
            self._start[number] = particles["position"][order]
            self._numbers = number
        own = [name for name in OF_STATE if name in particles.names]
        begun = self._start

        def found(name: str) -> np.ndarray:
            return diagnose(particles, stepper.table, stepper.models)[name]

        def field(name: str) -> np.ndarray:
            match name:
                case "displacement":
                    return np.asarray(particles["position"][order] - begun[number])
                case "peak_pressure":
                    return np.maximum(highest, found("pressure"))[order]
                case "failed":
                    return (particles["damage"][order] >= 1.0).astype(np.uint8)
            return np.asarray((particles[name] if name in own else found(name))[order])

        shown = list(diagnose(particles, stepper.table, stepper.models))
        names_ = (*own, *shown, "displacement", "peak_pressure", "failed")
        return Snapshot(time, step, particles.dim, Derived(names_, field), particles.body[order].astype(np.int64),
                        particles.material[order].astype(np.int64), number,
                        self.setup.bodies, self.setup.materials, dict(self.metadata))  # fmt: skip

    @property
    def exact(self) -> bool:
        """Whether files of the whole hold all of a snapshot, bit by bit."""
        return self.output.fields is None and self.output.precision == "double"

    def path(self, number: int | str) -> Path:
        """Return the file of a snapshot, the first of its formats."""
        hdf5 = "hdf5" in self.output.formats or isinstance(number, str)
        return self.folder.snapshot_path(number) if hdf5 else self.folder.vtu_path(int(number))

    def start(self) -> Snapshot | None:
        """Return the start, and keep what later snapshots need of it to be measured alone."""
        start = self.snapshot(0.0, 0)
        if start is None:
            return None
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
                own = names.number_of(path)
                stale = path.stem == names.POST_MORTEM or (own is not None and own > number)
                if path.parent.name != names.CHECKPOINT and stale and names.is_plain(path):
                    path.unlink()
        except OSError as error:
            raise OutputError(f"cannot delete {path}: {reason(error)}") from error

    def write_series(self) -> None:
        """Write the series of all snapshots so far; the next one is due after a while, the longer this one took."""
        if "hdf5" in self.output.formats:
            began = wall.monotonic()
            write_time_series(self.folder.path)
            now = wall.monotonic()
            self._series_due = now + (now - began) / MOST_TIME

    def write(self, snapshot: Snapshot, number: int | str, whole: bool = True) -> None:
        """Write a snapshot under its number, or one with a name of its own, in every format, and its regions.

        Parameters
        ----------
        snapshot, number
            The state, and its number or name.
        whole
            Whether more than its regions is written: else only where the case asks for it at this moment.
        """
        output, numbered = self.output, isinstance(number, int)
        if isinstance(number, int):
            self._write_regions(snapshot, number)
            if not whole and number % output.whole_every:
                return
        shown = _reduced(snapshot, output)
        if "hdf5" in output.formats or not numbered:
            first = self.folder.snapshot_path(0).name
            known = numbered and number != 0 and np.array_equal(snapshot.id, self._numbers)
            once = output.constants == "once" and known
            write_hdf5(
                self.folder.snapshot_path(number), shown, Form(output.compress == "gzip", first if once else None)
            )
            if wall.monotonic() > self._series_due:
                self.write_series()
        if "vtu" in output.formats and not isinstance(number, str):
            path = self.folder.vtu_path(number)
            write_vtu(path, shown)
            entry = f"{names.VTU}/{path.name}"
            self.series[:] = [one for one in self.series if one[1] != entry]
            self.series.append((snapshot.time, entry))
            write_pvd(self.folder.path / names.SERIES, self.series)

    def _write_regions(self, snapshot: Snapshot, number: int) -> None:
        for name, region in self.output.regions.items():
            chosen = in_box(region.box, snapshot.fields["position"]) & (snapshot.id % region.one_in == 0)
            if region.bodies:
                chosen &= np.isin(snapshot.body, [snapshot.bodies.index(body) for body in region.bodies])
            part = _reduced(snapshot.part(np.flatnonzero(chosen)), self.output)
            write_hdf5(self.folder.region_path(name, number), part, Form(self.output.compress == "gzip"))


def _reduced(snapshot: Snapshot, output: Output) -> Snapshot:
    """Return a snapshot with the fields that a case asks for, in its precision."""

    def stored(name: str, values: np.ndarray) -> np.ndarray:
        single = output.precision == "single" and values.dtype == np.float64 and name != "position"
        return values.astype(np.float32) if single else values

    asked = [one for one in snapshot.fields if output.fields is None or one in output.fields or one in ALWAYS]
    return replace(snapshot, fields=changed(snapshot.fields, stored, asked))


def _impedance(start: Snapshot, number: int) -> float:
    """Return density times bulk sound speed [Pa s/m] of a particle at the start."""
    row = int(np.flatnonzero(start.id == number)[0])
    return float(start.fields["density"][row] * start.fields["sound_speed"][row])
