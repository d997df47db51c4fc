"""Stiffened-gas equation of state.

    p = c0^2 (rho - rho0) + (gamma0 - 1) rho e
    c^2 = c0^2 + (gamma0 - 1) (e + p / rho)

Howell & Ball 2002, Mehra & Chaturvedi 2006. The Grueneisen coefficient is gamma0 - 1. In tensions
of the order of rho c0^2/(gamma0 - 1) c^2 is negative and the minimum sound speed is used.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.slots import RHO0

C0_SQUARED, GAMMA_MINUS_ONE = slots.EOS[:2]


@dataclass(frozen=True)
class StiffenedGas(slots.Parameters):
    """Parameters of the stiffened gas."""

    sound_speed: float  # c0 [m/s]
    gamma0: float  # adiabatic exponent [-]

    name: ClassVar[str] = "stiffened_gas"
    tag: ClassVar[int] = tags.STIFFENED_GAS
    converted = ("sound_speed", "gamma0")
    ambient_energy: ClassVar[float] = 0.0

    def ambient_sound_speed(self, density: float) -> float:
        """Return c0 [m/s]."""
        return self.sound_speed

    def pack(self, row: np.ndarray, density: float) -> None:
        row[C0_SQUARED] = self.sound_speed**2
        row[GAMMA_MINUS_ONE] = self.gamma0 - 1.0


@inline
def pressure(rho, e, row):
    """Pressure [Pa] at density `rho` [kg/m^3] and specific internal energy `e` [J/kg]."""
    return row[C0_SQUARED] * (rho - row[RHO0]) + row[GAMMA_MINUS_ONE] * rho * e


@inline
def sound_speed_squared(rho, e, p, row):
    """Square of the sound speed [m^2/s^2] at pressure `p` [Pa]; below zero where the state is unstable."""
    return row[C0_SQUARED] + row[GAMMA_MINUS_ONE] * (e + p / rho)
