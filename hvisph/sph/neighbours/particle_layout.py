"""Layouts of packed particle rows and of rows of rates.

A pair law declares its row as names with ranks. They determine the slots that its compiled loops use, and the signs
with which a row is mirrored at a symmetry plane.

A row of rates contains: acceleration (dim), rate of specific internal energy, largest |mu| of the pairs, velocity
gradient (dim^2); then, for laws that have them: rate of ln(rho) in addition to the trace, rate of the density
correction, heat of slip between bodies (a part of the energy rate); hoop strain rate (axisymmetric) or rate of the
torque residual per mass (axial); renormalised velocity gradient of the adjoint law (dim^2), for the next evaluation.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from hvisph.compiler.jit import CompiledFunction, bind
from hvisph.compiler.tensors import SIZE, put

# Components of each rank, as strings of axes; a symmetric tensor has its in-plane components only.
_AXES = "xyz"


def _components(rank: str, dim: int) -> list[str]:
    vector = list(_AXES[:dim])
    symmetric = ["xx"], ["xx", "yy", "xy"], ["xx", "yy", "zz", "xy", "xz", "yz"]
    match rank:
        case "scalar":
            return [""]
        case "radius":  # signed: of an image over the axis below zero
            return ["y"]
        case "vector":
            return vector
        case "axial":  # a mirror turns it as the product of two vectors of its plane
            return [[], ["xy"], ["yz", "zx", "xy"]][dim - 1]
        case "symmetric":
            return symmetric[dim - 1]
        case "gradient":
            return [a + b for a in vector for b in vector]
        case "symmetric_gradient":
            return [a + b for a in symmetric[dim - 1] for b in vector]
    raise ValueError(f"unknown rank {rank!r}")


# Powers of length in the units of fields, where those of velocity, density and others are 0.
_LENGTHS = {"x": 1, "h": 1, "ring": 1, "ahead_twice": 1, "gu_before": -1, "correction_decay": -1,
            "density_relaxation": -1, "turn_rate": -1}  # fmt: skip
_VOLUMES = ("v", "m", "inv_number_density")


def aligned_zeros(count: int, width: int) -> np.ndarray:
    """Return zeros (count, width) aligned to cache lines."""
    buffer = np.zeros(count * width + 7)
    start = -(buffer.ctypes.data // 8) % 8
    return buffer[start : start + count * width].reshape(count, width)


def select_fields(*fields: tuple[str, str] | bool) -> tuple[tuple[str, str], ...]:
    """Return the `("name", "rank")` of each wanted field."""
    return tuple(field for field in fields if not isinstance(field, bool))


@dataclass(frozen=True)
class RowLayout:
    """The slots of a packed row.

    `dim`: number of dimensions.
    `fields`: pairs of name and rank (``scalar``, ``radius``, ``vector``, ``axial``, ``symmetric``, ``gradient``,
    ``symmetric_gradient``); the first is the position.
    `computed`: likewise, fields that a pass computes for the next one, behind the others in sorted rows alone.
    """

    dim: int
    fields: tuple[tuple[str, str], ...]
    computed: tuple[tuple[str, str], ...] = ()

    def slots(self) -> dict[str, int]:
        """Return the slot of each field or rate by name."""
        return self._slots.copy()

    @cached_property
    def _slots(self) -> dict[str, int]:
        slots, offset = {}, 0
        for name, rank in (*self.fields, *self.computed):
            slots[name.upper()] = offset
            offset += len(_components(rank, self.dim))
        return slots

    def slots_of(self, names: tuple[str, ...]) -> np.ndarray:
        """Return the slots (k,) uint64 of all components of the fields among `names`."""
        owners = [name for name, rank in self.fields for _ in _components(rank, self.dim)]
        return np.array([slot for slot, name in enumerate(owners) if name in names], np.uint64)

    @cached_property
    def packed_width(self) -> int:
        """Number of slots packed by a particle."""
        return sum(len(_components(rank, self.dim)) for _, rank in self.fields)

    @cached_property
    def used_width(self) -> int:
        """Number of slots in use."""
        return self.packed_width + sum(len(_components(rank, self.dim)) for _, rank in self.computed)

    @cached_property
    def width(self) -> int:
        """Number of slots allocated: whole vectors of four."""
        return -(-self.used_width // 4) * 4

    def single(self) -> RowLayout:
        """Return the layout of sorted rows in single precision, with the rounding errors of position and velocity."""
        residuals = ("x_rest", "vector"), ("u_rest", "vector")
        return RowLayout(self.dim, self.fields, (*residuals, *self.computed))

    def single_units(self, length: float) -> np.ndarray:
        """Return the factors (packed_width,) of the packed slots for a unit of `length` [m]."""
        powers = _LENGTHS | dict.fromkeys(_VOLUMES, self.dim)
        return np.array(
            [length ** -powers.get(name, 0) for name, rank in self.fields for _ in _components(rank, self.dim)]
        )

    def mirror_signs(self, axis: int) -> np.ndarray:
        """Return the sign (width,) of each slot under reflection along `axis`."""
        return self._signs[axis]

    @cached_property
    def _signs(self) -> np.ndarray:
        names = [c for _, rank in (*self.fields, *self.computed) for c in _components(rank, self.dim)]
        signs = np.ones((self.dim, self.width))
        signs[:, : len(names)] = [[(-1.0) ** c.count(axis) for c in names] for axis in _AXES[: self.dim]]
        return signs


def width(dim: int) -> int:
    """Return the length of a row of rates, without a rate of ln(rho)."""
    return dim + 2 + dim * dim


@cache
def slots(dim: int) -> dict[str, int]:
    """Return the slot of each field or rate by name."""
    end = width(dim)
    return {"R_ACCELERATION": 0, "R_POWER": dim, "R_APPROACH": dim + 1, "R_GRADIENT": dim + 2, "R_DENSITY": end,
            "R_CORRECTION": end + 1, "R_SLIP": end + 2, "R_HOOP": end + 3, "R_SPIN": end + 3,
            "R_GRADIENT_BEFORE": end + 3 + SIZE["axial"][dim - 1]}  # fmt: skip


def single_units(layout: RowLayout, count: int, length: float) -> np.ndarray:
    """Return the factors (count,) that convert rates of rows with a unit of `length` [m] to SI."""
    index, units = slots(layout.dim), np.full(count, 1.0 / length)
    units[index["R_APPROACH"]] = 1.0
    if "RING" not in layout.slots():
        units[index["R_SPIN"] : index["R_GRADIENT_BEFORE"]] = 1.0
    return units


def _write(out, i, a, power, mu, l):
    """Write acceleration, power, largest |mu| and velocity gradient of particle `i`."""
    put(out, i, R_ACCELERATION, a)
    out[i, R_POWER] = power
    out[i, R_APPROACH] = mu
    put(out, i, R_GRADIENT, l)
    if SLIPS:  # for the law, or a contact beside it, to add to
        out[i, R_SLIP] = 0.0


def writer(dim: int, has_friction: bool) -> CompiledFunction:
    """Return the compiled function that writes the rates of a pair law in `dim` dimensions."""
    return bind(_write, {"SLIPS": int(has_friction)}, slots(dim))
