"""Polynomial equation of state.

    mu = rho/rho0 - 1
    compression:  p = A1 mu + A2 mu^2 + A3 mu^3 + (B0 + B1 mu) rho0 e
    expansion:    p = f [T1 mu + T2 mu^2 + B0 rho0 e]

Johnson & Holmquist 1994 call the coefficients K1, K2, K3; ceramics have B0 = B1 = 0. A1 and T1 are
bulk moduli; T1 = A1 unless given. Valid up to the pressure of its fit. f is that of
`mie_gruneisen`, with B0 for gamma0.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.slots import INVERSE_RHO0, RHO0

from . import expansion

A1, A2, A3, B0, B1, T1, T2, OF_GAS = slots.EOS[:8]


@dataclass(frozen=True)
class Polynomial(slots.Parameters):
    """Parameters of the polynomial equation of state."""

    a1: float  # [Pa]
    a2: float = 0.0  # [Pa]
    a3: float = 0.0  # [Pa]
    b0: float = 0.0  # [-]
    b1: float = 0.0  # [-]
    t1: float = 0.0  # [Pa]; zero takes a1
    t2: float = 0.0  # [Pa]

    name: ClassVar[str] = "polynomial"
    tag: ClassVar[int] = tags.POLYNOMIAL
    ambient_energy: ClassVar[float] = 0.0

    def ambient_sound_speed(self, density: float) -> float:
        """Return sqrt(A1/rho0) [m/s]."""
        return float(np.sqrt(self.a1 / density))

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        row[T1] = self.t1 or self.a1
        row[OF_GAS] = expansion.of_gas(self.b0)


@inline
def state(rho, e, row):
    """Pressure [Pa] and its slopes p_rho and p_e, at density `rho` [kg/m^3] and energy `e` [J/kg]."""
    mu = (rho - row[RHO0]) * row[INVERSE_RHO0]
    if mu >= 0.0:
        gamma = row[B0] + row[B1] * mu
        p = mu * (row[A1] + mu * (row[A2] + mu * row[A3])) + gamma * row[RHO0] * e
        slope = (row[A1] + mu * (2.0 * row[A2] + 3.0 * mu * row[A3])) * row[INVERSE_RHO0]
        return p, slope + row[B1] * e, gamma * row[RHO0]
    p = mu * (row[T1] + mu * row[T2]) + row[B0] * row[RHO0] * e
    by_density = (row[T1] + 2.0 * row[T2] * mu) * row[INVERSE_RHO0]
    f, falls = expansion.left(1.0 + mu, row[OF_GAS]), expansion.slope(1.0 + mu, row[OF_GAS]) * row[INVERSE_RHO0]
    return f * p, f * by_density + falls * p, f * row[B0] * row[RHO0]
