"""The compiled loops of a composite body, bound to its formulation, its row and its state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hvisph.core.binding import bind
from hvisph.core.chunks import each, shared
from hvisph.core.jit import specialise
from hvisph.core.particles import Particles
from hvisph.core.vectors import LANES
from hvisph.materials import state
from hvisph.materials.table import fitted
from hvisph.sph import rates as rate_slots
from hvisph.sph.kernels.kernel import scale
from hvisph.sph.laws import deformation, reference


@dataclass(frozen=True)
class Loops:
    """The passes over reference neighbours, as templates of `sph.laws` with everything bound.

    Parameters
    ----------
    move, deform, map_particles
        Displacements and velocities; F, stress and density; F alone.
    sums
        Pair forces, of particles without and with an Eulerian neighbour.
    """

    move: Any
    deform: Any
    map_particles: Any
    sums: tuple[Any, Any]


def motion_width(dim: int) -> int:
    """Return how many numbers a row of motions has: displacement and velocity, in whole vectors."""
    return -(-2 * dim // LANES) * LANES


def offered_to_loops(formulation: Any, particles: Particles, materials: tuple[np.ndarray, np.ndarray],
                     slots: dict[str, int], read: int) -> dict[str, Any]:  # fmt: skip
    """Return what the loops may name: options, slots of the row, columns of rates and of the state.

    Parameters
    ----------
    formulation, particles
        As those of `CompositeStepper`.
    materials
        Packed materials: table and models.
    slots, read
        Where what stands in a packed row, and how many slots of it pairs read.
    """
    dim, kernel = particles.dim, formulation.kernel
    moving = motion_width(dim)
    options = {
        "DIM": dim, "MIXED": int(formulation.correction.shepard), "PRINTED": int(formulation.printed_viscosity),
        "HOURGLASS": int(formulation.hourglass != 0.0), "WIDTH": read, "WEIGHTS": dim + 1,
        "ROW": formulation.row(dim)[0].used, "MOTIONS": moving // LANES, "STRIDE": moving, "SHAPED": dim * moving,
        "RATE_SHAPED": dim * moving + dim, "SUMS": (dim + 1) * moving,
        "SECANT": int(formulation.hourglass != 0.0 and formulation.secant), "SHEARS": int(formulation.shears),
        "RENEWS": int(formulation.renew_strain is not None), "REVOLVED": int(formulation.revolved),
        "remembered_state": fitted(state.remembered_state, *materials), "longitudinal_speed": state.longitudinal_speed,
        "shear_modulus": fitted(state.shear_modulus, *materials),
        "REMEMBERS": int("memory" in particles.offsets), "S_MEMORY": 0,
        **{name: at for name, at in particles.bindings().items()
           if name in ("S_DENSITY", "S_PLASTIC_STRAIN", "S_DAMAGE", "S_MEMORY")},
        "slope": kernel.slope,
        "scale": specialise(scale, DIM=dim, NORM=kernel.norm(dim)),
    }  # fmt: skip
    return options | slots | rate_slots.slots(dim)


def loops(formulation: Any, offered: dict[str, Any]) -> Loops:
    """Return the loops over reference neighbours, compiled with what is `offered`."""
    collect, mapped = deformation.collect, deformation.mapped
    return Loops(
        each(bind(deformation.move, {}, offered)),
        shared(bind(deformation.deform, {}, offered,
                    parts=(collect, mapped, deformation.show, deformation.deformed)), deformation.CHUNK),
        each(bind(deformation.map_particles, {}, offered, parts=(collect, mapped))),
        tuple(
            each(bind(reference.accumulate, {"COUPLED": coupled, "BY_PAIRS": int(coupled or formulation.revolved)},
                      offered)) for coupled in (0, 1)
        ),
    )  # fmt: skip
