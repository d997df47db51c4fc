"""JH-2 strength of glass and ceramics: intact and fractured surface, connected by damage.

    s_H = 3/2 (HEL - P_HEL),  x = max((p + T)/P_HEL, 0),  f = 1 + C ln(max(rate/(1 1/s), 1))
    intact       q_i = s_H A x^N f
    fractured    q_f = min(s_H B (max(p, 0)/P_HEL)^M f, SFMAX s_H)
    Y = q_i - D (q_i - q_f)

Requires the damage `johnson_holmquist` and a `polynomial` equation of state. Below rho0 the shear
modulus is G rho/rho0. Parameters are consistent if K1 mu + K2 mu^2 + K3 mu^3 + (4/3) G mu/(1 + mu)
= HEL at the pressure P_HEL. Johnson & Holmquist 1994, AIP Conf. Proc. 309, 981.
"""

from dataclasses import dataclass
from math import log
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags

HEL_STRESS, INTACT, INTACT_EXPONENT, RATE_COEFFICIENT = slots.STRENGTH[:4]
FRACTURED, FRACTURED_EXPONENT, FRACTURED_LIMIT, TENSION, INVERSE_HEL_PRESSURE = slots.STRENGTH[4:9]


@dataclass(frozen=True)
class JohnsonHolmquist(slots.Parameters):
    """Parameters of JH-2 strength."""

    shear_modulus: float  # G [Pa]
    hugoniot_elastic_limit: float  # HEL [Pa]
    hel_pressure: float  # P_HEL [Pa]
    tension: float  # T, greatest hydrostatic tension [Pa]
    intact: float  # A [-]
    intact_exponent: float  # N [-]
    fractured: float  # B [-]
    fractured_exponent: float  # M [-]
    rate_coefficient: float = 0.0  # C [-]
    fractured_limit: float = np.inf  # SFMAX [-]

    name: ClassVar[str] = "johnson_holmquist"
    tag: ClassVar[int] = tags.JOHNSON_HOLMQUIST
    converted = ("hugoniot_elastic_limit", "hel_pressure")

    @property
    def hel_stress(self) -> float:
        """Equivalent stress at the Hugoniot elastic limit [Pa]."""
        return 1.5 * (self.hugoniot_elastic_limit - self.hel_pressure)

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        row[HEL_STRESS] = self.hel_stress
        row[INVERSE_HEL_PRESSURE] = 1.0 / self.hel_pressure


@inline
def yield_stress(p, rate, damage, row):
    """Yield stress [Pa] at pressure `p` [Pa], strain rate [1/s] and damage."""
    f = 1.0
    if rate > 1.0:
        f += row[RATE_COEFFICIENT] * log(rate)
    inverse = row[INVERSE_HEL_PRESSURE]
    intact = row[HEL_STRESS] * row[INTACT] * max((p + row[TENSION]) * inverse, 0.0) ** row[INTACT_EXPONENT] * f
    if damage <= 0.0:
        return intact
    fractured = row[HEL_STRESS] * row[FRACTURED] * max(p * inverse, 0.0) ** row[FRACTURED_EXPONENT] * f
    fractured = min(fractured, row[FRACTURED_LIMIT] * row[HEL_STRESS])
    return intact - damage * (intact - fractured)
