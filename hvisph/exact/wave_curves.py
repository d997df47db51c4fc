"""Wave curves of materials for front tracking: states, and the waves between them.

A law turns "this state is to come to that stress" into a row of fronts, fastest first. Every
front, rarefactions cut into small pieces included, satisfies the jump conditions in mass
coordinates (mass flux j > 0 through the front, direction d = +1 to the right):

    u1 = u0 + d (sigma1 - sigma0)/j,    v1 = v0 - (sigma1 - sigma0)/j^2

so that mass and momentum balance exactly for any number of pieces.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, floor, log, sqrt
from typing import Protocol

from hvisph.materials.material_table import Material


@dataclass(frozen=True)
class State:
    """Uniform state between two fronts."""

    law: Law
    velocity: float  # u [m/s]
    stress: float  # compressive stress along x, p - S_xx [Pa]
    volume: float  # specific volume v [m^3/kg]
    energy: float = 0.0  # specific internal energy [J/kg]
    deviator: float = 0.0  # S_xx [Pa]

    @property
    def density(self) -> float:
        """[kg/m^3]."""
        return 1.0 / self.volume

    @property
    def pressure(self) -> float:
        """Compression positive [Pa]."""
        return self.stress + self.deviator


Wave = tuple[float, State]  # mass flux j [kg/(m^2 s)] and the state behind


class Law(Protocol):
    """The waves of one material."""

    def at_rest(self, velocity: float) -> State:
        """Return the unstressed material moving at `velocity` [m/s]."""

    def waves(self, state: State, stress: float, direction: int, strain_step: float) -> list[Wave]:
        """Return the fronts that bring `state` to `stress`, fastest first.

        `strain_step` is the change of ln(rho) by which rarefactions are cut into pieces.
        """

    def lowest_stress(self) -> float:
        """Return the stress above which all states lie [Pa]."""


class LinearLaw:
    """Barotropic material p = K (rho/rho0 - 1), whose waves are known in closed form.

    Shock and pieces of a rarefaction between rho_a and rho_b: j = c sqrt(rho_a rho_b), which is
    p = rho0 u U with U = (u + sqrt(u^2 + 4 c^2))/2 from rest. A rarefaction of vanishing pieces
    has du = c drho/rho.
    """

    def __init__(self, density: float, bulk_modulus: float):
        self.density, self.bulk_modulus = density, bulk_modulus
        self.speed = sqrt(bulk_modulus / density)

    @classmethod
    def from_material(cls, material: Material) -> LinearLaw:
        """Return the law of a material with the `linear` or the `elastic` equation of state."""
        return cls(material.density, material.density * material.bulk_sound_speed**2)

    def at_rest(self, velocity: float) -> State:
        """Return the unstressed material moving at `velocity`."""
        return State(self, velocity, 0.0, 1.0 / self.density)

    def lowest_stress(self) -> float:
        """Return -K, where the density vanishes."""
        return -self.bulk_modulus

    def waves(self, state: State, stress: float, direction: int, strain_step: float) -> list[Wave]:
        """Return one shock, or the pieces of a rarefaction."""
        rho, target = state.density, self.density * (1.0 + stress / self.bulk_modulus)
        if target >= rho:
            return [self._jump(state, target, stress, direction)]
        waves = []
        pieces = floor(log(rho / target) / strain_step)
        for _ in range(pieces):
            rho = state.density * exp(-strain_step)
            waves.append(self._jump(state, rho, self._stress(rho), direction))
            state = waves[-1][1]
        if state.stress > stress:
            waves.append(self._jump(state, target, stress, direction))
        return waves

    def _stress(self, rho: float) -> float:
        return self.bulk_modulus * (rho / self.density - 1.0)

    def _jump(self, state: State, rho: float, stress: float, direction: int) -> Wave:
        flux = self.speed * sqrt(rho * state.density)
        velocity = state.velocity + direction * (stress - state.stress) / flux
        return flux, State(self, velocity, stress, 1.0 / rho)
