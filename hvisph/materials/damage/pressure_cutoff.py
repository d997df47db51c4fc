"""Spall by a pressure cut-off, p >= p_min.

    p >= p_min,    p_min <= 0

The cut-off is recoverable: after recompression the material is as before. With `permanent: true`
the first state below p_min fails the material; molten material then fails under any tension. With
an exponent m tension accumulates damage, and the spall strength grows with the rate of expansion.

    d D/dt = K r/(m s) (-p/s)^(1/m - 1)   where -p > s,    D = 1 at once where -p >= sigma_0 (1e7/rate_0)^m
    s = sigma_0 (r/rate_0)^m,  r = 1e4 1/s,  K = rho0 c0^2 at rest

At a constant rate of expansion the tension is K rate t, and D reaches 1 at sigma_0 (rate/rate_0)^m,
the power law of plate impacts (Kanel 2010, Int. J. Fract. 163, 173; Antoun et al. 2003, Spall
Fracture). It is a cumulative criterion as that of Tuler & Butcher 1968, Int. J. Fract. Mech. 4, 431:
under a lower tension the material fails later, and no strain rate has to be evaluated. Valid from
1e4 1/s to 1e7 1/s (Moshe et al. 1998, J. Appl. Phys. 83, 4004).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.slots import FAILS_IN_TENSION, PRESSURE_MINIMUM, SPALL_GROWTH, SPALL_INVERSE, SPALL_POWER


@dataclass(frozen=True)
class PressureCutoff(slots.Parameters):
    """Parameters of the pressure cut-off."""

    pressure_minimum: float  # p_min [Pa], not above zero
    permanent: bool = False  # for good, at the first state below

    name: ClassVar[str] = "pressure_cutoff"
    tag: ClassVar[int] = tags.PRESSURE_CUTOFF
    converted = ("permanent",)

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        row[FAILS_IN_TENSION] = float(self.permanent)


@inline
def limited_pressure(p, row):
    """Pressure [Pa] after the cut-off; NaN passes through."""
    return row[PRESSURE_MINIMUM] if p < row[PRESSURE_MINIMUM] else p


@dataclass(frozen=True)
class NoDamage(slots.Parameters):
    """A material that never fails; it has no parameters."""

    name: ClassVar[str] = "none"
    tag: ClassVar[int] = tags.NO_DAMAGE


SLOWEST, FASTEST = 1e4, 1e7  # rates at which the law is known to hold [1/s]


def pack_rated(row: np.ndarray, strength: float, exponent: float, rate: float, bulk_modulus: float) -> None:
    """Write the law into the material's row: `strength` [Pa] at `rate` [1/s], of a material of `bulk_modulus` [Pa]."""
    least = strength * (SLOWEST / rate) ** exponent
    row[FAILS_IN_TENSION] = 1.0
    row[PRESSURE_MINIMUM] = -strength * (FASTEST / rate) ** exponent
    row[SPALL_INVERSE], row[SPALL_POWER] = 1.0 / least, 1.0 / exponent - 1.0
    row[SPALL_GROWTH] = bulk_modulus * SLOWEST / (exponent * least)


@inline
def grow_rated_damage(damage, p, dt, row):
    """Return the damage after `dt` [s] at the pressure `p` [Pa] of the undamaged material."""
    over = -p * row[SPALL_INVERSE]
    if over <= 1.0:
        return damage
    return min(damage + dt * row[SPALL_GROWTH] * over ** row[SPALL_POWER], 1.0)
