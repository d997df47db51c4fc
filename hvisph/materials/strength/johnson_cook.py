"""Johnson-Cook strength: hardening, rate and temperature.

    Y = (A + B eps_p^n) (1 + C ln rate*) (1 - T*^m)
    rate* = max(rate / rate0, 1),    T* = (T - T_room) / (T_melt - T_room) held in [0, 1]

Johnson & Cook 1983. Below the reference rate the rate factor is 1; at T* = 1 the strength vanishes.
T_melt is that at zero pressure unless the material has a melting law.
"""

from dataclasses import dataclass
from math import log
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.slots import INVERSE_HEAT_CAPACITY, INVERSE_MELT_RANGE

YIELD_STRESS = slots.STRENGTH[0]
HARDENING_COEFFICIENT = slots.STRENGTH[1]
HARDENING_EXPONENT = slots.STRENGTH[2]
RATE_COEFFICIENT = slots.STRENGTH[3]
LOG_REFERENCE_RATE = slots.STRENGTH[4]
THERMAL_EXPONENT = slots.STRENGTH[5]

_SMALL_SHARE = 0.04  # increment over plastic strain up to which a series takes the place of a power


@dataclass(frozen=True)
class JohnsonCook(slots.Parameters):
    """Parameters of Johnson-Cook strength."""

    shear_modulus: float  # G [Pa]
    yield_stress: float  # A [Pa]
    hardening_coefficient: float  # B [Pa]
    hardening_exponent: float  # n [-]
    rate_coefficient: float  # C [-]
    thermal_exponent: float  # m [-]
    melt_temperature: float  # T_melt [K]
    specific_heat: float  # c_v [J/(kg K)]
    room_temperature: float = 300.0  # T_room [K]
    reference_rate: float = 1.0  # rate0 [1/s]

    name: ClassVar[str] = "johnson_cook"
    tag: ClassVar[int] = tags.JOHNSON_COOK
    converted = ("specific_heat", "reference_rate")

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        row[INVERSE_HEAT_CAPACITY] = 1.0 / self.specific_heat
        row[INVERSE_MELT_RANGE] = 1.0 / (self.melt_temperature - self.room_temperature)
        row[LOG_REFERENCE_RATE] = log(self.reference_rate)


@inline
def rate_and_heat_factor(logged, homologous, row):
    """Return (1 + C ln rate*) (1 - T*^m), what a return leaves of the yield stress, from the logarithm of the rate."""
    factor = 1.0
    beyond = logged - row[LOG_REFERENCE_RATE]
    if beyond > 0.0:
        factor += row[RATE_COEFFICIENT] * beyond
    if homologous > 0.0:
        m = row[THERMAL_EXPONENT]
        factor *= 1.0 - (homologous if m == 1.0 else homologous**m)  # a power costs more than all else here
    return factor


@inline
def yield_stress(plastic_strain, factor, row):
    """Yield stress [Pa] at an equivalent plastic strain, with `factor` from `rate_and_heat_factor`."""
    hardened = row[YIELD_STRESS]
    if plastic_strain > 0.0:
        hardened += row[HARDENING_COEFFICIENT] * plastic_strain ** row[HARDENING_EXPONENT]
    return hardened * factor


@inline
def hardening(increment, plastic_strain, flow, factor, row):
    """Growth of the yield stress [Pa] from `flow` with an increment of the plastic strain, see `yield_stress`.

    Where the increment is a small share r of the strain, four terms of (1 + r)^n - 1, to 1e-8, in place of a power.
    """
    if increment > _SMALL_SHARE * plastic_strain:
        return yield_stress(plastic_strain + increment, factor, row) - flow
    r, n = increment / plastic_strain, row[HARDENING_EXPONENT]
    grown = 1.0 + 0.5 * (n - 1.0) * r * (1.0 + (1.0 / 3.0) * (n - 2.0) * r * (1.0 + 0.25 * (n - 3.0) * r))
    return n * r * grown * (flow - row[YIELD_STRESS] * factor)
