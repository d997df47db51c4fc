"""Snapshots from the files of other codes: VTU, VTP, legacy VTK (by pyvista) and LAMMPS text dumps.

Points are the positions; a coordinate that is 0 throughout is no dimension. Names of arrays are compared without case,
blanks, dashes and underscores. An array that is none of the quantities in `QUANTITIES` keeps its own name.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hvisph.core.errors import OutputError, suggest_nearest
from hvisph.core.text import sanitize

from .atomic_write import read_errors
from .snapshot import Snapshot

# Each quantity: powers of length, mass and time in its unit, and the usual names of its array.
QUANTITIES = {
    "position": ((1, 0, 0), ""),
    "velocity": ((1, 0, -1), "velocity vel v"),
    "mass": ((0, 1, 0), "mass m"),
    "density": ((-3, 1, 0), "density rho"),
    "internal_energy": ((2, 0, -2), "internalenergy specificinternalenergy energy e u"),
    "smoothing_length": ((1, 0, 0), "smoothinglength h"),
    "pressure": ((-1, 1, -2), "pressure p"),
    "sound_speed": ((1, 0, -1), "soundspeed cs c"),
    "plastic_strain": ((0, 0, 0), "plasticstrain equivalentplasticstrain eps"),
    "von_mises_stress": ((-1, 1, -2), "vonmisesstress vonmises"),
    "temperature": ((0, 0, 0), "temperature temp"),
    "damage": ((0, 0, 0), "damage d"),
    "body": ((0, 0, 0), "body bodyid mol object part material mat type"),
    "material": ((0, 0, 0), "material materialid mat type"),
    "id": ((0, 0, 0), "id particleid gid globalids tag"),
}
INTEGER_QUANTITIES = ("body", "material", "id")  # quantities whose arrays contain integers
VELOCITY_COMPONENTS = (("vx", "vy", "vz"), ("u", "v", "w"))
LARGEST_COORDINATE = 1e100  # so that its square is finite
UNLIKELY_DENSITY = 50.0  # [kg/m^3], less than that of any solid
# Usual systems of units by the power of ten of a solid's density in them.
LIKELY_UNITS = {0: "cm,g,us", -3: "mm,g,us", -6: "mm,kg,ms", -9: "mm,t,s"}

Array = tuple[str, np.ndarray]  # own name and values


def plain_name(name: str) -> str:
    """Return a name without case, blanks, dashes and underscores."""
    return re.sub(r"[ _-]", "", name.lower())


@dataclass(frozen=True)
class Convention:
    """Names and units of another code's files."""

    # the file's own name of a quantity, used in place of the usual ones: ``{"density": "rho_0"}``
    names: Mapping[str, str] = field(default_factory=dict)
    # units of length, mass and time in SI; all others follow. SI, if None
    units: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        known = [name for name in QUANTITIES if name != "position"]
        for quantity in self.names:
            if quantity not in known:
                raise OutputError(f"'{quantity}' is no quantity that measures use{suggest_nearest(quantity, known)}")

    def aliases(self, quantity: str) -> list[str]:
        """Return the bare names of a quantity's array: the given one, or the usual ones."""
        return [plain_name(self.names[quantity])] if quantity in self.names else QUANTITIES[quantity][1].split()

    def factor(self, quantity: str) -> float:
        """Return the SI value of a quantity's unit in these files."""
        powers = QUANTITIES[quantity][0] if quantity in QUANTITIES else (0, 0, 0)
        return math.prod(unit**power for unit, power in zip(self.units or (1.0, 1.0, 1.0), powers, strict=True))

    def refuse_for_own_files(self) -> None:
        """Raise `OutputError` where names or units are given for a snapshot of hvisph."""
        if self.names or self.units:
            raise OutputError("it is a snapshot of hvisph, which contains names and units: give none")


SI = Convention()


def snapshot_of_another_code(
    points: np.ndarray,
    point_data: Mapping[str, np.ndarray],
    field_data: Mapping[str, np.ndarray],
    convention: Convention = SI,
    step: int = 0,
) -> Snapshot:
    """Return a snapshot of another code's points and arrays by name, at `step` and the time of `field_data`.

    Raises `OutputError` without points, for a name that no array has, positions that are not finite, masses or
    densities not above zero, or densities that cannot be in SI.
    """
    n = len(points)
    if n == 0:
        raise OutputError("it holds no points")
    arrays: dict[str, Array] = {}
    for name, values in point_data.items():
        column = np.asarray(values)
        arrays[plain_name(name)] = (name, column[:, 0] if column.ndim == 2 and column.shape[1] == 1 else column)
    for quantity, name in convention.names.items():
        if plain_name(name) not in arrays:
            hint = sanitize(suggest_nearest(name, list(point_data)))
            raise OutputError(f"it has no array '{name}' for the {quantity}{hint}")
    dim = max((axis for axis in range(points.shape[1]) if points[:, axis].any()), default=0) + 1
    fields = {"position": np.ascontiguousarray(points[:, :dim], dtype=float)}
    velocity, keys_used = _velocity(arrays, dim, convention.aliases("velocity"))
    if velocity is not None:
        fields["velocity"] = velocity
    for name in (name for name in QUANTITIES if name not in ("position", "velocity", *INTEGER_QUANTITIES)):
        candidates = (key for key in convention.aliases(name) if key in arrays and key not in keys_used)
        key = next((key for key in candidates if arrays[key][1].ndim == 1), None)
        if key is not None:
            fields[name] = arrays[key][1].astype(float)
            keys_used.append(key)
    fields |= {name: values for key, (name, values) in arrays.items() if key not in keys_used and name not in fields}
    _refuse_impossible(fields)
    if convention.units is None and "density" in fields:
        _refuse_unlikely(fields["density"])
    body, bodies = _groups(arrays, convention, n, "body")
    material, materials = _groups(arrays, convention, n, "material")
    number = _integers(arrays, convention.aliases("id"))
    number = np.arange(n) if number is None or len(np.unique(number)) != n else number
    order = np.argsort(number, kind="stable")
    times = [np.ravel(values) for name, values in field_data.items() if plain_name(name) in ("timevalue", "time")]
    time = float(times[0][0]) if times and len(times[0]) else 0.0
    return Snapshot(
        time=time * (convention.units or (1.0, 1.0, 1.0))[2],
        step=step,
        dimensions=dim,
        fields={
            name: (values if convention.factor(name) == 1.0 else values * convention.factor(name))[order]
            for name, values in fields.items()
        },
        body=body[order],
        material=material[order],
        id=number[order],
        bodies=bodies,
        materials=materials,
    )


def _refuse_impossible(fields: Mapping[str, np.ndarray]) -> None:
    """Raise `OutputError` for positions that are no places, and for masses and densities that no matter has."""
    for name in fields.keys() & {"position", "mass", "density"}:
        values = fields[name].reshape(len(fields[name]), -1)
        fits = np.abs(values) < LARGEST_COORDINATE if name == "position" else (values > 0.0) & (values < np.inf)
        wrong = ~fits.all(axis=1)
        if wrong.any():
            k = int(np.argmax(wrong))
            allowed = f"below {LARGEST_COORDINATE:g} in size" if name == "position" else "above zero and finite"
            numbers = ", ".join(f"{value:.3g}" for value in values[k])
            raise OutputError(f"the {name} of point {k} is {numbers}, but must be {allowed}")


def _refuse_unlikely(density: np.ndarray) -> None:
    """Raise `OutputError` for densities that no solid has in SI, with the units that they are likely in."""
    largest = float(density.max(initial=0.0))
    if not 0.0 < largest < UNLIKELY_DENSITY:
        return
    likely = LIKELY_UNITS.get(3 * math.floor(math.log10(largest) / 3.0 + 0.1), "mm,g,us")
    raise OutputError(
        f"its densities, up to {largest:.3g}, cannot be those of a solid in kg/m^3; "
        f"give --units {likely}, or --units m,kg,s if they are"
    )


def _velocity(arrays: Mapping[str, Array], dim: int, names: list[str]) -> tuple[np.ndarray | None, list[str]]:
    """Return the velocity (n, dim) and the names of its arrays."""
    for name in names:
        if name in arrays and arrays[name][1].ndim == 2 and arrays[name][1].shape[1] >= dim:
            return np.ascontiguousarray(arrays[name][1][:, :dim], dtype=float), [name]
    for parts in VELOCITY_COMPONENTS:
        # in 1D a lone `u` is as likely an energy, so the set must be there as a whole
        if all(name in arrays and arrays[name][1].ndim == 1 for name in parts[: max(dim, 2)]):
            columns = [arrays[name][1].astype(float) for name in parts[:dim]]
            return np.stack(columns, axis=1), [name for name in parts if name in arrays]
    return None, []


def _integers(arrays: Mapping[str, Array], names: list[str]) -> np.ndarray | None:
    """Return the first array of `names` that holds whole numbers, as integers."""
    for name in names:
        values = arrays.get(name, ("", np.zeros((0, 0))))[1]
        if values.ndim == 1 and np.isfinite(values).all() and (values == np.round(values)).all():
            return values.astype(np.int64)
    return None


def _groups(arrays: Mapping[str, Array], convention: Convention, n: int, word: str) -> tuple[np.ndarray, list[str]]:
    """Return the index of each point's group, counted from 0 in the order of their numbers, and names."""
    values = _integers(arrays, convention.aliases(word))
    if values is None:
        return np.zeros(n, dtype=np.int64), [f"{word} 0"]
    numbers, index = np.unique(values, return_inverse=True)
    return index.astype(np.int64), [f"{word} {number}" for number in numbers]


def read_vtk(path: str | Path, convention: Convention = SI, ending: str = ".vtk") -> Snapshot:
    """Read points of a legacy VTK or VTP file; raises `OutputError` without pyvista, or for a damaged file."""
    with read_errors(path, "a VTK file"):
        try:
            import pyvista
        except ImportError:
            raise OutputError("VTP and VTK files need pyvista: pip install 'hvisph[foreign]'") from None
        with pyvista.VtkErrorCatcher(raise_errors=True):
            mesh = pyvista.read(path, force_ext=ending)
        if not isinstance(mesh, pyvista.PolyData | pyvista.UnstructuredGrid):
            raise OutputError(f"it holds {type(mesh).__name__}; read are POLYDATA and UNSTRUCTURED_GRID")
        arrays = {name: np.asarray(values) for name, values in mesh.point_data.items()}
        file_data = {name: np.asarray(values) for name, values in mesh.field_data.items()}
        return snapshot_of_another_code(np.asarray(mesh.points), arrays, file_data, convention)


def read_lammps(path: str | Path, convention: Convention = SI) -> Snapshot:
    """Read the last moment of a LAMMPS text dump.

    Scaled (xs), unwrapped (xu) and scaled unwrapped (xsu) coordinates are understood; ``c_``, ``v_`` and ``f_`` before
    the name of a compute, variable or fix are left out. Format: https://docs.lammps.org/dump.html Raises `OutputError`
    when the file is missing, truncated, damaged, or its particles have no positions.
    """
    with read_errors(path, "a text dump of LAMMPS"):
        _, _, moment = Path(path).read_text("ascii").rpartition("ITEM: TIMESTEP\n")
        parts = [part.partition("\n") for part in f"TIMESTEP\n{moment}".split("ITEM: ")]
        items = {re.sub(r" ?\b[a-z].*", "", head): (head.split()[1:], body.splitlines()) for head, _, body in parts}
        names, lines = items["ATOMS"]
        rows = np.genfromtxt(lines, dtype=float, ndmin=2)  # words, such as elements, are NaN
        if rows.shape != (int(items["NUMBER OF ATOMS"][1][0]), len(names)):
            raise ValueError(f"{items['NUMBER OF ATOMS'][1][0]} particles of {len(names)} columns were announced")
        columns = dict(zip((re.sub(r"^[cvf]_", "", name) for name in names), rows.T, strict=True))
        arrays = {name: values for name, values in columns.items() if not np.isnan(values).all()}
        boxes = [[float(bound) for bound in line.split()] for line in items["BOX BOUNDS"][1][:3]]
        if any(len(box) > 2 for box in boxes):
            raise OutputError("its box is not rectangular")
        points = np.zeros((len(rows), 3))
        for k, (axis, (low, high)) in enumerate(zip("xyz", boxes, strict=True)):
            name = next((axis + end for end in ("u", "", "su", "s") if axis + end in arrays), None)
            if name is not None:
                values = arrays.pop(name)
                points[:, k] = low + values * (high - low) if "s" in name else values
            elif axis != "z":
                raise OutputError(f"its particles have no '{axis}', '{axis}u' or '{axis}s'")
        file_data = {"time": np.array([float(items["TIME"][1][0])])} if "TIME" in items else {}
        return snapshot_of_another_code(points, arrays, file_data, convention, int(items["TIMESTEP"][1][0]))
