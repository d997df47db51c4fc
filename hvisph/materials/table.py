"""Materials as objects, and their packing into the arrays that compiled loops read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import sqrt

import numpy as np

from ..core.errors import CaseError
from . import slots
from .damage import JohnsonCookDamage, NoDamage
from .eos import MODULES
from .slots import EquationOfState, Model
from .strength import JohnsonCook, NoStrength

ROOM_TEMPERATURE = 300.0  # [K], where a material does not say


@dataclass(frozen=True)
class Material:
    """What a body is made of.

    Parameters
    ----------
    name
        Name for messages.
    density
        Reference density rho0 [kg/m^3].
    eos, strength, damage
        Parameter objects of the models.
    """

    name: str
    density: float  # [kg/m^3]
    eos: EquationOfState
    strength: Model = field(default_factory=NoStrength)
    damage: Model = field(default_factory=NoDamage)

    def __post_init__(self) -> None:
        slots.require_positive(self, "density")
        if isinstance(self.damage, JohnsonCookDamage):
            if isinstance(self.strength, NoStrength):
                raise CaseError("damage grows with plastic strain, but the material has no strength", where=self.name)
            if self.damage.d5 != 0.0 and not isinstance(self.strength, JohnsonCook):
                raise CaseError("d5 needs a temperature, which only johnson_cook strength gives", where=self.name)

    @property
    def shear_modulus(self) -> float:
        """G [Pa], zero without strength."""
        return float(getattr(self.strength, "shear_modulus", 0.0))

    @property
    def bulk_sound_speed(self) -> float:
        """Bulk sound speed at rest [m/s]."""
        return self.eos.ambient_sound_speed(self.density)

    @property
    def longitudinal_sound_speed(self) -> float:
        """Speed of longitudinal elastic waves at rest, sqrt(c^2 + 4G/(3 rho0)) [m/s]."""
        return sqrt(self.bulk_sound_speed**2 + 4.0 * self.shear_modulus / (3.0 * self.density))

    def row(self) -> np.ndarray:
        """Return the material's row of the table."""
        row = np.zeros(slots.SLOT_COUNT)
        row[slots.RHO0] = self.density
        row[slots.INVERSE_RHO0] = 1.0 / self.density
        row[slots.SOUND_SPEED_SQUARED_FLOOR] = slots.FLOOR_SHARE * self.bulk_sound_speed**2
        row[slots.PRESSURE_MINIMUM] = -np.inf
        row[slots.ROOM_TEMPERATURE] = ROOM_TEMPERATURE
        for model in (self.eos, self.strength, self.damage):
            model.pack(row, self.density)
        return row

    def pressure_function(self) -> Callable[[float, float], float]:
        """Return p(rho, e) of the equation of state in plain Python: nothing is compiled."""
        row, function = tuple(self.row().tolist()), MODULES[self.eos.name].pressure.py_func
        return lambda rho, e: function(rho, e, row)

    def pressure(self, rho: float, e: float) -> float:
        """Pressure [Pa] of the equation of state, in plain Python."""
        return self.pressure_function()(rho, e)

    def sound_speed_squared(self, rho: float, e: float) -> float:
        """Square of the bulk sound speed [m^2/s^2], without a floor, in plain Python."""
        module, row = MODULES[self.eos.name], tuple(self.row().tolist())
        p = module.pressure.py_func(rho, e, row)
        return float(module.sound_speed_squared.py_func(rho, e, p, row))


def pack(materials: Sequence[Material]) -> tuple[np.ndarray, np.ndarray]:
    """Pack materials for compiled loops.

    Returns
    -------
    table
        Parameters, float64 of shape (materials, slots), columns as in `slots`.
    models
        Tags of equation of state, strength and damage, int64 of shape (materials, 3).
    """
    table = np.array([material.row() for material in materials]).reshape(len(materials), slots.SLOT_COUNT)
    tags = [(material.eos.tag, material.strength.tag, material.damage.tag) for material in materials]
    models = np.array(tags, dtype=np.int64).reshape(len(materials), slots.MODEL_COUNT)
    return table, models
