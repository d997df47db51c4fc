"""Snapshots of a run in VTKHDF and VTU files."""

import time as wall
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from hvisph import __version__
from hvisph.case.case import Case
from hvisph.case.output import ALWAYS, Output, OutputRegion
from hvisph.core.errors import OutputError
from hvisph.core.fields import OF_STATE, Derived, transform_arrays
from hvisph.core.particles import FLAGS, RETIRED, Ordered, Particles
from hvisph.core.text import Plain
from hvisph.diagnostics.budgets import MigratingRows, Peaks, stated_roles
from hvisph.exact.hugoniot import entropy
from hvisph.integrators.gravity import SPHERE, Gravity
from hvisph.materials import tags
from hvisph.materials.slots import EOS_TAG
from hvisph.measures.measurement_frame import reference
from hvisph.output import file_names
from hvisph.output.atomic_write import reason
from hvisph.output.hdf5 import StorageOptions, write_hdf5
from hvisph.output.run_folder import RunFolder
from hvisph.output.snapshot import INDICES, Snapshot
from hvisph.output.time_series import write_time_series
from hvisph.output.vtu import write_pvd, write_vtu
from hvisph.parallel.parallel_output import SLAB, Moment, Slabs, load_arrays
from hvisph.schemes.derived_fields import diagnose, known_names
from hvisph.setup.build import Setup
from hvisph.setup.initial_fields import gravity_of
from hvisph.setup.initial_state import in_box

TIME_SHARE = 0.02  # largest share of a run's wall time for the series file


class SnapshotWriter:
    """Writer of numbered snapshots in the formats of the case."""

    def __init__(self, folder: RunFolder, setup: Setup, case: Case, text: str):
        self.folder, self.setup, self.output = folder, setup, case.output
        self.metadata: Plain = {
            "spacing": case.resolution,
            "h_over_dx": case.formulation.h_over_dx,
            "kernel_reach": case.formulation.support_over_h,
            "kinematics": case.kinematics,
            "title": case.title,
            "units": case.units,
            "code_version": __version__,
            "case": text,
        }
        self.metadata["shot"] = {
            "roles": stated_roles(case),
            "planes": [{"axis": "xyz"[plane.axis], "at": plane.at} for plane in setup.planes],
        }
        if case.escape is not None:
            self.metadata["escape"] = case.escape
        gravity = gravity_of(case)
        if gravity is not None:
            self.metadata["gravity"] = _field_of_gravity(gravity)
        if (gravity is not None or case.edges or setup.supported) and not setup.driven:
            self.metadata["outer_forces"] = True
        if any(material.entropies for material in setup.substances):
            self.metadata["entropies"] = [material.entropies or None for material in setup.substances]
        if case.witness is not None:
            self.metadata["witness"] = case.witness.x
        self.series: list[tuple[float, str]] = []
        self.peaks = Peaks(setup)
        self.start_positions = MigratingRows(setup, setup.particles["position"].copy())
        self._count = 0  # particles in the first snapshot
        self._series_due = 0.0

    def snapshot(self, time: float, step: int, particles: Particles | None = None) -> Moment:
        """Return the present or another state, ordered by permanent number, with fields computed on request."""
        share, particles = self.setup.subdomain, particles or self.setup.particles
        if share.uses_slabs:
            return self._snapshot_in_slabs(
                self._take_snapshot(time, step, particles, self.peaks.rows, self.start_positions.rows), particles
            )
        gathered = share.gather_particles(particles, self.peaks.rows, self.start_positions.rows)
        return Moment(None if gathered is None else self._take_snapshot(time, step, gathered[0], *gathered[1]))

    def _snapshot_in_slabs(self, part: Snapshot, particles: Particles) -> Moment:
        """Return a snapshot over all processes that is fetched by slabs; `part` is the part of this process."""
        share = self.setup.subdomain
        retired = np.sort(share.gather_numbers(particles.tags[:, FLAGS] & RETIRED > 0))
        indices = {name: getattr(part, name) for name in INDICES}
        arrays = Derived((*part.fields, *INDICES), lambda name: indices[name] if name in indices else part.fields[name])
        number = np.asarray(part.id)
        places = number - np.searchsorted(retired, number)
        slabs = Slabs(share.world, arrays, places, share.count - len(retired))
        if not share.world.first:
            return Moment(None, slabs)
        body, material, number = map(slabs.get_array, INDICES)
        fields = Derived(part.fields, slabs.get_array)
        return Moment(replace(part, fields=fields, body=body, material=material, id=number), slabs)

    def _take_snapshot(
        self, time: float, step: int, particles: Particles, highest: np.ndarray, initial: np.ndarray
    ) -> Snapshot:
        """Return a snapshot with maximum pressures [Pa] and initial positions (n, dim) [m]."""
        stepper = self.setup.stepper
        order = np.argsort(particles.id)
        order = order[particles.tags[order, FLAGS] & RETIRED == 0]
        stored = [name for name in OF_STATE if name in particles.names]

        def derive(name: str) -> np.ndarray:
            return diagnose(particles, stepper.table, stepper.models, (name,))[name]

        def field(name: str) -> Any:
            match name:
                case "displacement":
                    return Ordered(particles["position"] - initial, order)
                case "peak_pressure":
                    return np.maximum(highest, derive("pressure"))[order]
                case "entropy":
                    return self._entropy(particles, np.maximum(highest, derive("pressure")))[order]
                case "failed":
                    return (particles["damage"][order] >= 1.0).astype(np.uint8)
            return Ordered(particles[name] if name in stored else derive(name), order)

        derived = known_names(particles, stepper.table, stepper.models)
        optional = ["entropy"] * ("entropies" in self.metadata)
        names_ = (*stored, *derived, "displacement", "peak_pressure", *optional, "failed")
        numbers = particles.body, particles.material, particles.id
        body, material, number = (cast(Any, Ordered(values, order, np.int64)) for values in numbers)
        metadata, fields = dict(self.metadata) | self._moved_planes(time), Derived(names_, field)
        bodies, materials = self.setup.bodies, self.setup.materials
        return Snapshot(time, step, particles.dim, fields, body, material, number, bodies, materials, metadata)

    def _moved_planes(self, time: float) -> Plain:
        """Return the positions of moving planes of symmetry at the start and at a time [s]."""
        moving = getattr(getattr(self.setup.stepper, "boundaries", None), "moving", ())
        planes = [{"axis": "xyz"[m.plane.axis], "from": m.place, "at": m.place_at(time)} for m in moving]
        return {"moved_planes": planes} if planes else {}

    def _entropy(self, particles: Particles, peak: np.ndarray) -> np.ndarray:
        """Return specific entropies (n,) [J/(kg K)], not a number where the material has none."""
        entropies = np.full(particles.count, np.nan)
        for number, material in enumerate(self.setup.substances):
            rows = np.flatnonzero(particles.material == number)
            by_heat = material.eos.tag != tags.TILLOTSON and self.setup.stepper.models[number, EOS_TAG] == tags.LATE
            if material.entropies and len(rows) and not by_heat:
                distension = 1.0 if material.porosity is None else particles["history_variable"][rows]
                rho, e = (particles[name][rows] for name in ("density", "internal_energy"))
                entropies[rows] = entropy(material, rho, e, distension, peak[rows])
        return entropies

    def permute(self, order: np.ndarray) -> None:
        """Reorder stored arrays with the particles."""
        self.peaks.permute(order)
        self.start_positions.permute(order)

    @property
    def exact(self) -> bool:
        """Whether the files store every field exactly."""
        return self.output.fields is None and self.output.precision == "double"

    def path(self, number: int | str) -> Path:
        """Return the file of a snapshot in the first of its formats."""
        hdf5 = "hdf5" in self.output.formats or isinstance(number, str)
        return self.folder.snapshot_path(number) if hdf5 else self.folder.vtu_path(int(number))

    def start(self, time: float) -> Moment:
        """Return the initial snapshot, at a time [s], and store the reference for measures of later ones."""
        moment = self.snapshot(time, 0)
        with moment.open() as start:
            if start is not None:
                self._count = start.count
                self.metadata.update(self._reference(load_arrays(start)))
                start.metadata.update(self.metadata)
        return moment

    def _reference(self, start: Snapshot) -> Plain:
        surfaces = {}
        for name, (number, normal) in self.setup.gauges.surfaces.items():
            axis, sign = int(np.abs(normal).argmax()), float(normal.sum())
            surfaces[name] = {"axis": axis, "sign": sign, "impedance": _impedance(start, number)}
        return reference(start) | ({"surfaces": surfaces} if surfaces else {})

    def delete_after(self, number: int) -> None:
        """Delete the snapshots after `number` and that of a failure, before a run continues from there."""
        path = self.folder.path
        try:
            for path in file_names.own_files(self.folder.path):
                file_number = file_names.number_of(path)
                stale = path.stem == file_names.POST_MORTEM or (file_number is not None and file_number > number)
                if path.parent.name != file_names.CHECKPOINT and stale and file_names.is_plain(path):
                    path.unlink()
        except OSError as error:
            raise OutputError(f"cannot delete {path}: {reason(error)}") from error

    def write_series(self) -> None:
        """Write the series file of all snapshots, if due: the interval grows with its cost."""
        if "hdf5" in self.output.formats:
            began = wall.monotonic()
            write_time_series(self.folder.path)
            end = wall.monotonic()
            self._series_due = end + (end - began) / TIME_SHARE

    def write(self, snapshot: Snapshot, number: int | str, whole: bool = True) -> None:
        """Write a snapshot and its regions in every format, by number or name; `whole` writes all particles."""
        output, numbered = self.output, isinstance(number, int)
        if isinstance(number, int):
            self._write_regions(snapshot, number)
            if not whole and number % output.full_every:
                return
        reduced = _reduce_fields(snapshot, output)
        if "hdf5" in output.formats or not numbered:
            first = self.folder.snapshot_path(0).name
            constant = numbered and number != 0 and snapshot.count == self._count  # particles leave, and none comes
            refers = output.static_fields == "once" and constant
            write_hdf5(
                self.folder.snapshot_path(number),
                reduced,
                StorageOptions(output.compress == "gzip", first if refers else None),
            )
            if number and wall.monotonic() > self._series_due:  # not for the first snapshot
                self.write_series()
        if "vtu" in output.formats and not isinstance(number, str):
            path = _with_folder(self.folder.vtu_path(number))
            write_vtu(path, reduced)
            entry = f"{file_names.VTU}/{path.name}"
            self.series[:] = [item for item in self.series if item[1] != entry]
            self.series.append((snapshot.time, entry))
            write_pvd(self.folder.path / file_names.SERIES, self.series)

    def _write_regions(self, snapshot: Snapshot, number: int) -> None:
        for name, region in self.output.regions.items():
            part = _reduce_fields(snapshot.part(_in_region(snapshot, region)), self.output)
            path = _with_folder(self.folder.region_path(name, number))
            write_hdf5(path, part, StorageOptions(self.output.compress == "gzip"))


def _with_folder(path: Path) -> Path:
    """Create the folder of a file and return the file."""
    try:
        path.parent.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot write {path.parent}: {reason(error)}") from error
    return path


def _in_region(snapshot: Snapshot, region: OutputRegion) -> np.ndarray:
    """Return the indices of a region's particles in a snapshot, slab by slab."""
    indices, position = [], snapshot.fields["position"]
    bodies = [snapshot.bodies.index(body) for body in region.bodies]
    for begin in range(0, snapshot.count, SLAB):
        rows = slice(begin, begin + SLAB)
        inside = in_box(region.box, position[rows]) & (snapshot.id[rows] % region.stride == 0)
        if bodies:
            inside &= np.isin(snapshot.body[rows], bodies)
        indices.append(begin + np.flatnonzero(inside))
    return np.concatenate(indices)


def _reduce_fields(snapshot: Snapshot, output: Output) -> Snapshot:
    """Return a snapshot with the fields and the precision of the case."""

    def convert(name: str, values: np.ndarray) -> np.ndarray:
        single = output.precision == "single" and values.dtype == np.float64 and name != "position"
        return values.astype(np.float32) if single else values

    names = [name for name in snapshot.fields if output.fields is None or name in output.fields or name in ALWAYS]
    return replace(snapshot, fields=transform_arrays(snapshot.fields, convert, names))


def _impedance(start: Snapshot, number: int) -> float:
    """Return the initial acoustic impedance [Pa s/m] of a particle."""
    row = int(np.flatnonzero(start.id == number)[0])
    return float(start.fields["density"][row] * start.fields["sound_speed"][row])


def _field_of_gravity(field: Gravity) -> Plain:
    """Return the field of gravity as measures read it."""
    if field.kind == SPHERE:
        return {"centre": list(field.vector), "mass_parameter": field.strength, "radius": field.radius}
    return {"acceleration": list(field.vector)}
