"""Grady-Kipp damage: brittle fracture by crack growth from random Weibull flaws.

    flaws            N(<eps) = k eps^m per m^3, assigned to the particles at random until each has one
    active           n_act = min(n, (eps/eps_min)^m0) for eps > eps_min,  m0 = ln n/ln(eps_max/eps_min);
                     k V eps^m where that is more: there are stronger flaws than were assigned
    growth           d(D^(1/3))/dt = n_act^(1/3) c_g/R,  D^(1/3) <= (n_act/n)^(1/3)
    strain           eps = max(sigma_1, 0)/E, sigma_1 the greatest principal stress before damage is applied
    damaged stress   (1 - D) S, and (1 - D) p for p < 0
    shear of `rock`  D += (sqrt(3)/2) d eps_p/eps_f; eps_f 0.01 for p <= 0, 0.05 at p_bd, 0.1 at p_bp, 1 at 2 p_bp

c_g = 0.4 c_l, R = (3V/4 pi)^(1/3) with the volume V of the particle. Flaws are assigned at random
until each particle has one, about ln N each; where the Weibull law has more active flaws, k V eps^m
replaces their number, otherwise strength at high rates would depend on the spacing. Results depend
on the seed. k is per cubic metre (1e6 times a value per cm^3). Grady & Kipp 1980, Int. J. Rock
Mech. Min. Sci. 17, 147; Benz & Asphaug 1994, Icarus 107, 98; 1995, CPC 87, 253. Shear
adds to the same damage, after Collins, Melosh & Ivanov 2004, Meteorit. Planet. Sci. 39, 217, whose
strain is sqrt(3)/2 of the equivalent one; beyond p_bp as the public code SWIFT.
"""

from dataclasses import dataclass
from hashlib import sha256
from math import pi, sqrt
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags

CRACK_SPEED_OVER_RADIUS = slots.DAMAGE[0]  # c_g/R [1/s]
INVERSE_YOUNG = slots.DAMAGE[1]  # 1/E [1/Pa]
FLAWS = slots.DAMAGE[2]  # k V, flaws of a particle at a strain of one [-]
EXPONENT = slots.DAMAGE[3]  # Weibull's m [-]
BRITTLE_DUCTILE = slots.DAMAGE[4]  # p_bd [Pa]; 0 where shear does no damage
BRITTLE_PLASTIC = slots.DAMAGE[5]  # p_bp [Pa]
INVARIANT = 0.5 * sqrt(3.0)  # root of the second invariant of a strain over the equivalent strain
BRITTLE, DUCTILE, PLASTIC = 0.01, 0.05, 0.1  # failure strains without pressure, at p_bd and at p_bp


@dataclass(frozen=True)
class GradyKipp(slots.Parameters):
    """Parameters of Grady-Kipp damage; `particle_volume` and the moduli are set when a body is built."""

    weibull_k: float  # k [1/m^3]
    weibull_m: float  # m [-]
    seed: int = 0
    crack_speed: float = 0.0  # c_g [m/s]
    young_modulus: float = 0.0  # E [Pa]
    particle_volume: float = 0.0  # V [m^3]
    brittle_ductile: float = 0.0  # p_bd [Pa]; 0 where shear does no damage
    brittle_plastic: float = 0.0  # p_bp [Pa]

    speed_share: ClassVar[float] = 0.4  # c_g over c_l
    name: ClassVar[str] = "grady_kipp"
    tag: ClassVar[int] = tags.GRADY_KIPP
    converted = ("weibull_k", "weibull_m", "seed", "crack_speed", "young_modulus", "particle_volume")

    @property
    def radius(self) -> float:
        """R of a particle [m]."""
        return float((3.0 * self.particle_volume / (4.0 * pi)) ** (1.0 / 3.0))

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        if self.particle_volume > 0.0:
            row[CRACK_SPEED_OVER_RADIUS] = self.crack_speed / self.radius
        row[FLAWS], row[EXPONENT] = self.weibull_k * self.particle_volume, self.weibull_m
        if self.young_modulus > 0.0:
            row[INVERSE_YOUNG] = 1.0 / self.young_modulus

    def flaws(self, name: str, count: int, volume: float) -> np.ndarray:
        """Deal out flaws to the particles of a body.

        `name`: name of the body: bodies of one material differ.
        `count`: number of particles, in the order of their permanent numbers.
        `volume`: volume of the body [m^3].

        Returns least strain, exponent m0 and number of flaws of each particle, of shape (count, 3).
        """
        words = np.frombuffer(sha256(name.encode()).digest()[:16], np.uint32)
        generator = np.random.Generator(np.random.PCG64([self.seed, *map(int, words)]))
        least, most, number = np.full(count, np.inf), np.zeros(count), np.zeros(count)
        dealt = 0
        while (number == 0).any():
            to = generator.integers(count, size=count)
            missing = np.zeros(count, bool)
            missing[number == 0] = True
            first_seen = np.unique(to, return_index=True)[1]
            filled = np.sort(first_seen[missing[to[first_seen]]])
            if len(filled) == missing.sum():  # the flaw that fills the last particle is the last
                to = to[: filled[-1] + 1]
            strain = ((dealt + 1 + np.arange(len(to))) / (self.weibull_k * volume)) ** (1.0 / self.weibull_m)
            np.minimum.at(least, to, strain)
            np.maximum.at(most, to, strain)
            np.add.at(number, to, 1.0)
            dealt += len(to)
        several = number > 1
        exponent = np.ones(count)
        exponent[several] = np.log(number[several]) / np.log(most[several] / least[several])
        return np.column_stack([least, exponent, number])


@inline
def failure_strain(p, row):
    """Return the strain [-] at which shear has broken rock under the pressure `p` [Pa]."""
    ductile, plastic = row[BRITTLE_DUCTILE], row[BRITTLE_PLASTIC]
    if p <= ductile:
        return BRITTLE + (DUCTILE - BRITTLE) * max(p, 0.0) / ductile
    if p <= plastic:
        return DUCTILE + (PLASTIC - DUCTILE) * (p - ductile) / (plastic - ductile)
    return PLASTIC + (1.0 - PLASTIC) * (p - plastic) / plastic


@inline
def grow_damage(damage, strain, dt, least, exponent, number, row):
    """Return the damage after `dt` at the tensile `strain`, for the flaws of a particle."""
    if strain <= least or number <= 0.0 or damage >= 1.0:
        return damage
    active = max(min((strain / least) ** exponent, number), row[FLAWS] * strain ** row[EXPONENT])
    root = damage ** (1.0 / 3.0)
    limit = (active / number) ** (1.0 / 3.0)
    if root < limit:
        root = min(root + dt * active ** (1.0 / 3.0) * row[CRACK_SPEED_OVER_RADIUS], limit)
    return min(root * root * root, 1.0)
