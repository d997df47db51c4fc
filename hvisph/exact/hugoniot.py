"""Shock Hugoniots of the equations of state, and impedance matching of two materials.

A steady shock of speed U into material at rest, particle velocity u behind it:

    rho (U - u) = rho0 U,    p = p0 + rho0 U u,    e = e0 + u^2/2 + p0 u / (rho0 U)

Of porous material rho0 is the density with its pores, and p = p_s(alpha rho, e)/alpha behind the shock, alpha that of
the crush curve at p; an elastic precursor, which runs ahead of slow ones, is left out.
Hydrodynamic: strength is left out; `plate_impact` has it.
"""

from __future__ import annotations

from dataclasses import dataclass

from hvisph.compiler.jit import python_twin
from hvisph.core.errors import RunError
from hvisph.materials import slots
from hvisph.materials.material_table import Material
from hvisph.materials.porosity import crush_curve

from .wave_curves import bracketed_root


@dataclass(frozen=True)
class ShockState:
    """What is behind a shock into material at rest."""

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

    Raises
    ------
    RunError
        If the equation of state has no such shock.
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
