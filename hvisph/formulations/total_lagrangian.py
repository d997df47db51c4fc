"""Total Lagrangian SPH and its adaptive conversion to Eulerian kernels, AdapTLE (Young 2021).

Passes, over reference neighbours found once (`sph.laws.reference`): deformation and stress, then pair forces.
Where there are Eulerian particles, a spatial pass of the standard law over them and what is near
(`sph.laws.standard`, shares in `sph.laws.coupling`); where bodies meet, a pass of contact forces
(`sph.laws.contact`). See `formulations.composite` for the order.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hvisph.core.tensors import in_plane, put
from hvisph.sph.kernels import CUBIC_SPLINE, Kernel
from hvisph.sph.laws import reference
from hvisph.sph.laws.contact import Contact
from hvisph.sph.pairs import Pass
from hvisph.sph.rows import RowLayout

from .composite import CompositeStepper
from .conversion import Conversion
from .corrected import Corrected
from .eulerian import Eulerian
from .formulation import Smoothing


@dataclass(frozen=True)
class TotalLagrangian:
    """Total Lagrangian SPH, with Eulerian particles beside it.

    Parameters
    ----------
    kernel, h_over_dx
        Kernel, and smoothing length over spacing; the smoothing length stays.
    alpha, beta
        Coefficients of Monaghan's viscosity.
    stress_eps
        Artificial stress of the Eulerian particles, 0 for none.
    stress_at_interface
        Whether it acts between Eulerian and Total Lagrangian particles, on both sides; otherwise on neither.
    product
        Whether the pair stress of Eulerian particles is (sigma_a + sigma_b)/(rho_a rho_b).
    correction
        ``none``, ``gradient`` or ``mixed``, of the reference kernel.
    spatial_correction, factor
        ``none``, ``shepard``, ``gradient`` or ``mixed``, of the kernel in the current configuration, and its C_f.
    printed_viscosity
        Whether the viscosity of Total Lagrangian pairs is the printed one in reference gradients.
    hourglass
        Coefficient of the hourglass control, 0 for none.
    failed_leave
        Whether a failed Total Lagrangian particle that does not turn leaves its neighbours' lists.
    contact
        Contact between bodies; None where they meet through the spatial sums.
    conversion
        When Total Lagrangian particles turn Eulerian.
    """

    kernel: Kernel = CUBIC_SPLINE
    h_over_dx: float = 1.4
    alpha: float = 1.0
    beta: float = 2.0
    stress_eps: float = 0.0
    stress_exponent: int = 4
    stress_at_interface: bool = True
    product: bool = True
    correction: str = "mixed"
    spatial_correction: str = "none"
    factor: float = 90.0
    printed_viscosity: bool = False
    hourglass: float = 0.0
    failed_leave: bool = True
    contact: Contact | None = field(default_factory=Contact)
    conversion: Conversion = field(default_factory=Conversion)

    name = "total_lagrangian"
    fields: tuple[str, ...] = ("kernel_type", "reference_position")
    smoothing = Smoothing()
    stepper = CompositeStepper

    @property
    def viscous_factor(self) -> float:
        """1.2 beta, the share of max|mu| in the signal speed."""
        return 1.2 * self.beta

    @property
    def eulerian(self) -> Eulerian:
        """The scheme of the Eulerian particles."""
        shared: dict[str, Any] = {
            "kernel": self.kernel, "h_over_dx": self.h_over_dx, "alpha": self.alpha, "beta": self.beta,
            "product": self.product, "stress_eps": self.stress_eps, "stress_exponent": self.stress_exponent,
        }  # fmt: skip
        if self.spatial_correction == "none":
            return Eulerian(**shared)
        return Corrected(**shared, correction=self.spatial_correction, factor=self.factor)

    def passes(self, dim: int) -> list[Pass]:
        """Return nothing: the stepper of this formulation runs its own passes."""
        return []

    def layout(self, dim: int) -> RowLayout:
        """Return the row of a particle, of which neighbours read the first part."""
        return self.row(dim)[0]

    def row(self, dim: int) -> tuple[RowLayout, int]:
        """Return the row of a particle, and how many of its slots neighbours read."""
        return reference.row_layout(dim, self.correction == "mixed", self.printed_viscosity, self.hourglass != 0.0)

    def coefficients(self) -> np.ndarray:
        """Return alpha."""
        return np.array([self.alpha])

    def pack(self, dim: int) -> tuple[Any, dict[str, Any]]:
        """Return the packing function and what it is bound to."""
        return _pack, {}


def _pack(rows, s, coefficients, one):
    """Write what the passes read, but for place of reference and kind, which stay; return the speed of signals."""
    put(rows, s, 0, one.x)
    put(rows, s, U, one.u)
    rows[s, M] = one.mass
    rows[s, RHO] = one.rho
    rows[s, C] = one.c
    rows[s, H] = one.h
    rows[s, E] = one.e
    put(rows, s, S, in_plane(one.s, DIM))
    return one.c_l + 1.2 * coefficients[0] * one.c
