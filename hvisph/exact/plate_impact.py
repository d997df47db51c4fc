"""Exact plate impact in uniaxial strain: elastic-plastic plates, and layers without strength.

A flyer plate hits a target plate; in each an elastic precursor runs ahead of a plastic shock, or one front where the
impact is strong enough to overdrive it. `impact` gives the plateau between the two materials, `profile` the stress
before any reflection, and `with_reflections` follows all later waves: release at the free surfaces, elastic first and
then plastic, and what comes of it when waves cross.

Equations of state: any. Strength: none, elastic or von Mises.

Layers with p = K (rho/rho0 - 1) (Zisis 2013): shocks obey p = rho0 u U with U = (u + sqrt(u^2 + 4 c^2))/2, rarefactions
du = c drho/rho; both are followed through all reflections by `wave_fronts.track`. All consistent units do; Zisis's have
rho0 = 1 for the projectile and K = rho0/Ca.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.materials.eos import Elastic, Linear
from hvisph.materials.material_table import Material

from .wave_curves import Law, LinearLaw, SolidLaw, State, Wave, bracketed_root
from .wave_fronts import Layer, Tracked, track


@dataclass(frozen=True)
class PlateImpact:
    """The state between two plates just after impact, and the fronts from it, in the frame of the case."""

    interface_velocity: float  # [m/s]
    stress: float  # compressive stress along x on the plateau [Pa]
    flyer: State  # state of the flyer on the plateau
    target: State  # state of the target on the plateau
    flyer_fronts: "tuple[Front, ...]"  # fastest first
    target_fronts: "tuple[Front, ...]"  # fastest first

    def profile(self, x: np.ndarray, time: float, name: str = "stress") -> np.ndarray:
        """Return a quantity of `State` at `x` [m] from the impact face, before reflections."""
        values = np.full(np.shape(x), getattr(self.flyer, name), dtype=float)
        x = np.asarray(x)
        values[x > self.interface_velocity * time] = getattr(self.target, name)
        for front in reversed(self.flyer_fronts):
            values[x < front.velocity * time] = getattr(front.ahead, name)
        for front in reversed(self.target_fronts):
            values[x > front.velocity * time] = getattr(front.ahead, name)
        return values


@dataclass(frozen=True)
class Front:
    """A front before any reflection."""

    velocity: float  # in the frame of the case [m/s]
    speed: float  # relative to the matter ahead [m/s]
    ahead: State
    behind: State


Plates = Sequence[tuple[Material, float, float, float]]  # material, begin [m], end [m], velocity [m/s], left to right


def impact(flyer: Material, target: Material, velocity: float, target_velocity: float = 0.0) -> PlateImpact:
    """Return the plateau and the fronts of a flat impact.

    `velocity`, `target_velocity`: of flyer and target [m/s]; the flyer must be the faster.
    Raises `CaseError` if a strength model has no exact waves; `RunError` if no state satisfies the jump conditions.
    """
    left, right = SolidLaw(flyer).at_rest(velocity), SolidLaw(target).at_rest(target_velocity)

    def waves(stress: float) -> tuple[list[Wave], list[Wave]]:
        return left.law.waves(left, stress, -1, 0.01), right.law.waves(right, stress, 1, 0.01)

    def excess(stress: float) -> float:
        left_waves, right_waves = waves(stress)
        return right_waves[-1][1].velocity - left_waves[-1][1].velocity

    closing = velocity - target_velocity
    high = flyer.density * flyer.longitudinal_sound_speed * closing
    while excess(high) < 0.0:
        high *= 2.0
    stress = bracketed_root(excess, max(left.stress, right.stress) + 1e-9 * high, high)
    flyer_waves, target_waves = waves(stress)
    return PlateImpact(
        interface_velocity=target_waves[-1][1].velocity,
        stress=stress,
        flyer=flyer_waves[-1][1],
        target=target_waves[-1][1],
        flyer_fronts=_fronts(left, flyer_waves, -1),
        target_fronts=_fronts(right, target_waves, 1),
    )


def _fronts(state: State, waves: Sequence[Wave], direction: int) -> tuple[Front, ...]:
    fronts = []
    for flux, state_behind in waves:
        speed = flux * state.volume
        fronts.append(Front(state.velocity + direction * speed, speed, state, state_behind))
        state = state_behind
    return tuple(fronts)


def with_reflections(plates: Plates, end: float, strain_step: float = 0.004) -> Tracked:
    """Follow all waves in plates that hit one another up to a time `end` [s]; there may be gaps between them.

    Crossing elastic waves multiply without end, so the weakest are left out: momentum balances
    to about 1e-3, and plateaus are good to as much. Late, when very many are alive, more are left
    out (see `wave_fronts.track`), and momentum balances to a few 1e-3.

    `strain_step`: change of ln(rho) by which rarefactions are cut into fronts.
    Returns free-surface velocities by `.surface()`, histories by `.sample(...)`, profiles by `.profile(time)`.
    """
    return track(_layers(plates, SolidLaw), end, strain_step, weakest=5e-4, border=1e-2)


def _layers(plates: Plates, law_of: Callable[[Material], Law]) -> list[Layer]:
    laws = {material: law_of(material) for material, *_ in plates}
    return [Layer(laws[material], begin, finish, velocity) for material, begin, finish, velocity in plates]


def barotropic_law(material: Material) -> LinearLaw:
    """Return a barotropic material's waves; `CaseError` unless it is `linear` or `elastic` without strength."""
    if not isinstance(material.eos, Linear | Elastic):
        fault = f"layered impact is exact for the 'linear' equation of state, not '{material.eos.name}'"
        raise CaseError(fault, where=material.name)
    if material.shear_modulus != 0.0:
        raise CaseError("layered impact is exact for materials without strength", where=material.name)
    return LinearLaw.from_material(material)


def layered_impact(layers: Plates, end: float, strain_step: float = 0.01) -> Tracked:
    """Follow the impact of barotropic layers up to a time `end` [s]; there may be gaps between them.

    `strain_step`: change of ln(rho) by which rarefactions are cut into fronts.
    Returns histories by `.sample(position, times, "velocity")`, profiles by `.profile(time)`.
    """
    return track(_layers(layers, barotropic_law), end, strain_step)
