"""Tabulated equation of state (SESAME, ANEOS): bicubic interpolation of p over density and energy.

    p(ln rho, x),    e = e_cold(rho) + range(rho) (exp(k x) - 1)/(exp(k) - 1),    0 <= x <= 1

A table gives p and e over density and temperature. e(T) is inverted in each density column by
monotone cubics, and p is resampled on a grid of ln rho and x, dense about rho0 and at low energy.
The sound speed follows from the slopes of the interpolant. Outside the table: p ~ rho below the
lowest density, linear above the highest and beyond the energies.
"""

from dataclasses import dataclass
from functools import cached_property
from math import exp, log
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline, python_twin
from hvisph.compiler.vector.api import number_at
from hvisph.core.errors import CaseError
from hvisph.materials import slots, tags
from hvisph.materials.isentrope import LENGTH as CURVE_LENGTH
from hvisph.materials.slots import ADDRESS, CURVE

from .grid import Grid, monotone

LOW, MIDDLE, HIGH = 47, 160, 48  # cells along ln rho: below rho0/2, to 3 rho0, above
NODES = LOW + MIDDLE + HIGH + 1
ENERGIES = 256
STRETCH = 6.0  # k
_SCALE = exp(STRETCH) - 1.0

# Behind the isentrope: cold energy and its slope, range and its slope; then p, p_L, p_x and p_Lx of every node.
COLD = CURVE + CURVE_LENGTH
NODE = COLD + 4 * NODES
LENGTH = 4 * NODES + 4 * NODES * ENERGIES

START, FIRST, SECOND = slots.EOS[0], slots.EOS[1], slots.EOS[2]  # ln rho where the three stretches begin
INVERSE_LOW, INVERSE_MIDDLE, INVERSE_HIGH = slots.EOS[3], slots.EOS[4], slots.EOS[5]  # cells per ln rho


@dataclass(frozen=True)
class Table(slots.Parameters):
    """A tabulated equation of state about its reference density."""

    grid: Grid
    reference_density: float  # [kg/m^3]
    room_temperature: float = 300.0  # [K]

    name: ClassVar[str] = "table"
    tag: ClassVar[int] = tags.TABLE
    converted = ("grid", "reference_density")

    def __post_init__(self) -> None:
        low, high = self.grid.density[0], self.grid.density[-1]
        if not low < self.reference_density < high:
            raise CaseError(
                f"the table reaches from {low:g} to {high:g} kg/m^3, which leaves out the density "
                f"{self.reference_density:g}",
                where=self.name,
            )

    @cached_property
    def ambient_energy(self) -> float:
        """Energy of the table at the reference density and room temperature [J/kg]."""
        return self.grid.energy_at(self.reference_density, self.room_temperature)

    def ambient_sound_speed(self, density: float) -> float:
        """Return the sound speed at the reference density and room temperature [m/s]."""
        row = np.zeros(slots.SLOT_COUNT + CURVE_LENGTH + LENGTH)
        row[slots.RHO0], row[slots.INVERSE_RHO0] = density, 1.0 / density
        self.pack(row, density)
        row[COLD:] = self.tail
        p, p_rho, p_e = python_twin(state)(density, self.ambient_energy, slots.values(row))
        return float(np.sqrt(max(p_rho + p * p_e / density**2, 0.0)))

    def pack(self, row: np.ndarray, density: float) -> None:
        """Write the stretches of the grid into the material's row of the table."""
        start, first, second, end = self._stretches
        row[START], row[FIRST], row[SECOND] = start, first, second
        row[INVERSE_LOW] = LOW / (first - start)
        row[INVERSE_MIDDLE] = MIDDLE / (second - first)
        row[INVERSE_HIGH] = HIGH / (end - second)

    @property
    def _stretches(self) -> tuple[float, float, float, float]:
        start, end = log(self.grid.density[0]), log(self.grid.density[-1])
        least = 0.05 * (end - start)
        first = min(max(log(0.5 * self.reference_density), start + least), end - 2 * least)
        return start, first, min(max(log(3.0 * self.reference_density), first + least), end - least), end

    @cached_property
    def tail(self) -> np.ndarray:
        """The grid, as it stands behind the isentrope in the material's row, of shape (LENGTH,)."""
        start, first, second, end = self._stretches
        nodes = np.concatenate(
            [
                np.linspace(start, first, LOW, endpoint=False),
                np.linspace(first, second, MIDDLE, endpoint=False),
                np.linspace(second, end, HIGH + 1),
            ]
        )
        x = np.linspace(0.0, 1.0, ENERGIES)
        shares = np.expm1(STRETCH * x) / _SCALE
        of_column = np.log(self.grid.density)
        cold, span, columns = self.grid.columns(shares)
        cold, cold_slope = monotone(of_column, cold, nodes)
        span, span_slope = monotone(of_column, span, nodes)
        p, p_l = monotone(of_column, columns, nodes)
        p_x, p_lx = np.gradient(p, x, axis=1), np.gradient(p_l, x, axis=1)
        curves = np.stack([cold, cold_slope, span, span_slope], axis=-1).ravel()
        return np.concatenate([curves, np.stack([p, p_l, p_x, p_lx], axis=-1).ravel()])


@inline
def _hermite(t, width):
    """Cubic Hermite weights of two values and of their slopes, and the weights' own slopes, at `t` in a cell."""
    u = t - 1.0
    return (
        (1.0 + 2.0 * t) * u * u,
        t * t * (3.0 - 2.0 * t),
        t * u * u * width,
        t * t * u * width,
        6.0 * t * u / width,
        -6.0 * t * u / width,
        (3.0 * t - 1.0) * u,
        t * (3.0 * t - 2.0),
    )


@inline
def _interpolate(address, at, stride, w):
    """Value and slope of a curve between two nodes, each a value with its slope after it."""
    a, a_slope = number_at(address, at), number_at(address, at + 1)
    b, b_slope = number_at(address, at + stride), number_at(address, at + stride + 1)
    value = w[0] * a + w[1] * b + w[2] * a_slope + w[3] * b_slope
    return value, w[4] * a + w[5] * b + w[6] * a_slope + w[7] * b_slope


@inline
def state(rho, e, row):
    """Pressure [Pa] and its slopes p_rho and p_e, at density `rho` [kg/m^3] and energy `e` [J/kg]."""
    address = row[ADDRESS]
    start = row[START]
    at_l = max(log(rho), start)
    if at_l < row[FIRST]:
        cells, place = row[INVERSE_LOW], (at_l - start) * row[INVERSE_LOW]
    elif at_l < row[SECOND]:
        cells, place = row[INVERSE_MIDDLE], LOW + (at_l - row[FIRST]) * row[INVERSE_MIDDLE]
    else:
        cells, place = row[INVERSE_HIGH], LOW + MIDDLE + (at_l - row[SECOND]) * row[INVERSE_HIGH]
    beyond = max(place - (NODES - 1), 0.0) / cells  # ln rho behind the table's end
    i = min(int(place), NODES - 2)
    w = _hermite(min(place - i, 1.0), 1.0 / cells)
    cold, cold_l = _interpolate(address, COLD + 4 * i, 4, w)
    span, span_l = _interpolate(address, COLD + 4 * i + 2, 4, w)
    cold += beyond * cold_l
    span = max(span, 1e-300)
    relative = (e - cold) / span
    held = min(max(relative, 0.0), 1.0)
    x = log(1.0 + held * _SCALE) / STRETCH
    x_r = _SCALE / (STRETCH * (1.0 + held * _SCALE))  # d x/d relative
    j = min(int(x * (ENERGIES - 1)), ENERGIES - 2)
    width = 1.0 / (ENERGIES - 1)
    v = _hermite(x * (ENERGIES - 1) - j, width)
    at = NODE + 4 * (i * ENERGIES + j)
    stride = 4 * ENERGIES
    # values and x-slopes at the two energies, each along ln rho
    a, a_l = _interpolate(address, at, stride, w)
    b, b_l = _interpolate(address, at + 4, stride, w)
    c, c_l = _interpolate(address, at + 2, stride, w)
    d, d_l = _interpolate(address, at + 6, stride, w)
    p = v[0] * a + v[1] * b + v[2] * c + v[3] * d
    p_l = v[0] * a_l + v[1] * b_l + v[2] * c_l + v[3] * d_l
    p_r = (v[4] * a + v[5] * b + v[6] * c + v[7] * d) * x_r
    p_lr = (v[4] * a_l + v[5] * b_l + v[6] * c_l + v[7] * d_l) * x_r
    p += (relative - held) * p_r + beyond * p_l
    p_l += (relative - held) * p_lr
    p_e = p_r / span
    p_rho = (p_l - p_r * (cold_l + (0.0 if beyond > 0.0 else relative * span_l)) / span) / rho
    if log(rho) < start:
        thinner = rho * exp(-start)
        return p * thinner, p * exp(-start), p_e * thinner
    return p, p_rho, p_e
