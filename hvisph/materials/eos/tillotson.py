"""Tillotson equation of state, from the shocked solid to the expanded vapour.

    eta = rho/rho0,  mu = eta - 1,  z = 1/eta - 1,  w = e/(E0 eta^2) + 1
    p_c = (a + b/w) rho e + A mu + B mu^2                                rho >= rho0 or e <= e_iv
    p_h = a rho e + [b rho e/w + A mu exp(-beta z)] exp(-alpha z^2)      rho < rho0 and e >= e_cv
    between them  p = [(e - e_iv) p_h + (e_cv - e) p_c]/(e_cv - e_iv)

e_iv and e_cv are the energies of incipient and complete vaporisation. In cold expansion B mu^2
raises the pressure again below eta = 1 - A/(2B); `expansion: faded` uses A mu eta^2 (3 - 2 eta)
instead, `linear` A mu, `full` the published form. Below `low_density` cold material has no
pressure. Exponents are at most 70, and e in w at least -E0 eta^2/2. Aluminium with 5 to 12 MJ/kg at
rho0 does 0.6 to 2.7 MJ/kg of expansion work until p_c cancels p_h, at eta = 0.82 to 0.54, and 0 to
0.5 from there to eta = 0.1, where liquid that boils in equilibrium does 0.01 to 0.4; with p_c >= 0
(Reinhardt & Stadel 2017, MNRAS 467) it would do 0.5 to 3.0. At eta = 0.01 and 8 MJ/kg p is 40 MPa,
in equilibrium 5 MPa. Tillotson 1962 (General Atomic GA-3216); Melosh 1989, Impact Cratering,
appendix II.
"""

from dataclasses import dataclass
from math import exp
from typing import ClassVar

import numpy as np

from hvisph.compiler.jit import inline
from hvisph.materials import slots, tags
from hvisph.materials.slots import INVERSE_RHO0, RHO0

from . import expansion

BULK_MODULUS, CAPITAL_B, CAPITAL_B_TENSION, INVERSE_E0, SMALL_A, SMALL_B = slots.EOS[:6]
ALPHA, BETA, INCIPIENT_ENERGY, VAPORIZATION_ENERGY, LOW_DENSITY, FADES = slots.EOS[6:12]

_EXPONENT = 70.0
_LEAST = 0.5  # w is held above


@dataclass(frozen=True)
class Tillotson(slots.Parameters):
    """Parameters of the Tillotson equation of state."""

    bulk_modulus: float  # A [Pa]
    capital_b: float  # B [Pa]
    small_a: float  # a [-]
    small_b: float  # b [-]
    reference_energy: float  # E0 [J/kg]
    alpha: float  # [-]
    beta: float  # [-]
    incipient_energy: float  # e_iv [J/kg]
    vaporization_energy: float  # e_cv [J/kg]
    expansion: str = "faded"  # of the condensed branch below rho0: faded, linear or full
    low_density: float = 0.0  # rho/rho0 below which cold material has no pressure

    name: ClassVar[str] = "tillotson"
    tag: ClassVar[int] = tags.TILLOTSON
    converted = ("reference_energy", "expansion")
    ambient_energy: ClassVar[float] = 0.0

    def ambient_sound_speed(self, density: float) -> float:
        """Return sqrt(A/rho0) [m/s]."""
        return float(np.sqrt(self.bulk_modulus / density))

    def pack(self, row: np.ndarray, density: float) -> None:
        super().pack(row, density)
        row[CAPITAL_B_TENSION] = self.capital_b if self.expansion == "full" else 0.0
        row[INVERSE_E0] = 1.0 / self.reference_energy
        row[FADES] = float(self.expansion == "faded")


@inline
def _cold(rho, e, row):
    """Pressure of the condensed branch, its slopes p_rho and p_e, and b rho e/w with its slopes."""
    eta = rho * row[INVERSE_RHO0]
    mu = eta - 1.0
    inverse_scale = row[INVERSE_E0] / (eta * eta)
    w = e * inverse_scale + 1.0
    b = row[SMALL_B]
    if w > _LEAST:
        inverse = 1.0 / w
        term_rho = b * e * (3.0 * w - 2.0) * inverse * inverse
        term_e = b * rho * inverse * inverse
    else:
        inverse = 1.0 / _LEAST
        term_rho = b * e * inverse
        term_e = b * rho * inverse
    term = b * rho * e * inverse
    square = row[CAPITAL_B] if mu > 0.0 else row[CAPITAL_B_TENSION]
    cold, cold_slope = mu * (row[BULK_MODULUS] + square * mu), row[BULK_MODULUS] + 2.0 * square * mu
    if mu < 0.0 and row[FADES] > 0.0:
        cold_slope = expansion.left(eta, 0.0) * cold_slope + expansion.slope(eta, 0.0) * cold
        cold *= expansion.left(eta, 0.0)
    a = row[SMALL_A]
    p = a * rho * e + term + cold
    p_rho = a * e + term_rho + cold_slope * row[INVERSE_RHO0]
    p_e = a * rho + term_e
    if eta < row[LOW_DENSITY] and e < row[INCIPIENT_ENERGY]:
        p = p_rho = p_e = 0.0
    return p, p_rho, p_e, term, term_rho, term_e


@inline
def _hot(rho, e, term, term_rho, term_e, row):
    """Pressure of the vapour's branch and its slopes."""
    eta = rho * row[INVERSE_RHO0]
    inverse_eta = 1.0 / eta
    z = inverse_eta - 1.0
    mu = eta - 1.0
    a, alpha, beta = row[SMALL_A], row[ALPHA], row[BETA]
    gauss = exp(-min(alpha * z * z, _EXPONENT))
    fade = row[BULK_MODULUS] * exp(-min(beta * z, _EXPONENT))
    p = a * rho * e + (term + fade * mu) * gauss
    # d z/d rho = -1/(rho eta); the slope of the Gaussian is 2 alpha z/(rho eta) of itself
    fading = inverse_eta * inverse_eta * row[INVERSE_RHO0]
    p_rho = a * e + gauss * (
        term_rho + 2.0 * alpha * z * fading * term + fade * (row[INVERSE_RHO0] + mu * (beta + 2.0 * alpha * z) * fading)
    )
    return p, p_rho, a * rho + gauss * term_e


@inline
def state(rho, e, row):
    """Pressure [Pa] and its slopes p_rho and p_e, at density `rho` [kg/m^3] and energy `e` [J/kg]."""
    p, p_rho, p_e, term, term_rho, term_e = _cold(rho, e, row)
    if rho < row[RHO0] and e > row[INCIPIENT_ENERGY]:
        hot, hot_rho, hot_e = _hot(rho, e, term, term_rho, term_e, row)
        if e >= row[VAPORIZATION_ENERGY]:
            return hot, hot_rho, hot_e
        inverse = 1.0 / (row[VAPORIZATION_ENERGY] - row[INCIPIENT_ENERGY])
        share = (e - row[INCIPIENT_ENERGY]) * inverse
        p_rho += share * (hot_rho - p_rho)
        p_e += share * (hot_e - p_e) + (hot - p) * inverse
        p += share * (hot - p)
    return p, p_rho, p_e
