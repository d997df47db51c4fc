"""P-alpha porosity over any equation of state of the solid.

    p = p_s(alpha rho, e)/alpha,    alpha = rho_solid/rho the distension
    alpha = alpha0                                              p <= p_e
    alpha = 1 + (alpha0 - 1) ((p_s - p)/(p_s - p_e))^2          p_e < p < p_s
    alpha = 1                                                   p >= p_s

    p_rho = P_r alpha/d,  p_e = P_e/d,  d = alpha + A'(p - rho P_r)

Pores do not reopen: alpha is its smallest past value. Below p_e the sound speed is the solid's.
alpha = A(p(alpha)) is solved by bisection. P_r and P_e are the slopes of the solid at (alpha rho,
e), A' that of the crush curve, 0 on unloading. Temperature and melting are those of the solid;
shear modulus and yield stress are divided by alpha. Herrmann 1969, J. Appl. Phys. 40, 2490; Carroll
& Holt 1972, J. Appl. Phys. 43, 1626; Jutzi et al. 2008, Icarus 198, 242.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvisph.compiler.jit import inline, noinline
from hvisph.core.errors import CaseError

from . import slots
from .eos import pressure_and_sound_speed
from .slots import DISTENSION, ELASTIC_PRESSURE, SOLID_PRESSURE

_HALVINGS = 40


@dataclass(frozen=True)
class Porosity:
    """Parameters of P-alpha porosity."""

    distension: float  # alpha0 = rho_solid/rho at rest [-], above 1
    elastic_pressure: float  # p_e, where pores begin to crush [Pa]
    solid_pressure: float  # p_s, where they are gone [Pa]

    def __post_init__(self) -> None:
        slots.require_not_negative(self, "elastic_pressure")
        if not 1.0 < self.distension < np.inf:
            raise CaseError(f"distension is {self.distension!r}, but must be above 1", where="porosity")
        if not self.solid_pressure > self.elastic_pressure:
            raise CaseError("solid_pressure is not above elastic_pressure", where="porosity")

    def pack(self, row: np.ndarray) -> None:
        """Write the parameters into the material's row of the table."""
        row[DISTENSION] = self.distension
        row[ELASTIC_PRESSURE] = self.elastic_pressure
        row[SOLID_PRESSURE] = self.solid_pressure


@inline
def crush_curve(p, row):
    """Distension [-] of virgin material at the pressure `p` [Pa]."""
    if p <= row[ELASTIC_PRESSURE]:
        return row[DISTENSION]
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


def slopes(p: float, rho: float, alpha: float, of_solid: tuple[float, float], row: np.ndarray) -> tuple[float, float]:
    """Return p_rho and p_e on the crush curve, from those of the solid at (alpha rho, e), for plots and tests."""
    span = row[SOLID_PRESSURE] - row[ELASTIC_PRESSURE]
    inside = row[ELASTIC_PRESSURE] < p < row[SOLID_PRESSURE]
    falling = -2.0 * (row[DISTENSION] - 1.0) * (row[SOLID_PRESSURE] - p) / span**2 if inside else 0.0
    d = alpha + falling * (p - rho * of_solid[0])
    return of_solid[0] * alpha / d, of_solid[1] / d
