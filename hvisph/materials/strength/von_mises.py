"""Perfect plasticity: a constant yield stress Y in the von Mises criterion S:S <= 2 Y^2 / 3."""

from dataclasses import dataclass
from typing import ClassVar

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags

YIELD_STRESS = slots.STRENGTH[0]


@dataclass(frozen=True)
class VonMises(slots.Parameters):
    """Parameters of perfect plasticity."""

    shear_modulus: float  # G [Pa]
    yield_stress: float  # Y [Pa], in uniaxial stress

    name: ClassVar[str] = "von_mises"
    tag: ClassVar[int] = tags.VON_MISES


@inline
def yield_stress(row):
    """Yield stress [Pa]: the constant itself."""
    return row[YIELD_STRESS]
