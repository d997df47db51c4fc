"""Shock Hugoniots, impedance matching of two materials, the waves ahead of a piston, and entropy.

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

Specific entropy gives melt and vapour after release. With a Grueneisen coefficient that is a function of density alone,
and e_s, theta of the isentrope through the state at rest (`materials.isentrope`), here also below rho0:

    S = S_rest + int dh/tau,    h = (e - e_s(rho))/theta(rho),    tau = T/theta(rho);    c_v ln(tau/T_room) for one c_v

A variable heat capacity takes up the heat of melting, T_m (S_cm - S_im) unless given. Tillotson, whose coefficient
depends on energy, along the Hugoniot of the material at rest, over the peak pressure:

    T dS = ((V0 - V) dp + (p - p0) dV)/2

Tables have their own, S = (e - A)/T where they hold the free energy A. Release is isentropic, so that the fractions
that melt and vaporise follow from the lever at 1 bar (`measures.pressure`). Ahrens & O'Keefe 1972, The Moon 4, 214.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import inf, log, sqrt

import numpy as np
import scipy

from hvisph.compiler.jit import python_twin
from hvisph.core.errors import CaseError, RunError
from hvisph.exact.wave_curves import bracketed_root
from hvisph.materials import isentrope, slots, thermodynamics
from hvisph.materials.eos import Table, Tillotson
from hvisph.materials.eos.table import STRETCH
from hvisph.materials.material_table import Material, pack
from hvisph.materials.porosity import crush_curve
from hvisph.materials.slots import INVERSE_HEAT_CAPACITY, MELT_TEMPERATURE, ROOM_TEMPERATURE


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
    """Return the state behind the shock to `particle_velocity` [m/s]; raises `RunError` where there is none."""
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
        shocked = state(shock_speed)
        alpha = 1.0 if pores is None else python_twin(crush_curve)(shocked.pressure, row)
        return solid(alpha * shocked.density, shocked.energy) / alpha - shocked.pressure

    # From above: near U = u some equations of state have left their range and have other roots.
    high = 10.0 * (c0 + u)
    margin = high - u
    for _ in range(400):
        low = u + 0.9 * margin
        if excess(low) > 0.0:
            return state(bracketed_root(excess, low, u + margin))
        margin *= 0.9
    raise RunError(f"{material.name}: no shock reaches a particle velocity of {u:.6g} m/s")


def impedance_match(projectile: Material, target: Material, velocity: float) -> Impact:
    """Return the state at the interface after a flat impact at `velocity` [m/s] on a target at rest."""

    def excess(interface: float) -> float:
        return shock(projectile, velocity - interface).pressure - shock(target, interface).pressure

    interface = bracketed_root(excess, 0.0, velocity)
    projectile_state, target_state = shock(projectile, velocity - interface), shock(target, interface)
    return Impact(
        interface_velocity=interface,
        pressure=target_state.pressure,
        projectile=projectile_state,
        target=target_state,
        projectile_shock_velocity=velocity - projectile_state.shock_speed,
        target_shock_velocity=target_state.shock_speed,
    )


SHOCKED = 1e6  # strain rate in a shock [1/s]
_FIRST, _GROWTH, _STEP = 2e-5, 1.1, 1.5e-3  # of the compression eta from point to point
_MOST = 0.9  # compression
Stress = Callable[[float, float], float]  # [Pa], of density [kg/m^3] and energy [J/kg]


def last_waves(material: Material, velocities: Sequence[float], strength: bool = True) -> list[float]:
    """Return the speed of the last wave [m/s] behind which matter moves with each of the particle velocities [m/s].

    `velocities`: particle velocities [m/s], above zero.
    Returns speeds in the laboratory; not a number beyond where the material's models end.
    """
    stress = _stress(material, strength and material.shear_modulus > 0.0)
    ups, speeds = _integrate_wave(stress, material, max(velocities))
    return [float(np.interp(u, ups, speeds, right=np.nan)) for u in velocities]


def _stress(material: Material, strength: bool) -> Stress:
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


def _integrate_wave(stress: Stress, material: Material, highest: float) -> tuple[list[float], list[float]]:
    """Return particle velocity and speed of the last wave [m/s] up to `highest`."""
    v0, e0 = 1.0 / material.density, material.eos.ambient_energy
    corners = [(v0, stress(material.density, e0), e0, 0.0)]  # volume, stress, energy, particle velocity
    ups, speeds = [0.0], [0.0]
    eta, step = 0.0, _FIRST
    while eta < _MOST:
        eta, step = eta + step, min(step * _GROWTH, _STEP)
        v = v0 * (1.0 - eta)
        while True:
            corner = corners[-1]
            sigma = _stress_behind_shock(stress, v, corner)
            slope = (sigma - corner[1]) / (corner[0] - v)
            if len(corners) == 1 or slope < (corner[1] - corners[-2][1]) / (corners[-2][0] - corner[0]):
                break
            corners.pop()
        if not 0.0 < slope < inf:
            continue  # strength goes where it melts, and the stress with it
        e = corner[2] + 0.5 * (sigma + corner[1]) * (corner[0] - v)
        velocity = corner[3] + sqrt((sigma - corner[1]) * (corner[0] - v))
        if velocity <= ups[-1]:
            continue
        ups.append(velocity)
        speeds.append(corner[3] + corner[0] * sqrt(slope))
        corners.append((v, sigma, e, velocity))
        if velocity > highest:
            break
    speeds[0] = speeds[1]
    return ups, speeds


def _stress_behind_shock(stress: Stress, v: float, initial: tuple[float, ...]) -> float:
    """Return the stress [Pa] behind a shock from the state `initial` to the volume `v`, by secants."""

    def excess(sigma: float) -> float:
        return stress(1.0 / v, initial[2] + 0.5 * (sigma + initial[1]) * (initial[0] - v)) - sigma

    first = stress(1.0 / v, initial[2])
    trial = first + excess(first)
    at_first, at_second = excess(first), excess(trial)
    for _ in range(4):
        if at_second == at_first or abs(at_second) < 1e-9 * abs(trial):
            break
        first, trial = trial, trial - at_second * (trial - first) / (at_second - at_first)
        at_first, at_second = at_second, excess(trial)
    return trial


SHOCKS = 240  # points of a Hugoniot, to FASTEST of the bulk sound speed in particle velocity
SLOWEST, FASTEST = 1e-3, 8.0
ENERGIES = 200  # points of the density without pressure, and of a table's columns
HOTTEST = 0.3  # energy to which that density is sought, of the square of the sound speed


def entropy(
    material: Material, rho: np.ndarray, e: np.ndarray, distension: np.ndarray | float, peak: np.ndarray
) -> np.ndarray:
    """Return the specific entropy (n,) [J/(kg K)] of particles of a `material` with `entropies`.

    `rho`, `e`, `distension`, `peak`: density [kg/m^3], energy [J/kg], distension [-], highest pressure so far [Pa],
    (n,). Raises `CaseError` for a table without entropies.
    """
    if isinstance(material.eos, Table):
        return _entropy_of_table(material.eos, rho * distension, e)
    entropy_at_rest = material.entropies[0]
    if isinstance(material.eos, Tillotson):
        return np.asarray(entropy_at_rest + np.interp(peak, *_entropy_of_shocks(material)))
    return entropy_at_rest + _entropy_of_heat(material, rho * distension, e)


@lru_cache(maxsize=16)
def _entropy_of_shocks(material: Material) -> tuple[np.ndarray, np.ndarray]:
    """Return pressures [Pa] behind shocks and the entropy that they have added [J/(kg K)]."""
    row = slots.values(material.whole_row)
    states = []
    speeds = np.geomspace(SLOWEST, FASTEST, SHOCKS) * material.bulk_sound_speed
    for u in speeds:
        try:
            state = shock(material, float(u))
        except (RunError, ArithmeticError):
            break
        alpha = 1.0 if material.porosity is None else python_twin(crush_curve)(state.pressure, row)
        heat = material.temperature(alpha * state.density, state.energy)
        states.append((state.pressure, 1.0 / state.density, heat))
    p, v, t = np.array(states).T
    log_speed = np.log(speeds[: len(p)])
    slope_p, slope_v = (scipy.interpolate.CubicSpline(log_speed, column)(log_speed, 1) for column in (p, v))
    before = shock(material, 0.0)
    rate = 0.5 * ((1.0 / before.density - v) * slope_p + (p - before.pressure) * slope_v) / t
    return p, scipy.interpolate.CubicSpline(log_speed, rate).antiderivative()(log_speed)


def _entropy_of_heat(material: Material, rho: np.ndarray, e: np.ndarray) -> np.ndarray:
    """Return entropy above that at rest [J/(kg K)] at density `rho` of the solid [kg/m^3] and energy `e` [J/kg]."""
    densities, curve, unloaded, (heats, tau, entropies) = _thermal_tables(material)
    ambient = material.whole_row[ROOM_TEMPERATURE]
    rho = np.maximum(rho, np.interp(e, *unloaded))  # voids between it are none of the matter
    theta = np.interp(rho, densities, curve[:, 1]) / ambient
    h = (e - np.interp(rho, densities, curve[:, 0])) / theta
    last = (heats[-1] - heats[-2]) / (tau[-1] - tau[-2])  # held beyond the table
    extrapolation = last * np.log1p(np.maximum(h - heats[-1], 0.0) / (last * tau[-1]))
    return np.asarray(np.interp(h, heats, entropies) + extrapolation)


@lru_cache(maxsize=16)
def _thermal_tables(material: Material) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return densities and isentrope, density without pressure over energy (2, k), and h, tau and S (3, k)."""
    row, pressure = material.whole_row, material.pressure_function()
    rho0, e0, ambient = material.density, material.eos.ambient_energy, float(row[ROOM_TEMPERATURE])
    curve = isentrope.tabulate_isentrope(pressure, rho0, e0, ambient, held=False)
    densities = rho0 * np.linspace(isentrope.LOWEST, isentrope.HIGHEST, isentrope.POINTS)
    energies = e0 + np.linspace(0.0, HOTTEST * material.bulk_sound_speed**2, ENERGIES)
    unloaded = isentrope.densities_without_pressure(pressure, rho0, energies)
    finite = np.isfinite(unloaded)
    if material.heat_capacities:
        melts = float(row[MELT_TEMPERATURE])
        latent = (melts, melts * (material.entropies[2] - material.entropies[1])) if melts < np.inf else None
        start, per, tau = isentrope.heat_table(
            material.heat_capacities, material.heat_of_melting or latent, curve, pressure, (rho0, e0, ambient)
        )
        heats, tau = start + np.arange(len(tau)) / per, tau * ambient
        entropies = np.concatenate([[0.0], np.cumsum(0.5 * (1.0 / tau[1:] + 1.0 / tau[:-1]) * np.diff(heats))])
        entropies -= np.interp(0.0, heats, entropies)
    else:
        capacity = 1.0 / row[INVERSE_HEAT_CAPACITY]
        tau = np.geomspace(1.0, 1e3 * ambient, 4000)
        heats, entropies = capacity * (tau - ambient), capacity * np.log(tau / ambient)
    return densities, curve, np.array([energies, unloaded])[:, finite], np.array([heats, tau, entropies])


def _entropy_of_table(eos: Table, rho: np.ndarray, e: np.ndarray) -> np.ndarray:
    """Return the entropy of a table [J/(kg K)], linear between its densities and between shares of their energies."""
    if eos.grid.entropy is None:
        raise CaseError("the table holds no entropy and no free energy", where=eos.name)
    x = np.linspace(0.0, 1.0, ENERGIES)
    cold, span, columns = eos.grid.columns(np.expm1(STRETCH * x) / np.expm1(STRETCH), eos.grid.entropy)
    log_density = np.log(eos.grid.density)
    at = np.clip(np.log(rho), log_density[0], log_density[-1])
    relative = (e - np.interp(at, log_density, cold)) / np.interp(at, log_density, span)
    place = np.log1p(np.clip(relative, 0.0, 1.0) * np.expm1(STRETCH)) / STRETCH * (ENERGIES - 1)
    i = np.clip(np.searchsorted(log_density, at, side="right") - 1, 0, len(log_density) - 2)
    j = np.minimum(place.astype(int), ENERGIES - 2)
    s, t = (at - log_density[i]) / (log_density[i + 1] - log_density[i]), place - j
    low, high = ((1.0 - t) * columns[k, j] + t * columns[k, j + 1] for k in (i, i + 1))
    return np.asarray((1.0 - s) * low + s * high)
