"""Density correction: the exchange of volume in a pair, and its relaxation.

Density follows the rate of the number density sum W and an exchange of volume between both sides of a pair,
u* - (u_a + u_b)/2. The exchange keeps density smooth across a front. In strong compression it would separate density
from the number density permanently; pairs of one body therefore lose a part of it,

    s = min((10 t*_n / rho c^2)^2, 1/2),   t*_n < 0
    s = min((10 max(|t*_n| / rho c^2, 1 - rho_rest/rho))^2, 1)     where h follows density

The difference that remains, x = ln(rho/m) - ln(sum W), relaxes behind the front:

    dx/dt -= q,   d ln(rho)/dt -= q min((10 p/rho c_l^2)^2, 1),   q = x c_l/(10 h) max(0, 1 - 20 mu/c_l),   p > 0

Source: this code's own. Verification: `hugoniot` (stress and energy beside a struck face, 0.6 to 24 km/s).
"""

from __future__ import annotations

from hvisph.compiler.jit import inline

from .riemann_solver import FRONT

# Largest share of the exchange that a pair loses where h is constant.
EXCHANGE_CUTOFF_MAX = 0.5


@inline
def exchange_correction(us, du, t, inverse, densities, compression, limit):
    """Return the part of the exchange velocity [m/s] that density does not take.

    `us`, `du`, `t`: contact velocity and velocity of the neighbour, relative to the own one [m/s]; normal traction [Pa]
    `inverse`, `densities`: 1 over the sum of both impedances, and the sum of both densities
    `compression`: volumetric compression of the pair, for materials whose pores crush at a low traction, else 0
    `limit`: largest share
    """
    strain = max((-1.0 / FRONT) * densities * inverse * inverse * min(t, 0.0), (0.5 / FRONT) * compression)
    return min(strain * strain, limit) * (us - 0.5 * du)


@inline
def relaxation_rates(correction, p, rho, c_l, h):
    """Return the rates [1/s] at which the correction x decays and at which density relaxes, in smooth flow."""
    compression = min(0.5 / FRONT * max(p, 0.0) / (rho * c_l * c_l), 1.0)
    decay = correction * c_l / (0.5 / FRONT * h)
    return decay, decay * compression * compression
