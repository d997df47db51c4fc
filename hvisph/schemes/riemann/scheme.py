"""Riemann SPH (CON): scheme without artificial viscosity and artificial stress.

Passes: with reconstruction, gradients of velocity and stress into each row; then the
Riemann problem of every pair (`schemes.riemann.law`).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hvisph.compiler.jit import Options, PythonFunction
from hvisph.compiler.tensors import add, add_identity, multiply, put, row_symmetric
from hvisph.compiler.tensors3d import growth_factor, plane_components
from hvisph.core.particles import Particles
from hvisph.integrators.particle_steps import WHOLE
from hvisph.schemes.protocol import Smoothing
from hvisph.schemes.standard.frictional_contact import NoContact
from hvisph.schemes.stepper import Stepper
from hvisph.sph.contact import contact_normal, variable_resolution
from hvisph.sph.kernels import CUBIC_SPLINE, Kernel
from hvisph.sph.neighbours.ghost_rows import Plane
from hvisph.sph.neighbours.pairs import Pairs, Pass
from hvisph.sph.neighbours.particle_layout import RowLayout
from hvisph.sph.terms.density_correction import relaxation_rates
from hvisph.sph.terms.limiters import LIMITERS, Limiter
from hvisph.sph.terms.reconstruction import limited_shares_of_ratios
from hvisph.sph.terms.riemann_solver import SHEAR_IMPEDANCE_MIN, SHOCK_SLOPE

from . import law as riemann
from . import row as riemann_row

# Options of the templates, and the properties of the scheme that set them.
OPTIONS = {
    "RECONSTRUCTION": "reconstructs",
    "CORRECTED_VARIANT": "corrected_variant",
    "TENSION_STABILIZED": "tension_stabilized",
    "GRAD_H": "varies_smoothing",
    "DENSITY_CORRECTION": "corrects_density",
    "ANGULAR_MOMENTUM": "angular_momentum",
    "AXISYMMETRIC": "axisymmetric",
    "SEPARATING": "has_contact",
    "VARIABLE_RESOLUTION": "has_unequal_spacings",
    "SELF_CONTACT": "self_contact",
    "ANISOTROPIC": "anisotropic",
    "FRACTURES": "fractures",
    "ADJOINT": "adjoint",
    "RIGID": "rigid",
    "TURNS": "turns",
    "EDGES": "edges",
}
# Smallest section area at rest of an axisymmetric particle over its present one.
SECTION_RATIO_MIN = 0.5


@dataclass(frozen=True)
class Riemann:
    """Contact SPH: the published scheme or its corrected variant.

    `kernel`, `h_over_dx`, `smoothing`: kernel, smoothing length over spacing, and evolution of the smoothing length.
    `reconstruction`: slope limiter of `hvisph.sph.terms.limiters`; its ``none`` switches the reconstruction off.
    `corrected_variant`: whether density, impedance, limits of the tractions and free surfaces are those of the
    corrected variant.
    `tension_stabilized`: whether pairs that are too close lose their tension.
    `has_contact`: whether bodies separate and slide; otherwise they are bonded.
    `friction`: Coulomb's coefficient.
    `fragment_contact`: whether detached components of a body are in contact with it.
    `axisymmetric`: whether particles are axisymmetric about the axis x.
    `unequal_spacings`: whether bodies in contact differ in spacing.
    `self_contact`: whether surfaces of one connected body are in contact.
    `angular_momentum`: whether angular momentum is conserved; not in axisymmetric cases, nor in 1D.
    `anisotropic`: whether a material has wave speeds that depend on direction.
    `fractures`: whether a material has a fracture energy.
    `adjoint`: whether force and power have the corrected operator of the velocity gradient, and the stress jump does
    not enter the contact velocity of solids that have not yielded (`sph.terms.adjoint_operator`).
    `rigid`, `turns`, `edges`: whether some bodies are rigid; whether these rotate; whether there are open edges.
    `single`: whether pairs are evaluated in single precision.
    """

    kernel: Kernel = CUBIC_SPLINE
    h_over_dx: float = 1.4
    smoothing: Smoothing = field(default_factory=Smoothing)
    reconstruction: Limiter = LIMITERS["van_albada"]
    corrected_variant: bool = True
    tension_stabilized: bool = True
    has_contact: bool = False
    friction: float = 0.0
    fragment_contact: bool = False
    axisymmetric: bool = False
    unequal_spacings: bool = False
    self_contact: bool = False
    angular_momentum: bool = False
    anisotropic: bool = False
    fractures: bool = False
    adjoint: bool = False
    rigid: bool = False
    turns: bool = False
    edges: bool = False
    single: bool = False

    name = "riemann"
    corrects_kernels = stores_contact_energy = False
    switch = WHOLE
    band_spacings = 1.0  # width of a crack band over a particle's: the weaker side limits a pair
    reduces_shear_viscosity = False
    stepper = Stepper

    @property
    def fields(self) -> tuple[str, ...]:
        names = ("previous_density_rate",) if self.corrected_variant else ()
        names = (*names, "density_correction") if self.corrects_density else names
        return (*names, "torque_residual") if self.angular_momentum else names

    @property
    def varies_smoothing(self) -> bool:
        """Whether h varies with density (`sph.terms.grad_h`)."""
        return self.corrected_variant and self.smoothing.variable

    @property
    def corrects_density(self) -> bool:
        """Whether density has the correction of `sph.terms.density_correction`."""
        return self.corrected_variant and not self.smoothing.variable

    @property
    def reconstructs(self) -> bool:
        """Whether states are reconstructed."""
        return self.reconstruction.acts

    @property
    def viscous_factor(self) -> float:
        return SHOCK_SLOPE / self.kernel.width

    @property
    def has_friction(self) -> bool:
        return self.has_contact

    @property
    def has_unequal_spacings(self) -> bool:
        """Whether bodies of unequal spacings are in contact."""
        return self.has_contact and self.unequal_spacings

    def options(self, *templates: PythonFunction) -> Options:
        """Return the options, 0 or 1, that the templates use."""
        used = {name for template in templates for name in template.__code__.co_names}
        return {name: int(getattr(self, attribute)) for name, attribute in OPTIONS.items() if name in used}

    def passes(self, dim: int) -> list[Pass]:
        """Return the passes: neighbourhood data of each row, then Riemann problems."""
        law_options = self.options(riemann.accumulate, *riemann.PARTS) | {"share": self.reconstruction.share}
        if self.single:
            law_options["limited_shares"] = limited_shares_of_ratios
        row = self.layout(dim)
        flux = Pass(
            riemann.accumulate,
            riemann_row.pair_layout(row),
            law_options,
            riemann.PARTS,
            density_rate=self.corrected_variant,
            corrects_density=self.corrects_density,
            has_friction=self.has_contact,
            axisymmetric=self.axisymmetric,
            angular_momentum=self.angular_momentum or self.turns,
            adjoint=self.adjoint,
            own_reach=self.varies_smoothing,
            skips_undisturbed=not self.self_contact,
        )
        if not (self.reconstructs or self.has_contact or self.fractures):
            return [flux]
        first = [
            Pass(
                riemann_row.gradients,
                riemann_row.pair_layout(row),
                self.options(riemann_row.gradients, contact_normal.is_other_body),
                (contact_normal.is_other_body,),
                into_rows=True,
                skips_undisturbed=not self.self_contact,
            )
        ]
        if self.has_contact:
            first += riemann_row.contact_passes(row, self.kernel, self.unequal_spacings, self.self_contact)
        return [*first, flux]

    def body_contact(self, h: float, particles: Particles, planes: tuple[Plane, ...]) -> NoContact:
        """Return no contact: the pair law contains it."""
        return NoContact()

    def keep(self, pairs: Pairs, lengths: np.ndarray) -> None:
        """Store the surface normals of this evaluation in the rows for the next one."""
        if self.self_contact:
            slots, count, dim = pairs.slots, len(lengths), pairs.layout.dim
            normals = pairs.sorted[pairs.place[:count], slots["N_SURFACE"] : slots["N_SURFACE"] + dim]
            deficit = variable_resolution.kernel_deficit(self.kernel, self.h_over_dx, dim)[0]
            size = lengths / (deficit * pairs.unit)  # 1 in the layer under a flat face
            pairs.rows[:, slots["N_PREVIOUS"] : slots["N_PREVIOUS"] + dim] = normals * size[:, None]

    def layout(self, dim: int) -> RowLayout:
        return riemann_row.row_layout(dim, lambda option: bool(getattr(self, option)))

    def coefficients(self) -> np.ndarray:
        """Return the inverse kernel width, the friction coefficient, and depths for different spacings."""
        depths = variable_resolution.depths(self.kernel, self.h_over_dx) if self.has_unequal_spacings else ()
        return np.array([1.0 / self.kernel.width, self.friction, *depths])

    def pack(self, dim: int) -> tuple[PythonFunction, Options]:
        return _pack, self.options(_pack)

    def isolated_density(self, dim: int) -> float:
        """Return rho h^dim/m of an isolated particle, W(0), the least where density is the number density."""
        return float(self.kernel.value(0.0, 1.0, dim)) if self.corrected_variant else 0.0

    def limits(self) -> tuple[PythonFunction, Options] | None:
        """Return the packing function of strength limits and its constants; None in the original variant."""
        if not self.corrected_variant:
            return None
        return _show_limits, self.options(_show_limits)


def _pack(rows, s, coefficients, particle):
    """Pack the row of a particle; return its signal speed [m/s]."""
    put(rows, s, 0, particle.x)
    put(rows, s, U, particle.u)
    rows[s, H] = particle.h
    # a retired particle has neither mass nor volume; its force is 0, not 0/0
    rows[s, M] = particle.mass if particle.mass > 0.0 else 1.0
    rows[s, V] = particle.mass / particle.rho
    rows[s, ZN] = particle.rho * particle.c_l
    # A liquid has a small shear impedance: with none, u* of a pair of liquids is 0/0.
    rows[s, ZT] = particle.rho * max(particle.c_t, SHEAR_IMPEDANCE_MIN * particle.c_l)
    put(rows, s, T, plane_components(add_identity(particle.s, -particle.p), DIM))
    if ANISOTROPIC:
        put(rows, s, Z_SQUARED, plane_components(multiply(particle.rho * particle.rho, particle.waves), DIM))
    if ADJOINT:
        put(rows, s, GU_BEFORE, particle.gradient_before)
        rows[s, AHEAD_TWICE] = particle.ahead_twice
    if SEPARATING:
        rows[s, BODY] = particle.body
    if AXISYMMETRIC:
        rows[s, RING] = particle.ring
        rows[s, HOOP] = particle.s[2] - particle.p
    if ANGULAR_MOMENTUM:
        put(rows, s, SPIN_STRESS, multiply(0.5 * particle.rho, particle.spin))
    if CORRECTED_VARIANT:
        rows[s, ENERGY] = particle.e
    if DENSITY_CORRECTION:
        rows[s, INV_NUMBER_DENSITY] = rows[s, V] * growth_factor(particle.density_correction)
        rows[s, CORRECTION_DECAY], rows[s, DENSITY_RELAXATION] = relaxation_rates(
            particle.density_correction, particle.p, particle.rho, particle.c_l, particle.h
        )
    return coefficients[0] * particle.c_l


def _show_limits(rows, s, coefficients, signal, rho, c, limits):
    """Pack the traction limits of a particle, a liquid once failed; return its signal speed [m/s]."""
    rows[s, RHO] = rho
    rows[s, TENSION_LIMIT] = limits.tension
    rows[s, SHEAR_LIMIT] = limits.shear
    rows[s, LATTICE_ORDER] = -1.0 if limits.failed else limits.order
    if FRACTURES:
        rows[s, SOFT] = limits.soft
    if GRAD_H:
        rows[s, FOLLOWING_SHARE], rows[s, COMPRESSION] = limits.free, max(1.0 - limits.at_rest / rho, 0.0)
    if AXISYMMETRIC and DENSITY_CORRECTION:
        rows[s, REST_AREA] = rows[s, V] * max(rho / limits.at_rest, SECTION_RATIO_MIN) / (rows[s, H] * rows[s, H])
    if ANISOTROPIC:
        square, failure = rho * c * rho * c, 1.0 if limits.failed else 0.0
        liquid = plane_components((failure * square, failure * square, failure * square, 0.0, 0.0, 0.0), DIM)
        put(rows, s, Z_SQUARED, add(multiply(1.0 - failure, row_symmetric(rows, s, Z_SQUARED, DIM)), liquid))
    if limits.failed:
        rows[s, ZN] = rho * c
        rows[s, ZT] = SHEAR_IMPEDANCE_MIN * rho * c
        return coefficients[0] * c
    return signal
