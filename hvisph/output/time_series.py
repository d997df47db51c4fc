"""All snapshots of a run as one VTKHDF file that ParaView opens as a series in time.

It contains no particles: its arrays are virtual ones, which concatenate those of the snapshots by relative paths. It is
therefore small, and the run's folder can be moved.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from hvisph.core.errors import OutputError

from . import file_names
from .atomic_write import write_errors
from .hdf5 import CONSTANTS, COUNTS, mark_vtk, names_in, write_labels
from .verified_hdf5 import LABELS, reading

TIME = "FieldData/TimeValue"


@dataclass(frozen=True)
class _Layout:
    """Layout of a snapshot's file: shapes, types and files of its arrays, time, names."""

    path: Path
    arrays: dict[str, tuple[tuple[int, ...], np.dtype, str]]
    time: float
    labels: tuple[list[str], list[str]]


def write_time_series(folder: str | os.PathLike[str]) -> None:
    """Write the series of the numbered snapshots in a run's folder, atomically.

    A snapshot that cannot be read is left out. Without snapshots an existing series is removed. Raises
    `OutputError` when the file cannot be written.
    """
    home = Path(folder)
    target = home / file_names.TIME_SERIES
    partial = target.with_name(target.name + file_names.PARTIAL)
    layouts = _layouts(home / file_names.SNAPSHOTS)
    with write_errors(target):
        if not layouts:
            target.unlink(missing_ok=True)
            return
        with h5py.File(partial, "w") as h5:
            _write(h5, layouts)
        os.replace(partial, target)


def _layouts(place: Path) -> list[_Layout]:
    files = [
        path
        for path in place.glob(f"*{file_names.SNAPSHOT_ENDING}")
        if file_names.is_own(path) and file_names.is_plain(path)
    ]
    layouts = []
    for path in sorted((path for path in files if path.stem.isdecimal()), key=lambda path: int(path.stem)):
        try:
            with reading(path, "a snapshot", verified=False) as h5:
                layouts.append(_layout(path, h5))
        except OutputError:
            continue
    for layout in layouts:  # constants may be stored in the first alone
        for name in (f"PointData/{name}" for name in CONSTANTS):
            first = layouts[0].arrays.get(name)
            if first is not None and name not in layout.arrays and layout.arrays["Points"][0][0] == first[0][0]:
                layout.arrays[name] = first
    return layouts


def _layout(path: Path, h5: h5py.File) -> _Layout:
    root = h5["VTKHDF"]
    names = ("Points", "Connectivity", "Offsets", "Types", TIME, *(f"PointData/{name}" for name in root["PointData"]))
    arrays = {name: (root[name].shape, root[name].dtype, path.name) for name in names}
    return _Layout(path, arrays, float(root[TIME][0]), names_in(h5))


def _write(h5: h5py.File, layouts: Sequence[_Layout]) -> None:
    root, steps = mark_vtk(h5), len(layouts)
    sizes = np.array([layout.arrays["Points"][0][0] for layout in layouts], np.int64)
    begins = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64)
    for name in COUNTS:
        root[name] = sizes
    shared = [name for name in layouts[0].arrays if all(name in layout.arrays for layout in layouts)]
    for name in shared:
        _concatenate(root, name, layouts)
    write_labels(root, *layouts[0].labels)
    group = root.create_group("Steps")
    group.attrs["NSteps"] = steps
    group["Values"] = np.array([layout.time for layout in layouts])
    group["PartOffsets"], group["NumberOfParts"] = np.arange(steps), np.ones(steps, np.int64)
    group["PointOffsets"] = begins
    group["CellOffsets"], group["ConnectivityIdOffsets"] = begins.reshape(-1, 1), begins.reshape(-1, 1)
    for name in shared:
        if name.startswith("PointData/"):
            group[f"PointDataOffsets/{name.removeprefix('PointData/')}"] = begins
    for name, offsets, size in (
        (TIME, np.arange(steps), 1),
        *(
            (f"FieldData/{label}", np.zeros(steps, np.int64), len(texts))
            for label, texts in zip(LABELS, layouts[0].labels, strict=True)
        ),
    ):
        field = name.removeprefix("FieldData/")
        group[f"FieldDataOffsets/{field}"] = offsets
        group[f"FieldDataSizes/{field}"] = np.array([[1, size]] * steps)


def _concatenate(root: h5py.Group, name: str, layouts: Sequence[_Layout]) -> None:
    """Create the array that concatenates those of all snapshots."""
    (_, *columns), form, _ = layouts[0].arrays[name]
    total = sum(layout.arrays[name][0][0] for layout in layouts)
    virtual = h5py.VirtualLayout((total, *columns), form)
    at = 0
    for layout in layouts:
        shape, dtype, file = layout.arrays[name]
        source = h5py.VirtualSource(f"{file_names.SNAPSHOTS}/{file}", f"VTKHDF/{name}", shape, dtype)
        virtual[at : at + shape[0]] = source
        at += shape[0]
    root.create_virtual_dataset(name, virtual)
