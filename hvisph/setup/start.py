"""Bodies of another run in the state of one of its snapshots, as initial state.

Particles of the same kinematics are copied. A particle (x, r, m) of an axisymmetric run becomes

    n = max(round(2 pi r/dx), 2) particles of mass m/n at the angles 2 pi (k + g)/n about x,

where g of particle i is i (5^(1/2) - 1)/2 modulo 1. With planes of symmetry through x, n is a multiple of 2, or of 4
for two planes, and g = 1/2, so that no particle lies on a plane, and exactly a half or a quarter is kept. Velocity and
stress, the hoop stress included, are rotated by the angle. Mass, momentum, angular momentum and energy are conserved to
round-off. A particle of a plane run becomes n = round(width/dx) particles of mass m width/n along z.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from hvisph.case.bodies import Body
from hvisph.case.case import Case
from hvisph.case.output import SymmetryPlane
from hvisph.casefile.document import parse
from hvisph.casefile.loader import case_hash, load_case
from hvisph.core.errors import CaseError, OutputError
from hvisph.core.fields import AXES, CATALOGUE, CRACK, HISTORY, OF_STATE
from hvisph.core.particles import BASE_FIELDS
from hvisph.core.text import Plain
from hvisph.materials.material_table import Material
from hvisph.output.reader import list_snapshots, read_history, read_snapshot, read_time
from hvisph.output.snapshot import Snapshot

from .materials import material_of

SAME_TIME = 1e-9  # times that differ by this share of the later one are the same moment
# Shift of the angle between successive axisymmetric particles, in turns (golden ratio).
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
RECOMPUTED_FIELDS = ("density_correction", "torque_residual", "viscosity_factor", "thickness")
MOST_LISTED = 3  # snapshots that an error lists


@dataclass(frozen=True)
class Origin:
    """Snapshot of another run, `case` being the case of that run and `hash` that of its text."""

    folder: Path
    snapshot: Snapshot
    first: Snapshot
    case: Case
    hash: str

    @cached_property
    def initial_spacing(self) -> np.ndarray:
        """Spacing of the particles of the snapshot at the start of the run (n,) [m], by their smoothing lengths."""
        h_over_dx = self.case.formulation.h_over_dx
        snapshot, first = self.snapshot, self.first
        lengths = snapshot.fields["smoothing_length"]
        if np.isin(snapshot.id, first.id).all() and "smoothing_length" in first.fields:
            order = np.argsort(first.id)
            lengths = first.fields["smoothing_length"][order[np.searchsorted(first.id, snapshot.id, sorter=order)]]
        return np.asarray(lengths / h_over_dx)

    def as_dict(self) -> Plain:
        """Return the plain form for the summary, with properties and energy that are lost on mapping."""
        energy = 0.0
        with suppress(OutputError):
            history = read_history(self.folder)
            if "contact_energy" in history:
                row = int(np.searchsorted(history["time"], self.snapshot.time, side="right")) - 1
                energy = float(history["contact_energy"][max(row, 0)])
        return {"run": str(self.folder), "at": self.snapshot.time, "case_hash": self.hash, "lost_on_mapping": energy}


def origin_of(case: Case) -> Origin:
    """Return the snapshot that a case starts from; raises `CaseError` where there is none that it can."""
    start: Any = case.start
    folder = Path(start.run)
    if not folder.is_dir():
        raise CaseError(f"there is no folder '{start.run}'; give that of a run (runs/NAME)", where="start.run")
    files = list_snapshots(folder)
    if not files:
        raise CaseError(f"'{start.run}' holds no snapshot; run its case first", where="start.run")
    times = np.array([read_time(file) for file in files])
    nearest = np.argsort(abs(times - start.at), kind="stable")
    if abs(times[nearest[0]] - start.at) > SAME_TIME * max(times.max(), start.at):
        unit = " s" if case.units == "si" else ""
        listing = ", ".join(f"{time:.9g}{unit}" for time in sorted(times[nearest[:MOST_LISTED]]))
        raise CaseError(f"the run has no snapshot at {start.at:.9g}{unit}; nearest: {listing}", where="start.at")
    snapshot = read_snapshot(files[int(nearest[0])], lazily=True)
    text = str(snapshot.metadata.get("case", ""))
    try:
        parent = load_case(parse(text, "case").value)
    except CaseError as error:
        raise CaseError(f"the case of that run cannot be read: {error.message}", where="start.run") from error
    origin = Origin(folder, snapshot, read_snapshot(files[0], lazily=True), parent, case_hash(text))
    _refuse_other_model(case, origin)
    _refuse_other_bodies(case, origin)
    return origin


def _refuse_other_model(case: Case, origin: Origin) -> None:
    """Raise an error unless kinematics, units, spacing, planes and scheme of the run suit the case."""
    start: Any = case.start
    parent = origin.case
    required = {"same": case.kinematics, "revolved": "axisymmetric", "extruded": "plane_strain"}[start.mapping]
    if parent.kinematics != required:
        ways = {
            "axisymmetric": " in the same kinematics, or `as: revolved`",
            "plane_strain": " in the same kinematics, or `as: extruded`",
        }.get(parent.kinematics, " in the same kinematics")
        raise CaseError(f"that run is {parent.kinematics}; start from it{ways}", where="start.as")
    if any(stage.at == "auto" or stage.at <= start.at for stage in parent.late):
        fault = "that run may be in a late stage then, whose densities are of its modulus; start before it, of a run"
        raise CaseError(f"{fault} whose `late.at` is a time", where="start.at")
    if parent.units != case.units:
        raise CaseError(f"that run has units {parent.units}, and this case {case.units}", where="start.run")
    if parent.formulation.type == "projection":
        raise CaseError("a run of projection has no state that another one can start from", where="start.run")
    if abs(parent.resolution / case.resolution - 1.0) > SAME_TIME:
        fault = f"{case.resolution:g} is not that of the run, {parent.resolution:g}, whose particles stand so far apart"
        raise CaseError(fault, where="resolution")
    axes = {"same": "xyz", "revolved": "x", "extruded": "xy"}[start.mapping]
    planes = [plane for plane in case.symmetry if plane.axis in axes]
    if sorted(map(str, planes)) != sorted(map(str, parent.symmetry)):
        raise CaseError(f"planes of symmetry across {', '.join(axes[: case.dim])} must be those of the run", "symmetry")
    added_planes = [plane for plane in case.symmetry if plane.axis not in axes]
    if start.mapping == "revolved" and any(plane.at != 0.0 for plane in added_planes):
        raise CaseError("planes of symmetry across y and z must be at 0, where the axis of the run is", "symmetry")
    sides = {plane.keep: plane.at for plane in added_planes}
    if start.mapping == "extruded" and len(sides) == 2 and sides["below"] - sides["above"] != start.width:
        raise CaseError("is not the distance between the planes of symmetry across z", where="start.width")
    if case.initial_loads and case.initial_loads == parent.initial_loads:
        message = "these have acted in the run already; leave them out (`initial_loads: []`)"
        raise CaseError(message, where="initial_loads")


def _refuse_other_bodies(case: Case, origin: Origin) -> None:
    """Raise an error where a body of the run is missing, or its particles lack what the case needs of them."""
    fields = origin.snapshot.fields
    missing = [name for name in BASE_FIELDS if name not in fields]
    if missing:
        raise CaseError(f"its snapshots lack '{missing[0]}': `output.fields` left it out", where="start.run")
    for name, before in origin.case.bodies.items():
        where = f"bodies.{name}"
        if name not in case.bodies:
            message = f"that run has the body '{name}' and this case has not; describe it as there, or use `base`"
            raise CaseError(message, where="start.run")
        child = case.bodies[name]
        _refuse_other_rigidity(child, before, f"{where}.rigid")
        for key, old_value, new_value in (
            ("density", before.material.density, child.material.density),
            ("eos.type", before.material.eos.type, child.material.eos.type),
        ):
            if old_value != new_value:
                raise CaseError(f"is {old_value} in the run, and {new_value} here", where=f"{where}.material.{key}")
        old, new = (material_of(body.material, body.internal_energy) for body in (before, child))
        for field in _history_of(new, case):
            if field not in fields or field not in _history_of(old, origin.case):
                fault = f"needs the history variable '{field}', which the run does not have for this body"
                raise CaseError(fault, where=f"{where}.material")
        if type(old.damage) is not type(new.damage) and new.has_history:
            raise CaseError("its damage model has a history, and is not that of the run", f"{where}.material.damage")


def _refuse_other_rigidity(body: Body, before: Body, where: str) -> None:
    """Raise an error where a body is rigid in one of both runs, or has another mass; freedom and motion may differ."""
    if body.rigid is None or before.rigid is None:
        if body.rigid is not before.rigid:
            raise CaseError("a body that starts from another run is rigid in both runs or in none", where=where)
        return
    if body.rigid.mass != before.rigid.mass:
        raise CaseError("is the mass of the run; give the same", where=f"{where}.mass")
    if len(body.rigid.inertia) > 1:
        message = "is about axes that have turned with the body in the run; leave it out"
        raise CaseError(message, where=f"{where}.inertia")


def _history_of(material: Material, case: Case) -> tuple[str, ...]:
    """Return the fields that the particles of a material carry beside those of all."""
    names = HISTORY if material.has_history else ()
    names = (*names, *CRACK) if material.fracture is not None else names
    names = (*names, *AXES) if material.has_axes else names
    return (*names, "thickness") if case.kinematics == "plane_stress" else names


def carried_fields(case: Case, origin: Origin) -> dict[str, dict[str, np.ndarray]]:
    """Return the fields of each body of the run as a case takes them, with the initial `spacing` (n,) [m]."""
    snapshot, start = origin.snapshot, case.start
    fields = {name: np.asarray(snapshot.fields[name]) for name in OF_STATE if name in snapshot.fields}
    if origin.case.formulation.h_over_dx != case.formulation.h_over_dx:
        del fields["smoothing_length"]  # that of the spacing then
    fields["spacing"], body = origin.initial_spacing, snapshot.body
    mapping = start.mapping  # type: ignore[union-attr]
    if mapping != "same":  # these belong to the kernel sums of the plane
        fields = {name: values for name, values in fields.items() if name not in RECOMPUTED_FIELDS}
    if mapping == "revolved":
        fields, body = _revolve(fields, body, [plane for plane in case.symmetry if plane.axis in "yz"])
    elif mapping == "extruded":
        fields, body = _extrude(fields, body, start.width, case)  # type: ignore[union-attr]
    return {
        name: {field: values[body == number] for field, values in fields.items()}
        for number, name in enumerate(snapshot.bodies)
    }


Fields = dict[str, np.ndarray]


def _revolve(fields: Fields, body: np.ndarray, planes: Sequence[SymmetryPlane]) -> tuple[Fields, np.ndarray]:
    """Return the particles of a revolved axisymmetric run on the kept side of symmetry planes, and their bodies."""
    radius, part = abs(fields["position"][:, 1]), 2 ** len({plane.axis for plane in planes})
    n_around = 2.0 * np.pi * radius / fields["spacing"]
    counts = part * np.maximum(np.rint(n_around / part), 2 if part == 1 else 1).astype(np.int64)
    ring = np.repeat(np.arange(len(radius)), counts)
    first = np.cumsum(counts) - counts
    share = (np.arange(len(radius)) * GOLDEN) % 1.0 if part == 1 else np.full(len(radius), 0.5)
    angle = 2.0 * np.pi * (np.arange(len(ring)) - first[ring] + share[ring]) / counts[ring]
    cos, sin = np.cos(angle), np.sin(angle)
    selected = np.ones(len(ring), bool)
    for plane in planes:
        coordinate = cos if plane.axis == "y" else sin
        selected &= (coordinate > 0.0) == (plane.keep == "above")
    ring, cos, sin, angle = ring[selected], cos[selected], sin[selected], angle[selected]
    new = {}
    for name, values in fields.items():
        mapped, rank = values[ring], _rank(name)
        if rank == "vector":
            mapped = np.stack([mapped[:, 0], mapped[:, 1] * cos, mapped[:, 1] * sin], axis=1)
        elif rank == "symmetric":
            mapped = _turned_stress(mapped, cos, sin)
        elif rank == "quaternion":
            mapped = _turned_axes(mapped, angle)
        new[name] = mapped / counts[ring] if name == "mass" else mapped
    return new, body[ring]


def _turned_stress(stress: np.ndarray, cos: np.ndarray, sin: np.ndarray) -> np.ndarray:
    """Return the components xx, yy, zz, xy, xz, yz of a stress xx, rr, hoop, xr at angles from y about x (n, 6)."""
    xx, rr, hoop, xr = stress.T
    return np.stack(
        [xx, rr * cos**2 + hoop * sin**2, rr * sin**2 + hoop * cos**2, xr * cos, xr * sin, (rr - hoop) * cos * sin],
        axis=1,
    )


def _turned_axes(axes: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return quaternions w, x, y, z (n, 4) followed by a turn by angles about x."""
    cos, sin = np.cos(0.5 * angle), np.sin(0.5 * angle)
    w, x, y, z = axes.T
    return np.stack([cos * w - sin * x, cos * x + sin * w, cos * y - sin * z, cos * z + sin * y], axis=1)


def _extrude(fields: Fields, body: np.ndarray, width: float, case: Case) -> tuple[Fields, np.ndarray]:
    """Return the rows of particles along z that those of a plane run become, and their bodies."""
    planes = {plane.keep: plane.at for plane in case.symmetry if plane.axis == "z"}
    low = planes.get("above", planes.get("below", 0.5 * width) - width)
    count = max(round(width / case.resolution), 1)
    z = low + (np.arange(count) + 0.5) * width / count
    of, z = np.repeat(np.arange(len(body)), count), np.tile(z, len(body))
    new = {}
    for name, values in fields.items():
        mapped, rank = values[of], _rank(name)
        if rank == "vector":
            mapped = np.column_stack([mapped, z if name == "position" else np.zeros(len(of))])
        elif rank == "symmetric":
            mapped = np.column_stack([mapped, np.zeros((len(of), 2))])
        new[name] = mapped * (width / count) if name == "mass" else mapped
    return new, body[of]


def _rank(name: str) -> str:
    return CATALOGUE[name].rank if name in CATALOGUE else "scalar"
