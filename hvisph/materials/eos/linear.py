"""Linear barotropic equation of state: pressure depends on density only.

    p = K (rho / rho0 - 1),    c^2 = K / rho0

Zisis 2013, eq. 3; its non-dimensional form p = (rho - rho0)/Ca has K = rho0/Ca. For weak shocks; in
expansion the tension reaches K.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.slots import INVERSE_RHO0, RHO0

BULK_MODULUS = slots.EOS[0]


@dataclass(frozen=True)
class Linear:
    """Parameters of the linear equation of state."""

    bulk_modulus: float  # K [Pa]

    name: ClassVar[str] = "linear"
    tag: ClassVar[int] = tags.LINEAR
    ambient_energy: ClassVar[float] = 0.0

    def __post_init__(self) -> None:
        slots.require_positive(self, "bulk_modulus")

    def ambient_sound_speed(self, density: float) -> float:
        """Return sqrt(K/rho0) [m/s]."""
        return float(np.sqrt(self.bulk_modulus / density))

    def pack(self, row: np.ndarray, density: float) -> None:
        """Write the parameters into the material's row of the table."""
        row[BULK_MODULUS] = self.bulk_modulus


@inline
def pressure(rho, e, row):
    """Pressure [Pa] at density `rho` [kg/m^3]; the energy `e` is not used."""
    return row[BULK_MODULUS] * ((rho - row[RHO0]) * row[INVERSE_RHO0])


@inline
def sound_speed_squared(rho, e, p, row):
    """Square of the sound speed [m^2/s^2], a constant."""
    return row[BULK_MODULUS] * row[INVERSE_RHO0]
