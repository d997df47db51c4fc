"""Riemann SPH (CON): scheme without artificial viscosity and artificial stress.

Passes: with reconstruction, gradients of velocity and stress into each row; then the
Riemann problem of every pair (`schemes.riemann.law`).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hvisph.compiler.jit import Options, PythonFunction
from hvisph.compiler.tensors import add, add_identity, multiply, own_symmetric, put
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
from hvisph.sph.terms.riemann_solver import SHEAR_IMPEDANCE_MIN, SHOCK_SLOPE

from . import law as riemann
from . import row as riemann_row

# Share of its density at rest below which the section of a ring at rest counts as so much of that which it fills.
THIN = 0.5


@dataclass(frozen=True)
class Riemann:
    """Contact SPH, as published or in the form whose density keeps to the spacing.

    Parameters
    ----------
    kernel, h_over_dx, smoothing
        Kernel, smoothing length over spacing, and how it varies.
    reconstruction
        Its limiter, of `hvisph.sph.terms.limiters`, none among them.
    consistent
        Whether density, impedance, limits of the tractions and edges are those of the consistent form.
    held
        Whether tension leaves pairs that are too close, in bodies that have not flowed.
    parted
        Whether bodies separate and slide, or are welded.
    friction
        Coulomb's coefficient between bodies that are parted.
    fragment_contact
        Whether pieces that have come apart from a body are parted, too.
    revolved
        Whether particles are rings about the axis x.
    unlike
        Whether bodies that are parted differ in spacing.
    face_contact
        Whether surfaces of one connected body are in contact, too.
    spins
        Whether pairs of the consistent form take back the angular momentum that they make; not of rings, nor in 1D.
    anisotropic
        Whether the speed of waves depends on their direction in a material.
    fractures
        Whether a material has a fracture energy.
    adjoint
        Whether force and power have the corrected operator of the velocity gradient, and the dissipation of solids
        that have not yielded that of velocities alone (`sph.terms.adjoint_operator`).
    rigid, turns
        Whether some bodies are rigid, and whether these turn.
    """

    kernel: Kernel = CUBIC_SPLINE
    h_over_dx: float = 1.4
    smoothing: Smoothing = field(default_factory=Smoothing)
    reconstruction: Limiter = LIMITERS["van_albada"]
    consistent: bool = True
    held: bool = True
    parted: bool = False
    friction: float = 0.0
    fragment_contact: bool = False
    revolved: bool = False
    unlike: bool = False
    face_contact: bool = False
    spins: bool = False
    anisotropic: bool = False
    fractures: bool = False
    adjoint: bool = False
    rigid: bool = False
    turns: bool = False
    edges: bool = False

    name = "riemann"
    corrects = repels = False
    switch = WHOLE
    band_spacings = 1.0  # width of a crack band over a particle's: the weaker side limits a pair
    softens = False
    stepper = Stepper

    @property
    def fields(self) -> tuple[str, ...]:
        """State fields of the scheme."""
        own = ("previous_density_rate",) if self.consistent else ()
        own = (*own, "density_correction") if self.leads else own
        return (*own, "torque_residual") if self.spins else own

    @property
    def follows(self) -> bool:
        """Whether density is that of the kernel at the own h, which follows density."""
        return self.consistent and self.smoothing.variable

    @property
    def leads(self) -> bool:
        """Whether density is corrected towards the number density."""
        return self.consistent and not self.smoothing.variable

    @property
    def viscous_factor(self) -> float:
        """Factor of the largest closing speed in the signal speed."""
        return SHOCK_SLOPE / self.kernel.width

    @property
    def slips(self) -> bool:
        """Whether bodies slide on each other."""
        return self.parted

    @property
    def meets_unlike(self) -> bool:
        """Whether bodies of different spacing are in frictional contact."""
        return self.parted and self.unlike

    def _row(self, dim: int, reconstruct: bool) -> RowLayout:
        return riemann_row.row_layout(dim, reconstruct, self.consistent, self.parted, self.follows, self.revolved,
                                  self.meets_unlike, self.face_contact, self.spins, self.leads,
                                  self.anisotropic, self.fractures, self.adjoint, self.turns,
                                  self.edges)  # fmt: skip

    def passes(self, dim: int) -> list[Pass]:
        """Return the passes: neighbourhood data of each row, then Riemann problems."""
        ways = {
            "RECONSTRUCTION": int(self.reconstruction.acts),
            "CORRECTED_VARIANT": int(self.consistent),
            "SEPARATING": int(self.parted),
            "VARIABLE_RESOLUTION": int(self.meets_unlike),
            "SELF_CONTACT": int(self.face_contact),
            "FRACTURES": int(self.fractures),
            "ADJOINT": int(self.adjoint),
            "EDGES": int(self.edges),
        }
        row = self.layout(dim)
        flux = Pass(riemann.accumulate, riemann_row.pair_layout(row), ways | {
            "share": self.reconstruction.share,
            "TENSION_STABILIZED": int(self.consistent and self.held), "GRAD_H": int(self.follows),
            "AXISYMMETRIC": int(self.revolved), "ANGULAR_MOMENTUM": int(self.spins), "DENSITY_CORRECTION":
            int(self.leads), "ANISOTROPIC": int(self.anisotropic), "RIGID": int(self.rigid), "TURNS": int(self.turns),
        }, riemann.PARTS, density_rate=self.consistent, leads=self.leads,
        slips=self.parted,
            rings=self.revolved, spins=self.spins or self.turns,
            adjoint=self.adjoint, own_reach=self.follows, skips=not self.face_contact)  # fmt: skip
        if not (self.reconstruction.acts or self.parted or self.fractures):
            return [flux]
        first = [
            Pass(
                riemann_row.gradients,
                riemann_row.pair_layout(row),
                ways,
                (contact_normal.is_other_body,),
                into_rows=True,
                skips=not self.face_contact,
            )
        ]
        if self.parted:
            first += riemann_row.contact_passes(row, self.kernel, self.unlike, self.face_contact)
        return [*first, flux]

    def separating(self, h: float, particles: Particles, planes: tuple[Plane, ...]) -> NoContact:
        """Return no contact: the pair law contains it."""
        return NoContact()

    def keep(self, pairs: Pairs, lengths: np.ndarray) -> None:
        """Store the surface normals of this evaluation in the rows for the next one."""
        if self.face_contact:
            at, count, dim = pairs.slots, len(lengths), pairs.layout.dim
            lacking = pairs.sorted[pairs.place[:count], at["N_SURFACE"] : at["N_SURFACE"] + dim]
            size = (
                lengths / variable_resolution.kernel_deficit(self.kernel, self.h_over_dx, dim)[0]
            )  # 1 in the layer under a flat face
            pairs.rows[:, at["N_PREVIOUS"] : at["N_PREVIOUS"] + dim] = lacking * size[:, None]

    def layout(self, dim: int) -> RowLayout:
        """Return the row layout."""
        return self._row(dim, self.reconstruction.acts)

    def coefficients(self) -> np.ndarray:
        """Return the inverse kernel width, the friction coefficient, and depths for different spacings."""
        further = variable_resolution.depths(self.kernel, self.h_over_dx) if self.meets_unlike else ()
        return np.array([1.0 / self.kernel.width, self.friction, *further])

    def pack(self, dim: int) -> tuple[PythonFunction, Options]:
        """Return the packing function and its bound constants."""
        return _pack, {"SEPARATING": int(self.parted), "AXISYMMETRIC": int(self.revolved), "ANGULAR_MOMENTUM":
        int(self.spins),
                       "CORRECTED_VARIANT": int(self.consistent), "DENSITY_CORRECTION": int(self.leads),
                       "ANISOTROPIC": int(self.anisotropic), "ADJOINT": int(self.adjoint)}  # fmt: skip

    def sparsest(self, dim: int) -> float:
        """Return the least rho h^dim/m: W(0) of an isolated particle, where density is the number density."""
        return float(self.kernel.value(0.0, 1.0, dim)) if self.consistent else 0.0

    def limits(self) -> tuple[PythonFunction, Options] | None:
        """Return the packing function of strength limits and its constants; None in the original variant."""
        ways = {"GRAD_H": self.smoothing.variable, "AXISYMMETRIC": self.revolved, "DENSITY_CORRECTION": self.leads,
                "ANISOTROPIC": self.anisotropic, "FRACTURES": self.fractures}  # fmt: skip
        return (_show_limits, {name: int(way) for name, way in ways.items()}) if self.consistent else None


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
    rows[s, ZT] = one.rho * max(one.c_t, SHEAR_IMPEDANCE_MIN * one.c_l)
    put(rows, s, T, plane_components(add_identity(one.s, -one.p), DIM))
    if ANISOTROPIC:
        put(rows, s, Z_SQUARED, plane_components(multiply(one.rho * one.rho, one.waves), DIM))
    if ADJOINT:
        put(rows, s, GU_BEFORE, one.gradient_before)
        rows[s, AHEAD_TWICE] = one.ahead_twice
    if SEPARATING:
        rows[s, BODY] = one.body
    if AXISYMMETRIC:
        rows[s, RING] = one.ring
        rows[s, HOOP] = one.s[2] - one.p
    if ANGULAR_MOMENTUM:
        put(rows, s, SPIN_STRESS, multiply(0.5 * one.rho, one.spin))
    if CORRECTED_VARIANT:
        rows[s, ENERGY] = one.e
    if DENSITY_CORRECTION:
        rows[s, INV_NUMBER_DENSITY] = rows[s, V] * growth_factor(one.lead)
        rows[s, CORRECTION_DECAY], rows[s, DENSITY_RELAXATION] = relaxation_rates(
            one.lead, one.p, one.rho, one.c_l, one.h
        )
    return coefficients[0] * one.c_l


def _show_limits(rows, s, coefficients, signal, rho, c, limits):
    """Write the strength limits of a particle, a liquid once failed; return the signal speed."""
    rows[s, RHO] = rho
    rows[s, TENSION_LIMIT] = limits.tension
    rows[s, SHEAR_LIMIT] = limits.shear
    rows[s, LATTICE_ORDER] = -1.0 if limits.failed else limits.order
    if FRACTURES:
        rows[s, SOFT] = limits.soft
    if GRAD_H:
        rows[s, FREE_LENGTH] = limits.free
    if AXISYMMETRIC and DENSITY_CORRECTION:
        rows[s, REST_AREA] = rows[s, V] * max(rho / limits.at_rest, THIN) / (rows[s, H] * rows[s, H])
    if ANISOTROPIC:
        square, lost = rho * c * rho * c, 1.0 if limits.failed else 0.0
        of_liquid = plane_components((lost * square, lost * square, lost * square, 0.0, 0.0, 0.0), DIM)
        put(rows, s, Z_SQUARED, add(multiply(1.0 - lost, own_symmetric(rows, s, Z_SQUARED, DIM)), of_liquid))
    if limits.failed:
        rows[s, ZN] = rho * c
        rows[s, ZT] = SHEAR_IMPEDANCE_MIN * rho * c
        return coefficients[0] * c
    return signal
