"""CON, contact (Riemann) SPH: no viscosity and no artificial stress to tune.

Passes: with reconstruction, gradients of velocity and stress into each row; then the
Riemann problem of every pair (`sph.laws.riemann`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hvisph.core.tensors import in_plane, plus_identity, put
from hvisph.sph.kernels import CUBIC_SPLINE, Kernel
from hvisph.sph.laws import riemann
from hvisph.sph.pairs import Pass
from hvisph.sph.rows import RowLayout

from .formulation import Smoothing
from .stepper import Stepper


@dataclass(frozen=True)
class Riemann:
    """Contact SPH, first order as published or with limited reconstruction.

    Parameters
    ----------
    kernel, h_over_dx, smoothing
        Kernel, smoothing length over spacing, and how it varies.
    reconstruction
        ``none``, ``minmod`` or ``van_leer``.
    """

    kernel: Kernel = CUBIC_SPLINE
    h_over_dx: float = 1.4
    smoothing: Smoothing = field(default_factory=Smoothing)
    reconstruction: str = "van_leer"

    name = "riemann"
    fields: tuple[str, ...] = ()
    stepper = Stepper
    viscous_factor = 0.0

    def passes(self, dim: int) -> list[Pass]:
        """Return the passes: gradients, where values are reconstructed, and the Riemann problems."""
        if self.reconstruction == "none":
            limiters = riemann.LIMITERS["minmod"]  # bound, never called
        else:
            limiters = riemann.LIMITERS[self.reconstruction]
        options = {
            "RECONSTRUCTION": int(self.reconstruction != "none"),
            "limit": limiters[0],
            "share": limiters[1],
        }
        flux = Pass(riemann.accumulate, self.layout(dim), options)
        if self.reconstruction == "none":
            return [flux]
        return [Pass(riemann.gradients, riemann.row_layout(dim, False), {}, into_rows=True), flux]

    def layout(self, dim: int) -> RowLayout:
        """Return the row of the contact law."""
        return riemann.row_layout(dim, self.reconstruction != "none")

    def coefficients(self) -> np.ndarray:
        """Return nothing: the law has no coefficient."""
        return np.zeros(1)

    def pack(self, dim: int) -> tuple[Any, dict[str, Any]]:
        """Return the packing function and what it is bound to."""
        return _pack, {}


def _pack(rows, s, coefficients, one):
    """Write what the contact law reads of `one`; return the speed of signals."""
    put(rows, s, 0, one.x)
    put(rows, s, U, one.u)
    rows[s, H] = one.h
    # a retired particle has neither mass nor volume: not 0/0 but no force
    rows[s, M] = one.mass if one.mass > 0.0 else 1.0
    rows[s, V] = one.mass / one.rho
    rows[s, ZN] = one.rho * one.c_l
    # A liquid slips: a shear impedance of next to nothing, for with none at all u* of the pair is 0/0.
    rows[s, ZT] = one.rho * max(one.c_t, 1e-8 * one.c_l)
    put(rows, s, T, in_plane(plus_identity(one.s, -one.p), DIM))
    return one.c_l
