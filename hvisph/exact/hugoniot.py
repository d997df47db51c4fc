"""Shock Hugoniots, impedance matching of two materials, and the waves ahead of a piston.

A steady shock of speed U into material at rest, particle velocity u behind it:

    rho (U - u) = rho0 U,    p = p0 + rho0 U u,    e = e0 + u^2/2 + p0 u / (rho0 U)

Of porous material rho0 is the density with its pores, and p = p_s(alpha rho, e)/alpha behind the shock, alpha that of
the crush curve at p; an elastic precursor, which runs ahead of slow ones, is left out.
Hydrodynamic: strength is left out; `plate_impact` has it.

A constant piston velocity sends several waves into a material with strength and phase changes (`last_waves`):

    sigma(v) = p(rho, e) + min(4/3 G ln(rho/rho0), 2/3 Y),    e = e_s + (sigma + sigma_s)(v_s - v)/2
    up = sum over the waves of (d sigma d v)^(1/2),    Us of the last = up ahead + v ahead (d sigma/d v)^(1/2)

Compression runs along the upper hull of sigma over the specific volume v: every chord of it is a shock, and what lies
ahead of a chord is faster. A solid sends an elastic wave ahead of its plastic one, up to where that overtakes it; iron
splits once more at its transition. (sigma_s, v_s) is the corner before v, which the shock to v runs into. What
is measured beside an elastic precursor is the last wave: in the laboratory it runs into matter that moves already.

Y is that at a strain rate of `SHOCKED` and the plastic strain of the compression. Steady waves: no relaxation.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf, log, sqrt

import numpy as np

from hvisph.compiler.jit import python_twin
from hvisph.core.errors import RunError
from hvisph.exact.wave_curves import bracketed_root
from hvisph.materials import slots, thermodynamics
from hvisph.materials.material_table import Material, pack
from hvisph.materials.porosity import crush_curve


@dataclass(frozen=True)
class ShockState:
    """State behind a shock into material at rest."""

    particle_velocity: float  # u, in the direction of the shock [m/s]
    shock_speed: float  # U, relative to the material ahead [m/s]
    pressure: float  # [Pa]
    density: float  # [kg/m^3]
    energy: float  # specific internal energy [J/kg]


@dataclass(frozen=True)
class Impact:
    """Two materials just after a flat impact; velocities are the target's frame."""

    interface_velocity: float  # [m/s]
    pressure: float  # [Pa]
    projectile: ShockState  # seen from the unshocked projectile
    target: ShockState  # seen from the unshocked target
    projectile_shock_velocity: float  # of the shock in the projectile [m/s]
    target_shock_velocity: float  # of the shock in the target [m/s]


def shock(material: Material, particle_velocity: float) -> ShockState:
    """Return the state behind the shock that drives `material` to `particle_velocity` [m/s].

    Raises `RunError` if the equation of state has no such shock.
    """
    rho0, u = material.density_at_rest, particle_velocity
    e0 = material.eos.ambient_energy
    solid, pores = material.pressure_function(), material.porosity
    p0 = solid(material.density, e0)
    row = () if pores is None else slots.values(material.whole_row)
    c0 = material.bulk_sound_speed
    if u < 0.0:
        raise RunError(f"a shock cannot have a particle velocity below zero ({u:.6g} m/s)")
    if u == 0.0:
        return ShockState(0.0, c0, p0, rho0, e0)

    def state(shock_speed: float) -> ShockState:
        rho = rho0 * shock_speed / (shock_speed - u)
        e = e0 + 0.5 * u * u + p0 * u / (rho0 * shock_speed)
        return ShockState(u, shock_speed, p0 + rho0 * shock_speed * u, rho, e)

    def excess(shock_speed: float) -> float:
        behind = state(shock_speed)
        alpha = 1.0 if pores is None else python_twin(crush_curve)(behind.pressure, row)
        return solid(alpha * behind.density, behind.energy) / alpha - behind.pressure

    # From above: near U = u some equations of state have left their range and have other roots.
    high = 10.0 * (c0 + u)
    lead = high - u
    for _ in range(400):
        low = u + 0.9 * lead
        if excess(low) > 0.0:
            return state(bracketed_root(excess, low, u + lead))
        lead *= 0.9
    raise RunError(f"{material.name}: no shock reaches a particle velocity of {u:.6g} m/s")


def impedance_match(projectile: Material, target: Material, velocity: float) -> Impact:
    """Return the state at the interface after a flat impact at `velocity` [m/s] on a target at rest."""

    def excess(interface: float) -> float:
        return shock(projectile, velocity - interface).pressure - shock(target, interface).pressure

    interface = bracketed_root(excess, 0.0, velocity)
    behind, ahead = shock(projectile, velocity - interface), shock(target, interface)
    return Impact(
        interface_velocity=interface,
        pressure=ahead.pressure,
        projectile=behind,
        target=ahead,
        projectile_shock_velocity=velocity - behind.shock_speed,
        target_shock_velocity=ahead.shock_speed,
    )


SHOCKED = 1e6  # strain rate in a shock [1/s]
_FIRST, _GROWTH, _STEP = 2e-5, 1.1, 1.5e-3  # of the compression eta from point to point
_MOST = 0.9  # compression


def last_waves(material: Material, velocities: Sequence[float], strength: bool = True) -> list[float]:
    """Return the speed of the last wave [m/s] behind which matter moves with each of the particle velocities [m/s].

    `material`: the material, without pores.
    `velocities`: particle velocities [m/s], above zero.
    `strength`: whether its strength counts.

    Returns speeds in the laboratory; not a number beyond where the material's models end.
    """
    ups, speeds = _integrate_wave(
        _stress(material, strength and material.shear_modulus > 0.0), material, max(velocities)
    )
    return [float(np.interp(up, ups, speeds, right=np.nan)) for up in velocities]


def _stress(material: Material, strength: bool) -> Callable[[float, float], float]:
    """Return the stress [Pa] of density and energy along uniaxial compression."""
    pressure, rho0 = material.pressure_function(), material.density
    if not strength:
        return pressure
    table, models = pack([material])
    flow = python_twin(thermodynamics.flow_stress)

    def stress(rho: float, e: float) -> float:
        p, strain = pressure(rho, e), log(rho / rho0)
        y, shear = flow(table, models, 0, rho, e, p, 2.0 / 3.0 * strain, 0.0, SHOCKED)
        return float(p + min(4.0 / 3.0 * shear * strain, 2.0 / 3.0 * y))

    return stress


def _integrate_wave(
    stress: Callable[[float, float], float], material: Material, highest: float
) -> tuple[list[float], list[float]]:
    """Return particle velocity and speed of the last wave [m/s] up to `highest`."""
    v0, e0 = 1.0 / material.density, material.eos.ambient_energy
    corners = [(v0, stress(material.density, e0), e0, 0.0)]  # volume, stress, energy, particle velocity
    ups, speeds = [0.0], [0.0]
    eta, step = 0.0, _FIRST
    while eta < _MOST:
        eta, step = eta + step, min(step * _GROWTH, _STEP)
        v = v0 * (1.0 - eta)
        while True:
            ahead = corners[-1]
            sigma = _stress_behind_shock(stress, v, ahead)
            slope = (sigma - ahead[1]) / (ahead[0] - v)
            if len(corners) == 1 or slope < _slope(corners[-2], ahead):
                break
            corners.pop()
        if not 0.0 < slope < inf:
            continue  # strength goes where it melts, and the stress with it
        e = ahead[2] + 0.5 * (sigma + ahead[1]) * (ahead[0] - v)
        up = ahead[3] + sqrt((sigma - ahead[1]) * (ahead[0] - v))
        if up <= ups[-1]:
            continue
        ups.append(up)
        speeds.append(ahead[3] + ahead[0] * sqrt(slope))
        corners.append((v, sigma, e, up))
        if up > highest:
            break
    speeds[0] = speeds[1]
    return ups, speeds


def _slope(ahead: tuple[float, ...], behind: tuple[float, ...]) -> float:
    return (behind[1] - ahead[1]) / (ahead[0] - behind[0])


def _stress_behind_shock(stress: Callable[[float, float], float], v: float, ahead: tuple[float, ...]) -> float:
    """Return the stress [Pa] behind a shock from the state `ahead` to the volume `v`, by secants."""

    def excess(sigma: float) -> float:
        return stress(1.0 / v, ahead[2] + 0.5 * (sigma + ahead[1]) * (ahead[0] - v)) - sigma

    first = stress(1.0 / v, ahead[2])
    second = first + excess(first)
    at_first, at_second = excess(first), excess(second)
    for _ in range(4):
        if at_second == at_first or abs(at_second) < 1e-9 * abs(second):
            break
        first, second = second, second - at_second * (second - first) / (at_second - at_first)
        at_first, at_second = at_second, excess(second)
    return second
