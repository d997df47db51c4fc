"""Snapshots as VTU files: an unstructured grid of vertices, and the series that lists them.

Arrays are encoded and written one at a time, bit for bit, so that large states need no copy; time and hvisph's
header are field data. A checksum (`hvisph.output.verified_hdf5`) ends the file as an XML comment.
"""

import base64
import json
import math
import os
import sys
from collections.abc import Callable, Sequence
from functools import partial
from html import escape
from pathlib import Path
from typing import BinaryIO

import numpy as np

from .atomic_write import read_errors, replacing, write_text
from .foreign import SI, Convention, snapshot_of_another_code
from .snapshot import INDICES, Snapshot, header_text, snapshot_from, to_vtk
from .verified_hdf5 import append_checksum, has_checksum, verify_checksum

HEADER = "hvisph_header"
TIME = "TimeValue"  # name of the time in ParaView
_VERTEX = 1
_PIECE = 8_192  # particles


def write_vtu(path: str | Path, snapshot: Snapshot) -> None:
    """Write a snapshot; raises `OutputError` where it cannot be written, and leaves an earlier file untouched."""
    dim, n = snapshot.dimensions, snapshot.count
    with replacing(path) as file:
        order = "LittleEndian" if sys.byteorder == "little" else "BigEndian"
        file_type = f'type="UnstructuredGrid" version="1.0" byte_order="{order}" header_type="UInt64"'
        file.write(f"<VTKFile {file_type}>\n".encode())
        file.write(f'<UnstructuredGrid>\n<Piece NumberOfPoints="{n}" NumberOfCells="{n}">\n<Points>\n'.encode())
        _write_array(file, "Points", snapshot.fields["position"], lambda values: to_vtk("position", values, dim))
        file.write(b"</Points>\n<Cells>\n")
        _write_array(file, "connectivity", np.arange(n))
        _write_array(file, "offsets", np.arange(1, n + 1))
        _write_array(file, "types", np.full(n, _VERTEX))
        file.write(b"</Cells>\n<PointData>\n")
        for name in snapshot.fields:  # one at a time
            if name != "position":
                _write_array(file, name, snapshot.fields[name], partial(to_vtk, name, dim=dim))
        for name in INDICES:
            _write_array(file, name, getattr(snapshot, name))
        file.write(b"</PointData>\n</Piece>\n<FieldData>\n")
        header = np.frombuffer(header_text(snapshot).encode("ascii"), dtype=np.uint8)
        for name, values in ((TIME, np.array([snapshot.time])), (HEADER, header)):
            _write_array(file, name, values, attributes=f'NumberOfTuples="{len(values)}"')
        file.write(b"</FieldData>\n</UnstructuredGrid>\n</VTKFile>\n")
        append_checksum(file)


def read_vtu(path: str | Path, convention: Convention = SI) -> Snapshot:
    """Read a snapshot from a VTU file: hvisph's own exactly, another code's by the names of its arrays.

    See `hvisph.output.foreign` for how the arrays of other codes are understood. Raises `OutputError` when the file is
    missing, truncated, damaged or not a VTU file of points.
    """
    import meshio

    with read_errors(path, "a VTU file"), Path(path).open("rb") as file:
        verified = has_checksum(file)
        if verified:
            verify_checksum(file)
        mesh = meshio.vtu.read(path)
        if HEADER not in mesh.field_data:
            return snapshot_of_another_code(mesh.points, mesh.point_data or {}, mesh.field_data, convention)
        convention.refuse_for_own_files()
        if not verified:
            verify_checksum(file)
        header = json.loads(np.asarray(mesh.field_data[HEADER], dtype=np.uint8).tobytes())
        return snapshot_from(header, dict(mesh.point_data) | {"position": mesh.points})


def write_pvd(path: str | Path, entries: Sequence[tuple[float, str]]) -> None:
    """Write the series of VTU files, which ParaView opens as one, atomically.

    `entries`: time [s] and file of each snapshot, the file relative to the folder of `path`.
    Raises `OutputError` when it cannot be written.
    """
    lines = []
    for time, file in entries:
        name = escape(str(file).replace(os.sep, "/"))
        lines.append(f'    <DataSet timestep="{float(time)!r}" group="" part="0" file="{name}"/>')
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
    body = "\n".join(["  <Collection>", *lines, "  </Collection>", "</VTKFile>"])
    write_text(path, head + body + "\n")


def _write_array(
    file: BinaryIO,
    name: str,
    values: np.ndarray,
    convert: Callable[[np.ndarray], np.ndarray] = np.ascontiguousarray,
    attributes: str = "",
) -> None:
    """Write an array in base 64 after its length, in pieces; `convert` converts rows."""
    none = convert(values[:0])
    vtk = {"f": "Float", "i": "Int", "u": "UInt"}[none.dtype.kind] + str(8 * none.dtype.itemsize)
    columns = f'NumberOfComponents="{none.shape[1]}"' if none.ndim == 2 else ""
    file.write(f'<DataArray type="{vtk}" Name="{escape(name)}" {columns} {attributes} format="binary">\n'.encode())
    row = none.dtype.itemsize * math.prod(none.shape[1:])
    pending = np.uint64(row * len(values)).tobytes()
    for begin in range(0, len(values), _PIECE):
        pending += convert(values[begin : begin + _PIECE]).tobytes()
        length = len(pending) // 3 * 3  # pieces of whole triplets of bytes join without padding
        file.write(base64.b64encode(pending[:length]))
        pending = pending[length:]
    file.write(base64.b64encode(pending) + b"\n</DataArray>\n")
