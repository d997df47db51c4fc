"""Specific entropy of a state, by which melt and vapour after release follow.

With a Grueneisen coefficient that is a function of density alone, and e_s, theta of the isentrope through the state
at rest (`materials.isentrope`), here also below rho0:

    S = S_rest + int dh/tau,    h = (e - e_s(rho))/theta(rho),    tau = T/theta(rho);    c_v ln(tau/T_room) for one c_v

A variable heat capacity takes up the heat of melting, T_m (S_cm - S_im) unless given. Tillotson, whose coefficient
depends on energy, along the Hugoniot of the material at rest, over the peak pressure:

    T dS = ((V0 - V) dp + (p - p0) dV)/2

Tables have their own, S = (e - A)/T where they hold the free energy A. Release is isentropic, so that the fractions
that melt and vaporise follow from the lever at 1 bar (`measures.pressure`). Ahrens & O'Keefe 1972, The Moon 4,
214.
"""

from functools import lru_cache

import numpy as np

from hvisph.compiler.jit import python_twin
from hvisph.core.errors import CaseError, RunError
from hvisph.materials import isentrope, slots
from hvisph.materials.eos import Table, Tillotson
from hvisph.materials.eos.table import STRETCH
from hvisph.materials.material_table import Material
from hvisph.materials.porosity import crush_curve
from hvisph.materials.slots import INVERSE_HEAT_CAPACITY, MELT_TEMPERATURE, ROOM_TEMPERATURE

from .hugoniot import shock

SHOCKS = 240  # points of a Hugoniot, to FASTEST of the bulk sound speed in particle velocity
SLOWEST, FASTEST = 1e-3, 8.0
ENERGIES = 200  # points of the density without pressure, and of a table's columns
HOTTEST = 0.3  # energy to which that density is sought, of the square of the sound speed


def entropy(
    material: Material, rho: np.ndarray, e: np.ndarray, distension: np.ndarray | float, peak: np.ndarray
) -> np.ndarray:
    """Return the specific entropy of particles, (n,) [J/(kg K)].

    `material`: with `entropies`, the first of which is that at rest, and a heat capacity or a table.
    `rho`, `e`: density [kg/m^3] and energy [J/kg], (n,).
    `distension`: of porous material, (n,) [-].
    `peak`: highest pressure so far [Pa], (n,).

    Raises `CaseError` for a table without entropies.
    """
    if isinstance(material.eos, Table):
        return _entropy_of_table(material.eos, rho * distension, e)
    rest = material.entropies[0]
    if isinstance(material.eos, Tillotson):
        return np.asarray(rest + np.interp(peak, *_entropy_of_shocks(material)))
    return rest + _entropy_of_heat(material, rho * distension, e)


@lru_cache(maxsize=16)
def _entropy_of_shocks(material: Material) -> tuple[np.ndarray, np.ndarray]:
    """Return pressures [Pa] behind shocks and the entropy that they have added [J/(kg K)]."""
    from scipy.interpolate import CubicSpline

    row = slots.values(material.whole_row)
    states = []
    speeds = np.geomspace(SLOWEST, FASTEST, SHOCKS) * material.bulk_sound_speed
    for u in speeds:
        try:
            behind = shock(material, float(u))
        except (RunError, ArithmeticError):
            break
        alpha = 1.0 if material.porosity is None else python_twin(crush_curve)(behind.pressure, row)
        heat = material.temperature(alpha * behind.density, behind.energy)
        states.append((behind.pressure, 1.0 / behind.density, heat))
    p, v, t = np.array(states).T
    along = np.log(speeds[: len(p)])
    slope_p, slope_v = (CubicSpline(along, one)(along, 1) for one in (p, v))
    before = shock(material, 0.0)
    rate = 0.5 * ((1.0 / before.density - v) * slope_p + (p - before.pressure) * slope_v) / t
    return p, CubicSpline(along, rate).antiderivative()(along)


def _entropy_of_heat(material: Material, rho: np.ndarray, e: np.ndarray) -> np.ndarray:
    """Return entropy above that at rest [J/(kg K)] at density `rho` of the solid [kg/m^3] and energy `e` [J/kg]."""
    densities, curve, loose, (heats, tau, entropies) = _thermal_tables(material)
    ambient = material.whole_row[ROOM_TEMPERATURE]
    rho = np.maximum(rho, np.interp(e, *loose))  # voids between it are none of the matter
    theta = np.interp(rho, densities, curve[:, 1]) / ambient
    h = (e - np.interp(rho, densities, curve[:, 0])) / theta
    last = (heats[-1] - heats[-2]) / (tau[-1] - tau[-2])  # held beyond the table
    beyond = last * np.log1p(np.maximum(h - heats[-1], 0.0) / (last * tau[-1]))
    return np.asarray(np.interp(h, heats, entropies) + beyond)


@lru_cache(maxsize=16)
def _thermal_tables(material: Material) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return densities and isentrope, density without pressure over energy (2, k), and h, tau and S (3, k)."""
    row, pressure = material.whole_row, material.pressure_function()
    rho0, e0, ambient = material.density, material.eos.ambient_energy, float(row[ROOM_TEMPERATURE])
    curve = isentrope.tabulate_isentrope(pressure, rho0, e0, ambient, held=False)
    densities = rho0 * np.linspace(isentrope.LOWEST, isentrope.HIGHEST, isentrope.POINTS)
    energies = e0 + np.linspace(0.0, HOTTEST * material.bulk_sound_speed**2, ENERGIES)
    loose = isentrope.densities_without_pressure(pressure, rho0, energies)
    known = np.isfinite(loose)
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
    return densities, curve, np.array([energies, loose])[:, known], np.array([heats, tau, entropies])


def _entropy_of_table(eos: Table, rho: np.ndarray, e: np.ndarray) -> np.ndarray:
    """Return the entropy of a table [J/(kg K)], linear between its densities and between shares of their energies."""
    if eos.grid.entropy is None:
        raise CaseError("the table holds no entropy and no free energy", where=eos.name)
    x = np.linspace(0.0, 1.0, ENERGIES)
    cold, span, columns = eos.grid.columns(np.expm1(STRETCH * x) / np.expm1(STRETCH), eos.grid.entropy)
    known = np.log(eos.grid.density)
    at = np.clip(np.log(rho), known[0], known[-1])
    relative = (e - np.interp(at, known, cold)) / np.interp(at, known, span)
    place = np.log1p(np.clip(relative, 0.0, 1.0) * np.expm1(STRETCH)) / STRETCH * (ENERGIES - 1)
    i = np.clip(np.searchsorted(known, at, side="right") - 1, 0, len(known) - 2)
    j = np.minimum(place.astype(int), ENERGIES - 2)
    s, t = (at - known[i]) / (known[i + 1] - known[i]), place - j
    low, high = ((1.0 - t) * columns[k, j] + t * columns[k, j + 1] for k in (i, i + 1))
    return np.asarray((1.0 - s) * low + s * high)
