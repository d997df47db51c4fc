"""P-alpha porosity over any equation of state of the solid.

    p = p_s(alpha rho, e)/alpha,    alpha = rho_solid/rho the distension
    alpha = alpha0                                              p <= p_e
    alpha = 1 + (alpha0 - 1) ((p_s - p)/(p_s - p_e))^2          p_e < p < p_s
    alpha = 1                                                   p >= p_s
    or by lines through points [p, alpha] from alpha0 to 1

    dp/drho = P_r alpha/d,  dp/de = P_e/d,  d = alpha + A'(p - rho P_r)

Crushing begins at p_e and ends at p_s. Pores do not reopen: alpha is at most its smallest past value.
Below p_e the sound speed is the solid's. alpha = A(p(alpha)) is solved by bisection. P_r and P_e are
the derivatives of the solid's pressure by density and energy at (alpha rho, e), A' is the slope of
the crush curve, 0 on unloading. Temperature and melting are those of the solid;
shear modulus and yield stress are divided by alpha. Herrmann 1969, J. Appl. Phys. 40, 2490; Carroll
& Holt 1972, J. Appl. Phys. 43, 1626; Jutzi et al. 2008, Icarus 198, 242.
"""

from dataclasses import dataclass

import numpy as np

from hvisph.compiler.jit import inline, noinline
from hvisph.compiler.vector.api import number_at

from .eos import pressure_and_sound_speed
from .isentrope import CRUSH, CRUSH_POINTS
from .slots import ADDRESS, DISTENSION, ELASTIC_PRESSURE, SOLID_PRESSURE

_HALVINGS = 40


@dataclass(frozen=True)
class Porosity:
    """Parameters of P-alpha porosity."""

    distension: float  # alpha0 = rho_solid/rho at rest [-], above 1
    elastic_pressure: float  # p_e, where pores begin to crush [Pa]
    solid_pressure: float  # p_s, where they are gone [Pa]
    crush: tuple[tuple[float, float], ...] = ()  # points p [Pa], alpha [-] in place of the parabola

    def pack(self, row: np.ndarray) -> None:
        """Write the parameters into the material's row of the table."""
        row[DISTENSION] = self.distension
        row[ELASTIC_PRESSURE] = self.elastic_pressure
        row[SOLID_PRESSURE] = -self.solid_pressure if self.crush else self.solid_pressure  # below zero: by points

    def points(self) -> np.ndarray:
        """Return the points of the crush curve as they stand behind the isentrope, (2 `CRUSH_POINTS`,)."""
        known = [*self.crush, *[(self.solid_pressure, 1.0)] * (CRUSH_POINTS - len(self.crush))]
        return np.array(known).ravel()


@noinline
def _crush_by_points(p, row):
    """Distension [-] on the lines between the points of a crush curve, at a pressure `p` [Pa] above the first."""
    address = row[ADDRESS]
    low, before = number_at(address, CRUSH), number_at(address, CRUSH + 1)
    for k in range(1, CRUSH_POINTS):
        high, after = number_at(address, CRUSH + 2 * k), number_at(address, CRUSH + 2 * k + 1)
        if p < high:
            return before + (after - before) * (p - low) / (high - low)
        low, before = high, after
    return 1.0


@inline
def crush_curve(p, row):
    """Distension [-] of virgin material at the pressure `p` [Pa]."""
    if p <= row[ELASTIC_PRESSURE]:
        return row[DISTENSION]
    if row[SOLID_PRESSURE] < 0.0:
        return _crush_by_points(p, row)
    if p >= row[SOLID_PRESSURE]:
        return 1.0
    left = (row[SOLID_PRESSURE] - p) / (row[SOLID_PRESSURE] - row[ELASTIC_PRESSURE])
    return 1.0 + (row[DISTENSION] - 1.0) * left * left


@noinline
def crush(tag, rho, e, alpha, row):
    """Distension after loading to density `rho` and energy `e` from the distension `alpha`."""
    if alpha <= 1.0:
        return 1.0
    low, high = 1.0, alpha
    p = pressure_and_sound_speed(tag, high * rho, e, row)[0] / high
    if crush_curve(p, row) >= high:
        return alpha
    if crush_curve(pressure_and_sound_speed(tag, rho, e, row)[0], row) <= 1.0:
        return 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        p = pressure_and_sound_speed(tag, middle * rho, e, row)[0] / middle
        if crush_curve(p, row) > middle:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@noinline
def load_pores(tag, rho, e, alpha, row):
    """Return pressure [Pa], sound speed of the solid [m/s] and distension after loading from the distension `alpha`."""
    alpha = crush(tag, rho, e, alpha, row)
    p, c = pressure_and_sound_speed(tag, alpha * rho, e, row)
    return p / alpha, c, alpha
