"""Tables of equations of state in HDF5: four datasets in SI.

`density` (n) [kg/m^3], `temperature` (m) [K], `pressure` (n, m) [Pa] and `energy` (n, m) [J/kg], at the top of the file
or together in a group.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hvisph.core.errors import CaseError

if TYPE_CHECKING:
    import h5py

NAMES = ("density", "temperature", "pressure", "energy")
SUFFIXES = (".h5", ".hdf5")
MOST = 20_000_000  # numbers of a dataset


def read_eos_table(path: Path) -> dict[str, np.ndarray]:
    """Return the four arrays of a table by name.

    Raises `CaseError` if there is no such file, it is no HDF5, or its datasets do not fit each other.
    """
    import h5py

    if not path.is_file():
        raise CaseError("there is no such file", file=str(path))
    try:
        with h5py.File(path, "r") as file:
            return _arrays(_holder(file, path), path)
    except (OSError, KeyError, ValueError, TypeError, RuntimeError):  # of what it holds nothing is repeated
        raise CaseError("cannot be read as a table of an equation of state in HDF5", file=str(path)) from None


def _holder(file: h5py.File, path: Path) -> h5py.Group:
    """Return the group that has all four datasets."""
    for place in (file, *(file[name] for name in file if hasattr(file[name], "keys"))):
        if set(NAMES) <= set(place.keys()):
            return place
    raise CaseError(f"holds no datasets {', '.join(NAMES)}", file=str(path))


def _arrays(place: h5py.Group, path: Path) -> dict[str, np.ndarray]:
    shapes = {name: tuple(place[name].shape) for name in NAMES}
    if any(np.prod(shape) > MOST for shape in shapes.values()):
        raise CaseError(f"has more than {MOST} numbers in a dataset", file=str(path))
    whole = (*shapes["density"], *shapes["temperature"])
    if len(whole) != 2 or shapes["pressure"] != whole or shapes["energy"] != whole:
        sizes = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise CaseError(f"its datasets do not fit: {sizes}; needed are (n), (m), (n, m) and (n, m)", file=str(path))
    return {name: np.asarray(place[name], dtype=float) for name in NAMES}
