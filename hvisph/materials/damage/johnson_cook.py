"""Johnson-Cook damage: accumulated plastic strain over a failure strain.

    D = sum d eps_p / eps_f
    eps_f = (D1 + D2 exp(D3 sigma*)) (1 + D4 ln rate*) (1 + D5 T*)
    sigma* = -p / q,  q the von Mises stress;  rate* = max(rate / rate0, 1)

Johnson & Cook 1985. sigma* is at most 1.5, the range of the fit, and eps_f at least 1e-4. With
`high_triaxiality: void_growth` the fit continues as exp(-1.5 sigma*) where it would fall faster
(Rice & Tracey 1969, Hancock & Mackenzie 1976). With `softening` D_c the yield stress is reduced by
the share D_c D (Borvik, Hopperstad, Berstad & Langseth 2001). At D = 1 the particle has failed: no
deviator and no tension. With a rate-dependent spall strength, plastic strain adds no damage above
sigma* = 1.5. Molten material fails under any tension.
"""

from dataclasses import dataclass
from math import exp, inf, log
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.slots import SPALL_GROWTH

D1, D2, D3, D4, D5, LOG_REFERENCE_RATE, SOFTENING = slots.DAMAGE[:7]
VOID_GROWTH_FROM = slots.DAMAGE[7]  # triaxiality; infinite where it is held at `TRIAXIALITY_LIMIT`

FRACTURE_STRAIN_FLOOR = 1e-4
TRIAXIALITY_LIMIT = 1.5
VOID_GROWTH = 1.5  # d ln(eps_f)/d sigma* of Rice & Tracey, negative
_LARGEST = 1000.0  # triaxiality of either sign: a vanishing von Mises stress must not divide
_EXPONENT_LIMIT = 100.0  # exp stays finite


@dataclass(frozen=True)
class JohnsonCookDamage(slots.Parameters):
    """Parameters of Johnson-Cook damage."""

    d1: float  # [-]
    d2: float = 0.0  # [-]
    d3: float = 0.0  # [-]; below zero where tension embrittles
    d4: float = 0.0  # rate [-]
    d5: float = 0.0  # temperature [-]; needs Johnson-Cook strength, which knows the temperature
    reference_rate: float = 1.0  # rate0 [1/s]
    pressure_minimum: float = -inf  # p_min [Pa]
    softening: float = 0.0  # D_c, share of the yield stress that is gone when it fails [-]
    void_growth: bool = False  # whether a fit with D1 < 0 goes on as voids grow

    name: ClassVar[str] = "johnson_cook"
    tag: ClassVar[int] = tags.JOHNSON_COOK_DAMAGE
    converted = ("reference_rate", "void_growth")

    @property
    def void_growth_from(self) -> float:
        """Triaxiality from which the fit falls faster than voids grow, above 0; infinite where it is held instead."""
        if not self.void_growth:
            return inf
        return max(log(-VOID_GROWTH * self.d1 / (self.d2 * (VOID_GROWTH + self.d3))) / self.d3, 0.0)

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        row[LOG_REFERENCE_RATE] = log(self.reference_rate)
        row[VOID_GROWTH_FROM] = self.void_growth_from


@inline
def borne_share(harm, row):
    """Share of the yield stress that the material still has below failure at its damage D."""
    return 1.0 - row[SOFTENING] * harm


@inline
def fracture_strain(p, von_mises_stress, logged, homologous, row):
    """Equivalent plastic strain at which the material fails in the given state, `logged` the logarithm of its rate."""
    if row[SPALL_GROWTH] > 0.0 and -p >= TRIAXIALITY_LIMIT * von_mises_stress:
        return inf
    grown = row[VOID_GROWTH_FROM]
    limit = TRIAXIALITY_LIMIT if grown == inf else _LARGEST
    if von_mises_stress * limit <= -p:
        triaxiality = limit
    elif von_mises_stress * _LARGEST <= p:
        triaxiality = -_LARGEST
    else:
        triaxiality = -p / von_mises_stress
    strain = row[D1]
    if row[D2] != 0.0:
        strain += row[D2] * exp(min(max(row[D3] * min(triaxiality, grown), -_EXPONENT_LIMIT), _EXPONENT_LIMIT))
    if triaxiality > grown:
        strain *= exp(VOID_GROWTH * (grown - triaxiality))
    beyond = logged - row[LOG_REFERENCE_RATE]
    if beyond > 0.0:
        strain *= 1.0 + row[D4] * beyond
    strain *= 1.0 + row[D5] * homologous
    return max(strain, FRACTURE_STRAIN_FLOOR)
