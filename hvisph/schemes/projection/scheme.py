"""SPH-projection (Farahani 2009): a pressure Poisson equation restores the density at every step.

Passes, all with the kernels at the start of the step (`schemes.projection.law`, `projection_passes`):

    1  velocity gradient; deviator by `materials.stress_update`
    2  stress divergence; velocity u~ = u + dt (g + T)
    3  density that u~ leads to, and Poisson sums; pressure by one sweep of Jacobi's iteration
    4  pressure gradient; velocity, then position by the mean of the old and the new velocity
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hvisph.schemes.protocol import Smoothing
from hvisph.sph.kernels import CUBIC_SPLINE, Kernel

from .stepper import ProjectionStepper

# Points of the rule that integrates the kernel for the minimum support: its result is good to 1e-6.
_POINTS = 2000


@dataclass(frozen=True)
class Projection:
    """SPH-projection."""

    # kernel, smoothing length over spacing, and how it varies
    kernel: Kernel = CUBIC_SPLINE
    h_over_dx: float = 1.5
    smoothing: Smoothing = field(default_factory=Smoothing)
    # whether the pressure gradient is eq. 31 P_a/rho_a^2 + P_b/rho_b^2, in place of the conjugate of the divergence,
    # (P_a + P_b)/(rho_a rho_b)
    original_gradient: bool = False
    min_support: float = 0.3  # a particle whose neighbourhood is less full than this has no pressure; see `fullness`
    body_force: tuple[float, ...] = ()  # acceleration of all particles [m/s^2], as many components as dimensions
    pressure_average: float = 2e-7  # time over which recorded pressures are averaged [s]

    name = "projection"
    corrects = slips = repels = False
    fields: tuple[str, ...] = ("pressure",)
    viscous_factor = 0.0
    stepper = ProjectionStepper

    def fullness(self, dim: int) -> float:
        """Return the factor that makes -A rho0 h^2 of `schemes.projection.law` 1 inside a body.

        In the limit of many neighbours A = 2/rho0 int W'(r)/r dV, so a flat surface has 1/2.
        For the cubic spline in 2D the factor is 0.175.
        """
        edges = np.linspace(0.0, self.kernel.reach, _POINTS + 1)
        middles = 0.5 * (edges[1:] + edges[:-1])
        sphere = (2.0, 2.0 * np.pi, 4.0 * np.pi)[dim - 1]
        slopes = np.array([self.kernel.derivative(q, 1.0, dim) for q in middles])
        integral = sphere * (slopes * middles ** (dim - 2)).sum() * (edges[1] - edges[0])
        return float(-1.0 / (2.0 * integral))
