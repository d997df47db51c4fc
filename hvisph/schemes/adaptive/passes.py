"""Passes of the adaptive scheme: loops over reference neighbours, and the spatial pass.

The spatial pass evaluates the law of Eulerian particles over them and the particles near them, at present positions.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hvisph.compiler.jit import CompiledFunction, Options, bind, specialise
from hvisph.compiler.parallel_for import chunk_loop, particle_loop
from hvisph.compiler.tensors import add, no_axial, no_symmetric, put, row_gradient, row_symmetric, row_vector, subtract
from hvisph.compiler.tensors3d import extend_symmetric
from hvisph.compiler.vector.api import LANES
from hvisph.core.particles import Particles
from hvisph.integrators.particle_steps import Packed
from hvisph.materials import thermodynamics
from hvisph.materials.damage.fracture_energy import softened_pressure
from hvisph.materials.material_table import bind_models
from hvisph.schemes.total_lagrangian import deformation_gradient
from hvisph.schemes.total_lagrangian import law as reference
from hvisph.sph.contact import coupling
from hvisph.sph.kernels import scale
from hvisph.sph.neighbours import particle_layout as rate_slots
from hvisph.sph.neighbours.contact_candidates import Selection
from hvisph.sph.neighbours.ghost_rows import Halo, Plane
from hvisph.sph.neighbours.pairs import Pairs
from hvisph.sph.neighbours.particle_layout import RowLayout


class SpatialPass:
    """Selection of particles near another body or an Eulerian particle, and pairs of the latter."""

    def __init__(self, formulation: Any, positions: np.ndarray, h: float, planes: tuple[Plane, ...], bindings: Options):
        dim, kernel, euler, self._h = positions.shape[1], formulation.kernel, formulation.eulerian, h
        layout = RowLayout(dim, (*euler.layout(dim).fields, *coupling.FIELDS))
        slots = layout.slots()
        self.has_contact = formulation.contact.separates
        shares = specialise(
            coupling.shares,
            DIM=dim,
            KIND=slots["KIND"],
            BODY=slots["BODY"],
            D=slots["D"],
            CONTACT=float(self.has_contact),
            STRESS_AT_INTERFACE=float(formulation.stress_at_interface),
        )
        coupled = {"COUPLED": 1, "shares": shares} | ({"HYBRID": 1} if formulation.axisymmetric else {})
        passes = [
            replace(pass_, reads=layout, options=pass_.options | coupled, skips_undisturbed=False)
            for pass_ in euler.passes(dim)
        ]
        constants = np.append(euler.coefficients(), (kernel.reach * h) ** 2)
        self.pairs = Pairs(layout, kernel, passes, constants, positions, h, planes)
        self._selection = Selection(positions, kernel.reach * h, with_neighbours=formulation.spatial_correction.acts)
        packer, options = euler.pack(dim)
        write = bind(packer, options, {"DIM": dim} | slots)
        self._add_rates = particle_loop(bind(add_rates, {}, bindings))
        to_spatial = {"TO_D": slots["D"], "TO_KIND": slots["KIND"], "TO_BODY": slots["BODY"], "write": write}
        self._pack = particle_loop(bind(spatial_rows, to_spatial, bindings))
        self._selection_halo: Halo | None = None
        self._count = 0

    @property
    def paired_rows(self) -> np.ndarray:
        """Sorted rows of the particles paired in the last evaluation."""
        return self.pairs.place[: self._count]

    def find_near(
        self, rows: np.ndarray, numbers: np.ndarray, eulerian: np.ndarray, bodies: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return which particles are near another body, and which near an Eulerian one (n,), bool."""
        count = len(numbers)
        if self._selection_halo is not None:
            dim = self.pairs.layout.dim
            table = np.zeros((count, _selection_layout(dim).used_width))
            table[:, :dim], table[:, dim], table[:, dim + 1] = rows[:count, :dim], bodies, eulerian
            # cells are selected by the content of cells up to two cells away
            rows, _ = self._selection_halo.append(table, numbers, 3.0 * self._selection.grid.edge)
            bodies, eulerian = rows[:, dim].astype(np.uint32), rows[:, dim + 1].astype(np.uint8)
        near_body, near_eulerian = self._selection.choose(rows, eulerian, bodies)
        return near_body[:count], near_eulerian[:count]

    def rest(self) -> None:
        """Clear the pairs of this evaluation."""
        self._count = 0

    def add(
        self,
        indices: np.ndarray,
        rows: np.ndarray,
        numbers: np.ndarray,
        fields: tuple[np.ndarray, np.ndarray, np.ndarray],
        eulerian: np.ndarray,
        rates: np.ndarray,
    ) -> None:
        """Add the pairs of the particles `indices` (k,) to `rates`; `fields`: bodies, pressures and loads [Pa] (n,)."""
        pairs = self.pairs
        packed = np.zeros((len(indices), pairs.layout.used_width))
        self._pack(len(indices), rows, indices, *fields, pairs.coefficients, packed)
        self._count = len(indices)
        pairs.rows, pairs.numbers = packed, numbers[indices]
        pairs.evaluate(self._h)
        self._add_rates(len(indices), pairs.rates, self.paired_rows, indices, eulerian, rates)

    def attach_halo(self, halo_for: Callable[[RowLayout], Halo]) -> None:
        self._selection_halo = halo_for(_selection_layout(self.pairs.layout.dim))
        self.pairs.halo = halo_for(self.pairs.layout)

    def fit_grid(self, positions: np.ndarray) -> None:
        """Fit the selection grid to `positions` (n, dim) [m]."""
        self._selection.fit(positions)


def _selection_layout(dim: int) -> RowLayout:
    """Return the row layout of the selection."""
    return RowLayout(dim, (("x", "vector"), ("body", "scalar"), ("eulerian", "scalar")))


def spatial_rows(k, rows, indices, bodies, pressures, loads, coefficients, out):
    """Pack the rows of the particles `indices` for the standard law (template)."""
    i = np.uint64(indices[k])
    x = row_vector(rows, i, 0, DIM)
    put(out, k, TO_D, subtract(x, row_vector(rows, i, X0, DIM)))
    out[k, TO_KIND] = rows[i, KIND]
    out[k, TO_BODY] = bodies[i]
    s, ring = extend_symmetric(row_symmetric(rows, i, S, DIM)), 0.0
    if AXISYMMETRIC:
        s, ring = (s[0], s[1], -s[0] - s[1], s[3], 0.0, 0.0), rows[i, RING]
    write(out, k, coefficients, Packed(x, row_vector(rows, i, U, DIM), rows[i, M], rows[i, RHO], 0.0, rows[i, H],
                                      pressures[i] + loads[i], rows[i, C], 0.0, 0.0, s, bodies[i],
                                      ring, no_axial(DIM), 0.0, no_symmetric(3), 0.0, 0.0))  # fmt: skip


def add_rates(k, spatial, place, indices, eulerian, rates):
    """Add spatial rates of the particles `indices`: the larger max|mu|, of Eulerian ones the gradient (template)."""
    i, row = np.uint64(indices[k]), np.uint64(place[k])
    a = add(row_vector(rates, i, R_ACCELERATION, DIM), row_vector(spatial, row, R_ACCELERATION, DIM))
    put(rates, i, R_ACCELERATION, a)
    rates[i, R_POWER] += spatial[row, R_POWER]
    rates[i, R_APPROACH] = max(rates[i, R_APPROACH], spatial[row, R_APPROACH])
    if eulerian[i] == 1:
        put(rates, i, R_GRADIENT, row_gradient(spatial, row, R_GRADIENT, DIM))
        if AXISYMMETRIC:
            rates[i, R_HOOP] = spatial[row, R_HOOP]


@dataclass(frozen=True)
class Loops:
    """Passes over reference neighbours: displacements and velocities; F, stress and density; F alone; pair forces."""

    move: CompiledFunction
    deform: CompiledFunction
    map_particles: CompiledFunction
    sums: tuple[CompiledFunction, CompiledFunction]


def motion_width(dim: int) -> int:
    """Return the width of a row of displacement and velocity, in whole vectors."""
    return -(-2 * dim // LANES) * LANES


def loop_bindings(
    formulation: Any, particles: Particles, materials: tuple[np.ndarray, np.ndarray], slots: dict[str, int], read: int
) -> Options:
    """Return the names available to loops: options, row slots, columns of rates and of the state."""
    dim, kernel = particles.dim, formulation.kernel
    stride = motion_width(dim)
    options = {
        "DIM": dim, "MIXED": int(formulation.correction.shepard), "PRINTED": int(formulation.printed_viscosity),
        "HOURGLASS": int(formulation.hourglass != 0.0), "WIDTH": read, "WEIGHTS": dim + 1,
        "ROW": formulation.row(dim)[0].used_width, "MOTIONS": stride // LANES, "STRIDE": stride, "SHAPED": dim * stride,
        "RATE_SHAPED": dim * stride + dim, "SUMS": (dim + 1) * stride,
        "SECANT": int(formulation.hourglass != 0.0 and formulation.secant),
        "REDUCES_SHEAR_VISCOSITY": int(formulation.shears),
        "RENEWS": int(formulation.renew_strain is not None), "AXISYMMETRIC": int(formulation.axisymmetric),
        "state_with_history": bind_models(thermodynamics.state_with_history, *materials), "longitudinal_speed":
        thermodynamics.longitudinal_speed, "shear_modulus": bind_models(thermodynamics.shear_modulus, *materials),
        "HAS_HISTORY": int("history_variable" in particles.offsets), "S_HISTORY_VARIABLE": 0,
        "FRACTURES": int("band_width" in particles.offsets), "S_ONSET_TENSION": 0,
        "softened_pressure": softened_pressure,
        **{name: column for name, column in particles.bindings().items()
           if name in ("S_DENSITY", "S_PLASTIC_STRAIN", "S_DAMAGE", "S_HISTORY_VARIABLE", "S_ONSET_TENSION")},
        "slope": kernel.slope,
        "scale": specialise(scale, DIM=dim, NORM=kernel.norm(dim)),
    }  # fmt: skip
    return options | slots | rate_slots.slots(dim)


def loops(formulation: Any, bindings: Options) -> Loops:
    """Return the compiled loops over reference neighbours."""
    collect, load = deformation_gradient.collect, deformation_gradient.load_deformation
    return Loops(
        particle_loop(bind(deformation_gradient.move, {}, bindings)),
        chunk_loop(bind(deformation_gradient.deform, {}, bindings,
                    parts=(collect, load, deformation_gradient.show, deformation_gradient.deform_lanes)),
                    deformation_gradient.CHUNK),
        particle_loop(bind(deformation_gradient.map_particles, {}, bindings, parts=(collect, load))),
        tuple(
            particle_loop(bind(reference.accumulate,
                               {"COUPLED": coupled, "BY_PAIRS": int(coupled or formulation.axisymmetric)}, bindings))
            for coupled in (0, 1)
        ),
    )  # fmt: skip
