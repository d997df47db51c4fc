"""Snapshots as VTU files: an unstructured grid of vertices, through meshio, and the series that lists them.

meshio writes the points and their data; time and hvisph's header, which meshio does not write, are added
as field data, numbers bit for bit. A seal (`hvisph.output.seal`) ends the file as an XML comment.
"""

from __future__ import annotations

import base64
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO
from xml.sax.saxutils import quoteattr

import numpy as np

from hvisph.core.errors import OutputError
from hvisph.output import layout
from hvisph.output.atomic import reason, replacing, write_text
from hvisph.output.foreign import snapshot_of_another_code
from hvisph.output.foreign_names import SI, Convention
from hvisph.output.seal import append_seal, has_seal, verify_seal
from hvisph.output.snapshot import Snapshot

HEADER = "hvisph_header"
TIME = "TimeValue"  # the name under which ParaView looks for the time
_TAIL = b"</UnstructuredGrid>\n</VTKFile>\n"


def write_vtu(path: str | Path, snapshot: Snapshot) -> None:
    """Write `snapshot` to `path`, complete or not at all.

    Raises
    ------
    OutputError
        When it cannot be written; an earlier file of that name is then untouched.
    """
    import meshio

    dim, n = snapshot.dimensions, snapshot.count
    data = {k: layout.to_vtk(k, v, dim) for k, v in snapshot.fields.items() if k != "position"}
    data |= {name: getattr(snapshot, name) for name in layout.INDICES}
    points = layout.to_vtk("position", snapshot.fields["position"], dim)
    mesh = meshio.Mesh(points, [("vertex", np.arange(n).reshape(n, 1))], point_data=data)
    with replacing(path) as file:
        # meshio closes what it opens, so it gets a handle of its own; zlib would cost ten times the time
        meshio.vtu.write(os.dup(file.fileno()), mesh, compression=None)
        _insert_field_data(file, snapshot)
        append_seal(file)


def read_vtu(path: str | Path, convention: Convention = SI) -> Snapshot:
    """Read a snapshot from a VTU file, hvisph's own exactly, another code's as far as names tell.

    See `hvisph.output.foreign` for how the arrays of other codes are understood.

    Raises
    ------
    OutputError
        When the file is missing, truncated, damaged or not a VTU file of points.
    """
    import meshio

    try:
        with Path(path).open("rb") as file:
            sealed = has_seal(file)
            if sealed:
                verify_seal(file)
            mesh = _parsed(path, meshio)
            if HEADER not in mesh.field_data:
                return snapshot_of_another_code(mesh.points, mesh.point_data or {}, mesh.field_data, convention)
            convention.refuse_own()
            if not sealed:
                verify_seal(file)
        header = json.loads(np.asarray(mesh.field_data[HEADER], dtype=np.uint8).tobytes())
        arrays = dict(mesh.point_data) | {"position": mesh.points}
        return layout.snapshot_from(header, arrays)
    except OutputError as error:
        raise OutputError(f"cannot read {path}: {error}") from error
    except OSError as error:
        raise OutputError(f"cannot read {path}: {reason(error)}") from error
    except (KeyError, ValueError, TypeError) as error:
        raise OutputError(f"cannot read {path}: it is not a snapshot of hvisph ({error})") from error


def write_pvd(path: str | Path, entries: Sequence[tuple[float, str]]) -> None:
    """Write the series of VTU files that ParaView opens as one, beside and renamed.

    Parameters
    ----------
    path
        The `.pvd` file.
    entries
        Time [s] and file of each snapshot, the file relative to the folder of `path`.

    Raises
    ------
    OutputError
        When it cannot be written.
    """
    lines = []
    for time, file in entries:
        name = quoteattr(str(file).replace(os.sep, "/"))
        lines.append(f'    <DataSet timestep="{float(time)!r}" group="" part="0" file={name}/>')
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
    body = "\n".join(["  <Collection>", *lines, "  </Collection>", "</VTKFile>"])
    write_text(path, head + body + "\n")


def _parsed(path: str | Path, meshio: Any) -> Any:
    try:
        return meshio.vtu.read(path)
    except OSError:
        raise
    # a damaged file fails anywhere in meshio: XML, base64, missing attributes, shapes, plain asserts
    except Exception as error:
        text = str(error) or type(error).__name__
        raise OutputError(f"it is truncated, damaged or not a VTU file ({text})") from error


def _insert_field_data(file: BinaryIO, snapshot: Snapshot) -> None:
    """Put time and header before the closing tags that meshio wrote."""
    file.seek(-len(_TAIL), os.SEEK_END)
    if file.read() != _TAIL:
        raise OutputError("this version of meshio ends VTU files in a way that hvisph does not know")
    file.seek(-len(_TAIL), os.SEEK_END)
    header = np.frombuffer(layout.header_text(snapshot).encode("ascii"), dtype=np.uint8)
    file.write(b"<FieldData>\n")
    file.write(_data_array(TIME, "Float64", np.array([snapshot.time])))
    file.write(_data_array(HEADER, "UInt8", header))
    file.write(b"</FieldData>\n" + _TAIL)


def _data_array(name: str, kind: str, values: np.ndarray) -> bytes:
    content = np.uint32(values.nbytes).tobytes() + values.tobytes()
    head = f'<DataArray type="{kind}" Name="{name}" NumberOfTuples="{len(values)}" format="binary">\n'
    return head.encode() + base64.b64encode(content) + b"\n</DataArray>\n"
