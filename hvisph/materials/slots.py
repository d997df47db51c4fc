"""Column layout of a material's row.

The first slots mean the same for every material; three blocks after them belong to the
equation of state, the strength and the damage model, whose files name the slots they use.

Compiled loops hand over `(table, m)`. `parameters` reads the row into a tuple of scalars
once, before any branch, and the models take that tuple. An array that is alive across
branches costs numba atomic reference counts at each call, more than all the physics
(measured: 41 of 45 ns for a fluid); a tuple of scalars costs nothing, and the compiler
drops the numbers that are not used.
"""

import sys
from inspect import get_annotations
from typing import ClassVar, Protocol, get_origin

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.vector.api import row_address

# Columns of `table` that every material has.
RHO0 = 0  # reference density [kg/m^3]
INVERSE_RHO0 = 1  # [m^3/kg]
SOUND_SPEED_SQUARED_FLOOR = 2  # [m^2/s^2]
SHEAR_MODULUS = 3  # [Pa]; 0 without strength
PRESSURE_MINIMUM = 4  # [Pa]; -inf where tension is not limited
ROOM_TEMPERATURE = 5  # [K]
INVERSE_HEAT_CAPACITY = 6  # [kg K/J]; 0 where no heat capacity is known
INVERSE_MELT_RANGE = 7  # 1/(T_melt - T_room) [1/K]; 0 where unknown
TOTAL_ENERGY = 8  # above 0: temperature from the whole energy
DISTENSION = 9  # initial distension alpha0 of porous material [-]; 1 where it is solid
ELASTIC_PRESSURE = 10  # p_e, where pores begin to crush [Pa]
SOLID_PRESSURE = 11  # p_s, where they are gone [Pa]

MELT_LAW = 12  # 0 constant, 1 Lindemann, 2 Simon
MELT_TEMPERATURE = 13  # at no pressure [K]; infinite where unknown
MELT_FIRST = 14  # Lindemann: Gamma0; Simon: 1/a [1/Pa]
MELT_SECOND = 15  # Lindemann: a; Simon: 1/c
FAILED_FRICTION = 16  # of failed material [-]; 0 where it flows, KEEPS_STRESS where failing takes nothing
FAILS_IN_TENSION = 17  # above 0: material fails for good at the pressure cut-off
RATE_WEIGHT = 18  # share of a step's strain rate in the smoothed one; 0 where the rate is the step's own

HEAT_START = 19  # heat at which the table of the heat capacity begins [J/kg], see `isentrope`
HEAT_PER = 20  # its points per J/kg; 0 where the heat capacity is constant
SURE_ENERGY = 21  # energy below which a Johnson-Cook metal is cold enough, at any density, to bear [J/kg]
SURE_STRESS = 22  # this, at any rate and strain [Pa]

SPALL_INVERSE = 23  # see `damage.pressure_cutoff`: 1 over the least tension that does harm [1/Pa]
SPALL_POWER = 24  # 1/m - 1
SPALL_GROWTH = 25  # rate of damage at that tension [1/s]; 0 where one spall strength holds for all rates
MOLTEN_ENERGY = 26  # energy from which material in tension has melted, and fails [J/kg]; infinite where unknown

FRACTURE_COMPLIANCE = 27  # 1/(2 G_f) [m^2/J], see `damage.fracture_energy`; 0 where failure takes no energy
FITTED_LENGTH = 28  # L_0, width at which the strain to failure was fitted [m]; 0 where it holds for any
FRACTURE_MODULUS = 29  # E' = K + 4 G/3 at rest [Pa]

_COMMON = 30
_EOS, _STRENGTH, _DAMAGE = 12, 14, 10  # columns of each model's block
EOS = tuple(range(_COMMON, _COMMON + _EOS))
STRENGTH = tuple(range(EOS[-1] + 1, EOS[-1] + 1 + _STRENGTH))
DAMAGE = tuple(range(STRENGTH[-1] + 1, STRENGTH[-1] + 1 + _DAMAGE))
SLOT_COUNT = DAMAGE[-1] + 1

# Behind the slots a row goes on with the isentrope of the material, then the grid of a tabulated equation of
# state: read by the address of the row, which is what the tuple of `parameters` ends with.
ADDRESS = SLOT_COUNT
CURVE = SLOT_COUNT

KEEPS_STRESS = -1.0  # in FAILED_FRICTION

# Columns of `models`.
EOS_TAG = 0
STRENGTH_TAG = 1
DAMAGE_TAG = 2
MODEL_COUNT = 3

# The sound speed is held above a tenth of the ambient one: in deep tension some equations
# of state lose their stability (c^2 < 0), and a time step needs a number.
FLOOR_SHARE = 0.01


# Slots of row `m` (uint64) of the table as a tuple of scalars, and last the row's address.
_TEXT = "def parameters(table, m):\n    return ({}, row_address(table, m))"
exec(_TEXT.format(", ".join(f"table[m, {slot}]" for slot in range(SLOT_COUNT))), globals())  # noqa: S102 text of ours
parameters = inline(globals()["parameters"])


def values(row: np.ndarray) -> tuple[float, ...]:
    """Return the result of `parameters` for a whole row of the table, which must outlive it, in plain Python."""
    return (*row[:SLOT_COUNT].tolist(), row_address(row[None], 0))


class Parameters:
    """Base of the parameters of a model, a dataclass whose fields the case has checked.

    `converted`: names of fields that have no slot of their own: `pack` of the model writes what follows from them.
    A class with any other field that has no slot raises `TypeError` when it is defined.
    """

    name: ClassVar[str]
    converted: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls) -> None:
        slots = cls._slots()
        for name, kind in ((n, k) for base in cls.__mro__ for n, k in get_annotations(base).items()):
            if get_origin(kind) is not ClassVar and name not in slots and name not in cls.converted:
                raise TypeError(
                    f"{cls.__name__}.{name} would not be packed: no slot {name.upper()} in {cls.__module__}; "
                    "name a slot so, or pack the field in `pack` and name it in `converted`"
                )

    @classmethod
    def _slots(cls) -> dict[str, int]:
        """Return the slots in sight of the model's module, by the names of fields."""
        known = globals() | vars(sys.modules[cls.__module__])
        return {name.lower(): slot for name, slot in known.items() if name.isupper() and isinstance(slot, int)}

    def pack(self, row: np.ndarray, density: float) -> None:
        """Write each field into the slot of its name, here or in the model's module: `yield_stress` in YIELD_STRESS."""
        slots = self._slots()
        for name in self.__dataclass_fields__:  # type: ignore[attr-defined]
            if name in slots:
                row[slots[name]] = getattr(self, name)


class Model(Protocol):
    """Interface of equations of state, strength models and damage models."""

    name: ClassVar[str]
    tag: ClassVar[int]

    # write the parameters into the material's row of the table
    def pack(self, row: np.ndarray, density: float) -> None: ...


class EquationOfState(Model, Protocol):
    """A model of the pressure, with the state that a body starts from."""

    @property
    def ambient_energy(self) -> float: ...  # specific internal energy of the material at rest [J/kg]
    # bulk sound speed at the reference density and the ambient energy [m/s]
    def ambient_sound_speed(self, density: float) -> float: ...
