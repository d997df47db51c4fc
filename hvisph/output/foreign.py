"""Snapshots from the VTU files of other codes: which of their arrays are which quantity.

Names are compared without case, blanks, dashes and underscores. Points are the positions; a coordinate
that is 0 throughout is no dimension. Numbers are taken as SI.

| quantity | names |
| --- | --- |
| velocity | velocity, vel, v (a vector), or vx vy vz, or u v w (scalars) |
| mass | mass, m |
| density | density, rho |
| internal energy | internal energy, specific internal energy, energy, e, u (a scalar without v and w) |
| smoothing length | smoothing length, h |
| pressure | pressure, p |
| sound speed | sound speed, cs, c |
| plastic strain | plastic strain, equivalent plastic strain, eps |
| von Mises stress | von mises stress, von mises, vonmises |
| temperature, damage | temperature, temp; damage, d |
| body | body, body id, mol, object, part, material, mat, type, the first of them that holds whole numbers |
| material | material, material id, mat, type |
| id | id, particle id, gid, global ids, tag |

Every other array is kept under the name it has.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hvisph.core.errors import OutputError
from hvisph.output.snapshot import Snapshot

SCALARS = {
    "mass": ("mass", "m"),
    "density": ("density", "rho"),
    "internal_energy": ("internalenergy", "specificinternalenergy", "energy", "e", "u"),
    "smoothing_length": ("smoothinglength", "h"),
    "pressure": ("pressure", "p"),
    "sound_speed": ("soundspeed", "cs", "c"),
    "plastic_strain": ("plasticstrain", "equivalentplasticstrain", "eps"),
    "von_mises_stress": ("vonmisesstress", "vonmises"),
    "temperature": ("temperature", "temp"),
    "damage": ("damage", "d"),
}
BODY = ("body", "bodyid", "mol", "object", "part", "material", "mat", "type")
MATERIAL = ("material", "materialid", "mat", "type")
ID = ("id", "particleid", "gid", "globalids", "tag")
VELOCITY = ("velocity", "vel", "v")
VELOCITY_COMPONENTS = (("vx", "vy", "vz"), ("u", "v", "w"))
TIME = ("timevalue", "time")


def snapshot_of_another_code(
    points: np.ndarray, point_data: Mapping[str, np.ndarray], field_data: Mapping[str, np.ndarray]
) -> Snapshot:
    """Return what can be understood of another code's points and arrays.

    Parameters
    ----------
    points
        Positions, shape (n, 2) or (n, 3).
    point_data
        Arrays with one row a point, by name.
    field_data
        Arrays of the file, by name; a time is looked for among them.

    Raises
    ------
    OutputError
        When there are no points.
    """
    n = len(points)
    if n == 0:
        raise OutputError("it holds no points")
    arrays = {_bare(name): (name, _column(values)) for name, values in point_data.items()}
    dim = _dimensions(points)
    fields = {"position": np.ascontiguousarray(points[:, :dim], dtype=float)}
    used = set()
    velocity, parts = _velocity(arrays, dim)
    if velocity is not None:
        fields["velocity"] = velocity
        used.update(parts)
    for name, aliases in SCALARS.items():
        key = next((k for k in aliases if k in arrays and k not in used and arrays[k][1].ndim == 1), None)
        if key is not None:
            fields[name] = arrays[key][1].astype(float)
            used.add(key)
    fields |= {name: values for key, (name, values) in arrays.items() if key not in used and name not in fields}
    body, bodies = _groups(arrays, BODY, n, "body")
    material, materials = _groups(arrays, MATERIAL, n, "material")
    number = _whole(arrays, ID)
    number = np.arange(n) if number is None or len(np.unique(number)) != n else number
    order = np.argsort(number, kind="stable")
    return Snapshot(
        time=_time(field_data),
        step=0,
        dimensions=dim,
        fields={name: values[order] for name, values in fields.items()},
        body=body[order],
        material=material[order],
        id=number[order],
        bodies=bodies,
        materials=materials,
    )


def _bare(name: str) -> str:
    return "".join(c for c in name.lower() if c not in " _-")


def _column(values: np.ndarray) -> np.ndarray:
    values = np.asarray(values)
    return values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values


def _dimensions(points: np.ndarray) -> int:
    used = [axis for axis in range(points.shape[1]) if points[:, axis].any()]
    return max(used, default=0) + 1


def _velocity(arrays: Mapping[str, tuple[str, np.ndarray]], dim: int) -> tuple[np.ndarray | None, list[str]]:
    for name in VELOCITY:
        if name in arrays and arrays[name][1].ndim == 2 and arrays[name][1].shape[1] >= dim:
            return np.ascontiguousarray(arrays[name][1][:, :dim], dtype=float), [name]
    for names in VELOCITY_COMPONENTS:
        # in 1D a lone `u` is as likely an energy, so the set must be there as a whole
        if all(name in arrays and arrays[name][1].ndim == 1 for name in names[: max(dim, 2)]):
            parts = [name for name in names if name in arrays]
            return np.stack([arrays[name][1].astype(float) for name in names[:dim]], axis=1), parts
    return None, []


def _whole(arrays: Mapping[str, tuple[str, np.ndarray]], names: tuple[str, ...]) -> np.ndarray | None:
    """Return the first array of `names` that holds whole numbers, as integers."""
    for name in names:
        if name not in arrays:
            continue
        values = arrays[name][1]
        if values.ndim == 1 and np.isfinite(values).all() and (values == np.round(values)).all():
            return values.astype(np.int64)
    return None


def _groups(
    arrays: Mapping[str, tuple[str, np.ndarray]], names: tuple[str, ...], n: int, word: str
) -> tuple[np.ndarray, list[str]]:
    """Return the index of each point's group, counted from 0 in the order of their numbers, and names."""
    values = _whole(arrays, names)
    if values is None:
        return np.zeros(n, dtype=np.int64), [f"{word} 0"]
    numbers, index = np.unique(values, return_inverse=True)
    return index.astype(np.int64), [f"{word} {number}" for number in numbers]


def _time(field_data: Mapping[str, np.ndarray]) -> float:
    times = [np.ravel(values) for name, values in field_data.items() if _bare(name) in TIME]
    return float(times[0][0]) if times and len(times[0]) else 0.0
