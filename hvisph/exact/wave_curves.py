"""Wave curves of barotropic and elastic-plastic materials for front tracking: states, and the waves between them.

A law turns "this state is to come to that stress" into a row of fronts, fastest first. Every
front, rarefactions cut into small pieces included, satisfies the jump conditions in mass
coordinates (mass flux j > 0 through the front, direction d = +1 to the right):

    u1 = u0 + d (sigma1 - sigma0)/j,    v1 = v0 - (sigma1 - sigma0)/j^2

so that mass and momentum balance exactly for any number of pieces.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import copysign, exp, floor, inf, isnan, log, log1p, sqrt
from typing import Protocol

from hvisph.core.errors import CaseError, RunError
from hvisph.materials.material_table import Material
from hvisph.materials.strength import ElasticStrength, NoStrength, VonMises


@dataclass(frozen=True)
class State:
    """Uniform state between two fronts."""

    law: "Law"
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
        """Return the fronts from `state` to `stress`, fastest first, rarefactions in steps of ln(rho)."""

    def lowest_stress(self) -> float:
        """Return the stress above which all states lie [Pa]."""


class LinearLaw:
    """Barotropic material p = K (rho/rho0 - 1), whose waves are known in closed form.

    Shock and pieces of a rarefaction between rho_a and rho_b: j = c sqrt(rho_a rho_b), which is p = rho0 u U with U =
    (u + sqrt(u^2 + 4 c^2))/2 from rest. A rarefaction of vanishing pieces has du = c drho/rho.
    """

    def __init__(self, density: float, bulk_modulus: float):
        self.density, self.bulk_modulus = density, bulk_modulus
        self.speed = sqrt(bulk_modulus / density)

    @classmethod
    def from_material(cls, material: Material) -> "LinearLaw":
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
            waves.append(self._jump(state, rho, self.bulk_modulus * (rho / self.density - 1.0), direction))
            state = waves[-1][1]
        if state.stress > stress:
            waves.append(self._jump(state, target, stress, direction))
        return waves

    def _jump(self, state: State, rho: float, stress: float, direction: int) -> Wave:
        flux = self.speed * sqrt(rho * state.density)
        velocity = state.velocity + direction * (stress - state.stress) / flux
        return flux, State(self, velocity, stress, 1.0 / rho)


def bracketed_root(function: Callable[[float], float], low: float, high: float) -> float:
    """Return the root of a continuous function that has unlike signs at `low` and `high`, to rounding.

    Brent's method with the steps, and the bits, of `scipy.optimize.brentq`, whose import takes 0.2 s of every run.
    Raises `RunError` if the signs are alike.
    """
    before, current = low, high
    f_before, f_now = function(before), function(current)
    opposite, f_other, last, step = 0.0, 0.0, 0.0, 0.0
    if f_before != 0.0 != f_now and ((f_before > 0.0) == (f_now > 0.0) or isnan(f_before + f_now)):
        raise RunError(f"no state between {low:.6g} and {high:.6g} satisfies the jump conditions")
    if f_before == 0.0:
        return before
    for _ in range(300):
        if f_before != 0.0 and f_now != 0.0 and (f_before > 0.0) != (f_now > 0.0):
            opposite, f_other = before, f_before
            last = step = current - before
        if abs(f_other) < abs(f_now):
            before, current, opposite = current, opposite, current
            f_before, f_now, f_other = f_now, f_other, f_now
        tolerance, half = 0.5 * (1e-300 + 1e-15 * abs(current)), 0.5 * (opposite - current)
        if f_now == 0.0 or abs(half) < tolerance:
            return float(current)
        shift = inf  # bisection
        if abs(last) > tolerance and abs(f_now) < abs(f_before):
            if before == opposite:  # secant
                shift = -f_now * (current - before) / (f_now - f_before)
            else:  # inverse quadratic interpolation
                of_before, of_other = (f_before - f_now) / (before - current), (f_other - f_now) / (opposite - current)
                shift = (
                    -f_now * (f_other * of_other - f_before * of_before) / (of_other * of_before * (f_other - f_before))
                )
        interpolates = 2.0 * abs(shift) < min(abs(last), 3.0 * abs(half) - tolerance)
        last, step = (step, shift) if interpolates else (half, half)
        before, f_before = current, f_now
        current += step if abs(step) > tolerance else (tolerance if half > 0.0 else -tolerance)
        f_now = function(current)
    raise RunError(f"the root between {low:.6g} and {high:.6g} is not found")


class SolidLaw:
    """Waves of an elastic-plastic solid in uniaxial strain, with any equation of state.

        sigma = p(rho, e) - S_xx,    dS_xx = -(4/3) G dln(rho),    |S_xx| <= 2 Y/3

    Each jump obeys e1 - e0 = (sigma0 + sigma1)(v0 - v1)/2 beside mass and momentum. Loading past the elastic limit
    splits in two: an elastic front to the yield surface and a plastic shock behind it, or, where the shock would be the
    faster (overdriven), one front to the final state. Unloading is an elastic rarefaction through twice the elastic
    range, then a plastic one. The strength is `none`, `elastic` or `von_mises`. Raises `CaseError` for any other
    strength: its shocks depend on the history.
    """

    def __init__(self, material: Material):
        if not isinstance(material.strength, NoStrength | ElasticStrength | VonMises):
            fault = f"no exact waves for strength '{material.strength.name}'; allowed: none, elastic, von_mises"
            raise CaseError(fault, where=material.name)
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
        """Return a tension beyond the strength of any condensed matter: half the initial rho c^2."""
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
        """Return the volume at which the deviator reaches `sign` times its limit elastically; None if it does not."""
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
        final = residual(first)
        for _ in range(50):
            slope = (residual(final) - residual(first)) / (final - first) if final != first else 0.0
            first, final = final, final + (residual(final) - final) / (1.0 - slope)
            if abs(final - first) <= 1e-15 * abs(final):
                break
        return self._wave(state, volume, final, deviator, direction)

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
        inner, stride = state.volume, -1.2 * change / stiffness
        for _ in range(200):
            stride = max(stride, -0.3 * inner)
            outer = inner + stride
            if (excess(outer) < 0.0) == (change < 0.0):
                volume = bracketed_root(excess, inner, outer)
                return self._wave(state, volume, stress, self._deviator(state, volume), direction)
            inner = outer
        raise RunError(f"{self.material.name}: no state at {stress:.6g} Pa can be reached from {state.stress:.6g} Pa")

    def _residue(self, state: State) -> float:
        """Return the error of a state's stress by rounding and omitted waves; it is no wave."""
        return self.pressure(state.density, state.energy) - state.deviator - state.stress

    def _wave(self, state: State, volume: float, stress: float, deviator: float, direction: int) -> Wave:
        flux = sqrt((stress - state.stress) / (state.volume - volume))
        energy = state.energy + 0.5 * (state.stress + stress) * (state.volume - volume)
        velocity = state.velocity + direction * (stress - state.stress) / flux
        return flux, State(self, velocity, stress, volume, energy, deviator)
