"""Budgets of energy and momentum, the columns of the history, and histories of particles."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from hvisph.case.case import Case
from hvisph.compiler.exact_sum import decode_sum, encode_terms
from hvisph.core.particles import CLAMPED, FLAGS, Particles
from hvisph.integrators import sums as column
from hvisph.integrators.boundary_forces import Boundaries
from hvisph.integrators.gravity import UNIFORM, Gravity
from hvisph.integrators.prescribed_motion import GROUP_SHIFT, LAYER_GROUP, PrescribedMotion, is_rigid_particle
from hvisph.integrators.rigid_body import RigidMotion
from hvisph.materials.damage.fracture_energy import fracture_work
from hvisph.materials.slots import DISTENSION, FRACTURE_COMPLIANCE, RHO0
from hvisph.measures.impact_geometry import PROJECTILE, roles_of
from hvisph.measures.pressure import AXIS_COLUMN, CENTRE_COLUMN, axis_particles, centre_particles
from hvisph.output.snapshot import Snapshot
from hvisph.schemes.standard.scheme import fallbacks
from hvisph.setup.build import Setup
from hvisph.sph.neighbours.ghost_rows import Plane

# Of the two gradients of each pair in the last evaluation, those that the correction left plain.
FALLBACKS_COLUMN = "correction_fallbacks"
# Work of friction between bodies up to the record [J], which is heat in their internal energy.
SLIP_COLUMN = "slip_work"
# Work of plastic flow, and what viscosity, Riemann fluxes and friction dissipated, up to the record [J].
WORK_COLUMNS = ("plastic_work", "shock_heating")
GRAVITY_COLUMN = "gravity_energy"  # potential energy in the field of gravity [J], zero at the start
EXTERNAL_COLUMN = "external_work"  # work of what moves the clamps, up to the record [J]
# Energy that the integration of rigid bodies has made: the oscillation of their free rotation, and the difference of
# the kick from the velocities of the stage [J].
ROTATION_COLUMN = "rigid_rotation"
# Momentum that clamps, walls and planes of symmetry have taken up to the record [kg m/s].
SUPPORT_COLUMNS = ("support_momentum_x", "support_momentum_y", "support_momentum_z")
# Energy that left through open edges, up to the record [J], and momentum [kg m/s].
EDGE_COLUMNS = ("edge_energy", "edge_momentum_x", "edge_momentum_y", "edge_momentum_z")
LATE_COLUMN = "late_energy"  # energy that the softer moduli of late stages give back beyond those before [J]
HIGHEST_COLUMN = "highest_pressure"  # highest pressure of any particle up to the record [Pa]
# Angular momentum about the origin [kg m^2/s], by dimensions; summed every so many steps, not a number between.
ANGULAR_COLUMNS: dict[int, tuple[str, ...]] = {
    1: (),
    2: ("angular_momentum_z",),
    3: ("angular_momentum_x", "angular_momentum_y", "angular_momentum_z"),
}
ANGULAR_EVERY = 20
NAN = float("nan")
BATCH = 4096  # particles summed at a time, so that temporary arrays fit a cache
# Work against a contact algorithm since the start [J]: a separating contact keeps it, a repulsive one has made it heat.
CONTACT_COLUMN = "contact_energy"
FRACTURE_COLUMN = "fracture_work"  # work of fracture up to the record [J], a part of the internal energy


class Budget:
    """Energy and momentum since the start, including retired particles.

    `plastic_work`, `shock_heating` (viscosity, Riemann fluxes, friction) and `slip_work` in J; `impulse` on the clamped
    particles (3,) [kg m/s]; `retired` number, mass [kg], momentum (3) and energy [J] of particles that left the domain
    (6,); `highest_pressure` [Pa]; initial `angular_momentum` [kg m^2/s], None where it is not recorded; `pending`
    momentum (3) and energy that the next step removes from retired particles, per time (4,); `gravity_energy` the
    potential energy since the start [J], `potential` at the start, `weight` the momentum of a uniform field and
    of pressures (3,) [kg m/s]; `scale` is the energy to which drifts refer [J];
    `external_work` is the work of what moves the clamps and of pressures on faces [J], `rigid_rotation` that of
    `ROTATION_COLUMN`; `taken` (3,) [kg m/s] is what supports took up to the last step, where planes of symmetry move;
    `edge_energy` [J] and `edge_momentum` (3,) [kg m/s] are what left through open edges.
    """

    def __init__(self, setup: Setup):
        particles, sums = setup.particles, setup.stepper.sums
        self.energy = float(sums[column.KINETIC] + sums[column.INTERNAL]) + setup.stepper.stored_energy
        self.kinetic = float(sums[column.KINETIC])
        self._has_energy, self._stepper = setup.stepper.has_energy, setup.stepper
        self.momentum = sums[column.MOMENTUM : column.MOMENTUM + 3].copy()
        speed = np.sqrt((particles["velocity"] ** 2).sum(axis=1))
        share = setup.subdomain
        self.size = share.exact_sum(particles["mass"] * speed)
        self.slip_work = self.plastic_work = self.shock_heating = self.external_work = 0.0
        self.rigid_rotation = 0.0
        self.impulse, self.edge_momentum, self.edge_energy = np.zeros(3), np.zeros(3), 0.0
        self.boundaries: Boundaries | None = getattr(setup.stepper, "boundaries", None)
        self.retired, self.taken = np.zeros(6), np.zeros(3)
        self.pending = np.zeros(4)
        self.highest_pressure = float(setup.stepper.pressures.max(initial=0.0))
        self._setup = setup
        self.gravity: Gravity | None = getattr(setup.stepper, "gravity", None)
        self.weight, self.gravity_energy, self.scale, self.potential = np.zeros(3), 0.0, self.energy, 0.0
        if self.gravity is not None:
            self.potential = self._total_potential()
            potential = self.gravity.potential(particles["position"])
            mean = self.potential / share.exact_sum(particles["mass"])
            self.scale += share.exact_sum(particles["mass"] * np.abs(potential - mean))
        # planes and clamps give angular momentum of which no account is kept
        clamped = (particles.tags[:, FLAGS] & CLAMPED) != 0
        for rigid in _rigid_bodies(setup):
            if rigid.is_free(particles.dim):
                clamped &= particles.tags[:, FLAGS] >> GROUP_SHIFT != rigid.group
        has_clamps = share.get_maxima(float(clamped.any()))[0]
        is_conserved = not setup.planes and not has_clamps and self.boundaries is None
        self.angular_momentum = angular_momentum(setup) if is_conserved else np.zeros(0)
        middle = [share.exact_sum(x) / share.count for x in particles["position"].T]
        square = np.zeros(particles.count)  # of the lever
        for x_k, centre in zip(particles["position"].T, middle, strict=True):
            square += (x_k - centre) ** 2
        self._angular_scale = share.exact_sum(particles["mass"] * speed * np.sqrt(square))
        free = np.ones(3)
        free[[plane.axis for plane in setup.planes]] = 0.0  # a mirror gives momentum along its normal
        self._free = free

    def record(self, sums: np.ndarray, dt: float, pressures: np.ndarray) -> None:
        """Add the terms of a step [s]: forces on clamped particles, work, slip, pending terms, pressures (n,)."""
        self.highest_pressure = max(self.highest_pressure, float(pressures.max(initial=0.0)))
        plastic, heating, slipping = sums[column.PLASTIC : column.SLIPPING + 1].tolist()
        self.slip_work += dt * slipping
        self.plastic_work += plastic
        self.shock_heating += heating
        self.impulse += dt * sums[column.SUPPORT : column.SUPPORT + 3]
        if any(self.pending.tolist()):
            self.retired[2:] += dt * self.pending
            self.pending[:] = 0.0
        motion: PrescribedMotion | None = getattr(self._stepper, "motion", None)
        if motion is not None:
            self.external_work += motion.work
            self.rigid_rotation += motion.rotation
            self.impulse[: len(motion.momentum)] -= motion.momentum
        if self.boundaries is not None:
            gained, edge_momentum = self.boundaries.momentum, self.boundaries.edge_momentum
            self.external_work += self.boundaries.work
            self.weight[: len(gained)] += gained
            self.edge_energy += self.boundaries.edge_energy
            self.edge_momentum[: len(edge_momentum)] += edge_momentum
        if self.gravity is not None:
            particles = self._setup.particles
            self.gravity_energy = self._total_potential() - self.potential
            if self.gravity.kind == UNIFORM:
                free = ((particles.tags[:, FLAGS] & CLAMPED) == 0) | is_rigid_particle(particles.tags)
                pull = self._setup.subdomain.exact_sum(np.where(free, particles["mass"], 0.0))
                self.weight[: particles.dim] += dt * pull * np.array(self.gravity.vector)
        self._add_plane_work(sums)  # other sources of momentum are known

    def _add_plane_work(self, sums: np.ndarray) -> None:
        """Add the work of moving planes of symmetry in a step: their velocity times the momentum that they transmit."""
        if self.boundaries is not None and self.boundaries.speeds:
            momentum = np.array(self.support_momentum(sums))
            for axis, speed in self.boundaries.speeds:
                self.external_work -= speed * float(momentum[axis] - self.taken[axis])
            self.taken[:] = momentum

    def _total_potential(self) -> float:
        """Return the potential energy of all particles in the field of gravity [J]."""
        assert self.gravity is not None
        particles = self._setup.particles
        potential = self.gravity.potential(particles["position"])
        # the layer beyond an edge has no energy in the budget
        inside = particles.tags[:, FLAGS] >> GROUP_SHIFT != LAYER_GROUP
        return float(self._setup.subdomain.exact_sum(np.where(inside, particles["mass"] * potential, 0.0)))

    def highest(self) -> float:
        """Return the highest pressure of any particle of all processes so far [Pa]."""
        self.highest_pressure = float(self._setup.subdomain.get_maxima(self.highest_pressure)[0])
        return self.highest_pressure

    def crack_area(self) -> float | None:
        """Return the area of the cracks [m^2; m in 2D]; None without fracture energy."""
        setup = self._setup
        return work_of_fracture(setup, False) if "band_width" in setup.particles.offsets else None

    def energies(self, sums: np.ndarray) -> dict[str, float | None]:
        """Return the energies by kind [J; per metre in 2D] of the computed part; None for unknown ones."""
        has_energy = self._has_energy
        energies = {"initial": self.energy, "kinetic": float(sums[column.KINETIC]),
                 "internal": float(sums[column.INTERNAL]) if has_energy else None,
                 "plastic_work": self.plastic_work if has_energy else None,
                 "shock_heating": self.shock_heating if has_energy else None, "slip_work": self.slip_work}  # fmt: skip
        energies |= {} if self.gravity is None else {"gravity": self.gravity_energy}
        energies |= {"external_work": self.external_work} if self._setup.driven else {}
        energies |= {ROTATION_COLUMN: self.rigid_rotation} if _rigid_bodies(self._setup) else {}
        energies |= {"edge_energy": self.edge_energy} if has_edges(self.boundaries) else {}
        if "band_width" in self._setup.particles.offsets:
            energies[FRACTURE_COLUMN] = work_of_fracture(self._setup)
        return {name: value if value is not None and np.isfinite(value) else None for name, value in energies.items()}

    def energy_drift(self, sums: np.ndarray) -> float | None:
        """Return the change of total energy over that at the start; None if that is zero or energy is not computed."""
        if not self._has_energy:
            return None
        stored = self._stepper.stored_energy + self.gravity_energy - self.external_work - self.rigid_rotation
        stored += self.edge_energy
        total = float(sums[column.KINETIC] + sums[column.INTERNAL] + self.retired[5]) + stored
        scale = self.scale + abs(self.external_work)
        return (total - self.energy) / scale if scale > 0.0 else None

    def support_momentum(self, sums: np.ndarray) -> list[float]:
        """Return the momentum (3) [kg m/s] that clamps, walls and planes of symmetry have taken since the start."""
        momentum = sums[column.MOMENTUM : column.MOMENTUM + 3] + self.retired[2:5] - self.weight + self.edge_momentum
        return [float(component) for component in np.where(self._free > 0.0, self.impulse, self.momentum - momentum)]

    def momentum_drift(self, sums: np.ndarray) -> float | None:
        """Return the change of momentum over the sum of m |v| at the start; None if nothing moved, or for a sphere."""
        if self.gravity is not None and self.gravity.kind != UNIFORM:
            return None
        momentum = sums[column.MOMENTUM : column.MOMENTUM + 3] + self.impulse + self.retired[2:5] - self.weight
        momentum = momentum + self.edge_momentum
        change = float(np.linalg.norm((momentum - self.momentum) * self._free))
        return change / self.size if self.size > 0.0 else None

    def angular_drift(self) -> float | None:
        """Return the change of angular momentum over the first sum of m |r| |v|; None where it is not conserved."""
        if not len(self.angular_momentum) or self.retired[0] or not self._angular_scale > 0.0:
            return None
        return float(np.linalg.norm(angular_momentum(self._setup) - self.angular_momentum)) / self._angular_scale

    def as_dict(self, sums: np.ndarray) -> dict[str, float | None]:
        """Return the plain form for the summary, without numbers that are not finite."""
        ratio = float(sums[column.KINETIC]) / self.kinetic if self.kinetic > 0.0 else None
        figures = {"energy_drift": self.energy_drift(sums), "momentum_drift": self.momentum_drift(sums),
                 "angular_momentum_drift": self.angular_drift(), "kinetic_energy_ratio": ratio}  # fmt: skip
        if self.retired[0]:
            figures |= {"retired_particles": float(self.retired[0]), "retired_mass": float(self.retired[1]),
                      "retired_energy": float(self.retired[5])}  # fmt: skip
        return {name: value if value is not None and np.isfinite(value) else None for name, value in figures.items()}


def has_edges(boundaries: Boundaries | None) -> bool:
    """Return whether any of the boundaries is an open edge."""
    return boundaries is not None and boundaries.is_open


def angular_momentum(setup: Setup) -> np.ndarray:
    """Return the angular momentum about the origin [kg m^2/s]: about z in 2D, (3,) in 3D, else none."""
    stepper = setup.stepper
    # a sum in whole numbers of the unit of momentum, a million smoothing lengths away
    unit = float(stepper.totals.units[column.MOMENTUM] * 2.0 ** (20.0 + np.floor(np.log2(stepper.support))))
    particles = stepper.particles
    columns = len(ANGULAR_COLUMNS[_rotation_dimensions(particles)])
    if not columns:
        return np.zeros(0)
    parts = np.zeros((2, columns), np.int64)
    for first in range(0, particles.count, BATCH):
        parts += encode_terms(angular_momentum_of(particles, slice(first, first + BATCH)), unit)
    spin = sum((rigid.own_spin for rigid in _rigid_bodies(setup)), np.zeros(3))
    return decode_sum(setup.subdomain.total(parts), unit) + spin[3 - columns :]


def _rigid_bodies(setup: Setup) -> list[RigidMotion]:
    motion: PrescribedMotion | None = getattr(setup.stepper, "motion", None)
    return [] if motion is None else motion.rigid


def work_of_fracture(setup: Setup, of_energy: bool = True) -> float:
    """Return the work of fracture [J], or without `of_energy` the area of cracks [m^2], of all particles."""
    particles, table = setup.particles, setup.stepper.table[setup.particles.material]
    compliance = table[:, FRACTURE_COMPLIANCE]
    energy = np.zeros(len(compliance))
    np.divide(0.5, compliance, out=energy, where=compliance > 0.0)
    energy = energy if of_energy else np.sign(energy)
    work = fracture_work(particles["mass"], table[:, RHO0] / table[:, DISTENSION], particles["damage"],
                         particles["onset_tension"], particles["band_width"], energy)  # fmt: skip
    return setup.subdomain.exact_sum(work)


def angular_momentum_of(particles: Particles, rows: slice = slice(None)) -> np.ndarray:
    """Return the angular momentum of the particles `rows` about the origin (n, 0, 1 or 3) [kg m^2/s]."""
    x, momentum = particles["position"][rows], particles["mass"][rows, None] * particles["velocity"][rows]
    pairs: dict[int, tuple[tuple[int, int], ...]] = {1: (), 2: ((0, 1),), 3: ((1, 2), (2, 0), (0, 1))}
    columns = [x[:, a] * momentum[:, b] - x[:, b] * momentum[:, a] for a, b in pairs[_rotation_dimensions(particles)]]
    return np.stack(columns, 1) if columns else np.zeros((len(x), 0))


def _rotation_dimensions(particles: Particles) -> int:
    """Return the dimensions of rotation; none of axisymmetric particles."""
    return 1 if particles.kinematics.axisymmetric else particles.dim


class Observer:
    """The history: one record a step, with the pressures at the projectile's centre and on its axis, and gauges."""

    BASE = ("step", "time", "dt", "criterion", "limiting_particle", "kinetic_energy", "internal_energy",
            "momentum_x", "momentum_y", "momentum_z", "energy_drift")  # fmt: skip

    def __init__(self, setup: Setup, case: Case):
        self._setup, stepper = setup, setup.stepper
        self._watched = setup.observed or observed_particles(setup.particles, setup.planes, case)
        self._at_centre = len(self._watched[CENTRE_COLUMN])
        self._numbers = np.concatenate([self._watched[CENTRE_COLUMN], self._watched[AXIS_COLUMN]])
        dim, formulation, boundaries = setup.particles.dim, stepper.formulation, getattr(stepper, "boundaries", None)
        # columns that not every run has: whether this one has them, and their values by the budget and the sums
        optional: tuple[tuple[tuple[str, ...], object, Callable[[Budget, np.ndarray], Sequence[float]]], ...] = (
            ((FALLBACKS_COLUMN,), formulation.corrects_kernels, lambda *_: [int(self._total(fallbacks(stepper)))]),
            ((SLIP_COLUMN,), formulation.has_friction, lambda budget, _: [budget.slip_work]),
            (WORK_COLUMNS, stepper.has_energy, lambda budget, _: [budget.plastic_work, budget.shock_heating]),
            ((GRAVITY_COLUMN,), getattr(stepper, "gravity", None), lambda budget, _: [budget.gravity_energy]),
            ((EXTERNAL_COLUMN,), setup.driven, lambda budget, _: [budget.external_work]),
            (SUPPORT_COLUMNS, setup.supported, lambda budget, sums: budget.support_momentum(sums)),
            ((ROTATION_COLUMN,), _rigid_bodies(setup), lambda budget, _: [budget.rigid_rotation]),
            (EDGE_COLUMNS[: 1 + dim], has_edges(boundaries),
             lambda budget, _: [budget.edge_energy, *budget.edge_momentum[:dim].tolist()]),
            ((CONTACT_COLUMN,), formulation.stores_contact_energy, lambda *_: [float(stepper.contact_energy)]),
            ((FRACTURE_COLUMN,), "band_width" in setup.particles.offsets, lambda *_: [work_of_fracture(setup)]),
            ((LATE_COLUMN,), len(stepper.late) > 1, lambda *_: [float(stepper.late[0])]),
            ((HIGHEST_COLUMN,), True, lambda budget, _: [budget.highest()]),
        )  # fmt: skip
        self._optional = [(names, values) for names, applies, values in optional if applies]
        names = (name for names, _ in self._optional for name in names)
        self._angular = ANGULAR_COLUMNS[_rotation_dimensions(setup.particles)]
        self.columns = (*self.BASE, *self._watched, *names, *self._angular, *setup.gauges.columns)

    def _total(self, number: int) -> int:
        return int(self._setup.subdomain.total(np.array([number]))[0])

    def due(self, step: int) -> bool:
        """Return whether a gauge is due after `step` steps, independently of the interval of the history."""
        return self._setup.gauges.due(step)

    def record(self, step: int, time: float, dt: float, criterion: str, particle: int, budget: Budget) -> list[Any]:
        """Return the record of a step."""
        sums, share, centre = self._setup.stepper.sums, self._setup.subdomain, self._at_centre
        pressures = share.gather_values(self._numbers, self._setup.stepper.pressures)
        drift = budget.energy_drift(sums)
        turns = angular_momentum(self._setup) if step % ANGULAR_EVERY == 0 else [NAN] * len(self._angular)
        return [
            step, time, dt, criterion, particle, *sums[: column.MOMENTUM + 3].tolist(),
            NAN if drift is None else drift,
            float(pressures[:centre].sum()) / centre, float(pressures[centre:].min()),
            *(value for _, values in self._optional for value in values(budget, sums)),
            *map(float, turns), *self._setup.gauges.record(step, share),
        ]  # fmt: skip


def observed_particles(particles: Particles, planes: tuple[Plane, ...], case: Case) -> dict[str, np.ndarray]:
    """Return the numbers of particles of the projectile, its first body, whose pressures the history records."""
    fields, spacing = {name: particles[name] for name in ("position", "velocity", "mass")}, case.resolution
    body, material, number = particles.body.astype(np.int64), particles.material, particles.id
    start = Snapshot(0.0, 0, particles.dim, fields, body, material, number, list(case.bodies), [])
    roles = roles_of(start, start, stated_roles(case))
    projectile = np.flatnonzero(body == (roles.index(PROJECTILE) if PROJECTILE in roles else 0))
    position, numbers = particles["position"][projectile], particles.id[projectile]
    axis = _mirror_axis(position, planes)
    return {
        CENTRE_COLUMN: np.sort(numbers[centre_particles(position, spacing, axis)]),
        AXIS_COLUMN: np.sort(numbers[axis_particles(position, spacing, axis)]),
    }


def stated_roles(case: Case) -> list[str | None]:
    """Return the roles of bodies: gases at rest beside solids and explosives without projectile are `other`."""
    bodies = case.bodies.values()
    moves = [any(body.velocity) or bool(body.initial_velocity) for body in bodies]
    kinds = [body.material.eos.type for body in bodies]
    neutral = [
        (eos == "jwl" and not any(moves)) or (eos == "ideal_gas" and not moving and set(kinds) != {"ideal_gas"})
        for eos, moving in zip(kinds, moves, strict=True)
    ]
    return [body.role or ("other" if neither else None) for body, neither in zip(bodies, neutral, strict=True)]


def _mirror_axis(position: np.ndarray, planes: tuple[Plane, ...]) -> np.ndarray | None:
    """Return the shot line of a model with symmetry planes, which its particles alone do not determine."""
    if not any(plane.axis for plane in planes):
        return None
    centre = 0.5 * (position.min(axis=0) + position.max(axis=0))
    for plane in planes:
        centre[plane.axis] = plane.at
    return np.asarray(centre[1:])


class MigratingRows:
    """Array `rows` (n, ...) with a row for each particle, which is reordered and migrates with the particles."""

    def __init__(self, setup: Setup, rows: np.ndarray):
        self.rows = rows
        setup.subdomain.follow(lambda: self.rows, lambda rows: setattr(self, "rows", rows.copy()))

    def permute(self, order: np.ndarray) -> None:
        """Reorder the rows with the particles."""
        self.rows[:] = self.rows.take(order, axis=0)


class Peaks(MigratingRows):
    """Maximum pressure of each particle so far [Pa], in `rows`."""

    def __init__(self, setup: Setup):
        super().__init__(setup, np.full(setup.particles.count, -np.inf))
        self._setup = setup

    def record(self) -> None:
        """Update the maxima with the last pressures."""
        np.maximum(self.rows, self._setup.stepper.pressures, out=self.rows)
