"""Catalogue of state fields, the rows of `fields.csv`: name, rank, unit, meaning, value at the start.

Vectors have as many components as there are dimensions, axial vectors one in 2D and three in 3D, gradients the square
(row-major: xx, xy, xz, yx, ...). Symmetric tensors are stored in the order xx, yy, zz, xy, xz, yz, cut to 3 components
in 1D, 4 in 2D and 6 in 3D, so that the out-of-plane stress is always there.
"""

import csv
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SYMMETRIC_COMPONENTS = ("xx", "yy", "zz", "xy", "xz", "yz")
SYMMETRIC_LENGTH = {1: 3, 2: 4, 3: 6}
AXIAL_LENGTH = {1: 0, 2: 1, 3: 3}


@dataclass(frozen=True)
class Field:
    """State field of the particles."""

    name: str  # name at every interface: Python, files, history
    rank: str  # ``scalar``, ``vector``, ``axial``, ``symmetric``, ``gradient`` or ``quaternion``
    unit: str  # SI unit, as pint reads it
    meaning: str  # one line for the manual and for the attributes of files
    start: float = 0.0  # what it begins with in every particle, unless the case says something else

    def components(self, dim: int) -> int:
        """Return how many numbers a particle stores for this field in `dim` dimensions."""
        sizes = {
            "scalar": 1,
            "vector": dim,
            "axial": AXIAL_LENGTH[dim],
            "symmetric": SYMMETRIC_LENGTH[dim],
            "gradient": dim * dim,
            "quaternion": 4,
        }
        return sizes[self.rank]


def _catalogue() -> Iterator[Field]:
    with Path(__file__).with_suffix(".csv").open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            yield Field(row["name"], row["rank"], row["unit"], row["meaning"], float(row["start"] or 0.0))


CATALOGUE: dict[str, Field] = {field.name: field for field in _catalogue()}
_AXES = "xyz"
# Fields that no gauge records: they belong to a particle, not to a point in space.
_NOT_OF_GAUGES = ("displacement", "peak_pressure", "entropy", "failed", "torque_residual")


def component_names(name: str, dim: int) -> list[str]:
    """Return the columns of a field in `dim` dimensions: `velocity_x`, `velocity_y`; a component is its own."""
    field = CATALOGUE.get(name)
    if field is None or field.rank == "scalar":
        return [name]
    if field.rank == "vector":
        return [f"{name}_{axis}" for axis in _AXES[:dim]]
    if field.rank == "symmetric":
        return [f"{name}_{pair}" for pair in SYMMETRIC_COMPONENTS[: SYMMETRIC_LENGTH[dim]]]
    if field.rank == "quaternion":
        return [f"{name}_{part}" for part in "wxyz"]
    return [f"{name}_{a}{b}" for a in _AXES[:dim] for b in _AXES[:dim]]


def recordable(dim: int) -> list[str]:
    """Return the names of all fields, and components of fields, that a gauge can record in `dim` dimensions."""
    columns_of_all = []
    for name in CATALOGUE:
        if not name.startswith("previous_") and name not in _NOT_OF_GAUGES:
            columns = component_names(name, dim)
            columns_of_all += [name, *columns] if columns != [name] else columns
    return columns_of_all


def field_of(column: str) -> Field:
    """Return the field that a column of `component_names` belongs to."""
    return CATALOGUE[column if column in CATALOGUE else column.rpartition("_")[0]]


# History variables of particles: of the material models, in the order of `materials.stress_update.NO_HISTORY`; of a
# crack, in bodies with a fracture energy; of a material with axes.
HISTORY = ("history_variable", "flaw_strain", "flaw_exponent", "flaws", "strain_rate")
CRACK = ("onset_damage", "onset_flow_stress", "onset_tension", "band_width")
AXES = ("material_axes", "failure_modes")
# Fields of snapshots: of the state, derived from it, and of its history.
OF_STATE = ("position", "velocity", "mass", "density", "internal_energy", "smoothing_length", "deviator",
            "plastic_strain", "damage", "kernel_type", "thickness", *HISTORY, *CRACK, *AXES, "density_correction",
            "torque_residual", "viscosity_factor")  # fmt: skip
WRITTEN = (*OF_STATE, "pressure", "sound_speed", "von_mises_stress", "temperature", "displacement", "peak_pressure",
           "entropy", "failed")  # fmt: skip


class Derived(Mapping[str, np.ndarray]):
    """Mapping of arrays, each computed on access by `make` from its name."""

    def __init__(self, names: Iterable[str], make: Callable[[str], np.ndarray]):
        self._names, self._make = dict.fromkeys(names), make

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._names:
            raise KeyError(name)
        return self._make(name)

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def transform_arrays(
    arrays: Mapping[str, np.ndarray],
    change: Callable[[str, np.ndarray], np.ndarray],
    names: Iterable[str] | None = None,
) -> Mapping[str, np.ndarray]:
    """Return the arrays of some names, or all, as `change(name, array)` makes them.

    They are made at once, or on access where `arrays` are `Derived`. Raises `KeyError` for an unknown name.
    """
    selected = list(arrays if names is None else names)
    for name in selected:
        if name not in arrays:
            raise KeyError(name)
    if isinstance(arrays, Derived):
        return Derived(selected, lambda name: change(name, arrays[name]))
    return {name: change(name, arrays[name]) for name in selected}
