"""Strength of rock: Lundborg's curve when intact, friction when broken, thermal softening.

    intact    Y_i = Y0 + mu_i p/(1 + mu_i p/(Y_M - Y0)),  p >= 0;   Y0 in tension
    broken    Y_b = min(mu_b p, Y_i),                     p >= 0;   0 in tension
    Y = [(1 - D) Y_i + D Y_b] h
    heat      h = 1 - e/e_melt, or tanh(xi (T_m/T - 1)), xi = 1.2, or 1

With a `tension` t the pressure is at least -min(Y0/mu_i, t), Y0/mu_i being the apex of the cone. Sand
has t = 0: it expands without resistance, and bears pressure again at its reference density. There is
no dilation. Without the limit Y_M the intact strength is Drucker-Prager's line Y0 + mu_i p. Below
rho0 the shear modulus is G rho/rho0. Y is a von Mises stress: multiply constants of sources that
compare it with the root of the second invariant of the deviator, as Collins does, by sqrt(3).
Lundborg 1968, Int. J. Rock Mech. Min. Sci. 5, 427; Collins, Melosh & Ivanov 2004, Meteorit. Planet.
Sci. 39, 217.
"""

from dataclasses import dataclass
from math import inf, tanh
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags

COHESION, FRICTION, INVERSE_RANGE, BROKEN_FRICTION, INVERSE_MELT_ENERGY = slots.STRENGTH[:5]

XI = 1.2


@dataclass(frozen=True)
class Rock(slots.Parameters):
    """Parameters of the strength of rock."""

    shear_modulus: float  # G [Pa]
    cohesion: float  # Y0 [Pa]
    friction: float  # mu_i [-]
    limit: float = inf  # Y_M [Pa]
    broken_friction: float = 0.6  # mu_b [-]
    melt_energy: float = inf  # e_melt [J/kg]
    melt_temperature: float = inf  # T_m [K]
    tension: float = inf  # t, borne at most [Pa]; infinite where nothing limits it

    name: ClassVar[str] = "rock"
    tag: ClassVar[int] = tags.ROCK
    converted = ("limit", "melt_energy", "tension")

    @property
    def apex(self) -> float:
        """Tension [Pa] that is borne at most, infinite without a limit."""
        if self.tension == inf or self.friction == 0.0:
            return self.tension
        return min(self.tension, self.cohesion / self.friction)

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        row[INVERSE_RANGE] = 1.0 / (self.limit - self.cohesion)
        row[INVERSE_MELT_ENERGY] = 1.0 / self.melt_energy


@inline
def yield_stress(p, e, temperature, melt, damage, row):
    """Yield stress [Pa] at pressure `p` [Pa] and damage."""
    pressed = row[FRICTION] * max(p, 0.0)
    intact = row[COHESION] + pressed / (1.0 + pressed * row[INVERSE_RANGE])
    broken = min(row[BROKEN_FRICTION] * max(p, 0.0), intact)
    heat = max(1.0 - max(e, 0.0) * row[INVERSE_MELT_ENERGY], 0.0)
    if temperature >= melt:
        heat = 0.0
    elif melt < inf:
        heat *= tanh(XI * (melt / temperature - 1.0))
    return (intact - damage * (intact - broken)) * heat
