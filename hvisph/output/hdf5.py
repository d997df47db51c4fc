"""Snapshots as HDF5 files that ParaView opens directly (VTKHDF, an unstructured grid of vertices).

Group `VTKHDF` holds what ParaView reads: points, one vertex cell a particle, every field as point data.
Dataset `hvisph/header` holds the rest as JSON: time, step, names, metadata, and the CRC-32 of each array, by which one
that is read alone is verified. Numbers are stored unchanged by default (`StorageOptions`); the file ends with a
checksum (`hvisph.output.verified_hdf5`). Units and meanings are attributes, names of bodies and materials texts of the
field data. Format: https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from zlib import crc32

import h5py
import numpy as np

from hvisph.core.errors import CaseError, OutputError
from hvisph.core.fields import CATALOGUE, Derived
from hvisph.core.text import Plain
from hvisph.output import file_names
from hvisph.output.atomic_write import read_errors
from hvisph.output.verified_hdf5 import LABELS, reading, writing

from .snapshot import FORMAT_VERSION, INDICES, Snapshot, header_text, snapshot_from, to_vtk

_VTK_VERTEX = 1
COUNTS = ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds")
CONSTANTS = ("mass", "body", "material")  # constant data of particles, which may be stored in the first snapshot only
# Particles in a compressed piece, and particles written at a time without compression.
PIECE, _ROWS = 65536, 8192
_SMALL = 30_000  # particles of a snapshot that is read at once


@dataclass(frozen=True)
class StorageOptions:
    """Storage options of a snapshot."""

    compress: bool = False  # whether arrays are compressed by gzip
    # name of the snapshot beside it that holds `CONSTANTS` of the same particles; None where it has its own
    constants_in: str | None = None


PLAIN = StorageOptions()


def write_hdf5(path: str | Path, snapshot: Snapshot, form: StorageOptions = PLAIN) -> None:
    """Write a snapshot; raises `OutputError` where it cannot be written, and leaves an earlier file untouched."""
    with writing(path) as h5:
        entries: Plain = {"constants_in": form.constants_in} if form.constants_in else {}
        text = header_text(snapshot, entries | {"sums": _write_vtk(h5, snapshot, form)}).encode("ascii")
        h5.create_dataset("hvisph/header", data=np.bytes_(text)).attrs["crc32"] = np.uint32(crc32(text))


def read_hdf5(path: str | Path, lazily: bool = False) -> Snapshot:
    """Read a snapshot that `write_hdf5` wrote, after checking that it is whole.

    `lazily`: whether fields of a large file are read on each access, except masses, the numbers of bodies, materials
        and particles, and constants stored in another file: the file must not change.
    Raises `OutputError` when the file is missing, truncated, damaged, of another format version or not a snapshot.
    """
    with reading(path, "a snapshot", verified=not (lazily and _has_sums(path))) as h5:
        header = _header(h5)
        if header["format_version"] != FORMAT_VERSION:
            raise OutputError(f"its format is version {header['format_version']}, this hvisph reads {FORMAT_VERSION}")
        places = {name: f"VTKHDF/PointData/{name}" for name in h5["VTKHDF/PointData"]}
        places["position"] = "VTKHDF/Points"
        lazily = lazily and h5[places["position"]].shape[0] > _SMALL
        sums = header.get("sums", {}) if lazily else {}  # else the checksum of the file was verified
        arrays = {name: _array(h5, places[name], sums) for name in (INDICES if lazily else places) if name in places}
    if lazily:  # few values are needed
        arrays |= {name: arrays[name].astype(np.int32) for name in ("body", "material") if name in arrays}
    if "constants_in" in header:
        arrays |= _constants(Path(path), str(header["constants_in"]), arrays["id"])

    def field(name: str) -> np.ndarray:
        if name in arrays:
            return arrays[name]
        with reading(path, "a snapshot", verified=False) as h5:
            values = _array(h5, places[name], sums)
        return arrays.setdefault(name, values) if name == "mass" else values  # used by most measures

    with read_errors(path, "a snapshot of hvisph"):
        return snapshot_from(header, Derived((*places, *arrays), field) if lazily else arrays)


def _has_sums(path: str | Path) -> bool:
    """Return whether the file is large and has a checksum of each array; verifies that of the header."""
    with reading(path, "a snapshot", verified=False) as h5:
        if h5["VTKHDF/Points"].shape[0] <= _SMALL or "crc32" not in h5["hvisph/header"].attrs:
            return False
        if crc32(h5["hvisph/header"][()]) != h5["hvisph/header"].attrs["crc32"]:
            raise OutputError("it is damaged, or was changed after it was written (the checksum of its header)")
        return True


def time_in(path: str | Path) -> float:
    """Return the time [s] of a snapshot without its fields; raises `OutputError` where it is no whole snapshot."""
    with reading(path, "a snapshot", verified=False) as h5:
        return float(_header(h5)["time"])


def _array(h5: h5py.File, place: str, sums: Mapping[str, int]) -> np.ndarray:
    """Return an array of an open snapshot, verified by its checksum where that is known."""
    values = np.ascontiguousarray(h5[place][...])
    if place in sums and crc32(values.data) != sums[place]:
        raise OutputError(f"'{place}' in it is damaged, or was changed after it was written (its checksum)")
    return values


def _constants(path: Path, name: str, number: np.ndarray) -> dict[str, np.ndarray]:
    """Return the constant arrays of a snapshot that are stored in another one of the same particles."""
    sibling = path.with_name(name)
    if not file_names.PATTERNS[file_names.SNAPSHOTS].fullmatch(name):
        raise OutputError(f"cannot read {path}: '{name[:64]}' is no snapshot beside it")
    if not sibling.is_file():
        raise OutputError(f"cannot read {path}: masses, bodies and materials stand in {sibling}, which is not there")
    with reading(sibling, "a snapshot") as h5:
        data = h5["VTKHDF/PointData"]
        if not np.array_equal(data["id"][...], number):
            raise OutputError(f"it should hold masses, bodies and materials of {path}, but has other particles")
        return {constant: data[constant][...] for constant in CONSTANTS if constant in data}


def names_in(h5: h5py.File) -> tuple[list[str], list[str]]:
    """Return the names of bodies and materials of an open snapshot."""
    header = _header(h5)
    return [str(name) for name in header["bodies"]], [str(name) for name in header["materials"]]


def _header(h5: h5py.File) -> Plain:
    header = json.loads(h5["hvisph/header"][()]) if "hvisph/header" in h5 else None
    if not isinstance(header, dict):
        raise OutputError("it is an HDF5 file, but not a snapshot of hvisph")
    return header


def mark_vtk(h5: h5py.File) -> h5py.Group:
    """Return the group that ParaView reads, made and marked in an open HDF5 file."""
    root = h5.create_group("VTKHDF")
    # VTK compares this attribute as fixed-length ASCII and rejects h5py's default variable length
    grid_type = b"UnstructuredGrid"
    root.attrs.create("Type", grid_type, dtype=h5py.string_dtype("ascii", len(grid_type)))
    root.attrs["Version"] = np.array([2, 0])
    return root


def write_labels(root: h5py.Group, bodies: Sequence[str], materials: Sequence[str]) -> None:
    """Write names as texts of the field data, in the order of the numbers `body` and `material`."""
    # VTK reads texts of variable length that claim to be ASCII, and reads their content as UTF-8
    text_type = h5py.string_dtype("ascii")
    for label, words in zip(LABELS, (bodies, materials), strict=True):
        texts = [word.replace("\0", " ").encode() for word in words]
        root.create_dataset(f"FieldData/{label}", data=np.array(texts, dtype=object), dtype=text_type)


def _write_vtk(h5: h5py.File, snapshot: Snapshot, form: StorageOptions) -> dict[str, int]:
    """Write what ParaView reads, and return the CRC-32 of each array's values by its place."""
    n, sums = snapshot.count, dict[str, int]()
    root = mark_vtk(h5)
    left_out = CONSTANTS if form.constants_in else ()

    def put(group: h5py.Group, place: str, values: np.ndarray, name: str = "") -> h5py.Dataset:
        """Write an array, a field as ParaView expects it, a piece at a time."""
        shape = to_vtk(name, values[:0], snapshot.dimensions).shape[1:]
        packed = {"chunks": (min(n, PIECE), *shape), "compression": "gzip", "compression_opts": 1, "shuffle": True}
        pieces = packed if form.compress and n else {}
        dataset = group.create_dataset(place, (len(values), *shape), values.dtype, **pieces)
        size, total = PIECE if form.compress else _ROWS, 0
        for begin in range(0, len(values), size):
            piece = to_vtk(name, values[begin : begin + size], snapshot.dimensions)
            dataset[begin : begin + size] = piece
            total = crc32(np.ascontiguousarray(piece).data, total)
        sums[dataset.name.removeprefix("/")] = total
        return dataset

    for name in COUNTS:
        root.create_dataset(name, data=np.array([n], dtype=np.int64))
    points = put(root, "Points", snapshot.fields["position"], "position")
    put(root, "Connectivity", np.arange(n, dtype=np.int64))
    put(root, "Offsets", np.arange(n + 1, dtype=np.int64))
    put(root, "Types", np.full(n, _VTK_VERTEX, dtype=np.uint8))
    data = root.create_group("PointData")
    units = snapshot.metadata.get("units") != "none"
    _describe(points, "position", units)
    for name in snapshot.fields:  # one at a time
        if name != "position" and name not in left_out:
            _describe(put(data, name, snapshot.fields[name], name), name, units)
    for name in INDICES:
        if name not in left_out:
            _describe(put(data, name, getattr(snapshot, name)), name, units)
    root.create_dataset("FieldData/TimeValue", data=np.array([snapshot.time]))
    write_labels(root, snapshot.bodies, snapshot.materials)
    return sums


def _describe(dataset: h5py.Dataset, name: str, units: bool) -> None:
    """Write the attributes of an array; numbers of bodies, materials and particles have the unit 1."""
    dataset.attrs["units"] = CATALOGUE[name].unit if units and name in CATALOGUE else ""
    if name in CATALOGUE:
        dataset.attrs["meaning"] = CATALOGUE[name].meaning


NAMES = ("density", "temperature", "pressure", "energy")
SUFFIXES = (".h5", ".hdf5")
MOST_NUMBERS = 20_000_000  # numbers of a dataset


def read_eos_table(path: Path) -> dict[str, np.ndarray]:
    """Return the four arrays of a table by name; raises `CaseError` if the file is missing or does not fit."""
    if not path.is_file():
        raise CaseError("there is no such file", file=str(path))
    try:
        with h5py.File(path, "r") as file:
            for place in (file, *(file[name] for name in file if hasattr(file[name], "keys"))):
                if set(NAMES) <= set(place.keys()):
                    return _arrays(place, path)
            raise CaseError(f"holds no datasets {', '.join(NAMES)}", file=str(path))
    except (OSError, KeyError, ValueError, TypeError, RuntimeError):  # the message repeats nothing of the file
        raise CaseError("cannot be read as a table of an equation of state in HDF5", file=str(path)) from None


def _arrays(place: h5py.Group, path: Path) -> dict[str, np.ndarray]:
    shapes = {name: tuple(place[name].shape) for name in NAMES}
    if any(np.prod(shape) > MOST_NUMBERS for shape in shapes.values()):
        raise CaseError(f"has more than {MOST_NUMBERS} numbers in a dataset", file=str(path))
    grid = (*shapes["density"], *shapes["temperature"])
    if len(grid) != 2 or shapes["pressure"] != grid or shapes["energy"] != grid:
        sizes = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise CaseError(f"its datasets do not fit: {sizes}; needed are (n), (m), (n, m) and (n, m)", file=str(path))
    return {name: np.asarray(place[name], dtype=float) for name in NAMES}
