"""Perfect plasticity: a constant yield stress Y in the von Mises criterion S:S <= 2 Y^2 / 3."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.slots import SHEAR_MODULUS

YIELD_STRESS = slots.STRENGTH[0]


@dataclass(frozen=True)
class VonMises:
    """Parameters of perfect plasticity."""

    shear_modulus: float  # G [Pa]
    yield_stress: float  # Y [Pa], in uniaxial stress

    name: ClassVar[str] = "von_mises"
    tag: ClassVar[int] = tags.VON_MISES

    def __post_init__(self) -> None:
        slots.require_positive(self, "shear_modulus")
        slots.require_not_negative(self, "yield_stress")

    def pack(self, row: np.ndarray, density: float) -> None:
        """Write the parameters into the material's row of the table."""
        row[SHEAR_MODULUS] = self.shear_modulus
        row[YIELD_STRESS] = self.yield_stress


@inline
def yield_stress(row):
    """Yield stress [Pa]: the constant itself."""
    return row[YIELD_STRESS]
