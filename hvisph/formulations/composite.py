"""One step of bodies that meet: Total Lagrangian and Eulerian particles, and contact.

An evaluation runs, each only where it is needed,
1. `deform` over reference neighbours: F, stress, density of Total Lagrangian particles;
2. `accumulate` over them: their pair forces;
3. the standard law, or that of corrected kernels, over current neighbours, for Eulerian particles and those near one;
4. contact forces, for particles near another body.
Particles keep the order that they have at the start, sorted by place: reference lists hold their places in it. Each
process has those of its part of the reference for good, with copies of what its lists need of others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from hvisph.core.binding import bind
from hvisph.core.jit import specialise
from hvisph.core.particles import Particles
from hvisph.integrators import sums as column
from hvisph.integrators import update as single
from hvisph.materials import state
from hvisph.materials.table import Material, fitted, pack
from hvisph.sph import rates as rate_slots
from hvisph.sph.copies import FixedCopies, Halo
from hvisph.sph.kernels.kernel import scale
from hvisph.sph.laws import coupling, deformation, reference
from hvisph.sph.pairs import Pairs
from hvisph.sph.reference import Reference
from hvisph.sph.rows import RowLayout, aligned_zeros
from hvisph.sph.selection import Selection
from hvisph.sph.symmetry import Plane
from hvisph.sph.traversal import FAR

from . import composite_passes
from .body_contact import BodyContact
from .reference_changes import ReferenceChanges, stop_at_planes
from .stepper import Stepper, fastest_sound

# What a checkpoint holds beside the particles, of what every particle has one row.
KEPT = ("lengths", "signals", "pressures", "jacobians", "strains", "latest", "loads", "loose", "swellings", "alone",
        "volume", "sequence")  # fmt: skip


class CompositeStepper(ReferenceChanges, Stepper):
    """Moves Total Lagrangian and Eulerian particles, and bodies in contact.

    Parameters as those of `Stepper`; the particles carry `kernel_type`, `reference_position` is set here.

    Attributes
    ----------
    jacobians, strains
        J and equivalent strain of every particle whose deformation gradient is known, at the stage (n,).
    latest
        Equivalent strain since the reference was renewed (n,), where it is.
    swellings
        chi, what J has beside the determinant of F since lists were cut (n,).
    loads
        Pressure [Pa] that is added to every particle's own until the first step is done (n,).
    sequence
        Place of every particle in the order of the start (n,), by which lists are sorted.
    """

    formulation: Any
    turns_back = False  # a Total Lagrangian particle cannot be exchanged for its image
    settled = True  # reference lists bind particles to where they are

    def __init__(self, particles: Particles, formulation: Any, materials: list[Material], stage: float,
                 previous: float, h: float, planes: tuple[Plane, ...] = (), drift: float = 0.5):  # fmt: skip
        dim, count = particles.dim, particles.count
        self.particles, self.formulation, self.stage_share = particles, formulation, stage
        self.materials, self.planes, self.h = materials, planes, h
        self.contact: BodyContact | None = None
        self._averages = previous != 0.0
        self.table, self.models = pack(materials)
        self.coefficients = formulation.coefficients()
        self.h_low = self.h_high = self.h_max = h
        self.lengths, self.signals, self.pressures = np.zeros(count), np.zeros(count), np.zeros(count)
        self.loads = np.zeros(count)
        self.totals = column.Sums(particles, fastest_sound(materials), h, single.CHUNK)
        self.layout, self._read = formulation.row(dim)
        self.slots = self.layout.slots()
        self._update = self._specialised_update(self.layout, previous, drift)
        self._sort()
        particles["reference_position"] = particles["position"]
        self._at_start = particles["position"].copy()
        self._volume_at_start = particles["mass"] / particles["density"]
        self.copies = FixedCopies(planes, dim)
        self._seen: Halo | None = None

    def _sort(self) -> None:
        """Put the particles into the order of cells, body by body, and within a cell by number."""
        position = self.particles["position"]
        cells = np.floor(position / (self.formulation.kernel.reach * self.h)).astype(np.int64)
        self.particles.permute(np.lexsort((self.particles.id, *cells.T, self.particles.body)))

    @property
    def homes(self) -> np.ndarray:
        """Places (n, dim) [m] by which particles belong to a part of space."""
        return self.particles["reference_position"]

    def _set_up(self) -> None:
        """Build all that follows from state and reference positions, of all particles."""
        particles, formulation = self.particles, self.formulation
        self._moduli = np.array([(_young_modulus(one), 1.0 / one.first_yield) for one in self.materials])
        self._one_body, self._bodies_in_all = int(np.ptp(particles.body)) == 0, int(particles.body.max()) + 1
        self._one_piece = self._one_body
        self._can_fail = any(material.can_fail for material in self.materials)
        self._selection = Selection(self._at_start, formulation.kernel.reach * self.h,
                                    with_neighbours=formulation.spatial_correction.acts)  # fmt: skip
        self.volume = self._volume_at_start.copy()
        if formulation.revolved:  # areas of the section
            self.volume /= 2.0 * np.pi * self._ring_radius(self._at_start)
        self.sequence = np.arange(particles.count, dtype=np.uint64)
        self.alone = np.zeros(particles.count, bool)
        self._make_room()
        self._build_reference()
        self._specialise()
        self._classify()

    def _make_room(self) -> None:
        """Make the arrays that have a row for each of the particles that there are now."""
        particles, formulation, dim = self.particles, self.formulation, self.particles.dim
        count, body = particles.count, self.particles.body
        self._rates = np.zeros((count, rate_slots.width(dim) + (3 if formulation.revolved else 2 * formulation.slips)))
        self._place = np.arange(count, dtype=np.uint32)
        self.jacobians, self.strains, self.latest = np.ones(count), np.zeros(count), np.zeros(count)
        self.swellings, self.loose = np.ones(count), np.zeros(count, bool)
        start = np.eye(dim).ravel()
        if formulation.revolved:  # the hoop stretch behind F
            start = np.append(start, 1.0)
        self.before = np.tile(start, (count if formulation.renew_strain else 1, 1))
        self._stage, self._chosen = 0.0, 0
        self.rows_ = aligned_zeros(count, self.layout.width)
        turning = formulation.conversion.bodies
        self._convertible = np.ones(count, bool) if turning is None else np.isin(body, turning)
        self._body_indices = body.astype(np.uint32)
        self._bodies, self._numbers = body.astype(np.float64), particles.numbers()
        self._undamaged, self._none = np.zeros(count), np.zeros(count, bool)

    def _build_reference(self) -> None:
        """Build lists, images and rows of the present reference: places, `volume` and who is `alone`."""
        particles, formulation, slots, dim = self.particles, self.formulation, self.slots, self.particles.dim
        count, kernel = particles.count, formulation.kernel
        reach = kernel.reach * self.h
        extended, numbers = self.copies.find(particles["reference_position"], self.sequence, reach, self.alone)
        rows, x0 = aligned_zeros(len(extended) + 1, self.layout.width), slots["X0"]
        rows[:count] = self.rows_[:count]
        rows[:-1, x0 : x0 + dim] = extended
        rows[-1, :dim] = rows[-1, x0 : x0 + dim] = FAR
        rows[-1, slots["RHO"]] = 1.0
        if "RING0" in slots:
            rows[:-1, slots["RING0"]] = np.copysign(self._ring_radius(extended), extended[:, 1])
        if "EM" in slots:
            rows[:-1, slots["EM"]] = self.copies.extended(self._moduli[particles.material, 0])
        self.rows_ = rows
        bodies = particles.body.astype(np.int64)
        bodies[self.alone] = self._bodies_in_all + np.flatnonzero(self.alone)
        volume, bodies = self.copies.extended(self.volume), self.copies.extended(bodies)
        self.reference = Reference(extended, volume, bodies, numbers, count, kernel, self.h, formulation.correction)

    def _ring_radius(self, position: np.ndarray) -> np.ndarray:
        """Return the radius [m] of rings at `position` (n, dim) [m], as the pass over single particles has it."""
        return np.maximum(np.abs(position[:, 1]), single.ON_AXIS * self.h)

    def _specialise(self) -> None:
        formulation, slots, dim = self.formulation, self.slots, self.particles.dim
        kernel = formulation.kernel
        options = {
            "DIM": dim, "MIXED": int(formulation.correction == "mixed"), "PRINTED": int(formulation.printed_viscosity),
            "HOURGLASS": int(formulation.hourglass != 0.0), "WIDTH": self._read, "PLACES": 3 * dim,
            "SECANT": int(formulation.hourglass != 0.0 and formulation.secant), "SHEARS": int(formulation.shears),
            "RENEWS": int(formulation.renew_strain is not None), "REVOLVED": int(formulation.revolved),
            "remembered_state": fitted(state.remembered_state, self.table, self.models),
            "longitudinal_speed": state.longitudinal_speed,
            "shear_modulus": fitted(state.shear_modulus, self.table, self.models),
            "REMEMBERS": int("memory" in self.particles.offsets), "S_MEMORY": 0,
            **{name: at for name, at in self.particles.bindings().items()
               if name in ("S_DENSITY", "S_PLASTIC_STRAIN", "S_MEMORY")},
            "slope": kernel.slope,
            "scale": specialise(scale, DIM=dim, NORM=kernel.norm(dim)),
        }  # fmt: skip

        offered = options | slots | rate_slots.slots(dim)

        def bound(law: Any, **more: Any) -> Any:
            return bind(law, more, offered, parallel=True)

        parts = {part.__name__: bind(part, {}, offered) for part in deformation.PARTS}
        self._deform = bound(deformation.deform, **parts)
        self._map = bound(deformation.map_particles, gradients=parts["gradients"])
        self._sums = {coupled: bound(reference.accumulate, COUPLED=coupled,
                                     BY_PAIRS=int(coupled or formulation.revolved)) for coupled in (0, 1)}  # fmt: skip
        euler = formulation.eulerian
        layout = RowLayout(dim, (*euler.layout(dim).fields, *coupling.FIELDS))
        to = layout.slots()
        parted = formulation.contact.parts
        shares = specialise(coupling.shares, DIM=dim, KIND=to["KIND"], BODY=to["BODY"], D=to["D"],
                            CONTACT=float(parted),
                            STRESS_AT_INTERFACE=float(formulation.stress_at_interface))  # fmt: skip
        coupled = {"COUPLED": 1, "shares": shares} | ({"HYBRID": 1} if formulation.revolved else {})
        passes = [replace(one, reads=layout, options=one.options | coupled) for one in euler.passes(dim)]
        constants = np.append(euler.coefficients(), (kernel.reach * self.h) ** 2)
        self.pairs = self.spatial = Pairs(layout, kernel, passes, constants, self._at_start, self.h,
                                          self.planes)  # fmt: skip
        packer, more = euler.pack(dim)
        write = bind(packer, more, {"DIM": dim} | to)
        self._add_rates = bound(composite_passes.add_rates)
        self._spatial_rows = bound(composite_passes.spatial_rows, TO_D=to["D"], TO_KIND=to["KIND"],
                                   TO_BODY=to["BODY"], write=write)  # fmt: skip
        if parted and (formulation.contact.own_faces or not self._one_body):
            self.contact = BodyContact(
                self.particles,
                formulation,
                self.materials,
                self._at_start,
                self.h,
                self.planes,
                self.reference.zeroth_sums,
                self.totals.units[column.SLIPPING],
            )

    @property
    def rows(self) -> np.ndarray:
        """Packed rows, in the particles' order; behind them images at symmetry planes and the far row."""
        return self.rows_

    @property
    def stage_rows(self) -> np.ndarray:
        """The same rows: an evaluation leaves the velocities of its stage in them."""
        return self.rows_

    @property
    def rates(self) -> np.ndarray:
        """Rows of rates in the particles' order."""
        return self._rates

    @property
    def place(self) -> np.ndarray:
        """Row of each particle's rates: its own number."""
        return self._place

    @property
    def paired(self) -> np.ndarray:
        """Rows of `pairs`, sorted, of the particles of the last spatial pass, without images."""
        return self.spatial.place[: self._chosen]

    @property
    def contact_energy(self) -> float:
        """Work against the contact between bodies since the start [J]."""
        return self.contact.energy if self.contact is not None else 0.0

    @property
    def stored_energy(self) -> float:
        """Energy that is in no particle [J]: that of a contact which keeps it."""
        return self.contact.stored if self.contact is not None else 0.0

    @property
    def lagrangian(self) -> np.ndarray:
        """Which particles are Total Lagrangian (n,), bool."""
        return self._lagrangian

    def _classify(self) -> None:
        """Find which particles need a deformation gradient, and bring the rows' kinds up to date."""
        kinds = self.particles["kernel_type"]
        self.rows_[:-1, self.slots["KIND"]] = self.copies.extended(kinds)
        tied = (kinds == 1.0) & ~self.loose
        self._active = (tied | self.neighbours_of(tied)).astype(np.uint8)
        self._lagrangian = kinds == 1.0
        self._eulerian = (~self._lagrangian).astype(np.uint8)
        self._any_eulerian = self.anywhere(self._eulerian.any())
        if self._any_eulerian:
            near_eulerian = self.neighbours_of(~self._lagrangian)
            self._active[(self._active == 1) & (near_eulerian | ~self._lagrangian)] = 2
        self._tied = np.flatnonzero(tied)
        self._any_active, self._any_tied = self.anywhere(self._active.any()), self.anywhere(tied.any())

    def start(self) -> None:
        """Evaluate the forces of the state as it stands, without a step."""
        self.totals.begin(self.particles)
        self._set_up()  # not before: lists and their corrections take time and compiled loops
        self._turn()
        self.predict(0.0)
        if self.contact is not None:
            self.contact.begin(self.rows_, self.slots)
        super().start()

    def evaluate(self) -> None:
        """Evaluate the pair forces at the stage."""
        ref, formulation = self.reference, self.formulation
        self._rates[:] = 0.0
        if self._any_active:
            self._mirror()
            if self._can_fail:
                self.rows_[: self.particles.count, self.slots["DAMAGE"]] = self.particles["damage"]
            self._deform(self.rows_, self._active, (self.particles.data, self.particles.tags, ref.volume, self.loads,
                                                    self.swellings, self.before),
                         ref.lists, ref.corrections, (self.table, self.models, self._moduli), self._stage,
                         1.2 * formulation.alpha,
                         (self.jacobians, self.strains, self.latest, self.pressures, self.signals),
                         self._rates)  # fmt: skip
            self.copies.refresh(self.rows_, self.layout, slice(2 * self.particles.dim, self._read))
            for coupled in range(1 + self._any_eulerian):
                self._sums[coupled](self.rows_, self._active, 1 + coupled, ref.volume, ref.lists, ref.sums,
                                    (formulation.alpha, formulation.beta), formulation.hourglass, 1.0 / self.h,
                                    self._rates)  # fmt: skip
        self._chosen = 0
        near_body = near_spatial = self._none
        if self._any_eulerian or not self._one_piece:
            near_body, near_spatial = self._near()
        try:
            self._add_spatial(near_body, near_spatial)
        finally:  # other processes wait for this one's part in the contact, also where it has failed
            if self.contact is not None:
                self.contact.add(np.flatnonzero(near_body), self.rows_, self.slots, self.loose, self._rates)

    def _near(self) -> tuple[np.ndarray, np.ndarray]:
        """Return which particles are near another body, and which near an Eulerian one (n,), bool."""
        rows, eulerian, bodies = self.rows_, self._eulerian, self._body_indices
        if self._seen is not None:
            dim, own = self.particles.dim, self.particles.count
            rows = np.zeros((own, _seen_of(dim).used))
            rows[:, :dim], rows[:, dim], rows[:, dim + 1] = self.rows_[:own, :dim], bodies, eulerian
            # a cell is chosen by what is up to two cells away
            rows, _ = self._seen.append(rows, self._numbers, 3.0 * self._selection.grid.edge)
            bodies, eulerian = rows[:, dim].astype(np.uint32), rows[:, dim + 1].astype(np.uint8)
        near_body, near_spatial = self._selection.choose(rows, eulerian, bodies)
        return near_body[: self.particles.count], near_spatial[: self.particles.count]

    def _mirror(self) -> None:
        """Bring places and velocities of copies up to date."""
        until = self.slots["RING"] + 1 if "RING" in self.slots else 2 * self.particles.dim
        self.copies.refresh(self.rows_, self.layout, slice(0, until))

    def _add_spatial(self, near_body: np.ndarray, near: np.ndarray) -> None:
        """Add the pairs of Eulerian particles, and where no contact parts them of bodies, in the present places."""
        parted = self.formulation.contact.parts
        near = near if parted else near | near_body
        if not (self._any_eulerian or not parted) or not self.anywhere(near.any()):
            return
        chosen = np.flatnonzero(near & ~self.loose)
        packed = np.zeros((len(chosen), self.spatial.layout.used))
        self._spatial_rows(
            self.rows_, chosen, self._bodies, self.pressures, self.loads, self.spatial.coefficients, packed
        )
        self._chosen = len(chosen)
        self.spatial.rows, self.spatial.numbers = packed, self._numbers[chosen]
        self.spatial.evaluate(self.h)
        self._add_rates(self.spatial.rates, self.paired, chosen, self._eulerian, self._rates)

    def _carry(self, dt: float, stage: float, complete: bool) -> None:
        super()._carry(dt, stage, complete)
        self._stage = stage

    def complete(self, dt: float, following: float) -> None:
        """Carry the state over `dt` [s], predict the next stage, and turn the particles that must."""
        super().complete(dt, following)
        if self.contact is not None:
            self.contact.complete(dt, self._averages)
        if dt > 0.0:
            self.loads[:] = 0.0
            if self.planes and self.anywhere(stop_at_planes(self.particles, self.planes, self.h)):
                self.predict(following)
        self._turn()
        limit = self.formulation.renew_strain
        if limit is not None and self.anywhere((self.latest[self._tied] > limit).any()):
            self._renew()
            self._classify()

    def _turn(self) -> None:
        """Let particles turn Eulerian, or leave the lists."""
        particles, formulation = self.particles, self.formulation
        quiet = formulation.conversion.off and not self._any_eulerian
        if not self._any_tied or (quiet and not self._can_fail):
            return
        lagrangian = self._lagrangian & ~self.loose
        damage = particles["damage"] if self._can_fail else self._undamaged
        turns = formulation.conversion.turning(lagrangian, self._convertible, self._active != 0, self.jacobians,
                                               self.strains, damage, self)  # fmt: skip
        leaves = lagrangian & ~turns & (damage >= 1.0) if formulation.failed_leave else self._none
        turned, left = turns.any(), leaves.any()
        if not self.anywhere(turned or left):
            return
        if self.anywhere(left):
            before = self.loose.copy()
            self._leave(leaves)
            self._part(self.loose & ~before)
        if turned:
            particles["kernel_type"][turns] = 0.0
        self._classify()

    def _part(self, leaves: np.ndarray) -> None:
        """Have particles that left their lists meet the rest of their body as one of another."""
        if self.contact is not None and self.formulation.contact.own_faces:
            self.contact.leave(leaves)
            self._body_indices, self._one_piece = self.contact.pieces, False

    def limits(self) -> list[tuple[float, str, int]]:
        """Return what else limits the step: inverted particles, and contact. See `Stepper`."""
        inverted = self._tied[~(self.jacobians[self._tied] > 0.0)]
        if len(inverted):
            return [(0.0, "inverted", self._first(inverted))]
        if self.contact is None:
            return []
        if len(self.contact.passed):
            return [(0.0, "passed_through", self._first(self.contact.passed))]
        omega = self.contact.omega
        stiffest = float(omega.max(initial=0.0))
        if stiffest > 0.0:
            time = 2.0 / np.sqrt(stiffest)
            alike = np.flatnonzero(omega > stiffest * (1.0 - 1e-12))
            return [(float(time), "contact", self._first(alike[2.0 / np.sqrt(omega[alike]) == time]))]
        return []

    def _first(self, chosen: np.ndarray) -> int:
        """Return of the particles `chosen` that of the smallest permanent number."""
        return int(chosen[self._numbers[chosen].argmin()])

    def permute(self) -> np.ndarray:
        """Leave the particles where they are: reference lists hold their numbers."""
        return np.arange(self.particles.count)

    def carried(self) -> dict[str, np.ndarray]:
        """Return all that the next step needs of each particle beside its state, between steps, a row a particle."""
        renewed = {"before": self.before} if self.formulation.renew_strain is not None else {}
        return {name: getattr(self, name) for name in KEPT} | renewed | {
            "rows": self.rows_[: self.particles.count], "rates": self._rates,
        } | (self.contact.carried() if self.contact is not None else {})  # fmt: skip

    def history(self) -> dict[str, np.ndarray]:
        """Return what the next step needs of the whole, between steps, by name."""
        return self.totals.history() | {"stage": np.array([self._stage])} | (
            self.contact.history() if self.contact is not None else {}
        )  # fmt: skip

    def join(self, halo_for: Callable[[RowLayout], Halo]) -> None:
        """See what other processes have, by the halos that `halo_for` makes of layouts of rows."""
        self.copies.halo = halo_for(self.copies.layout)
        self._seen = halo_for(_seen_of(self.particles.dim))
        self.spatial.halo = halo_for(self.spatial.layout)
        if self.contact is not None:
            self.contact.join(halo_for)

    def hold(self, data: np.ndarray, tags: np.ndarray, carried: dict[str, np.ndarray]) -> None:
        """Have these particles in place of all others, between steps; see `carried`."""
        particles, stage = self.particles, self._stage
        particles.data, particles.tags = np.ascontiguousarray(data), np.ascontiguousarray(tags)
        self.totals.hold(len(data))
        self._make_room()
        self._take(carried)
        self._stage = stage

    def _take(self, carried: dict[str, np.ndarray]) -> None:
        """Take what is `carried` of the particles that there are now, and build what follows from it."""
        kept = {name: np.array(carried[name], getattr(self, name).dtype) for name in KEPT}
        self.volume, self.alone, self.sequence = (kept[name] for name in ("volume", "alone", "sequence"))
        self._build_reference()
        if self.anywhere(kept["loose"].any()):
            self.reference.remove(self.copies.extended(kept["loose"]))
        for name, values in kept.items():
            setattr(self, name, values)
        if "before" in carried:
            self.before = np.array(carried["before"])
        self.rows_[: self.particles.count], self._rates[...] = carried["rows"], carried["rates"]
        if self.contact is not None:
            self.contact.hold(carried)
            self._body_indices = self.contact.pieces
            self._one_piece = self._one_body and not self.anywhere(kept["loose"].any())
        self._classify()

    def fit_grid(self) -> None:
        """Make the grids of cells anew, around the particles that there are now."""
        if self.particles.count:
            super().fit_grid()
            self._selection.fit(self.particles["position"])
            if self.contact is not None:
                self.contact.fit_grid()

    def restore(self, carried: dict[str, np.ndarray], history: dict[str, np.ndarray]) -> None:
        """Go back to where `carried` and `history` were taken; the particles must be those of then, in that order."""
        self._set_up()
        self._take(carried)
        if self.contact is not None:
            self.contact.restore(history)
        self._stage = float(history["stage"][0])
        self.totals.restore(history)
        self._sum_up()


def _seen_of(dim: int) -> RowLayout:
    """Return the layout of what decides who is near another body, or near an Eulerian particle."""
    return RowLayout(dim, (("x", "vector"), ("body", "scalar"), ("eulerian", "scalar")))


def _young_modulus(material: Material) -> float:
    """Return E [Pa] from bulk and shear modulus, 0 without strength."""
    bulk, shear = material.density * material.bulk_sound_speed**2, material.shear_modulus
    return 9.0 * bulk * shear / (3.0 * bulk + shear) if shear > 0.0 else 0.0
