"""Linear isotropic hardening.

    Y = Y0 + H eps_p

H is the plastic hardening modulus dY/d eps_p; from the tangent modulus E_t of a tensile curve H = E
E_t/(E - E_t).
"""

from dataclasses import dataclass
from typing import ClassVar

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags

YIELD_STRESS, HARDENING_MODULUS = slots.STRENGTH[:2]


@dataclass(frozen=True)
class LinearHardening(slots.Parameters):
    """Parameters of linear hardening."""

    shear_modulus: float  # G [Pa]
    yield_stress: float  # Y0 [Pa], before any plastic strain
    hardening_modulus: float  # H [Pa]

    name: ClassVar[str] = "linear_hardening"
    tag: ClassVar[int] = tags.LINEAR_HARDENING


@inline
def yield_stress(plastic_strain, row):
    """Yield stress [Pa] at an equivalent plastic strain."""
    return row[YIELD_STRESS] + row[HARDENING_MODULUS] * plastic_strain
