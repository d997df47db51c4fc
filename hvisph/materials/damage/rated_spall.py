"""Rate-dependent spall strength as damage accumulated by tension.

    d D/dt = K r/(m s) (-p/s)^(1/m - 1)   where -p > s,    D = 1 at once where -p >= sigma_0 (1e7/rate_0)^m
    s = sigma_0 (r/rate_0)^m,  r = 1e4 1/s,  K = rho0 c0^2 at rest

At a constant rate of expansion the tension is K rate t, and D reaches 1 at sigma_0 (rate/rate_0)^m,
the power law of plate impacts (Kanel 2010, Int. J. Fract. 163, 173; Antoun et al. 2003, Spall
Fracture). As a sum over time it is the criterion of Tuler & Butcher 1968, Int. J. Fract. Mech. 4,
431: sustained tension fails later and at a lower stress, and no strain rate is measured. Valid from
1e4 1/s to 1e7 1/s (Moshe et al. 1998, J. Appl. Phys. 83, 4004).
"""

from __future__ import annotations

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials.slots import FAILS_IN_TENSION, PRESSURE_MINIMUM, SPALL_GROWTH, SPALL_INVERSE, SPALL_POWER

SLOWEST, FASTEST = 1e4, 1e7  # rates at which the law is known to hold [1/s]


def pack(row: np.ndarray, strength: float, exponent: float, rate: float, bulk_modulus: float) -> None:
    """Write the law into the material's row: `strength` [Pa] at `rate` [1/s], of a material of `bulk_modulus` [Pa]."""
    least = strength * (SLOWEST / rate) ** exponent
    row[FAILS_IN_TENSION] = 1.0
    row[PRESSURE_MINIMUM] = -strength * (FASTEST / rate) ** exponent
    row[SPALL_INVERSE], row[SPALL_POWER] = 1.0 / least, 1.0 / exponent - 1.0
    row[SPALL_GROWTH] = bulk_modulus * SLOWEST / (exponent * least)


@inline
def grow_damage(damage, p, dt, row):
    """Return the damage after `dt` [s] at the pressure `p` [Pa] of the undamaged material."""
    over = -p * row[SPALL_INVERSE]
    if over <= 1.0:
        return damage
    return min(damage + dt * row[SPALL_GROWTH] * over ** row[SPALL_POWER], 1.0)
