"""Standard SPH in updated Lagrangian form: the SAV family of Mehra & Chaturvedi.

One pass: `schemes.standard.law` with Monaghan's viscosity and, as options, Balsara's or Morris and Monaghan's
shares of it (BAL, MON), Gray's artificial stress and Zisis's density dissipation. Shares follow from the
velocity gradient of the evaluation before: within a step of 0.2 dx/c it hardly changes, and a pass is saved.
With corrected kernels (Young 2021) a pass before it, `sph.terms.kernel_correction`, writes the corrections into each
row.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hvisph.compiler.jit import Options, PythonFunction, bind
from hvisph.compiler.tensors import add_identity, multiply, put
from hvisph.compiler.tensors3d import plane_components
from hvisph.core.particles import Particles
from hvisph.integrators.time_step import VISCOUS_SIGNAL
from hvisph.schemes.protocol import Smoothing
from hvisph.schemes.stepper import Stepper
from hvisph.sph.contact import coupling
from hvisph.sph.kernels import CUBIC_SPLINE, Kernel
from hvisph.sph.neighbours.ghost_rows import Plane
from hvisph.sph.neighbours.pairs import Pairs, Pass
from hvisph.sph.neighbours.particle_layout import RowLayout
from hvisph.sph.terms import artificial_stress, kernel_correction
from hvisph.sph.terms.riemann_solver import SHEAR_IMPEDANCE_MIN

from . import law as standard
from . import options
from .frictional_contact import NoContact, SeparatingContact


@dataclass(frozen=True)
class Eulerian:
    """Standard SPH of solids."""

    # kernel, smoothing length over spacing, and how it varies
    kernel: Kernel = CUBIC_SPLINE
    h_over_dx: float = 1.4
    smoothing: Smoothing = field(default_factory=Smoothing)
    # options of `hvisph.schemes.standard.options`
    viscosity: options.MonaghanViscosity = field(default_factory=options.MonaghanViscosity)
    artificial_stress: options.GrayArtificialStress = options.NO_ARTIFICIAL_STRESS
    dissipation: options.DensityDissipation = options.NO_DENSITY_DISSIPATION
    correction: options.KernelCorrection = options.PLAIN_GRADIENT
    product: bool = False  # whether the pair stress is (sigma_a + sigma_b)/(rho_a rho_b), as a correction always has it
    # whether the rate of density is sum m_b u_ab . grad W, not rho_a sum m_b/rho_b u_ab . grad W
    mass_form: bool = False
    # whether bodies separate and slide, or are bonded, and Coulomb's coefficient between them
    has_contact: bool = False
    friction: float = 0.0
    fragment_contact: bool = False  # whether detached components of a body are in contact with it
    axisymmetric: bool = False  # whether particles are axisymmetric about the axis x
    unequal_spacings: bool = False  # whether bodies in contact differ in spacing
    shears: bool = False  # whether particles in shear flow take a share of the linear viscosity
    # whether angular momentum is conserved; not in axisymmetric cases, with a kernel correction, nor in 1D
    angular_momentum: bool = False
    # whether some bodies are rigid, and whether these turn
    rigid: bool = False
    turns: bool = False
    single: bool = False  # whether pairs are evaluated in single precision

    name = "eulerian"
    stores_contact_energy = False
    stepper = Stepper
    band_spacings = 3.0  # width of a crack band over a particle's: gradients over 2h share it among three rows

    @property
    def fields(self) -> tuple[str, ...]:
        names = self.viscosity.fields
        names = (*names, "torque_residual") if self.angular_momentum else names
        return (*names, "previous_density_rate") if self.density_rate else names

    @property
    def density_rate(self) -> bool:
        """Whether density has a rate beside that of the velocity gradient."""
        return self.mass_form or self.dissipation.acts

    @property
    def viscous_factor(self) -> float:
        return VISCOUS_SIGNAL * self.viscosity.beta

    @property
    def corrects_kernels(self) -> bool:
        return self.correction.acts

    @property
    def switch(self) -> int:
        """Which share of the viscosity particles take."""
        return self.viscosity.switch

    @property
    def reduces_shear_viscosity(self) -> bool:
        return self.shears

    @property
    def has_friction(self) -> bool:
        return self.has_contact

    def body_contact(self, h: float, particles: Particles, planes: tuple[Plane, ...]) -> NoContact | SeparatingContact:
        """Return the contact between the bodies of `particles`; none where they are bonded."""
        if not self.has_contact:
            return NoContact()
        return SeparatingContact(self.kernel, h, particles["position"], particles.body, self.friction, planes,
                                 self.axisymmetric, self.unequal_spacings, self.h_over_dx, self.angular_momentum,
                                 {"RIGID": int(self.rigid), "TURNS": int(self.turns)})  # fmt: skip

    def passes(self, dim: int) -> list[Pass]:
        """Return the passes: the corrections into each row, where there are any, then all rates at once."""
        plain, law_options = (
            self._plain_layout(dim),
            {
                "ARTIFICIAL_STRESS": int(self.artificial_stress.acts),
                "PRODUCT": int(self.product),
                "MASS_FORM": int(self.mass_form),
                "DISSIPATION": int(self.dissipation.acts),
                "SWITCHED": int(self.viscosity.has_switch),
                "EXPONENT": self.artificial_stress.exponent,
                "AXISYMMETRIC": int(self.axisymmetric),
                "ANGULAR_MOMENTUM": int(self.angular_momentum),
            },
        )
        contact_options: Options = {}
        if self.has_contact:  # pairs of different bodies are left to the contact between them
            contact_options = {"COUPLED": 1, "shares": bind(coupling.separate_shares, {}, plain.slots())}
        if not self.correction.acts:
            law_options |= contact_options
            return [
                Pass(
                    standard.accumulate,
                    plain,
                    law_options,
                    density_rate=self.density_rate,
                    has_friction=self.has_contact,
                    axisymmetric=self.axisymmetric,
                    angular_momentum=self.angular_momentum or self.turns,
                    skips_undisturbed=True,
                )
            ]
        parts = {"SHEPARD": int(self.correction.shepard), "GRADIENT": int(self.correction.gradient)}
        # each side's stress over rho_a rho_b, as published
        law_options |= {"CORRECTED": 1, "PRODUCT": 1, "FACTOR": len(self._plain_coefficients())}
        if self.correction.by_component:
            law_options["correction_margin"] = standard.correction_margin_by_component
        return [
            Pass(kernel_correction.corrections, plain, parts | contact_options, into_rows=True),
            Pass(
                standard.accumulate,
                kernel_correction.pair_layout(plain),
                law_options | contact_options,
                density_rate=self.density_rate,
                has_friction=self.has_contact,
                angular_momentum=self.turns,
            ),
        ]

    def layout(self, dim: int) -> RowLayout:
        """Return the row of the standard law, with the corrections where there are any."""
        plain = self._plain_layout(dim)
        return kernel_correction.row_layout(plain) if self.correction.acts else plain

    def _plain_layout(self, dim: int) -> RowLayout:
        extra = (("p", "scalar"),) if self.dissipation.acts else ()
        if self.viscosity.has_switch:
            extra = (*extra, ("share", "scalar"))
        if self.has_contact:
            extra = (*extra, ("body", "scalar"), ("zn", "scalar"), ("zt", "scalar"))
        if self.angular_momentum:
            extra = (*extra, ("spin_stress", "axial"))
        if self.turns:
            extra = (*extra, ("turn_rate", "axial"))
        if self.axisymmetric:
            extra = (*extra, ("ring", "radius"), ("hoop", "scalar"))
        return standard.row_layout(dim, self.artificial_stress.acts, extra)

    def coefficients(self) -> np.ndarray:
        """Return alpha, beta, 1 / w(dx/h), eps, alpha_rho, s_min and C1 of the shares, then those of the correction."""
        plain = self._plain_coefficients()
        return np.concatenate([plain, standard.safeguard(self.correction.factor)]) if self.correction.acts else plain

    def _plain_coefficients(self) -> np.ndarray:
        value = self.kernel.shape.py_func(1.0 / self.h_over_dx)
        return np.array(
            [
                self.viscosity.alpha,
                self.viscosity.beta,
                1.0 / value,
                self.artificial_stress.eps,
                self.dissipation.alpha,
                *self.viscosity.relaxation,
            ]
        )

    def pack(self, dim: int) -> tuple[PythonFunction, Options]:
        return _pack, {
            "ARTIFICIAL_STRESS": int(self.artificial_stress.acts),
            "DISSIPATION": int(self.dissipation.acts),
            "SEPARATING": int(self.has_contact),
            "AXISYMMETRIC": int(self.axisymmetric),
            "ANGULAR_MOMENTUM": int(self.angular_momentum),
            "tensile_part": artificial_stress.tensile_part(dim),
        }

    def isolated_density(self, dim: int) -> float:
        """Return the least rho h^dim/m, that of a lone axisymmetric particle, whose section would grow; else 0."""
        return float(self.kernel.value(0.0, 1.0, dim)) if self.axisymmetric else 0.0

    def limits(self) -> None:
        """Return None: the law has no limits of tractions."""

    def keep(self, pairs: Pairs, lengths: np.ndarray) -> None:
        """Store nothing."""


def _pack(rows, s, coefficients, particle):
    """Pack the row of a particle; return its signal speed [m/s] without the |mu| term."""
    inverse2 = 1.0 / (particle.rho * particle.rho)
    stress = plane_components(add_identity(particle.s, -particle.p), DIM)
    put(rows, s, 0, particle.x)
    put(rows, s, U, particle.u)
    rows[s, H] = particle.h
    rows[s, M] = particle.mass
    rows[s, RHO] = particle.rho
    rows[s, C] = particle.c
    put(rows, s, T, multiply(inverse2, stress))
    if ARTIFICIAL_STRESS:
        put(rows, s, R, multiply(-coefficients[3] * inverse2, tensile_part(stress)))
    if SEPARATING:
        rows[s, BODY] = particle.body
        rows[s, ZN] = particle.rho * particle.c_l
        rows[s, ZT] = particle.rho * max(particle.c_t, SHEAR_IMPEDANCE_MIN * particle.c_l)
    if AXISYMMETRIC:
        rows[s, RING] = particle.ring
        rows[s, HOOP] = (particle.s[2] - particle.p) * inverse2
    if ANGULAR_MOMENTUM:
        put(rows, s, SPIN_STRESS, multiply(0.5 * particle.rho * inverse2, particle.spin))
    if DISSIPATION:
        rows[s, P] = particle.p
        return particle.c_l + VISCOUS_SIGNAL * (coefficients[0] + coefficients[4]) * particle.c
    return particle.c_l + VISCOUS_SIGNAL * coefficients[0] * particle.c


def fallbacks(stepper: Any) -> int:
    """Return how many gradients, two a pair, were plain in the last evaluation of a corrected `stepper`."""
    pairs = stepper.pairs
    return round(float(pairs.sorted[stepper.paired_rows, pairs.slots["FALLBACKS"]].sum()))
