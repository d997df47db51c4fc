"""Snapshot: the particles at one time, and the layout of its fields in files for ParaView.

Vectors get zeros up to 3 components, gradients up to 9 (row-major). Symmetric tensors get 6 components in VTK's order
xx, yy, zz, xy, yz, xz, which is not the order inside hvisph (xx, yy, zz, xy, xz, yz). The conversion is reversible
bit for bit.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from hvisph.core.fields import CATALOGUE, SYMMETRIC_LENGTH, transform_arrays
from hvisph.core.text import Plain, is_number, sanitize


@dataclass
class Snapshot:
    """All particles at one time, ordered by `id`.

    `time`, `step`: time since the start of the run [s] and number of steps done.
    `fields`: arrays by the names of `hvisph.core.fields.CATALOGUE`: shape (n,) for scalars, (n, components) for others,
        with the components of the run's dimensions. SI units. Those of a running simulation, and of large files read
        `lazily`, are computed or read on each access.
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

    def part(self, rows: np.ndarray) -> "Snapshot":
        """Return the particles with the indices `rows` alone."""
        fields = transform_arrays(self.fields, lambda _, values: values[rows])
        return replace(self, fields=fields, body=self.body[rows], material=self.material[rows], id=self.id[rows])


FORMAT_VERSION = 1
# Columns of VTK's symmetric tensor, as columns of hvisph's.
VTK_SYMMETRIC = (0, 1, 2, 3, 5, 4)
INDICES = ("body", "material", "id")
# What kinds of values a header has, and the metadata that measures read.
_HEADER: Plain = {"time": int | float, "metadata": dict} | dict.fromkeys(("step", "dimensions"), int)
_HEADER |= dict.fromkeys(("bodies", "materials", "fields"), list)
_NUMBERS = ("spacing", "face", "thickness", "width", "kernel_reach")
_TEXTS = ("title", "units", "kinematics", "code_version", "case")


def _vtk_columns(name: str, dim: int) -> tuple[int, list[int]]:
    """Return the number of components of a field in VTK, and the places of ours among them; 0 and none of a scalar."""
    columns = {
        "vector": (3, list(range(dim))),
        "axial": (3, {1: [], 2: [2], 3: [0, 1, 2]}[dim]),  # rotation in the plane is about z
        "symmetric": (6, list(VTK_SYMMETRIC[: SYMMETRIC_LENGTH[dim]])),
        "gradient": (9, [3 * i + j for i in range(dim) for j in range(dim)]),
        "quaternion": (4, [0, 1, 2, 3]),
    }
    return columns.get(CATALOGUE[name].rank if name in CATALOGUE else "scalar", (0, []))


def to_vtk(name: str, values: np.ndarray, dim: int) -> np.ndarray:
    """Return field `name` in `dim` dimensions as ParaView expects it; unknown names stay as they are."""
    width, columns = _vtk_columns(name, dim)
    if not width:
        return values
    out = np.zeros((len(values), width), dtype=values.dtype)
    out[:, columns] = values
    return out


def header_text(snapshot: Snapshot, entries: Plain | None = None) -> str:
    """Return all of `snapshot` except its arrays, and further `entries`, as JSON text."""
    header = {
        "format_version": FORMAT_VERSION,
        "time": float(snapshot.time),
        "step": int(snapshot.step),
        "dimensions": int(snapshot.dimensions),
        "bodies": list(snapshot.bodies),
        "materials": list(snapshot.materials),
        "fields": list(snapshot.fields),
        "metadata": snapshot.metadata,
    } | (entries or {})

    def plain(value: object) -> object:
        if isinstance(value, np.generic | np.ndarray):
            return value.tolist()
        raise TypeError(f"a snapshot's metadata holds plain numbers and text, not {type(value).__name__}")

    return json.dumps(header, default=plain, ensure_ascii=True)


def snapshot_from(header: Plain, arrays: Mapping[str, np.ndarray]) -> Snapshot:
    """Return the snapshot of a header and arrays as in a file; `KeyError`, `TypeError`, `ValueError` if foreign."""
    for key, value_type in _HEADER.items():
        if not isinstance(header[key], value_type) or isinstance(header[key], bool):
            raise ValueError(f"its {key} is no {value_type.__name__ if isinstance(value_type, type) else 'number'}")
    dim, number = header["dimensions"], arrays["id"]
    if dim not in SYMMETRIC_LENGTH:
        raise ValueError(f"it has {dim} dimensions")
    ordered = number.ndim == 1 and bool((number[1:] > number[:-1]).all())  # as we write them
    if number.ndim != 1 or not (ordered or len(np.unique(number)) == len(number)):
        raise ValueError("its particles are not numbered, each once")
    for name in ("bodies", "materials"):
        if not header[name] or not all(isinstance(entry, str) for entry in header[name]):
            raise ValueError(f"its {name} have no names")
    for name, count in (("body", len(header["bodies"])), ("material", len(header["materials"])), ("id", 2**62)):
        values = arrays[name]
        fits = values.shape == number.shape and values.dtype.kind in "iu"
        if not fits or (len(values) and not (values.min() >= 0 and values.max() < count)):
            raise ValueError(f"'{name}' is no index for each particle")
    _check_metadata(header["metadata"], dim)
    fields = transform_arrays(arrays, lambda name, values: _field(name, values, dim, len(number)), header["fields"])
    if "position" not in fields:
        raise ValueError("its particles have no positions")
    return Snapshot(
        time=float(header["time"]),
        step=header["step"],
        dimensions=dim,
        fields=fields,
        body=arrays["body"],
        material=arrays["material"],
        id=number,
        bodies=[sanitize(name) for name in header["bodies"]],
        materials=[sanitize(name) for name in header["materials"]],
        metadata={k: sanitize(v) if k in _TEXTS else v for k, v in header["metadata"].items()},
    )


def _field(name: str, values: np.ndarray, dim: int, count: int) -> np.ndarray:
    """Return one field as hvisph has it; raises `ValueError` when it has not the shape that it is written with."""
    width, columns = _vtk_columns(name, dim)
    is_odd = name in CATALOGUE and values.shape[1:] != ((width,) if width else ())
    if is_odd or values.dtype.kind not in "fiu" or values.shape[:1] != (count,):
        raise ValueError(f"'{name}' has shape {values.shape} for {count} particles")
    if values.dtype.kind == "f":  # as whoever computes with it expects, however it was stored
        values = values.astype(np.float64, copy=False)
    return values if columns == list(range(width)) else np.ascontiguousarray(values[:, columns])


def _check_metadata(metadata: Plain, dim: int) -> None:
    """Raise `ValueError` where something that measures rely on is of another kind."""
    for name, value in metadata.items():
        if name in _NUMBERS and not is_number(value):
            raise ValueError(f"its {name} is no number")
        if name in _TEXTS and not isinstance(value, str):
            raise ValueError(f"its {name} is no text")
    if "spacing" in metadata and not metadata["spacing"] > 0.0:
        raise ValueError("its spacing is not positive")
    axis = metadata.get("axis", [0.0] * (dim - 1))
    if not isinstance(axis, list) or len(axis) != dim - 1 or not all(map(is_number, axis)):
        raise ValueError("its axis is no line across the other coordinates")
