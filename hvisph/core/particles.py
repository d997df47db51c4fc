"""Particle state: one packed array with named views."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np

from .catalogues import Kinematics, unstrained_kinematics
from .fields import CATALOGUE

_OF_MOTION = ("position", "velocity", "mass", "density", "internal_energy", "smoothing_length")
BASE_FIELDS = (*_OF_MOTION, "deviator", "plastic_strain", "damage")
# Columns of `tags`.
ID, BODY, MATERIAL, FLAGS = 0, 1, 2, 3
# Bits of the column FLAGS.
CLAMPED = 1
RETIRED = 2
SLAB = 8192  # rows that are copied at once


class Particles:
    """All particles of a run.

    `extra`: names of the fields that a formulation needs beside `BASE_FIELDS`.
    `kinematics`: assumption for the dimensions that are not computed; no strain unless given.
    `data`: float array (count, width), a row a particle; fields as laid out in `offsets`.
    `tags`: unsigned integers (count, 4): permanent number, body, material, flags.
    `offsets`: first column of each field.
    """

    def __init__(self, dim: int, count: int, extra: Sequence[str] = (), kinematics: Kinematics | None = None):
        self.dim, self.extra = dim, tuple(extra)
        self.kinematics = kinematics or unstrained_kinematics(dim)
        self.names = (*BASE_FIELDS, *self.extra, *self.kinematics.fields)
        self.offsets: dict[str, int] = {}
        width = 0
        for name in self.names:
            self.offsets[name] = width
            width += CATALOGUE[name].components(dim)
        self.data = np.zeros((count, width))
        self.tags = np.zeros((count, 4), np.uint32)
        self.begin(slice(None))

    def begin(self, rows: np.ndarray | slice) -> None:
        """Initialize all fields of the particles `rows` from the catalogue."""
        for name in self.names:
            self[name][rows] = CATALOGUE[name].start

    @property
    def count(self) -> int:
        """Number of particles."""
        return len(self.data)

    def like(self, count: int) -> "Particles":
        """Return `count` particles with the fields of these, as they begin."""
        return Particles(self.dim, count, self.extra, self.kinematics)

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the view of a field: (count,) for scalars, (count, components) for others."""
        field, start = CATALOGUE[name], self.offsets[name]
        if field.rank == "scalar":
            return self.data[:, start]
        return self.data[:, start : start + field.components(self.dim)]

    def __setitem__(self, name: str, value: np.ndarray | float) -> None:
        self[name][...] = value

    @property
    def id(self) -> np.ndarray:
        """Permanent numbers (count,)."""
        return self.tags[:, ID]

    def numbers(self) -> np.ndarray:
        """Return a copy of the permanent numbers (count,), uint64."""
        return self.tags[:, ID].astype(np.uint64)

    @property
    def body(self) -> np.ndarray:
        """Index of each particle's body (count,)."""
        return self.tags[:, BODY]

    @property
    def material(self) -> np.ndarray:
        """Index of each particle's material (count,)."""
        return self.tags[:, MATERIAL]

    @property
    def has_previous(self) -> bool:
        """Whether the integrator carries the rates of the step before."""
        return "previous_velocity" in self.offsets

    def bindings(self) -> dict[str, int]:
        """Return the columns of all fields as constants for compiled loops, such as ``S_VELOCITY``."""
        return {f"S_{name.upper()}": start for name, start in self.offsets.items()}

    def permute(self, order: np.ndarray, buffer: np.ndarray | None = None) -> None:
        """Put the particles into a new order, in place: row k becomes the former row order[k]; see `reorder`."""
        for values in (self.data, self.tags):
            reorder(values, order, buffer)


def reorder(values: np.ndarray, order: np.ndarray, buffer: np.ndarray | None = None) -> None:
    """Reorder rows (n, ...) in place: row k becomes the former row order[k]; `buffer` as for `take_rows`."""
    values[...] = take_rows(values, order, buffer)


def take_rows(values: np.ndarray, order: np.ndarray, buffer: np.ndarray | None = None) -> np.ndarray:
    """Return row order[k] of `values` (n, ...) as row k, in a contiguous `buffer` that is large enough or anew."""
    copy = _in_buffer((len(order), *values.shape[1:]), values.dtype, buffer)
    for first in range(0, len(order), SLAB):  # `take` copies the whole unless both sides are contiguous
        copy[first : first + SLAB] = values[order[first : first + SLAB]]
    return copy


def copy_rows(values: np.ndarray, buffer: np.ndarray | None) -> np.ndarray:
    """Return a copy, in `buffer` as for `take_rows`."""
    copy = _in_buffer(values.shape, values.dtype, buffer)
    copy[...] = values
    return copy


def _in_buffer(shape: tuple[int, ...], dtype: np.dtype, buffer: np.ndarray | None) -> np.ndarray:
    size, free = prod(shape), (np.empty(0) if buffer is None else buffer).view(dtype)
    if free.ndim == 2:
        columns = free[: shape[0], : prod(shape[1:])]
        fits = columns.shape == (shape[0], prod(shape[1:]))
        return columns.reshape(shape, copy=False) if fits else np.empty(shape, dtype)
    return free[:size].reshape(shape) if free.size >= size else np.empty(shape, dtype)


@dataclass(frozen=True)
class Ordered:
    """Rows `values[order]` of an array, as numbers of the type `kind` if given, taken where they are asked for."""

    values: np.ndarray
    order: np.ndarray
    kind: Any = None

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the whole."""
        return len(self.order), *self.values.shape[1:]

    @property
    def dtype(self) -> np.dtype:
        """Type of its numbers."""
        return np.dtype(self.kind or self.values.dtype)

    def __len__(self) -> int:
        return len(self.order)

    def __getitem__(self, rows: slice | np.ndarray) -> np.ndarray:
        return np.asarray(self.values[self.order[rows]], self.dtype)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return self[:].astype(dtype or self.dtype, copy=False)

    def astype(self, kind: Any) -> np.ndarray:
        """Return all rows as numbers of another type."""
        return self[:].astype(kind)
