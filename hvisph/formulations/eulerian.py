"""Eulerian (updated Lagrangian) SPH in its standard form: Mehra & Chaturvedi's SAV family.

One pass: `sph.laws.standard` with Monaghan's viscosity and, as options, Balsara's or Morris and Monaghan's
shares of it (BAL, MON), Gray's artificial stress and Zisis's density dissipation. Shares follow from the
velocity gradient of the evaluation before: within a step of 0.2 dx/c it hardly changes, and a pass is saved.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hvisph.core.tensors import in_plane, plus_identity, put, times
from hvisph.sph import artificial_stress
from hvisph.sph.kernels import CUBIC_SPLINE, Kernel
from hvisph.sph.laws import standard
from hvisph.sph.pairs import Pass
from hvisph.sph.rows import RowLayout

from .formulation import Smoothing
from .stepper import Stepper


@dataclass(frozen=True)
class Eulerian:
    """Standard SPH of solids.

    Parameters
    ----------
    kernel, h_over_dx, smoothing
        Kernel, smoothing length over spacing, and how it varies.
    alpha, beta
        Linear and quadratic coefficients of Monaghan's viscosity; SAV1 is 1 and 2.
    stress_eps
        Strength of the artificial stress, 0 for none.
    stress_exponent
        Its exponent n of W/W(dx).
    product
        Whether the pair stress is (sigma_a + sigma_b)/(rho_a rho_b).
    mass_form
        Whether the rate of density is sum m_b u_ab . grad W, not rho_a sum m_b/rho_b u_ab . grad W.
    alpha_rho
        Coefficient of the density dissipation, 0 for none.
    switch
        Share of the viscosity that a particle takes: ``none`` (all of it), ``balsara`` or ``morris_monaghan``.
    share_minimum, share_decay
        s_min and C1 of ``morris_monaghan``.
    """

    kernel: Kernel = CUBIC_SPLINE
    h_over_dx: float = 1.4
    smoothing: Smoothing = field(default_factory=Smoothing)
    alpha: float = 1.0
    beta: float = 2.0
    stress_eps: float = 0.0
    stress_exponent: int = 4
    product: bool = False
    mass_form: bool = False
    alpha_rho: float = 0.0
    switch: str = "none"
    share_minimum: float = 0.1
    share_decay: float = 0.2

    name = "eulerian"
    stepper = Stepper

    @property
    def fields(self) -> tuple[str, ...]:
        """What particles carry beside the state."""
        switched = ("viscosity_share",) if self.switch == "morris_monaghan" else ()
        return (*switched, "previous_density_rate") if self.density_rate else switched

    @property
    def density_rate(self) -> bool:
        """Whether density has a rate beside that of the velocity gradient."""
        return self.mass_form or self.alpha_rho != 0.0

    @property
    def viscous_factor(self) -> float:
        """1.2 beta, the share of max|mu| in the signal speed."""
        return 1.2 * self.beta

    def passes(self, dim: int) -> list[Pass]:
        """Return the one pass: all rates at once."""
        options = self._options() | {"EXPONENT": self.stress_exponent}
        return [Pass(standard.accumulate, self.layout(dim), options, density_rate=self.density_rate)]

    def _options(self) -> dict[str, int]:
        return {
            "ARTIFICIAL_STRESS": int(self.stress_eps != 0.0),
            "PRODUCT": int(self.product),
            "MASS_FORM": int(self.mass_form),
            "DISSIPATION": int(self.alpha_rho != 0.0),
            "SWITCHED": int(self.switch != "none"),
        }

    def layout(self, dim: int) -> RowLayout:
        """Return the row of the standard law."""
        more = (("p", "scalar"),) if self.alpha_rho else ()
        if self.switch != "none":
            more = (*more, ("share", "scalar"))
        return standard.row_layout(dim, self.stress_eps != 0.0, more)

    def coefficients(self) -> np.ndarray:
        """Return alpha, beta, 1 / w(dx/h), eps, alpha_rho, s_min and C1 of the shares."""
        at_spacing = self.kernel.shape.py_func(1.0 / self.h_over_dx)
        return np.array([self.alpha, self.beta, 1.0 / at_spacing, self.stress_eps, self.alpha_rho,
                         self.share_minimum, self.share_decay])  # fmt: skip

    def pack(self, dim: int) -> tuple[Any, dict[str, Any]]:
        """Return the packing function and what it is bound to."""
        return _pack, {
            "ARTIFICIAL_STRESS": int(self.stress_eps != 0.0),
            "DISSIPATION": int(self.alpha_rho != 0.0),
            "tensile_part": artificial_stress.tensile_part(dim),
        }


def _pack(rows, s, coefficients, one):
    """Write what the standard law reads of `one`; return the speed of signals without the |mu| term."""
    inverse2 = 1.0 / (one.rho * one.rho)
    stress = in_plane(plus_identity(one.s, -one.p), DIM)
    put(rows, s, 0, one.x)
    put(rows, s, U, one.u)
    rows[s, H] = one.h
    rows[s, M] = one.mass
    rows[s, RHO] = one.rho
    rows[s, C] = one.c
    put(rows, s, T, times(inverse2, stress))
    if ARTIFICIAL_STRESS:
        put(rows, s, R, times(-coefficients[3] * inverse2, tensile_part(stress)))
    if DISSIPATION:
        rows[s, P] = one.p
        return one.c_l + 1.2 * (coefficients[0] + coefficients[4]) * one.c
    return one.c_l + 1.2 * coefficients[0] * one.c
