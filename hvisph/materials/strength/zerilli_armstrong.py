"""Zerilli-Armstrong strength of face-centred and body-centred cubic metals.

    fcc    Y = C0 + C2 eps^(1/2) exp(-C3 T + C4 T ln r)
    bcc    Y = C0 + C1 exp(-C3 T + C4 T ln r) + C5 eps^n,        r = max(rate/(1 1/s), 1)
    T >= T_m:  Y = 0

Temperature reduces the hardening of fcc metals and the yield stress of bcc metals. Fitted to Taylor
tests, up to about 1e6 1/s. Zerilli & Armstrong 1987, J. Appl. Phys. 61, 1816.
"""

from dataclasses import dataclass
from math import exp, inf, log
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.slots import MELT_TEMPERATURE, SHEAR_MODULUS

C0, C1, HARDENING, C3, C4, EXPONENT, BODY_CENTRED = slots.STRENGTH[:7]


@dataclass(frozen=True)
class ZerilliArmstrong:
    """Parameters of Zerilli-Armstrong strength."""

    shear_modulus: float  # G [Pa]
    lattice: str  # "fcc" or "bcc"
    c0: float  # [Pa]
    c3: float  # [1/K]
    c4: float  # [1/K]
    c1: float = 0.0  # bcc [Pa]
    c2: float = 0.0  # fcc [Pa]
    c5: float = 0.0  # bcc [Pa]
    exponent: float = 0.5  # n of bcc [-]
    melt_temperature: float = inf  # [K]

    name: ClassVar[str] = "zerilli_armstrong"
    tag: ClassVar[int] = tags.ZERILLI_ARMSTRONG

    def pack(self, row: np.ndarray, density: float) -> None:
        body_centred = self.lattice == "bcc"
        row[SHEAR_MODULUS] = self.shear_modulus
        row[C0], row[C1] = self.c0, self.c1 if body_centred else 0.0
        row[HARDENING], row[EXPONENT] = (self.c5, self.exponent) if body_centred else (self.c2, 0.5)
        row[C3], row[C4], row[BODY_CENTRED] = self.c3, self.c4, float(body_centred)
        row[MELT_TEMPERATURE] = self.melt_temperature


@inline
def heat(rate, temperature, melt, row):
    """Return factor, offset [Pa] and share of the shear modulus: see `yield_stress`."""
    if temperature >= melt:
        return 0.0, 0.0, 1.0
    activated = exp(temperature * (row[C4] * log(max(rate, 1.0)) - row[C3]))
    if row[BODY_CENTRED] > 0.0:
        return 1.0, row[C0] + row[C1] * activated, 1.0
    return activated, row[C0], 1.0


@inline
def yield_stress(plastic_strain, factor, offset, row):
    """Yield stress [Pa] with the constant part `offset` and the thermal `factor` of the hardening part."""
    if plastic_strain > 0.0:
        return offset + factor * row[HARDENING] * plastic_strain ** row[EXPONENT]
    return offset
