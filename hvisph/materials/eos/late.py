"""Late stages at a low sound speed: a bulk modulus K_new in place of the equation of state, from a time on.

    rho_r = rho/(1 + p/K_new)  at the switch, for each particle,    p = K_new (rho/rho_r - 1) >= 0,    c^2 = K_new/rho_r

Pressure and deviator are continuous; energy changes by work and makes no pressure. A particle hotter than its melting
point, or of less than half of its density at rest, moves on without pressure: its rho_r is infinite. Pores keep their
distension, whose share 1/alpha of a section bears the strength. Raducan & Jutzi 2022, Planet. Sci. J. 3, 128, for the
method; there p jumps by K_new/K.
"""

from dataclasses import dataclass
from math import sqrt
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import tags
from hvisph.materials.slots import INVERSE_RHO0, PRESSURE_MINIMUM, RHO0, SOUND_SPEED_SQUARED_FLOOR

from .linear import BULK_MODULUS, Linear


@dataclass(frozen=True)
class Late(Linear):
    """Parameters of a late stage: its bulk modulus K_new."""

    name: ClassVar[str] = "late"
    tag: ClassVar[int] = tags.LATE

    def pack(self, row: np.ndarray, density: float) -> None:
        """Write the parameters into the material's row of the table: there is no tension."""
        super().pack(row, density)
        row[PRESSURE_MINIMUM] = 0.0


@inline
def late_state(rho, reference, row):
    """Pressure [Pa] before the limit to tension, and sound speed [m/s]; `reference` is the density without pressure."""
    c_squared = max(row[BULK_MODULUS] / reference, row[SOUND_SPEED_SQUARED_FLOOR])
    return row[BULK_MODULUS] * (rho / reference - 1.0), sqrt(c_squared)


@inline
def state(rho, e, row):
    """Pressure [Pa] and its slopes dp/drho and dp/de, taken about the density at rest in place of `reference`."""
    slope = row[BULK_MODULUS] * row[INVERSE_RHO0]
    return slope * (rho - row[RHO0]), slope, 0.0
