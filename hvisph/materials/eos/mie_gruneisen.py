"""Mie-Grueneisen equation of state on a cubic Us-up Hugoniot.

    mu = rho / rho0 - 1,    x = mu / (mu + 1)
    compression:  p = rho0 c0^2 mu [1 + (1 - gamma0/2) mu - a mu^2/2] / D^2 + (gamma0 + a mu) rho0 e
                  D = 1 - (s1 - 1) mu - s2 mu x - s3 mu x^2
    expansion:    p = f [rho0 c0^2 mu + (gamma0 + a mu) rho0 e]
                  f = r [v + (3 - 2 v) r + (v - 2) r^2],  r = rho/rho0,  v = min(1, 2/(3 (gamma0 - a)))

The Hugoniot is U = c0 + s1 u + s2 u^2/U + s3 u^3/U^2 (Steinberg 1996; Young 2021, section 3.3).
With a = s2 = s3 = 0 it is p = p_H (1 - gamma0 eta/2) + gamma0 rho0 e, eta = 1 - rho0/rho, p_H =
rho0 c0^2 eta/(1 - s1 eta)^2. Valid below the compression at which D vanishes; D is at least 0.1. f
tends to the pressure of a monatomic gas in expansion and is no model of vaporisation; with
`expansion: linear` it is 1, as published, and hot dispersed material keeps pressures of gigapascals.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.slots import INVERSE_RHO0, RHO0

from . import expansion

C0_SQUARED, GAMMA0, A, S1_MINUS_ONE, S2, S3, OF_GAS = slots.EOS[:7]

DENOMINATOR_FLOOR = 0.1


@dataclass(frozen=True)
class MieGrueneisen(slots.Parameters):
    """Parameters of the Mie-Grueneisen equation of state."""

    sound_speed: float  # c0 [m/s]
    gamma0: float  # Grueneisen coefficient at the reference density [-]
    s1: float  # slope of the Us-up curve [-]
    s2: float = 0.0  # its quadratic coefficient [-]
    s3: float = 0.0  # its cubic coefficient [-]
    a: float = 0.0  # first-order volume correction of gamma0 [-]
    linear_expansion: bool = False  # whether expansion is the printed line, without f

    name: ClassVar[str] = "mie_gruneisen"
    tag: ClassVar[int] = tags.MIE_GRUENEISEN
    converted = ("sound_speed", "s1", "linear_expansion")
    ambient_energy: ClassVar[float] = 0.0

    def ambient_sound_speed(self, density: float) -> float:
        """Return c0 [m/s]."""
        return self.sound_speed

    def largest_density(self, density: float) -> float:
        """Return the density [kg/m^3] at which D falls to its floor: the end of the range of validity."""
        compression = np.linspace(0.0, 20.0, 20_001)
        x = compression / (compression + 1.0)
        d = 1.0 - compression * (self.s1 - 1.0 + x * (self.s2 + x * self.s3))
        beyond = d < DENOMINATOR_FLOOR
        return density * float(1.0 + compression[beyond.argmax()]) if beyond.any() else np.inf

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        row[C0_SQUARED] = self.sound_speed**2
        row[S1_MINUS_ONE] = self.s1 - 1.0
        row[OF_GAS] = expansion.AS_CONDENSED if self.linear_expansion else expansion.of_gas(self.gamma0 - self.a)


@inline
def pressure(rho, e, row):
    """Pressure [Pa] at density `rho` [kg/m^3] and specific internal energy `e` [J/kg]."""
    rho0, a, gamma0 = row[RHO0], row[A], row[GAMMA0]
    s1, s2, s3 = row[S1_MINUS_ONE], row[S2], row[S3]
    mu = (rho - rho0) * row[INVERSE_RHO0]
    reference = row[C0_SQUARED] * mu
    if mu > 0.0:
        x = mu / (mu + 1.0)
        d = 1.0 - mu * (s1 + x * (s2 + x * s3))
        if d < DENOMINATOR_FLOOR:
            d = DENOMINATOR_FLOOR
        reference *= (1.0 + mu * (1.0 - 0.5 * gamma0 - 0.5 * a * mu)) / (d * d)
    p = rho0 * (reference + (gamma0 + a * mu) * e)
    if mu < 0.0 and row[OF_GAS] >= 0.0:
        p *= expansion.left(1.0 + mu, row[OF_GAS])
    return p


@inline
def sound_speed_squared(rho, e, p, row):
    """Square of the sound speed [m^2/s^2] at pressure `p` [Pa], from p_rho + p p_e / rho^2."""
    rho0, a, gamma0 = row[RHO0], row[A], row[GAMMA0]
    s1, s2, s3 = row[S1_MINUS_ONE], row[S2], row[S3]
    mu = (rho - rho0) * row[INVERSE_RHO0]
    slope = row[C0_SQUARED]
    if mu > 0.0:
        x = mu / (mu + 1.0)
        first = 1.0 - 0.5 * gamma0
        numerator = 1.0 + mu * (first - 0.5 * a * mu)
        d = 1.0 - mu * (s1 + x * (s2 + x * s3))
        d_slope = -(s1 + x * (s2 * (2.0 - x) + s3 * x * (3.0 - 2.0 * x)))
        if d < DENOMINATOR_FLOOR:
            d = DENOMINATOR_FLOOR
            d_slope = 0.0
        inverse = 1.0 / d
        slope *= (numerator + mu * (first - a * mu - 2.0 * numerator * d_slope * inverse)) * (inverse * inverse)
    by_density, by_energy = slope + a * e, (gamma0 + a * mu) * rho0
    if mu < 0.0 and row[OF_GAS] >= 0.0:
        eta, v = 1.0 + mu, row[OF_GAS]
        f = expansion.left(eta, v)
        by_density = f * by_density + expansion.slope(eta, v) * (row[C0_SQUARED] * mu + (gamma0 + a * mu) * e)
        by_energy *= f
    return by_density + p * by_energy / (rho * rho)
