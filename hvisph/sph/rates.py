"""The rates that a pair law writes for each particle, and where they stand in the row of rates.

In order: acceleration (dim), rate of specific internal energy, largest |mu| of its pairs,
velocity gradient (dim^2); from laws that have one, a rate of ln(rho) beside the gradient's.
"""

from __future__ import annotations

from hvisph.core.jit import specialise


def width(dim: int) -> int:
    """Return the length of a row of rates."""
    return dim + 2 + dim * dim


def _write(out, i, a_x, a_y, a_z, power, mu, l_xx, l_xy, l_xz, l_yx, l_yy, l_yz, l_zx, l_zy, l_zz):
    out[i, 0] = a_x
    out[i, DIM] = power
    out[i, DIM + 1] = mu
    out[i, DIM + 2] = l_xx
    if DIM == 2:
        out[i, 1] = a_y
        out[i, DIM + 3] = l_xy
        out[i, DIM + 4] = l_yx
        out[i, DIM + 5] = l_yy
    if DIM == 3:
        out[i, 1] = a_y
        out[i, 2] = a_z
        out[i, DIM + 3] = l_xy
        out[i, DIM + 4] = l_xz
        out[i, DIM + 5] = l_yx
        out[i, DIM + 6] = l_yy
        out[i, DIM + 7] = l_yz
        out[i, DIM + 8] = l_zx
        out[i, DIM + 9] = l_zy
        out[i, DIM + 10] = l_zz


def writer(dim: int):
    """Return the compiled function by which a pair law writes its rates in `dim` dimensions."""
    return specialise(_write, DIM=dim)
