"""Materials as objects, and their packing into the arrays that compiled loops read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import sqrt

import numpy as np

from ..core.errors import CaseError
from ..core.jit import plain
from . import isentrope, slots
from .damage import JohnsonCookDamage, NoDamage
from .eos import MODULES
from .porosity import Porosity
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
    eos, strength, damage, porosity
        Parameter objects of the models.
    heat_capacity, room_temperature
        c_v [J/(kg K)] and temperature at rest [K]; those of a strength model that has them, unless given.
    total_energy
        Whether all energy counts as heat, see `isentrope`.
    """

    name: str
    density: float  # [kg/m^3]
    eos: EquationOfState
    strength: Model = field(default_factory=NoStrength)
    damage: Model = field(default_factory=NoDamage)
    porosity: Porosity | None = None
    heat_capacity: float = 0.0  # c_v [J/(kg K)]; that of the strength unless given
    room_temperature: float = 0.0  # [K]; likewise
    total_energy: bool = False  # temperature from the whole energy, see `isentrope`

    def __post_init__(self) -> None:
        slots.require_positive(self, "density")
        slots.require_not_negative(self, "heat_capacity", "room_temperature")
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
        """Return the slots of the material's row of the table."""
        row = np.zeros(slots.SLOT_COUNT)
        row[slots.RHO0] = self.density
        row[slots.INVERSE_RHO0] = 1.0 / self.density
        row[slots.SOUND_SPEED_SQUARED_FLOOR] = slots.FLOOR_SHARE * self.bulk_sound_speed**2
        row[slots.PRESSURE_MINIMUM] = -np.inf
        row[slots.ROOM_TEMPERATURE] = ROOM_TEMPERATURE
        row[slots.DISTENSION] = 1.0
        for model in (self.eos, self.strength, self.damage):
            model.pack(row, self.density)
        if self.heat_capacity > 0.0:
            row[slots.INVERSE_HEAT_CAPACITY] = 1.0 / self.heat_capacity
        if self.room_temperature > 0.0:
            row[slots.ROOM_TEMPERATURE] = self.room_temperature
        row[slots.TOTAL_ENERGY] = float(self.total_energy)
        if self.porosity is not None:
            self.porosity.pack(row)
        return row

    @cached_property
    def _without_isentrope(self) -> np.ndarray:
        grid = getattr(self.eos, "tail", np.empty(0))
        return np.concatenate([self.row(), np.zeros(isentrope.LENGTH), grid])

    @cached_property
    def whole_row(self) -> np.ndarray:
        """The material's row of the table: slots, isentrope, and the grid of a tabulated equation of state."""
        row = self._without_isentrope.copy()
        row[slots.CURVE : slots.CURVE + isentrope.LENGTH] = isentrope.tabulated(
            self.pressure_function(), self.density, self.eos.ambient_energy, row[slots.ROOM_TEMPERATURE]
        )
        return row

    def _state(self) -> Callable[[float, float], tuple[float, float, float]]:
        """Return pressure, p_rho and p_e as a function of density and energy, in plain Python."""
        values, module = slots.values(self._without_isentrope), MODULES[self.eos.name]
        if hasattr(module, "state"):
            state = plain(module.state)
            return lambda rho, e: state(rho, e, values)
        pressure, square = plain(module.pressure), plain(module.sound_speed_squared)

        def of_two(rho: float, e: float) -> tuple[float, float, float]:
            p, slope = pressure(rho, e, values), square(rho, e, 0.0, values)  # linear in the pressure
            return p, slope, (square(rho, e, p, values) - slope) / p * rho**2 if p else 0.0

        return of_two

    def pressure_function(self) -> Callable[[float, float], float]:
        """Return p(rho, e) of the equation of state in plain Python: nothing is compiled."""
        state = self._state()
        return lambda rho, e: float(state(rho, e)[0])

    def pressure(self, rho: float, e: float) -> float:
        """Pressure [Pa] of the equation of state, in plain Python."""
        return float(self._state()(rho, e)[0])

    def sound_speed_squared(self, rho: float, e: float) -> float:
        """Square of the bulk sound speed [m^2/s^2], without a floor, in plain Python."""
        p, p_rho, p_e = self._state()(rho, e)
        return float(p_rho + p * p_e / rho**2)

    def temperature(self, rho: float, e: float) -> float:
        """Temperature [K], in plain Python."""
        return float(plain(isentrope.temperature)(rho, e, slots.values(self.whole_row)))


def pack(materials: Sequence[Material]) -> tuple[np.ndarray, np.ndarray]:
    """Pack materials for compiled loops.

    Returns
    -------
    table
        Parameters, float64 of shape (materials, width), columns as in `slots`; then isentropes and grids.
    models
        Tags of equation of state, strength and damage, int64 of shape (materials, 3).
    """
    rows = [material.whole_row for material in materials]
    table = np.zeros((len(materials), max((len(row) for row in rows), default=slots.SLOT_COUNT)))
    for row, slots_of_it in zip(table, rows, strict=True):
        row[: len(slots_of_it)] = slots_of_it
    tags = [(material.eos.tag, material.strength.tag, material.damage.tag) for material in materials]
    models = np.array(tags, dtype=np.int64).reshape(len(materials), slots.MODEL_COUNT)
    return table, models
