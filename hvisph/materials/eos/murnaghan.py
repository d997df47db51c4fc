"""Murnaghan equation of state: a bulk modulus that increases linearly with pressure.

    compression:  p = K/n ((rho/rho0)^n - 1) + Gamma rho0 (e - e_c),    K(p) = K + n p
    expansion:    p = f [K/n ((rho/rho0)^n - 1) + Gamma rho0 e]
    e_c = K/(n rho0) [((rho/rho0)^(n-1) - 1)/(n-1) + rho0/rho - 1]

e_c is the energy of cold compression; f is that of `mie_gruneisen`. With Gamma = 0, the default, the
pressure is independent of energy: for liquids and solids that stay cold. Murnaghan 1944, Proc.
Natl. Acad. Sci. 30, 244.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.slots import INVERSE_RHO0, RHO0

from . import expansion

BULK_MODULUS, EXPONENT, GAMMA, OF_GAS = slots.EOS[:4]


@dataclass(frozen=True)
class Murnaghan(slots.Parameters):
    """Parameters of the Murnaghan equation of state."""

    bulk_modulus: float  # K [Pa]
    exponent: float  # n = dK/dp [-]
    gamma: float = 0.0  # Gamma, with Gamma rho constant [-]

    name: ClassVar[str] = "murnaghan"
    tag: ClassVar[int] = tags.MURNAGHAN
    ambient_energy: ClassVar[float] = 0.0

    def ambient_sound_speed(self, density: float) -> float:
        """Return sqrt(K/rho0) [m/s]."""
        return float(np.sqrt(self.bulk_modulus / density))

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        row[OF_GAS] = expansion.of_gas(self.gamma)


@inline
def state(rho, e, row):
    """Pressure [Pa] and its slopes p_rho and p_e, at density `rho` [kg/m^3] and energy `e` [J/kg]."""
    n, k = row[EXPONENT], row[BULK_MODULUS]
    eta = rho * row[INVERSE_RHO0]
    power = eta ** (n - 1.0)
    cold = k / n * (eta * power - 1.0)
    thermal = row[GAMMA] * row[RHO0]
    slope = k * row[INVERSE_RHO0] * power
    if eta >= 1.0:
        cold_energy = k * row[INVERSE_RHO0] / n * ((power - 1.0) / (n - 1.0) + 1.0 / eta - 1.0)
        return cold + thermal * (e - cold_energy), slope - thermal * cold / (rho * rho), thermal
    p = cold + thermal * e
    f, falls = expansion.left(eta, row[OF_GAS]), expansion.slope(eta, row[OF_GAS]) * row[INVERSE_RHO0]
    return f * p, f * slope + falls * p, f * thermal
