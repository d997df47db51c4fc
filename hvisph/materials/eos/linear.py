"""Linear barotropic equation of state: pressure depends on density only.

    p = K (rho / rho0 - 1),    c^2 = K / rho0

Zisis 2013, eq. 3; its non-dimensional form p = (rho - rho0)/Ca has K = rho0/Ca. For weak shocks; in
expansion the tension reaches K.

The type `elastic` is the same law with the bulk modulus from E and nu,

    K = E / (3 (1 - 2 nu)),

for bodies that stay nearly elastic (Young 2021, section 3.3). Give the strength the shear modulus
of the same E and nu, G = E/(2 (1 + nu)).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.slots import INVERSE_RHO0, RHO0

BULK_MODULUS = slots.EOS[0]


@dataclass(frozen=True)
class Linear(slots.Parameters):
    """Parameters of the linear equation of state."""

    bulk_modulus: float  # K [Pa]

    name: ClassVar[str] = "linear"
    tag: ClassVar[int] = tags.LINEAR
    ambient_energy: ClassVar[float] = 0.0

    def ambient_sound_speed(self, density: float) -> float:
        """Return sqrt(K/rho0) [m/s]."""
        return float(np.sqrt(self.bulk_modulus / density))


@inline
def pressure(rho, e, row):
    """Pressure [Pa] at density `rho` [kg/m^3]; the energy `e` is not used."""
    return row[BULK_MODULUS] * ((rho - row[RHO0]) * row[INVERSE_RHO0])


@inline
def sound_speed_squared(rho, e, p, row):
    """Square of the sound speed [m^2/s^2], a constant."""
    return row[BULK_MODULUS] * row[INVERSE_RHO0]


def bulk_modulus(young_modulus: float, poisson_ratio: float) -> float:
    """Return K = E / (3 (1 - 2 nu)) [Pa]."""
    return young_modulus / (3.0 * (1.0 - 2.0 * poisson_ratio))


def young_modulus(bulk_modulus: float, shear_modulus: float) -> float:
    """Return E = 9 K G / (3 K + G) [Pa], 0 of a fluid."""
    return 9.0 * bulk_modulus * shear_modulus / (3.0 * bulk_modulus + shear_modulus) if shear_modulus > 0.0 else 0.0


@dataclass(frozen=True)
class Elastic(slots.Parameters):
    """Parameters of the elastic equation of state."""

    young_modulus: float  # E [Pa]
    poisson_ratio: float  # nu [-]

    name: ClassVar[str] = "elastic"
    tag: ClassVar[int] = tags.ELASTIC
    converted = ("young_modulus", "poisson_ratio")
    ambient_energy: ClassVar[float] = 0.0

    @property
    def bulk_modulus(self) -> float:
        """K [Pa]."""
        return bulk_modulus(self.young_modulus, self.poisson_ratio)

    def ambient_sound_speed(self, density: float) -> float:
        """Return sqrt(K/rho0) [m/s]."""
        return float(np.sqrt(self.bulk_modulus / density))

    def pack(self, row: np.ndarray, density: float) -> None:
        row[BULK_MODULUS] = self.bulk_modulus
