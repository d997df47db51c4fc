"""Exchange of volume in a pair, and its cut-off in strong compression.

Density follows the rate of the number density sum W and an exchange of volume between both sides of a pair,
u* - (u_a + u_b)/2. The exchange keeps density even across a front. In strong compression it would separate density from
the number density for good, so that pairs of one body lose a part of it,

    s = min((10 t*_n / rho c^2)^2, 1/2),   t*_n < 0        (at most 1 where h follows density)

Source: this code's own. Verification: `hugoniot` (stress and energy beside a struck face, 0.6 to 24 km/s).
"""

from __future__ import annotations

from hvisph.compiler.jit import inline

# Root of the share of the exchange that a pair loses, over p/(2 rho c^2): half of it at 0.07 rho c^2.
EXCHANGE_CUTOFF = 20.0
# Largest share of the exchange that a pair loses where h is constant.
EXCHANGE_CUTOFF_MAX = 0.5


@inline
def exchange_correction(us, du, t, inverse, densities, limit):
    """Return the part of the exchange velocity [m/s] that density does not take.

    Parameters
    ----------
    us, du, t
        Contact velocity and velocity of the neighbour, relative to the own one [m/s]; normal traction [Pa].
    inverse, densities
        1 over the sum of both impedances, and the sum of both densities.
    limit
        Largest share.
    """
    compression = EXCHANGE_CUTOFF * densities * inverse * inverse * min(t, 0.0)
    return min(compression * compression, limit) * (us - 0.5 * du)
