"""JH-2 damage of glass and ceramics: crushing strain and bulking.

    D = sum d eps_p/(D1 x^D2),  x = max((p + T)/P_HEL, 0);    p >= -T (1 - D)
    dU = (Y_old^2 - Y_new^2)/(6 G)                          elastic energy lost as the strength falls
    dp = -K1 mu + sqrt((K1 mu + dp_old)^2 + 2 beta K1 dU)   added to the pressure where mu > 0

Requires the strength `johnson_holmquist`, whose x and Y these are, and a `polynomial` equation of
state, whose A1 is K1. Johnson & Holmquist 1994, AIP Conf. Proc. 309, 981.
"""

from dataclasses import dataclass
from math import sqrt
from typing import ClassVar

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.eos.polynomial import A1
from hvisph.materials.slots import INVERSE_RHO0, SHEAR_MODULUS
from hvisph.materials.strength.johnson_holmquist import INVERSE_HEL_PRESSURE, TENSION

D1, D2, BETA = slots.DAMAGE[:3]

_LEAST_STRAIN = 1e-9


@dataclass(frozen=True)
class JohnsonHolmquistDamage(slots.Parameters):
    """Parameters of JH-2 damage."""

    d1: float  # [-]
    d2: float  # [-]
    beta: float = 1.0  # share of the elastic energy that becomes bulking [-]

    name: ClassVar[str] = "johnson_holmquist"
    tag: ClassVar[int] = tags.CRUSHING


@inline
def fracture_strain(p, row):
    """Equivalent plastic strain at which the material is crushed, at pressure `p` [Pa]."""
    return max(row[D1] * max((p + row[TENSION]) * row[INVERSE_HEL_PRESSURE], 0.0) ** row[D2], _LEAST_STRAIN)


@inline
def bulking(rho, before, flow_before, flow_after, row):
    """Pressure of bulking [Pa] once the strength has fallen from `flow_before` to `flow_after` [Pa]."""
    squeezed = row[A1] * (rho * row[INVERSE_RHO0] - 1.0)
    if squeezed <= 0.0 or flow_after >= flow_before:
        return before
    lost = (flow_before * flow_before - flow_after * flow_after) / (6.0 * row[SHEAR_MODULUS])
    start = squeezed + before
    return sqrt(start * start + 2.0 * row[BETA] * row[A1] * lost) - squeezed
