"""Cowper-Symonds strength: linear hardening with a rate factor.

    Y = (Y0 + H eps_p) (1 + (rate/D)^(1/q))

For structures at moderate rates; independent of temperature. Mild steel D = 40.4 1/s, q = 5;
aluminium 6500, 4; stainless steel 304 100, 10. Cowper & Symonds 1957 (Brown University report 28);
Jones 1989, Structural Impact.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags

from .linear_hardening import HARDENING_MODULUS, YIELD_STRESS

INVERSE_REFERENCE_RATE, INVERSE_EXPONENT = slots.STRENGTH[2:4]


@dataclass(frozen=True)
class CowperSymonds(slots.Parameters):
    """Parameters of Cowper-Symonds strength."""

    shear_modulus: float  # G [Pa]
    yield_stress: float  # Y0 [Pa]
    reference_rate: float  # D [1/s]
    exponent: float  # q [-]
    hardening_modulus: float = 0.0  # H [Pa]

    name: ClassVar[str] = "cowper_symonds"
    tag: ClassVar[int] = tags.COWPER_SYMONDS
    converted = ("reference_rate", "exponent")

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        row[YIELD_STRESS], row[HARDENING_MODULUS] = self.yield_stress, self.hardening_modulus
        row[INVERSE_REFERENCE_RATE], row[INVERSE_EXPONENT] = 1.0 / self.reference_rate, 1.0 / self.exponent


@inline
def rate_factor(rate, row):
    """Return 1 + (rate/D)^(1/q)."""
    if rate <= 0.0:
        return 1.0
    return 1.0 + (rate * row[INVERSE_REFERENCE_RATE]) ** row[INVERSE_EXPONENT]
