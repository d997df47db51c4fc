"""Temperature from energy relative to the isentrope through the state at rest.

    T = T_s(rho) + (e - e_s(rho)) / c_v,    not below 1 K
    de_s/drho = p(rho, e_s)/rho^2,          e_s(rho0) = ambient energy
    dT_s/drho = T_s Gamma/rho,              T_s(rho0) = T_room,  Gamma = p_e/rho

    T = theta tau,    e - e_s(rho) = theta h(tau),    h(tau) = int c dtau from T_room,    theta = T_s(rho)/T_room

The isentrope is tabulated at 511 densities from 0.5 to 3 rho0, linear between them and constant
outside; T_s = T_room below rho0. A temperature-dependent heat capacity is a function of the scaled
temperature tau = T/theta, otherwise T would not be the derivative of energy by entropy. h follows
from c_p(T) measured at zero pressure, less the work of expansion, in 512 steps. With a heat of
melting T stays at the melting point while material melts, which is right after release and too
early under pressure. `total_energy` takes all energy as heat, T = T_room + max(e, 0)/c_v (Young
2021): 870 K instead of 490 K behind a shock of 1 km/s in aluminium.
"""

from collections.abc import Callable, Sequence

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.compiler.vector.api import number_at

from .slots import (
    ADDRESS,
    CURVE,
    HEAT_PER,
    HEAT_START,
    INVERSE_HEAT_CAPACITY,
    INVERSE_RHO0,
    ROOM_TEMPERATURE,
    TOTAL_ENERGY,
)

POINTS = 511  # one of them is rho0 itself
LOWEST, HIGHEST = 0.5, 3.0  # of rho0
WIDTH = 3  # numbers in the row for each density in turn: e_s, T_s, T_room/T_s
CURVE_LENGTH = WIDTH * POINTS
HEAT_POINTS = 512
HEATS = CURVE + CURVE_LENGTH  # behind them in the row: tau/T_room of each heat
CRUSH = HEATS + HEAT_POINTS  # then points of a crush curve, see `porosity`: pressure and distension in turn
CRUSH_POINTS = 16
LENGTH = CURVE_LENGTH + HEAT_POINTS + 2 * CRUSH_POINTS
_PER_SHARE = (POINTS - 1) / (HIGHEST - LOWEST)
_STEPS = 4  # Runge-Kutta steps between two points
_LEAST = 1.0  # [K]
_HEATS = 120  # temperatures at which heat is added up


@inline
def temperature(rho, e, row):
    """Temperature [K] at density `rho` [kg/m^3] and energy `e` [J/kg]; that at rest without a heat capacity."""
    ambient, inverse = row[ROOM_TEMPERATURE], row[INVERSE_HEAT_CAPACITY]
    if inverse == 0.0:
        return ambient
    if row[TOTAL_ENERGY] > 0.0:
        return ambient + max(e, 0.0) * inverse
    place = min(max((rho * row[INVERSE_RHO0] - LOWEST) * _PER_SHARE, 0.0), POINTS - 1.001)
    k = int(place)
    share = place - k
    at = CURVE + WIDTH * k
    address = row[ADDRESS]
    cold, next_cold = number_at(address, at), number_at(address, at + WIDTH)
    of_isentrope, after = number_at(address, at + 1), number_at(address, at + WIDTH + 1)
    heat = e - (cold + share * (next_cold - cold))
    at_rest = of_isentrope + share * (after - of_isentrope)
    if row[HEAT_PER] > 0.0:
        per_theta, next_per_theta = number_at(address, at + 2), number_at(address, at + WIDTH + 2)
        heat *= per_theta + share * (next_per_theta - per_theta)
        place = (heat - row[HEAT_START]) * row[HEAT_PER]
        k = int(min(max(place, 0.0), HEAT_POINTS - 2.0))
        tau, next_tau = number_at(address, HEATS + k), number_at(address, HEATS + k + 1)
        return max(at_rest * (tau + (place - k) * (next_tau - tau)), _LEAST)
    return max(at_rest + heat * inverse, _LEAST)


def tabulate_isentrope(
    pressure: Callable[[float, float], float], rho0: float, e0: float, ambient: float, held: bool = True
) -> np.ndarray:
    """Return e_s [J/kg], T_s [K] and ambient/T_s of the isentrope through (rho0, e0, ambient), shape (POINTS, WIDTH).

    `pressure`: p(rho, e) [Pa].
    `rho0`, `e0`, `ambient`: density [kg/m^3], energy [J/kg] and temperature [K] of the state at rest.
    `held`: whether T_s is that at rest below rho0.
    """
    points = np.empty((POINTS, WIDTH))
    densities = rho0 * np.linspace(LOWEST, HIGHEST, POINTS)
    middle = int(np.searchsorted(densities, rho0))
    with np.errstate(over="ignore", invalid="ignore"):  # far beyond what extreme numbers allow
        for places in (range(middle, POINTS), range(middle - 1, -1, -1)):
            rho, e, t = rho0, e0, ambient
            for k in places:
                h = (densities[k] - rho) / _STEPS
                for _ in range(_STEPS if h else 0):
                    e, t = _step(pressure, rho, h, e, t)
                    rho += h
                points[k, :2] = e, ambient if held and densities[k] <= rho0 else t
    points[:, 2] = ambient / points[:, 1]
    return points


def energies(rho: np.ndarray, temperature: float, row: np.ndarray) -> np.ndarray:
    """Return the energies [J/kg] at densities [kg/m^3], all at one temperature [K], of a whole row of the table."""
    ambient, per = row[ROOM_TEMPERATURE], row[HEAT_PER]
    if row[TOTAL_ENERGY] > 0.0:
        return np.full(np.shape(rho), (temperature - ambient) / row[INVERSE_HEAT_CAPACITY])
    known = row[CURVE:HEATS].reshape(POINTS, WIDTH)
    share, shares = rho * row[INVERSE_RHO0], np.linspace(LOWEST, HIGHEST, POINTS)
    cold, at_rest, per_theta = (np.interp(share, shares, known[:, k]) for k in range(WIDTH))
    if per == 0.0:
        return cold + (temperature - at_rest) / row[INVERSE_HEAT_CAPACITY]
    tau, wanted = row[HEATS : HEATS + HEAT_POINTS], temperature / at_rest
    k = np.clip(np.searchsorted(tau, wanted) - 1, 0, HEAT_POINTS - 2)
    return cold + (row[HEAT_START] + (k + (wanted - tau[k]) / (tau[k + 1] - tau[k])) / per) / per_theta


def _step(pressure: Callable[[float, float], float], rho: float, h: float, e: float, t: float) -> tuple[float, float]:
    """Return energy and temperature after one Runge-Kutta step `h` of the density."""

    def slopes(rho: float, e: float, t: float) -> tuple[float, float]:
        spread = 1e-4 * abs(e) + 1.0
        by_energy = (pressure(rho, e + spread) - pressure(rho, e - spread)) / (2.0 * spread)
        return pressure(rho, e) / rho**2, t * by_energy / rho**2

    a = slopes(rho, e, t)
    b = slopes(rho + h / 2, e + h / 2 * a[0], t + h / 2 * a[1])
    c = slopes(rho + h / 2, e + h / 2 * b[0], t + h / 2 * b[1])
    d = slopes(rho + h, e + h * c[0], t + h * c[1])
    total = [h / 6 * (w + 2 * x + 2 * y + z) for w, x, y, z in zip(a, b, c, d, strict=True)]
    return e + total[0], t + total[1]


def heat_table(
    capacities: Sequence[tuple[float, float]],
    melting: tuple[float, float] | None,
    curve: np.ndarray,
    pressure: Callable[[float, float], float],
    at_rest: tuple[float, float, float],
) -> tuple[float, float, np.ndarray]:
    """Return `HEAT_START` [J/kg], `HEAT_PER` [kg/J] and tau/T_room at `HEAT_POINTS` even steps of h.

    `capacities`: points (T [K], c_p [J/(kg K)]) without pressure, joined by lines and held beyond their ends.
    `melting`: melting point [K] and heat of melting [J/kg], unless left out.
    `curve`: what `tabulate_isentrope` returned.
    `pressure`: p(rho, e) [Pa].
    `at_rest`: density [kg/m^3], energy [J/kg] and temperature [K] of the state at rest.
    """
    rho0, e0, ambient = at_rest
    given = np.array(capacities, dtype=float)
    kinks = [*given[:, 0], ambient, *([] if melting is None else [melting[0]] * 2)]
    t = np.sort(np.concatenate([np.linspace(_LEAST, 1.2 * max(kinks), _HEATS), kinks]))
    c = np.interp(t, *given.T)
    heat = np.concatenate([[0.0], np.cumsum(0.5 * (c[1:] + c[:-1]) * np.diff(t))])
    heat -= np.interp(ambient, t, heat)
    if melting is not None:
        heat[np.searchsorted(t, melting[0], side="right") - 1 :] += melting[1]
    densities = rho0 * np.linspace(LOWEST, HIGHEST, POINTS)
    taken = densities_without_pressure(pressure, rho0, e0 + heat)
    known = np.isfinite(taken)
    theta = np.interp(taken[known], densities, curve[:, 1]) / ambient
    of = (e0 + heat[known] - np.interp(taken[known], densities, curve[:, 0])) / theta
    evenly = np.linspace(of[0], of[-1], HEAT_POINTS)
    return float(of[0]), (HEAT_POINTS - 1) / float(of[-1] - of[0]), np.interp(evenly, of, t[known] / theta) / ambient


def densities_without_pressure(
    pressure: Callable[[float, float], float], rho0: float, energies: np.ndarray
) -> np.ndarray:
    """Return the densities [kg/m^3] without pressure at rising energies, by secants; not a number where none is."""
    found = np.full(len(energies), np.nan)
    near = rho0
    for k in range(len(energies)):
        a, b = near, near * (1.0 - 1e-4)
        at_a, at_b = pressure(a, energies[k]), pressure(b, energies[k])
        for _ in range(20):
            if at_a == at_b or abs(b - a) < 1e-10 * rho0:
                break
            a, b, at_a = b, b - at_b * (b - a) / (at_b - at_a), at_b
            if not LOWEST * rho0 < b < HIGHEST * rho0:
                return found
            at_b = pressure(b, energies[k])
        if not abs(b - a) < 1e-6 * rho0:
            return found
        found[k] = near = b
    return found
