"""Temperature of every material: what is left of the energy when the cold work of compression is taken out.

    T = T_s(rho) + (e - e_s(rho)) / c_v,    not below 1 K
    de_s/drho = p(rho, e_s)/rho^2,          e_s(rho0) = ambient energy
    dT_s/drho = T_s Gamma/rho,              T_s(rho0) = T_room,  Gamma = p_e/rho

The isentrope through the state at rest is tabulated per material, linear between `POINTS` densities from
0.5 to 3 rho0 and held outside; below rho0 T_s is T_room. `total_energy` takes all energy as heat,
T = T_room + max(e, 0)/c_v, as Young 2021 does: a shock then counts the cold work of compression as heat,
887 K in place of 490 K at 1 km/s in aluminium.

Every model that asks for a temperature asks here.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..core.jit import compiled
from ..core.memory import number_at
from .slots import ADDRESS, CURVE, INVERSE_HEAT_CAPACITY, INVERSE_RHO0, ROOM_TEMPERATURE, TOTAL_ENERGY

POINTS = 511  # one of them is rho0 itself
LOWEST, HIGHEST = 0.5, 3.0  # of rho0
LENGTH = 2 * POINTS  # numbers in the row: e_s and T_s of each density in turn
_PER_SHARE = (POINTS - 1) / (HIGHEST - LOWEST)
_STEPS = 4  # Runge-Kutta steps between two points
_LEAST = 1.0  # [K]


@compiled
def temperature(rho, e, row):
    """Temperature [K] at density `rho` [kg/m^3] and energy `e` [J/kg]; the room's without a heat capacity."""
    room, inverse = row[ROOM_TEMPERATURE], row[INVERSE_HEAT_CAPACITY]
    if inverse == 0.0:
        return room
    if row[TOTAL_ENERGY] > 0.0:
        return room + max(e, 0.0) * inverse
    place = min(max((rho * row[INVERSE_RHO0] - LOWEST) * _PER_SHARE, 0.0), POINTS - 1.001)
    k = int(place)
    share = place - k
    at = CURVE + 2 * k
    address = row[ADDRESS]
    cold, next_cold = number_at(address, at), number_at(address, at + 2)
    of_isentrope, after = number_at(address, at + 1), number_at(address, at + 3)
    heat = e - (cold + share * (next_cold - cold))
    return max(of_isentrope + share * (after - of_isentrope) + heat * inverse, _LEAST)


def tabulated(pressure: Callable[[float, float], float], rho0: float, e0: float, room: float) -> np.ndarray:
    """Return e_s [J/kg] and T_s [K] of the isentrope through (rho0, e0, room), interleaved, of shape (LENGTH,).

    Parameters
    ----------
    pressure
        p(rho, e) [Pa].
    rho0, e0, room
        Density [kg/m^3], energy [J/kg] and temperature [K] of the state at rest.
    """
    points = np.empty((POINTS, 2))
    densities = rho0 * np.linspace(LOWEST, HIGHEST, POINTS)
    middle = int(np.searchsorted(densities, rho0))
    for places in (range(middle, POINTS), range(middle - 1, -1, -1)):
        rho, e, t = rho0, e0, room
        for k in places:
            h = (densities[k] - rho) / _STEPS
            for _ in range(_STEPS if h else 0):
                with np.errstate(over="ignore", invalid="ignore"):  # far beyond what extreme numbers allow
                    e, t = _stepped(pressure, rho, h, e, t)
                rho += h
            points[k] = e, t if densities[k] > rho0 else room
    return points.ravel()


def _stepped(
    pressure: Callable[[float, float], float], rho: float, h: float, e: float, t: float
) -> tuple[float, float]:
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
