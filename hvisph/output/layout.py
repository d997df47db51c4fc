"""How fields look in files that ParaView reads: three-component vectors, VTK's order of tensors.

Vectors get zeros up to 3 components, gradients up to 9 (row-major). Symmetric tensors get 6 components
in VTK's order xx, yy, zz, xy, yz, xz, which is not the order inside hvisph (xx, yy, zz, xy, xz, yz).
Going there and back returns every number bit for bit.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from hvisph.core.fields import CATALOGUE, SYMMETRIC_LENGTH
from hvisph.output.snapshot import Snapshot

FORMAT_VERSION = 1
# Columns of VTK's symmetric tensor, as columns of hvisph's.
VTK_SYMMETRIC = (0, 1, 2, 3, 5, 4)
INDICES = ("body", "material", "id")


def to_vtk(name: str, values: np.ndarray, dim: int) -> np.ndarray:
    """Return field `name` in `dim` dimensions as ParaView expects it; unknown names stay as they are."""
    rank = _rank(name)
    if rank == "vector":
        return _padded(values, 3, range(dim))
    if rank == "symmetric":
        return _padded(values, 6, VTK_SYMMETRIC[: SYMMETRIC_LENGTH[dim]])
    if rank == "gradient":
        return _padded(values, 9, _gradient_columns(dim))
    return values


def from_vtk(name: str, values: np.ndarray, dim: int) -> np.ndarray:
    """Return what `to_vtk` was given."""
    rank = _rank(name)
    if rank == "vector":
        return np.ascontiguousarray(values[:, :dim])
    if rank == "symmetric":
        return np.ascontiguousarray(values[:, VTK_SYMMETRIC[: SYMMETRIC_LENGTH[dim]]])
    if rank == "gradient":
        return np.ascontiguousarray(values[:, _gradient_columns(dim)])
    return values


def header_text(snapshot: Snapshot) -> str:
    """Return everything of `snapshot` but its arrays, as JSON text."""
    header = {
        "format_version": FORMAT_VERSION,
        "time": float(snapshot.time),
        "step": int(snapshot.step),
        "dimensions": int(snapshot.dimensions),
        "bodies": list(snapshot.bodies),
        "materials": list(snapshot.materials),
        "fields": list(snapshot.fields),
        "metadata": snapshot.metadata,
    }
    return json.dumps(header, default=_plain, ensure_ascii=True)


def snapshot_from(header: dict[str, Any], arrays: dict[str, np.ndarray]) -> Snapshot:
    """Return the snapshot with this header and these arrays, named and laid out as in the file."""
    dim = int(header["dimensions"])
    fields = {name: from_vtk(name, arrays[name], dim) for name in header["fields"]}
    return Snapshot(
        time=float(header["time"]),
        step=int(header["step"]),
        dimensions=dim,
        fields=fields,
        body=arrays["body"],
        material=arrays["material"],
        id=arrays["id"],
        bodies=list(header["bodies"]),
        materials=list(header["materials"]),
        metadata=dict(header["metadata"]),
    )


def _rank(name: str) -> str:
    return CATALOGUE[name].rank if name in CATALOGUE else "scalar"


def _padded(values: np.ndarray, width: int, columns: Any) -> np.ndarray:
    out = np.zeros((len(values), width), dtype=values.dtype)
    out[:, list(columns)] = values
    return out


def _gradient_columns(dim: int) -> list[int]:
    return [3 * i + j for i in range(dim) for j in range(dim)]


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"a snapshot's metadata holds plain numbers and text, not {type(value).__name__}")
