"""Points of other codes in VTP files (VTK's XML for PolyData), decoded as meshio decodes VTU."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hvisph.core.errors import OutputError

from .atomic_write import reason
from .foreign import snapshot_of_another_code
from .foreign_names import SI, Convention
from .snapshot import Snapshot


def is_vtp(path: str | Path) -> bool:
    """Whether an XML file says in its head that it holds PolyData."""
    with Path(path).open("rb") as file:
        head = file.read(4096)
    return b"PolyData" in head and b"UnstructuredGrid" not in head


def read_vtp(path: str | Path, convention: Convention = SI) -> Snapshot:
    """Read another code's points from a VTP file.

    Raises
    ------
    OutputError
        When the file is missing, truncated, damaged or without points.
    """
    try:
        points, data, told = _arrays(path)
        return snapshot_of_another_code(points, data, told, convention)
    except OutputError as error:
        raise OutputError(f"cannot read {path}: {error}") from error
    except OSError as error:
        raise OutputError(f"cannot read {path}: {reason(error)}") from error
    # a damaged file fails anywhere in the decoder: XML, base64, zlib, missing attributes, shapes
    except Exception as error:
        text = str(error) or type(error).__name__
        raise OutputError(f"cannot read {path}: it is truncated, damaged or not a VTP file ({text})") from error


def _arrays(path: str | Path) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return points (n, 3), arrays by name with one row a point, and the file's own arrays."""
    decoder, pieces, fields = _opened(path)
    points, data = [], []
    for piece in pieces:
        if int(piece.attrib["NumberOfPoints"]) == 0:
            continue
        place, own = piece.find("Points"), piece.find("PointData")
        points.append(np.asarray(decoder.read_data(place.find("DataArray"))).reshape(-1, 3))
        data.append({array.attrib["Name"]: decoder.read_data(array) for array in own.findall("DataArray")}
                    if own is not None else {})  # fmt: skip
    if not points:
        raise OutputError("it holds no points")
    shared = [name for name in data[0] if all(name in one for one in data)]
    told = {array.attrib["Name"]: decoder.read_data(array) for array in fields}
    return np.concatenate(points), {name: np.concatenate([one[name] for one in data]) for name in shared}, told


def _opened(path: str | Path) -> tuple[Any, list[Any], list[Any]]:
    """Return meshio's decoder of VTK's XML, the file's pieces, and the arrays of its field data."""
    from xml.etree import ElementTree

    from meshio.vtu import _vtu

    try:
        root = ElementTree.parse(path).getroot()  # noqa: S314 - expat bounds the growth of entities
    except ElementTree.ParseError:
        root = _vtu._parse_raw_binary(str(path))
    decoder = _vtu.VtuReader.__new__(_vtu.VtuReader)  # its constructor reads unstructured grids only
    decoder.compression = root.attrib.get("compressor")
    decoder.header_type = root.attrib.get("header_type", "UInt32")
    decoder.byte_order = root.attrib.get("byte_order")
    appended = root.find("AppendedData")
    decoder.appended_data = None if appended is None else (appended.text or "").strip().removeprefix("_")
    grid = root.find("PolyData")
    if grid is None:
        raise OutputError("it is XML of VTK, but holds no PolyData")
    return decoder, grid.findall("Piece"), [*grid.findall("FieldData/DataArray"), *root.findall("FieldData/DataArray")]
