"""Total Lagrangian SPH and its adaptive conversion to Eulerian kernels, AdapTLE (Young 2021).

Passes over reference neighbours, which are found once (`schemes.total_lagrangian.law`): deformation and stress, then
pair forces. Eulerian particles and their neighbours have a spatial pass of the standard law (`schemes.standard.law`,
weights in `sph.contact.coupling`); bodies in contact have a pass of contact forces (`sph.contact.penalty_contact`). See
`schemes.adaptive.stepper` for the order.
"""

from dataclasses import dataclass, field

import numpy as np

from hvisph.compiler.jit import Options, PythonFunction
from hvisph.compiler.tensors import put
from hvisph.compiler.tensors3d import plane_components
from hvisph.integrators.particle_steps import WHOLE
from hvisph.integrators.time_step import VISCOUS_SIGNAL
from hvisph.schemes.adaptive.state import Conversion
from hvisph.schemes.adaptive.stepper import CompositeStepper
from hvisph.schemes.protocol import Smoothing
from hvisph.schemes.standard import options
from hvisph.schemes.standard.scheme import Eulerian
from hvisph.sph.contact.penalty_contact import Pressing
from hvisph.sph.contact.repulsion import Bonded, Contact
from hvisph.sph.kernels import CUBIC_SPLINE, Kernel
from hvisph.sph.neighbours.pairs import Pass
from hvisph.sph.neighbours.particle_layout import RowLayout

from . import law as reference


@dataclass(frozen=True)
class TotalLagrangian:
    """Total Lagrangian SPH, with Eulerian particles beside it."""

    # kernel, and smoothing length over spacing; the smoothing length stays
    kernel: Kernel = CUBIC_SPLINE
    h_over_dx: float = 1.4
    viscosity: options.MonaghanViscosity = field(default_factory=options.MonaghanViscosity)  # Monaghan's, or none
    # that of the Eulerian particles
    artificial_stress: options.GrayArtificialStress = options.NO_ARTIFICIAL_STRESS
    # whether it acts between Eulerian and Total Lagrangian particles, on both sides; otherwise on neither
    stress_at_interface: bool = True
    product: bool = True  # whether the pair stress of Eulerian particles is (sigma_a + sigma_b)/(rho_a rho_b)
    # that of the reference kernel: none, of the gradient, or of both
    correction: options.KernelCorrection = field(default_factory=options.KernelCorrection)
    # that of the kernel in the current configuration
    spatial_correction: options.KernelCorrection = options.PLAIN_GRADIENT
    # whether the viscosity of Total Lagrangian pairs is the printed one in reference gradients
    printed_viscosity: bool = False
    hourglass: float = 0.0  # coefficient of the hourglass control, 0 for none
    secant: bool = False  # whether its stiffness falls with plastic strain and damage
    shears: bool = False  # whether a particle in plastic flow takes a share of the linear viscosity alone
    # whether a failed Total Lagrangian particle that does not turn leaves its neighbours' lists, and whether these keep
    # their volume then
    failed_leave: bool = True
    keeps_volume: bool = True
    # equivalent strain since the last renewal of the reference at which it is renewed; None for never
    renew_strain: float | None = None
    # contact between bodies, and self-contact; `Bonded` for bodies that spatial sums connect
    contact: Pressing | Contact | Bonded = field(default_factory=Pressing)
    conversion: Conversion = field(default_factory=Conversion)  # when Total Lagrangian particles turn Eulerian
    axisymmetric: bool = False  # whether particles are axisymmetric about the axis x
    # Courant number of the run: the share of a spacing to which particles may be squeezed before they set the step
    courant: float = 0.3

    name = "total_lagrangian"
    fields: tuple[str, ...] = ("kernel_type", "reference_position")
    smoothing = Smoothing()
    switch = WHOLE
    band_spacings = 3.0  # width of a crack band over a particle's: gradients over 2h share it among three rows
    stepper = CompositeStepper

    @property
    def has_friction(self) -> bool:
        return self.contact.friction > 0.0

    @property
    def stores_contact_energy(self) -> bool:
        return self.contact.separates

    @property
    def viscous_factor(self) -> float:
        return VISCOUS_SIGNAL * self.viscosity.beta

    @property
    def corrects_kernels(self) -> bool:
        return self.spatial_correction.acts

    @property
    def reduces_shear_viscosity(self) -> bool:
        """Whether the linear viscosity is reduced in shear flow; not of axisymmetric particles."""
        return self.shears and self.axisymmetric

    @property
    def eulerian(self) -> Eulerian:
        """The scheme of the Eulerian particles."""
        return Eulerian(
            self.kernel,
            self.h_over_dx,
            viscosity=self.viscosity,
            artificial_stress=self.artificial_stress,
            correction=self.spatial_correction,
            product=self.product,
            axisymmetric=self.axisymmetric,
            shears=self.shears,
        )

    def passes(self, dim: int) -> list[Pass]:
        """Return no passes: the stepper has its own."""
        return []

    def layout(self, dim: int) -> RowLayout:
        """Return the row layout; neighbours read its first part."""
        return self.row(dim)[0]

    def row(self, dim: int) -> tuple[RowLayout, int]:
        """Return the row layout, and the number of slots that neighbours read."""
        law_options = self.correction.shepard, self.printed_viscosity, self.hourglass != 0.0
        return reference.row_layout(dim, *law_options, self.axisymmetric)

    def coefficients(self) -> np.ndarray:
        """Return alpha of the viscosity."""
        return np.array([self.viscosity.alpha])

    def pack(self, dim: int) -> tuple[PythonFunction, Options]:
        return _pack, {"AXISYMMETRIC": int(self.axisymmetric)}

    def isolated_density(self, dim: int) -> float:
        """Return W(0) h^dim of an isolated particle, where failed particles convert; else 0."""
        converts = self.conversion.damage and self.conversion.fallback_damage
        return float(self.kernel.value(0.0, 1.0, dim)) if converts else 0.0

    def limits(self) -> None:
        """Return None: no law needs strength limits."""


def _pack(rows, s, coefficients, particle):
    """Pack the row of a particle except its reference position and kind; return its signal speed [m/s]."""
    put(rows, s, 0, particle.x)
    put(rows, s, U, particle.u)
    rows[s, M] = particle.mass
    rows[s, RHO] = particle.rho
    rows[s, C] = particle.c
    rows[s, H] = particle.h
    rows[s, E] = particle.e
    put(rows, s, S, plane_components(particle.s, DIM))
    if AXISYMMETRIC:
        rows[s, RING] = particle.ring
    return particle.c_l + VISCOUS_SIGNAL * coefficients[0] * particle.c
