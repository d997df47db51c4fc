"""Jones-Wilkins-Lee equation of state of detonation products, with programmed burn.

    V = rho0/rho
    p = F { A [1 - w/(R1 V)] exp(-R1 V) + B [1 - w/(R2 V)] exp(-R2 V) + w rho e }

The explosive starts with its chemical energy e = E0/rho0, E0 per volume. F is the burnt fraction:
it rises from 0 to 1 while the detonation front, which starts at given points and runs at D
(Chapman-Jouguet unless given), crosses one and a half spacings. Unburnt explosive has no pressure.
Without points everything is burnt at the start. Lee, Hornig & Kury 1968 (UCRL-50422); parameters:
Dobratz & Crawford 1985 (UCRL-52997).
"""

from dataclasses import dataclass
from math import exp, sqrt
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline, python_twin
from hvisph.materials import slots, tags
from hvisph.materials.slots import RHO0

CAPITAL_A, CAPITAL_B, R1, R2, OMEGA = slots.EOS[:5]
BURN_RATE = slots.EOS[5]  # 1/s of the share that has burnt; 0 where all has burnt at the start

BURN_SPACINGS = 1.5


@dataclass(frozen=True)
class JonesWilkinsLee(slots.Parameters):
    """Parameters of the Jones-Wilkins-Lee equation of state."""

    capital_a: float  # A [Pa]
    capital_b: float  # B [Pa]
    r1: float  # R1 [-]
    r2: float  # R2 [-]
    omega: float  # w [-]
    detonation_energy: float  # E0 [J/m^3]
    reference_density: float  # rho0 [kg/m^3]
    burn_rate: float = 0.0  # D/(1.5 dx) [1/s]

    name: ClassVar[str] = "jwl"
    tag: ClassVar[int] = tags.JWL
    converted = ("detonation_energy", "reference_density")

    @property
    def ambient_energy(self) -> float:
        """Specific chemical energy E0/rho0 [J/kg]."""
        return self.detonation_energy / self.reference_density

    def ambient_sound_speed(self, density: float) -> float:
        """Sound speed of the products at the reference density and the whole energy [m/s]."""
        row = np.zeros(slots.SLOT_COUNT)
        row[slots.RHO0] = density
        self.pack(row, density)
        values, e = tuple(row.tolist()), self.ambient_energy
        p, p_rho, p_e = python_twin(state)(density, e, values)
        return sqrt(p_rho + p * p_e / density**2)

    def chapman_jouguet(self) -> tuple[float, float]:
        """Speed [m/s] and pressure [Pa] of the slowest front that ends on the Hugoniot of the products."""
        v = np.linspace(0.5, 0.95, 9001)
        w = self.omega
        cold = sum(
            a * (1.0 - w / (r * v)) * np.exp(-r * v) for a, r in ((self.capital_a, self.r1), (self.capital_b, self.r2))
        )
        # the heat of the front is E0 + p (1 - V)/2 per volume at the start
        p = (cold + w * self.detonation_energy / v) / (1.0 - 0.5 * w * (1.0 - v) / v)
        speed = np.sqrt(p / (1.0 - v) / self.reference_density)
        return float(speed.min()), float(p[speed.argmin()])


@inline
def state(rho, e, row):
    """Pressure [Pa] of the products and its slopes p_rho and p_e, at density `rho` and energy `e` [J/kg]."""
    v = row[RHO0] / rho
    first, second, omega = row[R1] * v, row[R2] * v, row[OMEGA]
    one, two = row[CAPITAL_A] * exp(-first), row[CAPITAL_B] * exp(-second)
    p = one * (1.0 - omega / first) + two * (1.0 - omega / second) + omega * rho * e
    # d/d rho of (1 - w/(R V)) exp(-R V), with d(R V)/d rho = -R V/rho
    slope = (one * (first - omega - omega / first) + two * (second - omega - omega / second)) / rho
    return p, slope + omega * e, omega * rho
