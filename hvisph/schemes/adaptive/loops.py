"""Compiled loops of bodies of Total Lagrangian and Eulerian particles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hvisph.compiler.jit import specialise
from hvisph.compiler.template_binding import bind
from hvisph.compiler.tensors import add, no_axial, no_symmetric, own_gradient, own_symmetric, own_vector, put, subtract
from hvisph.compiler.tensors3d import extend_symmetric
from hvisph.compiler.threads.parallel_for import chunk_loop, particle_loop
from hvisph.compiler.vector.api import LANES
from hvisph.core.particles import Particles
from hvisph.integrators.particle_steps import Shown
from hvisph.materials import thermodynamics
from hvisph.materials.material_table import bind_models
from hvisph.schemes.total_lagrangian import deformation_gradient
from hvisph.schemes.total_lagrangian import law as reference
from hvisph.sph.kernels.kernel import scale
from hvisph.sph.neighbours import particle_layout as rate_slots


def spatial_rows(k, rows, chosen, bodies, pressures, loads, coefficients, out):
    """Pack the rows of the `chosen` particles for the standard law (template)."""
    i = np.uint64(chosen[k])
    x = own_vector(rows, i, 0, DIM)
    put(out, k, TO_D, subtract(x, own_vector(rows, i, X0, DIM)))
    out[k, TO_KIND] = rows[i, KIND]
    out[k, TO_BODY] = bodies[i]
    s, ring = extend_symmetric(own_symmetric(rows, i, S, DIM)), 0.0
    if AXISYMMETRIC:
        s, ring = (s[0], s[1], -s[0] - s[1], s[3], 0.0, 0.0), rows[i, RING]
    write(out, k, coefficients, Shown(x, own_vector(rows, i, U, DIM), rows[i, M], rows[i, RHO], 0.0, rows[i, H],
                                      pressures[i] + loads[i], rows[i, C], 0.0, 0.0, s, bodies[i],
                                      ring, no_axial(DIM), 0.0, no_symmetric(3)))  # fmt: skip


def add_rates(k, spatial, place, chosen, eulerian, rates):
    """Add the rates of the spatial pass to those of the `chosen` particles (template).

    The larger max|mu| remains, and an Eulerian particle takes the spatial velocity gradient.
    """
    i, at = np.uint64(chosen[k]), np.uint64(place[k])
    a = add(own_vector(rates, i, R_ACCELERATION, DIM), own_vector(spatial, at, R_ACCELERATION, DIM))
    put(rates, i, R_ACCELERATION, a)
    rates[i, R_POWER] += spatial[at, R_POWER]
    rates[i, R_APPROACH] = max(rates[i, R_APPROACH], spatial[at, R_APPROACH])
    if eulerian[i] == 1:
        put(rates, i, R_GRADIENT, own_gradient(spatial, at, R_GRADIENT, DIM))
        if AXISYMMETRIC:
            rates[i, R_HOOP] = spatial[at, R_HOOP]


@dataclass(frozen=True)
class Loops:
    """Passes over reference neighbours: displacements and velocities; F, stress and density; F alone; pair forces."""

    move: Any
    deform: Any
    map_particles: Any
    sums: tuple[Any, Any]


def motion_width(dim: int) -> int:
    """Return the width of a row of displacement and velocity, in whole vectors."""
    return -(-2 * dim // LANES) * LANES


def offered_to_loops(formulation: Any, particles: Particles, materials: tuple[np.ndarray, np.ndarray],
                     slots: dict[str, int], read: int) -> dict[str, Any]:  # fmt: skip
    """Return the names available to loops: options, row slots, columns of rates and of the state."""
    dim, kernel = particles.dim, formulation.kernel
    moving = motion_width(dim)
    options = {
        "DIM": dim, "MIXED": int(formulation.correction.shepard), "PRINTED": int(formulation.printed_viscosity),
        "HOURGLASS": int(formulation.hourglass != 0.0), "WIDTH": read, "WEIGHTS": dim + 1,
        "ROW": formulation.row(dim)[0].used_width, "MOTIONS": moving // LANES, "STRIDE": moving, "SHAPED": dim * moving,
        "RATE_SHAPED": dim * moving + dim, "SUMS": (dim + 1) * moving,
        "SECANT": int(formulation.hourglass != 0.0 and formulation.secant), "SHEARS": int(formulation.shears),
        "RENEWS": int(formulation.renew_strain is not None), "AXISYMMETRIC": int(formulation.revolved),
        "remembered_state": bind_models(thermodynamics.remembered_state, *materials), "longitudinal_speed":
        thermodynamics.longitudinal_speed, "shear_modulus": bind_models(thermodynamics.shear_modulus, *materials),
        "REMEMBERS": int("history_variable" in particles.offsets), "S_HISTORY_VARIABLE": 0,
        **{name: at for name, at in particles.bindings().items()
           if name in ("S_DENSITY", "S_PLASTIC_STRAIN", "S_DAMAGE", "S_HISTORY_VARIABLE")},
        "slope": kernel.slope,
        "scale": specialise(scale, DIM=dim, NORM=kernel.norm(dim)),
    }  # fmt: skip
    return options | slots | rate_slots.slots(dim)


def loops(formulation: Any, offered: dict[str, Any]) -> Loops:
    """Return the compiled loops over reference neighbours."""
    collect, mapped = deformation_gradient.collect, deformation_gradient.load_deformation
    return Loops(
        particle_loop(bind(deformation_gradient.move, {}, offered)),
        chunk_loop(bind(deformation_gradient.deform, {}, offered,
                    parts=(collect, mapped, deformation_gradient.show, deformation_gradient.deform_lanes)),
                    deformation_gradient.CHUNK),
        particle_loop(bind(deformation_gradient.map_particles, {}, offered, parts=(collect, mapped))),
        tuple(
            particle_loop(bind(reference.accumulate,
                               {"COUPLED": coupled, "BY_PAIRS": int(coupled or formulation.revolved)}, offered))
            for coupled in (0, 1)
        ),
    )  # fmt: skip
