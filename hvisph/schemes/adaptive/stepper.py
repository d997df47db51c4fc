"""Step of the adaptive scheme: Total Lagrangian and Eulerian particles, and contact.

An evaluation consists of these passes, of which unneeded ones are skipped:
1. `deform` over reference neighbours: F, stress and density of Total Lagrangian particles;
2. `accumulate` over reference neighbours: their pair forces;
3. the standard law, with corrected kernels where given, over current neighbours: Eulerian particles and their
   neighbours;
4. contact forces: particles near another body.
Particles keep their initial order, sorted by position, as reference lists contain indices. Each process keeps its part
of the reference configuration throughout the run, with copies of the listed neighbours of other processes.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from hvisph.core.particles import Particles
from hvisph.integrators import particle_update as update
from hvisph.integrators import sums as column
from hvisph.integrators.gravity import Gravity
from hvisph.integrators.prescribed_motion import is_rigid_particle
from hvisph.integrators.time_step import VISCOUS_SIGNAL
from hvisph.materials.material_table import Material, pack
from hvisph.schemes.stepper import fastest_sound
from hvisph.schemes.total_lagrangian.reference_update import stop_at_planes
from hvisph.sph.neighbours.ghost_rows import FixedCopies, Halo, Plane
from hvisph.sph.neighbours.particle_layout import RowLayout

from .passes import SpatialPass, loop_bindings, loops
from .penalty_contact_pass import BodyContact
from .state import CompositeState


class CompositeStepper(CompositeState):
    """Moves Total Lagrangian and Eulerian particles, and bodies in contact.

    Parameters as those of `Stepper`; the particles carry `kernel_type`, `reference_position` is set here.

    `jacobians`, `strains`: J and equivalent strain (n,) of particles whose deformation gradient is known, at the stage.
    `latest`: equivalent strain since the last renewal of the reference (n,).
    `swellings`: chi = J / det F (n,), which differs from 1 once lists were cut.
    `loads`: pressure [Pa] that is added to every particle's own until the end of the first step (n,).
    `sequence`: index of every particle in the initial order (n,), by which lists are sorted.
    """

    formulation: Any
    turns_back = False  # a Total Lagrangian particle cannot be exchanged for its image
    keeps_order = True  # reference lists bind particles to where they are
    workspace = None

    def __init__(self, particles: Particles, formulation: Any, materials: list[Material], stage: float,
                 previous: float, h: float, planes: tuple[Plane, ...] = (), drift: float = 0.5,
                 gravity: Gravity | None = None):  # fmt: skip
        dim, count = particles.dim, particles.count
        self.particles, self.formulation, self.stage_share = particles, formulation, stage
        self.materials, self.planes, self.h = materials, planes, h
        self.gravity = gravity
        self.contact: BodyContact | None = None
        self._averages = previous != 0.0
        self.table, self.models = pack(materials)
        self.coefficients = formulation.coefficients()
        self.h_limits, self.h_max = np.full((len(materials), 2), h), h
        self.lengths, self.signals, self.pressures = np.zeros(count), np.zeros(count), np.zeros(count)
        self.loads = np.zeros(count)
        self.totals = column.Sums(particles, fastest_sound(materials), h, update.CHUNK)
        self.layout, self._pair_width = formulation.row(dim)
        self.slots = self.layout.slots()
        self._update = self._specialised_update(self.layout, previous, drift)
        particles.permute(order_of(particles, formulation.kernel.reach * h))
        particles["reference_position"] = particles["position"]
        self._x0 = particles["position"].copy()
        self._volume0 = particles["mass"] / particles["density"]
        self.copies = FixedCopies(planes, dim)
        self.sequence = np.arange(count, dtype=np.uint64)
        self._halo_for: Callable[[RowLayout], Halo] | None = None

    def keep_order(self, sequence: np.ndarray) -> None:
        """Take the particles as a part with the places `sequence` (n,) in the order of all."""
        self.sequence = sequence.astype(np.uint64)

    @property
    def owner_positions(self) -> np.ndarray:
        return self.particles["reference_position"]

    def _set_up(self) -> None:
        """Build all that depends on state and reference positions."""
        particles, formulation = self.particles, self.formulation
        self._moduli = np.array([(material.young_modulus, 1.0 / material.first_yield) for material in self.materials])
        bodies = particles.body.astype(float)
        lowest, highest = self.get_maxima(np.array([(-bodies).max(initial=-np.inf), bodies.max(initial=-np.inf)]))
        self._one_body, self._bodies_in_all = bool(highest == -lowest), int(highest) + 1
        self._one_piece = self._one_body
        self._can_fail = any(material.can_fail for material in self.materials)
        self.volume = self._volume0.copy()
        if formulation.axisymmetric:  # areas of the section
            self.volume /= 2.0 * np.pi * self._ring_radius(self._x0)
        self._allocate_arrays()
        self.alone = is_rigid_particle(particles.tags)  # they have no pairs of their own
        self.loose = self.alone.copy()
        self._build_reference()
        bindings = loop_bindings(formulation, particles, (self.table, self.models), self.slots, self._pair_width)
        self._loops = loops(formulation, bindings)
        self.spatial = SpatialPass(formulation, self._x0, self.h, self.planes, bindings)
        self.pairs = self.spatial.pairs
        if self._halo_for is not None:
            self.spatial.attach_halo(self._halo_for)
        if formulation.contact.separates and (formulation.contact.self_contact or not self._one_body):
            maxima = np.zeros(self._bodies_in_all)
            np.maximum.at(maxima, particles.body.astype(np.int64), self.reference.zeroth_sums)
            self.contact = BodyContact(particles, formulation, self.materials, self._x0, self.h, self.planes,
                                       (self.reference.zeroth_sums, self.get_maxima(maxima)),
                                       self.totals.units[column.SLIPPING])  # fmt: skip
            if self._halo_for is not None:
                self.contact.attach_halo(self._halo_for)
        self._classify()

    @property
    def rows(self) -> np.ndarray:
        """Packed rows with velocities of the stage, in the particles' order; then images and the far row."""
        return self.rows_

    @property
    def row_slots(self) -> dict[str, int]:
        """Slots of a packed row, by name."""
        return self.slots

    @property
    def rates(self) -> np.ndarray:
        """Rows of rates in the particles' order."""
        return self._rates

    @property
    def place(self) -> np.ndarray:
        """Row of each particle's rates: its own index."""
        return self._place

    @property
    def paired_rows(self) -> np.ndarray:
        """Rows of `pairs`, sorted, of the particles of the last spatial pass, without images."""
        return self.spatial.paired_rows

    @property
    def contact_energy(self) -> float:
        return self.contact.energy if self.contact is not None else 0.0

    @property
    def stored_energy(self) -> float:
        return self.contact.stored_energy if self.contact is not None else 0.0

    @property
    def lagrangian(self) -> np.ndarray:
        """Which particles are Total Lagrangian (n,), bool."""
        return self._lagrangian

    def _classify(self) -> None:
        """Find the particles that need a deformation gradient, and update the kinds in the rows."""
        kinds = self.particles["kernel_type"]
        self.rows_[:-1, self.slots["KIND"]] = self.copies.extend_rows(kinds)
        tied = (kinds == 1.0) & ~self.loose
        self._active = (tied | self.neighbours_of(tied)).astype(np.uint8)
        self._lagrangian = kinds == 1.0
        self._eulerian = (~self._lagrangian).astype(np.uint8)
        self._any_eulerian = self.any_process(self._eulerian.any())
        if self._any_eulerian:
            near_eulerian = self.neighbours_of(~self._lagrangian)
            self._active[(self._active == 1) & (near_eulerian | ~self._lagrangian)] = 2
        self._tied = np.flatnonzero(tied)
        self._any_active, self._any_tied = self.any_process(self._active.any()), self.any_process(tied.any())

    def start(self) -> None:
        self.totals.begin(self.particles)
        self._set_up()  # not before: lists and their corrections take time and compiled loops
        self._convert()
        self.predict(0.0)
        if self.contact is not None:
            self.contact.begin(self.rows_, self.slots)
        super().start()

    def evaluate(self) -> None:
        ref, formulation, viscosity = self.reference, self.formulation, self.formulation.viscosity
        self._rates[:] = 0.0
        if self._any_active:
            self._mirror()
            self._loops.deform(
                len(self._active),
                self.rows_,
                self._current_rows(),
                self._active,
                self._eulerian,
                (self.particles.data, self.particles.tags, ref.volume, self.loads, self.swellings, self.f_start),
                ref.lists,
                ref.corrections,
                (self.table, self.models, self._moduli),
                (self._stage, VISCOUS_SIGNAL * viscosity.alpha, formulation.courant),
                (self.jacobians, self.strains, self.latest, self.pressures, self.signals),
                self._rates,
            )
            self.copies.refresh(self.rows_, self.layout, slice(2 * self.particles.dim, self._pair_width))
            for coupled in range(1 + self._any_eulerian):
                self._loops.sums[coupled](
                    self.particles.count, self.rows_, self._active, 1 + coupled, ref.volume, ref.lists, ref.sums,
                    (viscosity.alpha, viscosity.beta), formulation.hourglass, 1.0 / self.h, self._rates,
                )  # fmt: skip
        self.spatial.rest()
        near_body = near_eulerian = self._no_particles
        if self._any_eulerian or not self._one_piece:
            near_body, near_eulerian = self.spatial.find_near(
                self.rows_, self._numbers, self._eulerian, self._body_indices
            )
        try:
            self._add_spatial(near_eulerian if self.spatial.has_contact else near_eulerian | near_body)
        finally:  # other processes wait for this one in the contact, also after an error
            if self.contact is not None:
                self.contact.add(np.flatnonzero(near_body), self.rows_, self.slots, self.loose, self._rates)
        self._act()

    def _add_spatial(self, mask: np.ndarray) -> None:
        """Add the pairs of Eulerian particles, and of bodies in bonded contact, at present positions."""
        if (self._any_eulerian or not self.spatial.has_contact) and self.any_process(mask.any()):
            indices = np.flatnonzero(mask & ~self.loose)
            self.spatial.add(indices, self.rows_, self._numbers, (self._bodies, self.pressures, self.loads),
                             self._eulerian, self._rates)  # fmt: skip

    def _mirror(self) -> None:
        """Update positions and velocities of images and copies."""
        end = self.slots["RING"] + 1 if "RING" in self.slots else 2 * self.particles.dim
        self.copies.refresh(self.rows_, self.layout, slice(0, end))

    def _advance(self, dt: float, stage: float, complete: bool) -> None:
        super()._advance(dt, stage, complete)
        self._stage = stage

    def complete(self, dt: float, next_dt: float) -> None:
        super().complete(dt, next_dt)
        if self.contact is not None:
            self.contact.complete(dt, self._averages)
        if dt > 0.0:
            self.loads[:] = 0.0
            if self.planes and self.any_process(stop_at_planes(self.particles, self.planes, self.h)):
                self.predict(next_dt)
        self._convert()
        limit = self.formulation.renew_strain
        if limit is not None and self.any_process((self.latest[self._tied] > limit).any()):
            self._renew()
            self._classify()

    def _convert(self) -> None:
        """Convert particles to Eulerian, or remove them from the lists."""
        particles, formulation = self.particles, self.formulation
        is_idle = formulation.conversion.is_off and not self._any_eulerian
        if not self._any_tied or (is_idle and not self._can_fail):
            return
        lagrangian = self._lagrangian & ~self.loose
        damage = particles["damage"].copy() if self._can_fail else self._undamaged  # side by side: read several times
        mask = formulation.conversion.find_converting(
            lagrangian, self._convertible, self._active != 0, self.jacobians, self.strains, damage, self
        )
        removals = lagrangian & ~mask & (damage >= 1.0) if formulation.failed_leave else self._no_particles
        any_converted, any_removed = mask.any(), removals.any()
        if not self.any_process(any_converted or any_removed):
            return
        if self.any_process(any_removed):
            previous = self.loose.copy()
            self._leave(removals)
            self._separate(self.loose & ~previous)
        if any_converted:
            particles["kernel_type"][mask] = 0.0
        self._classify()

    def _separate(self, mask: np.ndarray) -> None:
        """Make particles that left their lists bodies of their own in contact."""
        if self.contact is not None and self.formulation.contact.self_contact:
            self.contact.leave(mask)
            self._body_indices, self._one_piece = self.contact.pieces, False

    def limits(self) -> list[tuple[float, str, int]]:
        """Return further limits of the step: inverted particles, hourglass control and contact. See `Stepper`."""
        inverted = self._tied[~(self.jacobians[self._tied] > 0.0)]
        if len(inverted):
            return [(0.0, "inverted", self._first(inverted))]
        limits = super().limits() + self._hourglass_limits
        if self.contact is None:
            return limits
        if len(self.contact.penetrations):
            return [(0.0, "passed_through", self._first(self.contact.penetrations))]
        return limits + self._oscillation_limits("contact", self.contact.omega)

    def permute(self) -> np.ndarray:
        """Keep the order, which reference lists depend on."""
        return np.arange(self.particles.count)


def order_of(particles: Particles, edge: float) -> np.ndarray:
    """Return the order by body, by cell of an `edge` [m], and by number (n,)."""
    cells = np.floor(particles["position"] / edge).astype(np.int64)
    return np.lexsort((particles.id, *cells.T, particles.body))
