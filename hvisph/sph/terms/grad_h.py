"""Number density of the kernel at the own smoothing length, where h follows density.

The rate of sum W(r, h_a) has the change of h in it, which divides by

    Omega_a = 1 + V_a h_a/d sum dW/dh

Source: Springel & Hernquist 2002. Verification: `sod`, `blast`, `noh`.
"""

from __future__ import annotations


def grad_h_sums(h, r, weight, du_n, us_n, other):
    """Return the velocity that the number density counts, and the sums of the own kernel: rate and dW/dh.

    A template: bound are DIM, `scale`, `slope` and `shape`.
    """
    q, moving = r / h, weight * (du_n + other * (2.0 * us_n - du_n))
    own_kernel = scale(1.0 / h) * slope(q) * moving
    return moving, own_kernel, weight * scale(1.0 / h) * (DIM * shape(q) + q * slope(q))


def grad_h_rate(h, volume, rate, own_number, grad_h, free):
    """Return the rate of volume [1/s] of the own kernel; `free` is the share by which h follows density."""
    change = grad_h + scale(1.0 / h) * DIM * shape(0.0)
    return (rate + volume * own_number) / (1.0 - free * volume * h / DIM * change)
