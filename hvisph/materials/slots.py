"""Layout of a material's row: which number stands in which column.

The first slots mean the same for every material; three blocks after them belong to the
equation of state, the strength and the damage model, whose files name the slots they use.

Compiled loops hand over `(table, m)`. `parameters` reads the row into a tuple of scalars
once, before any branch, and the models take that tuple. An array that is alive across
branches costs numba atomic reference counts at each call, more than all the physics
(measured: 41 of 45 ns for a fluid); a tuple of scalars costs nothing, and the compiler
drops the numbers that are not used.
"""

from __future__ import annotations

from typing import ClassVar, Protocol

import numpy as np

from ..core.errors import CaseError
from ..core.jit import compiled

# Columns of `table` that every material has.
RHO0 = 0  # reference density [kg/m^3]
INVERSE_RHO0 = 1  # [m^3/kg]
SOUND_SPEED_SQUARED_FLOOR = 2  # [m^2/s^2]
SHEAR_MODULUS = 3  # [Pa]; 0 without strength
PRESSURE_MINIMUM = 4  # [Pa]; -inf where tension is not limited
ROOM_TEMPERATURE = 5  # [K]
INVERSE_HEAT_CAPACITY = 6  # [kg K/J]; 0 where no heat capacity is known
INVERSE_MELT_RANGE = 7  # 1/(T_melt - T_room) [1/K]; 0 where unknown

_COMMON, _BLOCK = 8, 6
EOS = tuple(range(_COMMON, _COMMON + _BLOCK))
STRENGTH = tuple(range(_COMMON + _BLOCK, _COMMON + 2 * _BLOCK))
DAMAGE = tuple(range(_COMMON + 2 * _BLOCK, _COMMON + 3 * _BLOCK))
SLOT_COUNT = _COMMON + 3 * _BLOCK

# Columns of `models`.
EOS_TAG = 0
STRENGTH_TAG = 1
DAMAGE_TAG = 2
MODEL_COUNT = 3

# The sound speed is held above a tenth of the ambient one: in deep tension some equations
# of state lose their stability (c^2 < 0), and a time step needs a number.
FLOOR_SHARE = 0.01


@compiled
def parameters(table, m):
    """Return row `m` (uint64) of the table as a tuple of scalars."""
    return (
        table[m, 0],
        table[m, 1],
        table[m, 2],
        table[m, 3],
        table[m, 4],
        table[m, 5],
        table[m, 6],
        table[m, 7],
        table[m, 8],
        table[m, 9],
        table[m, 10],
        table[m, 11],
        table[m, 12],
        table[m, 13],
        table[m, 14],
        table[m, 15],
        table[m, 16],
        table[m, 17],
        table[m, 18],
        table[m, 19],
        table[m, 20],
        table[m, 21],
        table[m, 22],
        table[m, 23],
        table[m, 24],
        table[m, 25],
    )


class Model(Protocol):
    """What an equation of state, a strength model and a damage model have in common."""

    name: ClassVar[str]
    tag: ClassVar[int]

    def pack(self, row: np.ndarray, density: float) -> None:
        """Write the parameters into the material's row of the table."""


class EquationOfState(Model, Protocol):
    """A model of the pressure, with the state that a body starts from."""

    @property
    def ambient_energy(self) -> float:
        """Specific internal energy of the material at rest [J/kg]."""

    def ambient_sound_speed(self, density: float) -> float:
        """Bulk sound speed at the reference density and the ambient energy [m/s]."""


def require_positive(model: object, *fields: str) -> None:
    """Raise `CaseError` unless the named fields of a parameter dataclass are finite and above zero."""
    for field in fields:
        value = getattr(model, field)
        if not 0.0 < value < np.inf:
            raise CaseError(f"{field} is {value!r}, but must be above zero", where=getattr(model, "name", ""))


def require_not_negative(model: object, *fields: str) -> None:
    """Raise `CaseError` unless the named fields of a parameter dataclass are finite and at least zero."""
    for field in fields:
        value = getattr(model, field)
        if not 0.0 <= value < np.inf:
            raise CaseError(f"{field} is {value!r}, but must not be below zero", where=getattr(model, "name", ""))
