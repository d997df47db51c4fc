"""Melting temperature under pressure.

    constant     T_m = T_m0
    Lindemann    T_m = T_m0 exp(2 a (1 - 1/eta)) eta^(2 (Gamma0 - a - 1/3)),    eta = rho/rho0
    Simon        T_m = T_m0 (1 + p/a)^(1/c),                                    p >= 0

Lindemann's law in the form of Steinberg, Cochran & Guinan 1980, J. Appl. Phys. 51, 1498; Simon &
Glatzel 1929, Z. anorg. Chem. 178, 309. The heat of melting is neglected.
"""

from dataclasses import dataclass
from math import exp

import numpy as np

from hvisph.compiler.jit import inline

from .slots import INVERSE_RHO0, MELT_FIRST, MELT_LAW, MELT_SECOND, MELT_TEMPERATURE

CONSTANT, LINDEMANN, SIMON = 0.0, 1.0, 2.0


@dataclass(frozen=True)
class Lindemann:
    """Lindemann's law."""

    temperature: float  # T_m0 [K]
    gamma0: float  # Grueneisen coefficient at rest [-]
    a: float  # [-]

    def pack(self, row: np.ndarray) -> None:
        """Write the parameters into the material's row of the table."""
        row[MELT_LAW], row[MELT_TEMPERATURE] = LINDEMANN, self.temperature
        row[MELT_FIRST], row[MELT_SECOND] = self.gamma0, self.a


@dataclass(frozen=True)
class Simon:
    """Simon's law."""

    temperature: float  # T_m0 [K]
    a: float  # [Pa]
    c: float  # [-]

    def pack(self, row: np.ndarray) -> None:
        """Write the parameters into the material's row of the table."""
        row[MELT_LAW], row[MELT_TEMPERATURE] = SIMON, self.temperature
        row[MELT_FIRST], row[MELT_SECOND] = 1.0 / self.a, 1.0 / self.c


@inline
def melt_temperature(rho, p, row):
    """Melting temperature [K] at density `rho` [kg/m^3] and pressure `p` [Pa]."""
    if row[MELT_LAW] == LINDEMANN:
        eta, a = rho * row[INVERSE_RHO0], row[MELT_SECOND]
        return (
            row[MELT_TEMPERATURE] * exp(2.0 * a * (1.0 - 1.0 / eta)) * eta ** (2.0 * (row[MELT_FIRST] - a - 1.0 / 3.0))
        )
    if row[MELT_LAW] == SIMON and p > 0.0:
        return row[MELT_TEMPERATURE] * (1.0 + p * row[MELT_FIRST]) ** row[MELT_SECOND]
    return row[MELT_TEMPERATURE]
