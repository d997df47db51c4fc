"""Snapshots from the files of other codes: which of their arrays are which quantity.

Points are the positions; a coordinate that is 0 throughout is no dimension. Names and units:
`hvisph.output.foreign_names`. Every array that is none of the quantities known there is kept under the name it has.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hvisph.core.errors import OutputError, suggest_nearest
from hvisph.core.text import harmless

from .foreign_names import BODY, ID, MATERIAL, SCALARS, SI, VELOCITY, Convention, bare
from .snapshot import Snapshot

VELOCITY_COMPONENTS = (("vx", "vy", "vz"), ("u", "v", "w"))
TIME = ("timevalue", "time")


def snapshot_of_another_code(
    points: np.ndarray,
    point_data: Mapping[str, np.ndarray],
    field_data: Mapping[str, np.ndarray],
    convention: Convention = SI,
    step: int = 0,
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
    convention
        Names and units of the file.
    step
        Number of steps done; 0 where the file does not tell.

    Raises
    ------
    OutputError
        When there are no points, or no array has a name that was given.
    """
    n = len(points)
    if n == 0:
        raise OutputError("it holds no points")
    arrays = {bare(name): (name, _column(values)) for name, values in point_data.items()}
    _refuse_missing(convention, arrays, list(point_data))
    dim = _dimensions(points)
    fields = {"position": np.ascontiguousarray(points[:, :dim], dtype=float)}
    used = set()
    velocity, parts = _velocity(arrays, dim, convention.aliases("velocity", VELOCITY))
    if velocity is not None:
        fields["velocity"] = velocity
        used.update(parts)
    for name, aliases in SCALARS.items():
        known = convention.aliases(name, aliases)
        key = next((k for k in known if k in arrays and k not in used and arrays[k][1].ndim == 1), None)
        if key is not None:
            fields[name] = arrays[key][1].astype(float)
            used.add(key)
    fields |= {name: values for key, (name, values) in arrays.items() if key not in used and name not in fields}
    fields = {name: values if convention.factor(name) == 1.0 else values * convention.factor(name)
              for name, values in fields.items()}  # fmt: skip
    body, bodies = _groups(arrays, convention.aliases("body", BODY), n, "body")
    material, materials = _groups(arrays, convention.aliases("material", MATERIAL), n, "material")
    number = _whole(arrays, convention.aliases("id", ID))
    number = np.arange(n) if number is None or len(np.unique(number)) != n else number
    order = np.argsort(number, kind="stable")
    return Snapshot(
        time=_time(field_data) * convention.units[2],
        step=step,
        dimensions=dim,
        fields={name: values[order] for name, values in fields.items()},
        body=body[order],
        material=material[order],
        id=number[order],
        bodies=bodies,
        materials=materials,
    )


def _column(values: np.ndarray) -> np.ndarray:
    values = np.asarray(values)
    return values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values


def _dimensions(points: np.ndarray) -> int:
    used = [axis for axis in range(points.shape[1]) if points[:, axis].any()]
    return max(used, default=0) + 1


def _refuse_missing(convention: Convention, arrays: Mapping[str, object], there: list[str]) -> None:
    for quantity, name in convention.names.items():
        if bare(name) not in arrays:
            raise OutputError(f"it has no array '{name}' for the {quantity}{harmless(suggest_nearest(name, there))}")


def _velocity(
    arrays: Mapping[str, tuple[str, np.ndarray]], dim: int, names: tuple[str, ...]
) -> tuple[np.ndarray | None, list[str]]:
    for name in names:
        if name in arrays and arrays[name][1].ndim == 2 and arrays[name][1].shape[1] >= dim:
            return np.ascontiguousarray(arrays[name][1][:, :dim], dtype=float), [name]
    for parts in VELOCITY_COMPONENTS:
        # in 1D a lone `u` is as likely an energy, so the set must be there as a whole
        if all(name in arrays and arrays[name][1].ndim == 1 for name in parts[: max(dim, 2)]):
            columns = [arrays[name][1].astype(float) for name in parts[:dim]]
            return np.stack(columns, axis=1), [name for name in parts if name in arrays]
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
    times = [np.ravel(values) for name, values in field_data.items() if bare(name) in TIME]
    return float(times[0][0]) if times and len(times[0]) else 0.0
