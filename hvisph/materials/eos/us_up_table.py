"""Mie-Grueneisen equation of state on a piecewise linear Us-up Hugoniot.

    eta = 1 - rho0/rho,    U = c_k + s_k u,    p_H = rho0 c_k^2 eta / (1 - s_k eta)^2
    compression:  p = p_H (1 - Gamma0 eta/2) + Gamma0 rho0 e
    expansion:    p = f [rho0 c0^2 mu + Gamma0 rho0 e],    mu = rho/rho0 - 1

For phase changes: a steep segment up to the transition, a flat one in the mixed-phase region, the
line of the dense phase above. The points describe single shocks from rest. Where Us falls with up,
the shock splits in two, and the measured second wave is slower than U (`exact.hugoniot`).
Release follows the same curve, without hysteresis. The last segment extends to 1 - s eta = 0.05. f
is that of `mie_gruneisen`.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.vector.api import number_at
from hvisph.materials import slots, tags
from hvisph.materials.isentrope import LENGTH as CURVE_LENGTH
from hvisph.materials.slots import ADDRESS, CURVE, INVERSE_RHO0, RHO0

from . import expansion

C0_SQUARED, GAMMA0, OF_GAS, PIECES = slots.EOS[:4]
PIECE = CURVE + CURVE_LENGTH  # eta where it begins, c and s of each piece, behind the isentrope

DENOMINATOR_FLOOR = 0.05


@dataclass(frozen=True)
class UsUpTable(slots.Parameters):
    """Parameters of the Mie-Grueneisen equation of state on a tabulated Hugoniot."""

    us_up: tuple[tuple[float, float], ...]  # points (up, Us) [m/s], the first (0, c0)
    gamma0: float  # Grueneisen coefficient at the reference density [-]

    name: ClassVar[str] = "us_up_table"
    tag: ClassVar[int] = tags.US_UP_TABLE
    converted = ("us_up",)
    ambient_energy: ClassVar[float] = 0.0

    def ambient_sound_speed(self, density: float) -> float:
        """Return c0 [m/s]."""
        return self.us_up[0][1]

    def largest_density(self, density: float) -> float:
        """Return the density [kg/m^3] at which the last piece ends: the end of the range of validity."""
        s = self.tail[-1]
        return density / (1.0 - (1.0 - DENOMINATOR_FLOOR) / s) if s > 1.0 - DENOMINATOR_FLOOR else np.inf

    @cached_property
    def tail(self) -> np.ndarray:
        """Beginning, c [m/s] and s of each piece, as they stand behind the isentrope, of shape (3 pieces,)."""
        pieces = []
        for (u, speed), (later, faster) in pairwise(self.us_up):
            s = (faster - speed) / (later - u)
            pieces += [u / speed, speed - s * u, s]
        return np.array(pieces)

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        row[C0_SQUARED] = self.us_up[0][1] ** 2
        row[OF_GAS], row[PIECES] = expansion.of_gas(self.gamma0), len(self.us_up) - 1


@inline
def state(rho, e, row):
    """Pressure [Pa] and its slopes p_rho and p_e, at density `rho` [kg/m^3] and energy `e` [J/kg]."""
    rho0, gamma0, address = row[RHO0], row[GAMMA0], row[ADDRESS]
    mu = (rho - rho0) * row[INVERSE_RHO0]
    if mu <= 0.0:
        condensed = row[C0_SQUARED] * mu + gamma0 * e
        f = expansion.left(1.0 + mu, row[OF_GAS])
        slope = f * row[C0_SQUARED] + expansion.slope(1.0 + mu, row[OF_GAS]) * condensed
        return f * rho0 * condensed, slope, f * gamma0 * rho0
    eta = mu / (1.0 + mu)
    at = PIECE + 3 * (int(row[PIECES]) - 1)
    while at > PIECE and eta < number_at(address, at):
        at -= 3
    c, s = number_at(address, at + 1), number_at(address, at + 2)
    d, bends = 1.0 - s * eta, 1.0 + s * eta
    if d < DENOMINATOR_FLOOR:
        d = DENOMINATOR_FLOOR
        bends = d
    scale = c * c / (d * d)
    kept = 1.0 - 0.5 * gamma0 * eta
    p = rho0 * (scale * eta * kept + gamma0 * e)
    slope = scale * (kept * bends / d - 0.5 * gamma0 * eta)
    return p, slope * (rho0 / rho) * (rho0 / rho), gamma0 * rho0
