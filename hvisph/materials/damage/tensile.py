"""Tensile failure by principal stress, by plastic work (Cockcroft-Latham), and by Grady's spall energy.

    principal stress    D = 1 once sigma_1 >= sigma_f, or (sigma_1 - sigma_3)/2 >= tau_f
    Cockcroft-Latham    D = sum max(sigma_1, 0) d eps_p / W_cr
    Grady's spall       D = 1 once -p >= p_s, the smaller of
                        brittle (3 rho c^2 K_c^2 rate)^(1/3), ductile (2 rho c^2 Y eps_c)^(1/2)
                        rate = max(tr D, 0); the limit is fixed when tension first passes half of it

sigma_1 >= sigma_3 are the largest and smallest principal stress, tension positive. Cockcroft &
Latham 1968, J. Inst. Metals 96, 33; Grady 1988, J. Mech. Phys. Solids 36, 353 (eps_c 0.15).
"""

from dataclasses import dataclass
from math import acos, cos, inf, sqrt
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags

TENSILE_STRENGTH, SHEAR_STRENGTH = slots.DAMAGE[0], slots.DAMAGE[1]
INVERSE_WORK = slots.DAMAGE[0]
TOUGHNESS, CRITICAL_STRAIN, SPALL_YIELD = slots.DAMAGE[0], slots.DAMAGE[1], slots.DAMAGE[2]

_THIRD_OF_A_TURN = 2.0943951023931953
# Von Mises stress below which a deviator is none [Pa]: its cube is no number any more, and a wave's first forerunners
# are as faint.
_NOTHING = 1e-100


@dataclass(frozen=True)
class PrincipalStress(slots.Parameters):
    """Parameters of failure by principal stress."""

    tensile_strength: float  # sigma_f [Pa]
    shear_strength: float = inf  # tau_f [Pa]

    name: ClassVar[str] = "principal_stress"
    tag: ClassVar[int] = tags.PRINCIPAL_STRESS


@dataclass(frozen=True)
class CockcroftLatham(slots.Parameters):
    """Parameters of failure by plastic work in tension."""

    critical_work: float  # W_cr [Pa = J/m^3]

    name: ClassVar[str] = "cockcroft_latham"
    tag: ClassVar[int] = tags.COCKCROFT_LATHAM
    converted = ("critical_work",)

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        row[INVERSE_WORK] = 1.0 / self.critical_work


@dataclass(frozen=True)
class GradySpall(slots.Parameters):
    """Parameters of Grady's spall."""

    toughness: float  # K_c [Pa m^(1/2)]
    yield_stress: float  # Y [Pa]; 0 where the ductile limit plays no part
    critical_strain: float = 0.15  # eps_c [-]

    name: ClassVar[str] = "grady_spall"
    tag: ClassVar[int] = tags.GRADY_SPALL
    converted = ("yield_stress",)

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        row[SPALL_YIELD] = self.yield_stress


@inline
def principal_deviators(q, determinant):
    """Greatest and least eigenvalue [Pa] of a deviator with von Mises stress `q` and its determinant."""
    if q < _NOTHING:
        return 0.0, 0.0
    angle = acos(min(max(13.5 * determinant / (q * q * q), -1.0), 1.0)) / 3.0
    return 2.0 / 3.0 * q * cos(angle), 2.0 / 3.0 * q * cos(angle + _THIRD_OF_A_TURN)


@inline
def spall_strength(rho, c, rate, row):
    """Grady's limit to tension [Pa] at a rate of volume [1/s]; infinite where nothing expands."""
    if rate <= 0.0:
        return inf
    stiffness = rho * c * c
    brittle = (3.0 * stiffness * row[TOUGHNESS] * row[TOUGHNESS] * rate) ** (1.0 / 3.0)
    if row[SPALL_YIELD] <= 0.0:
        return brittle
    return min(brittle, sqrt(2.0 * stiffness * row[SPALL_YIELD] * row[CRITICAL_STRAIN]))
