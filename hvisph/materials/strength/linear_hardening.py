"""Linear isotropic hardening.

    Y = Y0 + H eps_p

H is the plastic hardening modulus dY/d eps_p; from the tangent modulus E_t of a tensile curve H = E
E_t/(E - E_t).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.slots import SHEAR_MODULUS

YIELD_STRESS = slots.STRENGTH[0]
HARDENING_MODULUS = slots.STRENGTH[1]


@dataclass(frozen=True)
class LinearHardening:
    """Parameters of linear hardening."""

    shear_modulus: float  # G [Pa]
    yield_stress: float  # Y0 [Pa], before any plastic strain
    hardening_modulus: float  # H [Pa]

    name: ClassVar[str] = "linear_hardening"
    tag: ClassVar[int] = tags.LINEAR_HARDENING

    def __post_init__(self) -> None:
        slots.require_positive(self, "shear_modulus")
        slots.require_not_negative(self, "yield_stress", "hardening_modulus")

    def pack(self, row: np.ndarray, density: float) -> None:
        """Write the parameters into the material's row of the table."""
        row[SHEAR_MODULUS] = self.shear_modulus
        row[YIELD_STRESS] = self.yield_stress
        row[HARDENING_MODULUS] = self.hardening_modulus


@inline
def yield_stress(plastic_strain, row):
    """Yield stress [Pa] at an equivalent plastic strain."""
    return row[YIELD_STRESS] + row[HARDENING_MODULUS] * plastic_strain
