"""Ideal gas with a constant adiabatic exponent.

    p = (gamma - 1) rho e,    c^2 = gamma (gamma - 1) e

For gas dynamics and for air between bodies. No tension; a negative energy gives a negative pressure
and the minimum sound speed.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.core.errors import CaseError
from hvisph.materials import slots, tags

GAMMA_MINUS_ONE = slots.EOS[0]


@dataclass(frozen=True)
class IdealGas(slots.Parameters):
    """Parameters of the ideal gas."""

    gamma: float  # adiabatic exponent [-]
    ambient_energy: float  # specific internal energy that a body starts with [J/kg]

    name: ClassVar[str] = "ideal_gas"
    tag: ClassVar[int] = tags.IDEAL_GAS
    converted = ("gamma", "ambient_energy")

    def __post_init__(self) -> None:
        if not self.ambient_energy > 0.0:
            raise CaseError(f"ambient_energy is {self.ambient_energy!r}, but must be above zero", where=self.name)

    def ambient_sound_speed(self, density: float) -> float:
        """Return sqrt(gamma (gamma - 1) e) at the ambient energy [m/s]."""
        return float(np.sqrt(self.gamma * (self.gamma - 1.0) * self.ambient_energy))

    def pack(self, row: np.ndarray, density: float) -> None:
        row[GAMMA_MINUS_ONE] = self.gamma - 1.0


@inline
def pressure(rho, e, row):
    """Pressure [Pa] at density `rho` [kg/m^3] and specific internal energy `e` [J/kg]."""
    return row[GAMMA_MINUS_ONE] * rho * e


@inline
def sound_speed_squared(rho, e, p, row):
    """Square of the sound speed [m^2/s^2]; the pressure `p` is not used."""
    return (row[GAMMA_MINUS_ONE] + 1.0) * row[GAMMA_MINUS_ONE] * e
