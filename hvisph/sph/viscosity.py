"""Monaghan's artificial viscosity between approaching particles.

    mu_ab = min(h_ab u_ab . x_ab / (|x_ab|^2 + 0.01 h_ab^2), 0)
    Pi_ab = (-alpha c_ab mu_ab + beta mu_ab^2) / rho_ab

with the means c_ab = (c_a + c_b)/2 and rho_ab = (rho_a + rho_b)/2. Both functions take plain floats or
eight lanes; the pair laws hand them reciprocals, because they take all of theirs from one division.

Source: Monaghan 1992; Young 2021 eqs. 6-7.
"""

from __future__ import annotations

from hvisph.core.jit import compiled

SOFTENING = 0.01  # share of h^2 in the denominator of mu


@compiled
def approach(h, ur, inverse):
    """Return mu [m/s]: `ur` = u_ab . x_ab [m^2/s], `inverse` = 1 / (|x_ab|^2 + 0.01 h^2) [1/m^2]."""
    return min(h * ur * inverse, 0.0)


@compiled
def monaghan(mu, alpha, beta, c, inverse_density):
    """Return Pi [m^5/(kg s^2)] from the sums `c` = c_a + c_b and `inverse_density` = 1 / (rho_a + rho_b)."""
    return mu * (2.0 * beta * mu - alpha * c) * inverse_density
