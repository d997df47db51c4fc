"""Number density of the kernel at the own smoothing length, where h follows density.

The rate of n_a = sum W(r, h_a) contains the change of h, so that it is divided by

    Omega_a = 1 + h_a/(d n_a) sum dW/dh = - 1/(d n_a) sum q w'(q)/h_a^d

With n_a itself, not 1/V_a, Omega is positive, and the rate by the own kernel is d times the mean of (u_b - u_a) . e/r
with weights q |w'|. Without neighbours Omega is zero, and n is proportional to density for any h; the exchange with
neighbours of longer reach is then divided by OMEGA_MIN.

The rate is that of ln n_a, so that V_a counts as 1/n_a at most: else a particle whose V_a n_a is above 1 thins faster
than its neighbours leave it, by exp. At a free face V_a n_a is below 1, and V_a counts.

Neighbours of other bodies count by the interaction area of the contact, not by the own kernel, so that the volume
changes by what does work: gas of a twentieth of a wall's volume would else strain its first row without heating it.

Source: Springel & Hernquist 2002; Springel 2005 has no correction below the same Omega. Verification: `sod`, `blast`,
`noh`.
"""

from __future__ import annotations

# Omega below which a particle counts as without neighbours.
OMEGA_MIN = 0.1


def grad_h_sums(h, r, weight, du_n, other):
    """Return the velocity that the own kernel counts, and its sums: rate, W and q dW/dq.

    A template: bound are DIM, `scale`, `slope` and `shape`.
    """
    q, moving = r / h, weight * (1.0 - other) * du_n
    own_kernel = scale(1.0 / h) * slope(q) * moving
    return moving, own_kernel, weight * scale(1.0 / h) * h * shape(q), weight * scale(1.0 / h) * h * q * slope(q)


def grad_h_rate(h, volume, rate, own_number, kernel_sum, slope_sum, free):
    """Return the rate of volume [1/s] of the own kernel; `free` is the share by which h follows density."""
    n = kernel_sum + scale(1.0 / h) * h * shape(0.0)
    own = rate + volume * own_number
    return own / (max(volume * n, 1.0) * max(1.0 - free * (1.0 + slope_sum / (DIM * n)), OMEGA_MIN))
