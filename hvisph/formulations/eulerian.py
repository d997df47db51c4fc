"""Eulerian (updated Lagrangian) SPH in its standard form: Mehra & Chaturvedi's SAV family.

One pass: `sph.laws.standard` with Monaghan's viscosity and, as options, Balsara's or Morris and Monaghan's
shares of it (BAL, MON), Gray's artificial stress and Zisis's density dissipation. Shares follow from the
velocity gradient of the evaluation before: within a step of 0.2 dx/c it hardly changes, and a pass is saved.
With corrected kernels (Young 2021) a pass before it, `sph.laws.corrections`, writes the corrections into each row.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hvisph.core.tensors import in_plane, plus_identity, put, times
from hvisph.sph import artificial_stress
from hvisph.sph.kernels import CUBIC_SPLINE, Kernel
from hvisph.sph.laws import corrections, standard
from hvisph.sph.pairs import Pass
from hvisph.sph.rows import RowLayout

from .formulation import Smoothing
from .options import (
    DensityDissipation,
    GrayArtificialStress,
    KernelCorrection,
    MonaghanViscosity,
    NoArtificialStress,
    NoCorrection,
    NoDensityDissipation,
)
from .stepper import Stepper


@dataclass(frozen=True)
class Eulerian:
    """Standard SPH of solids.

    Parameters
    ----------
    kernel, h_over_dx, smoothing
        Kernel, smoothing length over spacing, and how it varies.
    viscosity, artificial_stress, dissipation, correction
        What `hvisph.formulations.options` offers.
    product
        Whether the pair stress is (sigma_a + sigma_b)/(rho_a rho_b), as a correction always has it.
    mass_form
        Whether the rate of density is sum m_b u_ab . grad W, not rho_a sum m_b/rho_b u_ab . grad W.
    """

    kernel: Kernel = CUBIC_SPLINE
    h_over_dx: float = 1.4
    smoothing: Smoothing = field(default_factory=Smoothing)
    viscosity: MonaghanViscosity = field(default_factory=MonaghanViscosity)
    artificial_stress: GrayArtificialStress = field(default_factory=NoArtificialStress)
    dissipation: DensityDissipation = field(default_factory=NoDensityDissipation)
    correction: KernelCorrection = field(default_factory=NoCorrection)
    product: bool = False
    mass_form: bool = False

    name = "eulerian"
    slips = False
    stepper = Stepper

    @property
    def fields(self) -> tuple[str, ...]:
        """What particles carry beside the state."""
        own = self.viscosity.fields
        return (*own, "previous_density_rate") if self.density_rate else own

    @property
    def density_rate(self) -> bool:
        """Whether density has a rate beside that of the velocity gradient."""
        return self.mass_form or self.dissipation.acts

    @property
    def viscous_factor(self) -> float:
        """1.2 beta, the share of max|mu| in the signal speed."""
        return 1.2 * self.viscosity.beta

    @property
    def corrects(self) -> bool:
        """Whether kernels are corrected."""
        return self.correction.acts

    @property
    def switch(self) -> str:
        """Which share of the viscosity particles take."""
        return self.viscosity.switch

    def passes(self, dim: int) -> list[Pass]:
        """Return the passes: the corrections into each row, where there are any, then all rates at once."""
        plain, ways = self._plain_layout(dim), {
            "ARTIFICIAL_STRESS": int(self.artificial_stress.acts),
            "PRODUCT": int(self.product),
            "MASS_FORM": int(self.mass_form),
            "DISSIPATION": int(self.dissipation.acts),
            "SWITCHED": int(self.viscosity.switched),
            "EXPONENT": self.artificial_stress.exponent,
        }  # fmt: skip
        if not self.correction.acts:
            return [Pass(standard.accumulate, plain, ways, density_rate=self.density_rate)]
        parts = {"SHEPARD": int(self.correction.shepard), "GRADIENT": int(self.correction.gradient)}
        # each side's stress over rho_a rho_b, as published
        ways |= {"CORRECTED": 1, "PRODUCT": 1, "FACTOR": len(self._plain_coefficients())}
        return [
            Pass(corrections.corrections, plain, parts, into_rows=True),
            Pass(standard.accumulate, corrections.pair_layout(plain), ways, density_rate=self.density_rate),
        ]

    def layout(self, dim: int) -> RowLayout:
        """Return the row of the standard law, with the corrections where there are any."""
        plain = self._plain_layout(dim)
        return corrections.row_layout(plain) if self.correction.acts else plain

    def _plain_layout(self, dim: int) -> RowLayout:
        more = (("p", "scalar"),) if self.dissipation.acts else ()
        if self.viscosity.switched:
            more = (*more, ("share", "scalar"))
        return standard.row_layout(dim, self.artificial_stress.acts, more)

    def coefficients(self) -> np.ndarray:
        """Return alpha, beta, 1 / w(dx/h), eps, alpha_rho, s_min and C1 of the shares, then those of the correction."""
        plain = self._plain_coefficients()
        return np.concatenate([plain, standard.safeguard(self.correction.factor)]) if self.correction.acts else plain

    def _plain_coefficients(self) -> np.ndarray:
        at_spacing = self.kernel.shape.py_func(1.0 / self.h_over_dx)
        return np.array([self.viscosity.alpha, self.viscosity.beta, 1.0 / at_spacing, self.artificial_stress.eps,
                         self.dissipation.alpha, *self.viscosity.relaxation])  # fmt: skip

    def pack(self, dim: int) -> tuple[Any, dict[str, Any]]:
        """Return the packing function and what it is bound to."""
        return _pack, {
            "ARTIFICIAL_STRESS": int(self.artificial_stress.acts),
            "DISSIPATION": int(self.dissipation.acts),
            "tensile_part": artificial_stress.tensile_part(dim),
        }

    def limits(self) -> None:
        """Return nothing: no law asks for what a particle bears."""


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


def fallbacks(stepper: Any) -> int:
    """Return how many gradients, two a pair, were plain in the last evaluation of a corrected `stepper`."""
    pairs = stepper.pairs
    return round(float(pairs.sorted[stepper.paired, pairs.slots["FALLBACKS"]].sum()))
