"""Failure of orthotropic solids mode by mode: Hashin 1980 and maximum stress.

sigma is in material axes, tension positive; c = max(-(s22 + s33)/2, 0) is the confinement of the fibres.

    Hashin   fibre          s11 >= 0: (s11/XT)^2 + (s12^2 + s13^2)/S12^2 >= 1,   else -s11 - c >= XC
             matrix         s22 + s33 >= 0: ((s22 + s33)/YT)^2 + h >= 1
                            else ((YC/(2 S23))^2 - 1)(s22 + s33)/YC + ((s22 + s33)/(2 S23))^2 + h >= 1
                            h = (s23^2 - s22 s33)/S23^2 + (s12^2 + s13^2)/S12^2
             delamination   s33 >= 0: (s33/ZT)^2 + (s13^2 + s23^2)/SZ^2 >= 1
    max stress   each normal and shear stress against its own limit: 11; 22 and 12; 33, 13 and 23
                 (compression beyond that of the other two axes)

An open mode bears no tension: s11 within -(residual XC + c) and 0, s22 <= 0, s33 <= 0, by strains of cracks normal to
the axes; nothing at all normal to it while the volume is above that at rest (pressure below zero). Of the shear stress
and moduli 12 and 23 (matrix), 13 and 23 (delamination) the share `residual` is left. A particle whose fibre and
delamination modes are open has failed (max stress: any two modes). Compression counts beyond the confinement, as in Yen
2002, Proc. 7th Int. LS-DYNA Users Conf.: pressure alone breaks no fibre. Neither strain rate nor fracture energy
enters: the result depends on the spacing. Hashin 1980, J. Appl. Mech. 47, 329; cracks of fixed direction: Rashid 1968,
Nucl. Eng. Des. 7, 334.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.strength.orthotropic import BULK, R11, R12, R13, R22, R23, R33

XT, XC, YT, YC, ZT, ZC, S12, S13, S23, RESIDUAL = slots.DAMAGE
SZ = ZC  # Hashin's modes have no compression along 3, and one strength in shear along fibres


@dataclass(frozen=True)
class Hashin:
    """Parameters of Hashin's criteria in 3D."""

    fibre_tension: float  # XT [Pa]
    fibre_compression: float  # XC [Pa]
    matrix_tension: float  # YT [Pa]
    matrix_compression: float  # YC [Pa]
    shear: float  # S12 [Pa]
    transverse_shear: float  # S23 [Pa]
    delamination_tension: float = 0.0  # ZT [Pa]; YT unless given
    delamination_shear: float = 0.0  # SZ [Pa]; S12 unless given
    residual: float = 0.2  # share of shear, and of XC, that is left [-]

    name: ClassVar[str] = "hashin"
    tag: ClassVar[int] = tags.HASHIN

    def pack(self, row: np.ndarray, density: float) -> None:
        row[XT], row[XC], row[YT], row[YC] = (
            self.fibre_tension,
            self.fibre_compression,
            self.matrix_tension,
            self.matrix_compression,
        )
        row[S12], row[S23] = self.shear, self.transverse_shear
        row[ZT] = self.delamination_tension or self.matrix_tension
        row[SZ] = self.delamination_shear or self.shear
        row[RESIDUAL] = self.residual


@dataclass(frozen=True)
class MaxStress:
    """Parameters of maximum stress."""

    tension: tuple[float, float, float]  # X, Y, Z [Pa]
    compression: tuple[float, float, float]  # [Pa]
    shear: tuple[float, float, float]  # S12, S13, S23 [Pa]
    residual: float = 0.2  # as of Hashin [-]

    name: ClassVar[str] = "max_stress"
    tag: ClassVar[int] = tags.MAX_STRESS

    def pack(self, row: np.ndarray, density: float) -> None:
        row[[XT, YT, ZT]], row[[XC, YC, ZC]], row[[S12, S13, S23]] = self.tension, self.compression, self.shear
        row[RESIDUAL] = self.residual


@inline
def hashin_modes(s, row):
    """Return fibre's, matrix' and delamination's criteria, 1 at failure, for six stresses along the axes [Pa]."""
    s11, s22, s33, s12, s13, s23 = s
    along = (s12 * s12 + s13 * s13) / (row[S12] * row[S12])
    confinement = max(-0.5 * (s22 + s33), 0.0)
    fibre = (s11 / row[XT]) * (s11 / row[XT]) + along if s11 >= 0.0 else (-s11 - confinement) / row[XC]
    both, square = s22 + s33, row[S23] * row[S23]
    shared = (s23 * s23 - s22 * s33) / square + along
    matrix = shared + (both / row[YT]) * (both / row[YT])
    if both < 0.0:
        matrix = shared + (row[YC] * row[YC] / (4.0 * square) - 1.0) * both / row[YC] + both * both / (4.0 * square)
    pulled = max(s33, 0.0) / row[ZT]
    apart = pulled * pulled + (s13 * s13 + s23 * s23) / (row[SZ] * row[SZ])
    delamination = apart if s33 >= 0.0 else 0.0
    return fibre, matrix, delamination


@inline
def max_stress_modes(s, row):
    """Return the criteria of maximum stress along 1, 2 and 3 [-], each 1 at failure; see `hashin_modes`."""
    s11, s22, s33, s12, s13, s23 = s
    first = max(s11 / row[XT], (-s11 - max(-0.5 * (s22 + s33), 0.0)) / row[XC])
    second = max(max(s22 / row[YT], (-s22 - max(-0.5 * (s11 + s33), 0.0)) / row[YC]), abs(s12) / row[S12])
    third = max(s33 / row[ZT], (-s33 - max(-0.5 * (s11 + s22), 0.0)) / row[ZC])
    return first, second, max(third, max(abs(s13) / row[S13], abs(s23) / row[S23]))


@inline
def shear_shares(modes, row):
    """Return the shares of the shear moduli 12, 13 and 23 that open modes leave [-]."""
    left = row[RESIDUAL]
    of_matrix, of_layers = (left if modes[1] > 0.0 else 1.0), (left if modes[2] > 0.0 else 1.0)
    return of_matrix, of_layers, min(of_matrix, of_layers)


@inline
def limit_stress(s, modes, slack, row):
    """Return the stress [Pa] in material axes that open modes still bear.

    A crack normal to axis i takes the strain x that makes its excess s_ii zero: s_jj falls by C_ij x. With `slack`
    above zero the volume is above that at rest, and cracks are open whatever the stress is.
    """
    s11, s22, s33, s12, s13, s23 = s
    bulk = row[BULK]
    if modes[2] > 0.0:
        x = (s33 if slack > 0.0 else max(s33, 0.0)) / (row[R33] + bulk)
        s11, s22, s33 = s11 - (row[R13] + bulk) * x, s22 - (row[R23] + bulk) * x, s33 - (row[R33] + bulk) * x
    if modes[1] > 0.0:
        x = (s22 if slack > 0.0 else max(s22, 0.0)) / (row[R22] + bulk)
        s11, s22, s33 = s11 - (row[R12] + bulk) * x, s22 - (row[R22] + bulk) * x, s33 - (row[R23] + bulk) * x
    if modes[0] > 0.0:
        low = 0.0 if slack > 0.0 else -row[RESIDUAL] * row[XC] - max(-0.5 * (s22 + s33), 0.0)
        x = (s11 - min(max(s11, low), 0.0)) / (row[R11] + bulk)
        s11, s22, s33 = s11 - (row[R11] + bulk) * x, s22 - (row[R12] + bulk) * x, s33 - (row[R13] + bulk) * x
    if modes[1] > 0.0:  # changed by the other cracks
        s22 = 0.0 if slack > 0.0 else min(s22, 0.0)
    if modes[2] > 0.0:
        s33 = 0.0 if slack > 0.0 else min(s33, 0.0)
    return s11, s22, s33, s12, s13, s23
