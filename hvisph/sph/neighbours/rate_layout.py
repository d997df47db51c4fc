"""The rates that a pair law writes for each particle, and where they stand in the row of rates.

In order: acceleration (dim), rate of specific internal energy, largest |mu| of its pairs,
velocity gradient (dim^2); from laws that have them, a rate of ln(rho) beside the gradient's, the rate of its lead over
the number of particles, and the heat of slip between bodies, which is in the rate of energy; of rings the rate of their
circumference, of others, where angular momentum is kept, the rate at which their pairs make it (axial, for each mass).
"""

from __future__ import annotations

from functools import cache
from typing import Any

from hvisph.compiler.template_binding import bind
from hvisph.compiler.tensors import put


def width(dim: int) -> int:
    """Return the length of a row of rates, without a rate of ln(rho)."""
    return dim + 2 + dim * dim


@cache
def slots(dim: int) -> dict[str, int]:
    """Return where each rate stands, as constants for compiled loops."""
    end = width(dim)
    return {"R_ACCELERATION": 0, "R_POWER": dim, "R_APPROACH": dim + 1, "R_GRADIENT": dim + 2, "R_DENSITY": end,
            "R_CORRECTION": end + 1, "R_SLIP": end + 2, "R_HOOP": end + 3, "R_SPIN": end + 3}  # fmt: skip


def _write(out, i, a, power, mu, l):
    """Write acceleration, power, largest |mu| and velocity gradient of particle `i`."""
    put(out, i, R_ACCELERATION, a)
    out[i, R_POWER] = power
    out[i, R_APPROACH] = mu
    put(out, i, R_GRADIENT, l)
    if SLIPS:  # for the law, or a contact beside it, to add to
        out[i, R_SLIP] = 0.0


def writer(dim: int, slips: bool) -> Any:
    """Return the compiled function by which a pair law, or one that `slips`, writes its rates in `dim` dimensions."""
    return bind(_write, {"SLIPS": int(slips)}, slots(dim))
