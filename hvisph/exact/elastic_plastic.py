"""Waves of an elastic-plastic solid in uniaxial strain, with any equation of state.

    sigma = p(rho, e) - S_xx,    dS_xx = -(4/3) G dln(rho),    |S_xx| <= 2 Y/3

Each jump obeys e1 - e0 = (sigma0 + sigma1)(v0 - v1)/2 beside mass and momentum. Loading past the
elastic limit splits in two: an elastic front to the yield surface and a plastic shock behind it,
or, where the shock would be the faster (overdriven), one front to the final state. Unloading is
an elastic rarefaction through twice the elastic range, then a plastic one.
"""

from __future__ import annotations

from math import copysign, exp, inf, log1p, sqrt

from hvisph.core.errors import CaseError, RunError
from hvisph.materials.material_table import Material
from hvisph.materials.strength import ElasticStrength, NoStrength, VonMises

from .roots import bracketed_root
from .wave_curves import State, Wave


class SolidLaw:
    """The waves of a material with strength `none`, `elastic` or `von_mises`.

    Raises
    ------
    CaseError
        For any other strength: its shocks depend on the history.
    """

    def __init__(self, material: Material):
        if not isinstance(material.strength, NoStrength | ElasticStrength | VonMises):
            raise CaseError(
                f"no exact waves for strength '{material.strength.name}'; allowed: none, elastic, von_mises",
                where=material.name,
            )
        self.material = material
        self.shear = material.shear_modulus
        yield_stress = getattr(material.strength, "yield_stress", inf if self.shear else 0.0)
        self.limit = 2.0 * yield_stress / 3.0  # of |S_xx| [Pa]
        self.pressure = material.pressure_function()

    def at_rest(self, velocity: float) -> State:
        """Return the unstressed material moving at `velocity`."""
        rho, e = self.material.density, self.material.eos.ambient_energy
        return State(self, velocity, self.pressure(rho, e), 1.0 / rho, e)

    def lowest_stress(self) -> float:
        """Return a tension no condensed matter bears: half the initial rho c^2."""
        return -0.5 * self.material.density * self.material.longitudinal_sound_speed**2

    def waves(self, state: State, stress: float, direction: int, strain_step: float) -> list[Wave]:
        """Return the fronts of loading or unloading to `stress`."""
        if stress == state.stress:
            return []
        if stress > state.stress:
            return self._loading(state, stress, direction)
        return self._unloading(state, stress, direction, strain_step)

    def _loading(self, state: State, stress: float, direction: int) -> list[Wave]:
        corner = self._corner(state, -1.0)
        if corner is None:
            return [self._jump_to_stress(state, stress, direction)]
        elastic = self._jump_to_volume(state, corner, direction)
        if stress <= elastic[1].stress:
            return [self._jump_to_stress(state, stress, direction)]
        plastic = self._jump_to_stress(elastic[1], stress, direction)
        if plastic[0] < elastic[0]:
            return [elastic, plastic]
        return [self._jump_to_stress(state, stress, direction)]

    def _unloading(self, state: State, stress: float, direction: int, strain_step: float) -> list[Wave]:
        waves: list[Wave] = []
        corner = self._corner(state, 1.0)
        while state.stress > stress:
            volume = state.volume * exp(strain_step)
            if corner is not None and state.volume < corner * (1.0 - 1e-14):
                volume = min(volume, corner)
            wave = self._jump_to_volume(state, volume, direction)
            if wave[1].stress < stress:
                wave = self._jump_to_stress(state, stress, direction)
            waves.append(wave)
            state = wave[1]
        return waves

    def _corner(self, state: State, sign: float) -> float | None:
        """Volume at which the deviator, changing elastically, comes to `sign` times its limit, if ever."""
        if self.shear == 0.0 or self.limit == inf:
            return None
        way = 0.75 * (sign * self.limit - state.deviator) / self.shear
        return state.volume * exp(way) if abs(way) > 1e-13 else None

    def _deviator(self, state: State, volume: float) -> float:
        if self.shear == 0.0:
            return 0.0
        trial = state.deviator + 4.0 / 3.0 * self.shear * log1p((volume - state.volume) / state.volume)
        return min(max(trial, -self.limit), self.limit)

    def _jump_to_volume(self, state: State, volume: float, direction: int) -> Wave:
        deviator, change = self._deviator(state, volume), 0.5 * (state.volume - volume)
        residue = self._residue(state)

        def residual(stress: float) -> float:
            return self.pressure(1.0 / volume, state.energy + change * (state.stress + stress)) - deviator - residue

        # Energy and stress behind depend on one another; linear equations of state close at once.
        first = state.stress
        second = residual(first)
        for _ in range(50):
            slope = (residual(second) - residual(first)) / (second - first) if second != first else 0.0
            first, second = second, second + (residual(second) - second) / (1.0 - slope)
            if abs(second - first) <= 1e-15 * abs(second):
                break
        return self._wave(state, volume, second, deviator, direction)

    def _jump_to_stress(self, state: State, stress: float, direction: int) -> Wave:
        mean, change = 0.5 * (state.stress + stress), stress - state.stress
        residue = self._residue(state)

        def excess(volume: float) -> float:
            p = self.pressure(1.0 / volume, state.energy + mean * (state.volume - volume))
            return p - self._deviator(state, volume) - residue - stress

        tiny = -copysign(1e-6 * state.volume, change)
        stiffness = -(excess(state.volume + tiny) + change) / tiny  # the flux squared of a weak wave
        if abs(change) < 1e-8 * stiffness * state.volume:
            volume = state.volume - change / stiffness
            velocity = state.velocity + direction * change / sqrt(stiffness)
            energy, deviator = state.energy + mean * change / stiffness, self._deviator(state, volume)
            return sqrt(stiffness), State(self, velocity, stress, volume, energy, deviator)
        near, way = state.volume, -1.2 * change / stiffness
        for _ in range(200):
            way = max(way, -0.3 * near)
            far = near + way
            if (excess(far) < 0.0) == (change < 0.0):
                volume = bracketed_root(excess, near, far)
                return self._wave(state, volume, stress, self._deviator(state, volume), direction)
            near = far
        raise RunError(
            f"{self.material.name}: no state at a stress of {stress:.6g} Pa can be reached from {state.stress:.6g} Pa"
        )

    def _residue(self, state: State) -> float:
        """Return what a state's stress lacks of its own law, from rounding and from waves left out: it is no wave."""
        return self.pressure(state.density, state.energy) - state.deviator - state.stress

    def _wave(self, state: State, volume: float, stress: float, deviator: float, direction: int) -> Wave:
        flux = sqrt((stress - state.stress) / (state.volume - volume))
        energy = state.energy + 0.5 * (state.stress + stress) * (state.volume - volume)
        velocity = state.velocity + direction * (stress - state.stress) / flux
        return flux, State(self, velocity, stress, volume, energy, deviator)
