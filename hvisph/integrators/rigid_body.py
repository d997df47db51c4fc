"""Rigid bodies: centre, velocity, orientation and angular momentum of a body whose particles keep their places in it.

    M = sum m_a,   X = sum m_a x_a / M,   J = sum m_a [(r^2 + s^2/6) 1 - r (x) r]      s: spacing, of a cube
    step   free flow over dt/2;  forces and torques there;  M U += dt F,  L += dt T;  free flow over dt/2

The reaction of a deformable particle a acts at x_a, where the body has the velocity U + w x (x_a - X): forces and
torques of both sides cancel, whatever the direction of the force. The pairs do their work at the velocities of the
stage, the kick at the mean of those before and after it. `rotation` is that difference and the oscillation of the flow.

Source: Dullweber, Leimkuhler & McLachlan 1997; the free rotation is in `integrators.rotation`.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from hvisph.compiler.jit import Options, specialise
from hvisph.sph.neighbours.particle_layout import slots

from .gravity import UNIFORM
from .rotation import flow, quaternion, rotation, turn_about

# Parts of the state: centre, velocity, quaternion, angular momentum in space, the last acceleration and torque, how far
# the stage is ahead [s], and the rate at which the velocity of the contact relaxes [1/s].
CENTRE, VELOCITY, TURN, SPIN = slice(0, 3), slice(3, 6), slice(6, 10), slice(10, 13)
FORCE, TORQUE, AHEAD, RELAXATION, STATE = slice(13, 16), slice(16, 19), 19, 20, 21
# Largest step times the rate at which the velocity of a contact relaxes: velocities of the stage are predicted.
MOST_RELAXATION = 0.5
# Largest displacement of a particle by rotation in a step, over the spacing.
MOST_ROTATION = 0.1


@dataclass(frozen=True)
class MassProperties:
    """Mass [kg], centre (3,) [m] and inertia (3, 3) [kg m^2] about it, and that of the particles as points."""

    mass: float
    centre: np.ndarray
    inertia: np.ndarray
    point_inertia: np.ndarray


def in_space(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (n, dim) with three components, (n, 3)."""
    space = np.zeros((len(vectors), 3))
    space[:, : vectors.shape[1]] = vectors
    return space


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the vector products of rows (n, 3)."""
    x, y, z = (a[:, (k + 1) % 3] * b[:, (k + 2) % 3] - a[:, (k + 2) % 3] * b[:, (k + 1) % 3] for k in range(3))
    return np.stack([x, y, z], axis=1)


def find_compliances(group, place, rows, state, packed, centre, moves, turns, terms):
    """Write A (1/M + r_n^2/J) of the particles of a `group` (n,) beside others into `terms` (n,); return how many.

    Bound names: DIM, NORMAL (slot of the sorted `rows`), S_MASS, S_DENSITY.

    `moves`, `turns`: matrices (3, 3) whose quadratic forms of the normal and of its arm are 1/M and r_n^2/J
    """
    count, n, r, arm = 0, np.zeros(3), np.zeros(3), np.zeros(3)
    for i in group:
        for f in range(DIM):
            n[f], r[f] = rows[place[i], NORMAL + f], packed[i, f] - centre[f]
        size = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        if size > 0.0:
            for f in range(3):
                g, h = (f + 1) % 3, (f + 2) % 3
                arm[f] = r[g] * n[h] - r[h] * n[g]
            compliance = 0.0
            for f in range(3):
                for g in range(3):
                    compliance += n[f] * moves[f, g] * n[g] + arm[f] * turns[f, g] * arm[g]
            terms[count] = 2.0 * state[i, S_MASS] / state[i, S_DENSITY] * compliance / size
            count += 1
    return count


def collect_forces(group, place, rates, state, packed, centre, terms):
    """Write force, torque about `centre` and power of the particles of a `group` that have some into `terms` (n, 7).

    Return how many. Bound names: DIM, S_MASS, TORQUE_RATE (slot of the torque in the rates, 0 for none).
    """
    count, r = 0, np.zeros(3)
    for i in group:
        row, has_force, mass = place[i], False, state[i, S_MASS]
        for f in range(DIM):
            terms[count, f], r[f] = mass * rates[row, f], packed[i, f] - centre[f]
        for f in range(DIM + 1):
            has_force = has_force or rates[row, f] != 0.0
        for f in range(3):
            g, h = (f + 1) % 3, (f + 2) % 3
            terms[count, 3 + f] = r[g] * terms[count, h] - r[h] * terms[count, g]
        if TORQUE_RATE:
            for f in range(2 * DIM - 3):
                terms[count, 6 - (2 * DIM - 3) + f] += mass * rates[row, TORQUE_RATE + f]
        terms[count, 6] = mass * rates[row, DIM]
        count += has_force
    return count


def place_particles(group, state, packed, frames, turns, is_complete):
    """Write positions and velocities of the particles of a `group` (n,) into state and packed rows.

    Bound names: DIM, S_POSITION, S_VELOCITY, U, TURN_RATE (slots of the row, 0 for none).

    `frames`: centre, velocity and angular velocity (3, 9) of the body before a step, now and at the stage
    `turns`: rotations (2, 3, 3) from each to the next
    `is_complete`: whether a step was completed, which the positions of the state do not know of
    """
    start, frame, stage = frames[0], frames[1], frames[2]
    r, arm = np.zeros(3), np.zeros(3)
    for i in group:
        if is_complete:
            for f in range(DIM):
                r[f] = state[i, S_POSITION + f] - start[f]
            for f in range(DIM):
                shift = turns[0, f, 0] * r[0] + turns[0, f, 1] * r[1] + turns[0, f, 2] * r[2]
                state[i, S_POSITION + f] = frame[f] + shift
        for f in range(DIM):
            r[f] = state[i, S_POSITION + f] - frame[f]
        for f in range(3):
            arm[f] = turns[1, f, 0] * r[0] + turns[1, f, 1] * r[1] + turns[1, f, 2] * r[2]
        for f in range(DIM):
            g, h = (f + 1) % 3, (f + 2) % 3
            state[i, S_VELOCITY + f] = frame[3 + f] + frame[6 + g] * r[h] - frame[6 + h] * r[g]
            packed[i, f] = stage[f] + arm[f]
            packed[i, U + f] = stage[3 + f] + stage[6 + g] * arm[h] - stage[6 + h] * arm[g]
        if TURN_RATE:
            for f in range(2 * DIM - 3):
                packed[i, TURN_RATE + f] = stage[9 - (2 * DIM - 3) + f]


@cache
def _loops(dim: int, columns: tuple[int, ...], u: int, turn_rate: int, torque: int, normal: int) -> tuple[Any, ...]:
    """Return the compiled loops for slots of the state (mass, density, position, velocity), the rows and the rates."""
    pairs = zip(("S_MASS", "S_DENSITY", "S_POSITION", "S_VELOCITY"), columns, strict=True)
    items: Options = dict(pairs) | {"DIM": dim, "U": u, "TURN_RATE": turn_rate, "TORQUE_RATE": torque, "NORMAL": normal}
    parts = (find_compliances, collect_forces, place_particles)
    return tuple(specialise(function, parallel=False, **items) for function in parts)


class RigidMotion:
    """Motion of a rigid body, the particles of `group`.

    `name`, `group`: name of the body, and number of its particles' group.
    `mass`: mass, centre, inertia.
    `moves`: projection (3, 3) on the directions in which it moves.
    `axis`: axis (3,) of the only rotation, None where it turns freely or not at all (`turns`).
    `velocity`, `rate`: those at the start (3,) [m/s], [rad/s].
    `radius`, `spacing`: largest distance of a particle from the centre, and spacing [m].
    `impedance`: of the stiffest deformable material [kg/(m^2 s)].
    `table`: prescribed motion of the centre, if any: an object with `velocity(time)` and `displacement(first, last)`.
    """

    def __init__(self, name: str, group: int, mass: MassProperties, moves: np.ndarray, turns: bool,
                 axis: np.ndarray | None, velocity: np.ndarray, rate: np.ndarray, radius: float, spacing: float,
                 impedance: float, table: Any = None):  # fmt: skip
        self.name, self.group, self.mass, self.moves, self.turns, self.axis = name, group, mass, moves, turns, axis
        self.table, self._radius, self._spacing, self._impedance = table, radius, spacing, impedance
        self.inertia, axes = np.linalg.eigh(mass.inertia)
        axes *= np.copysign(1.0, np.linalg.det(axes))
        if axis is not None:
            self.inertia, axes = float(axis @ mass.inertia @ axis) * np.ones(3), np.eye(3)
        self._point_inertia = axes.T @ mass.point_inertia @ axes
        self.state = np.zeros(STATE)
        self.state[CENTRE], self.state[VELOCITY], self.state[TURN] = mass.centre, velocity, quaternion(axes)
        self.state[SPIN] = self._project(mass.inertia @ rate)
        self._frame: np.ndarray | None = None  # centre and axes before a step
        self._compliances: np.ndarray | None = None  # of the particles beside others
        self._cache: dict[tuple[float, float, bytes], tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = {}

    def is_free(self, dim: int) -> bool:
        """Return whether nothing supports the body, in `dim` dimensions."""
        turns = dim == 1 or (self.turns and (self.axis is None or dim == 2))
        return bool(np.array_equal(self.moves[:dim, :dim], np.eye(dim))) and turns and self.table is None

    @property
    def velocity(self) -> np.ndarray:
        """Velocity of the centre (3,) [m/s]."""
        return self.state[VELOCITY].copy()

    @property
    def angular_velocity(self) -> np.ndarray:
        """Angular velocity (3,) [rad/s]."""
        return self._rate(self.state[TURN], self.state[SPIN])

    @property
    def own_spin(self) -> np.ndarray:
        """Angular momentum that the particles as points do not have (3,) [kg m^2/s]."""
        axes = rotation(self.state[TURN])
        return np.asarray(self.state[SPIN] - axes @ (self._point_inertia @ (axes.T @ self.angular_velocity)))

    def limits(self) -> list[tuple[float, str, int]]:
        """Return the step limits of the body, see `Stepper.limits`."""
        speed = float(np.linalg.norm(self.angular_velocity)) * self._radius
        times = [MOST_ROTATION * self._spacing / speed] if speed > 0.0 else []
        times += [MOST_RELAXATION / self.state[RELAXATION]] if self.state[RELAXATION] > 0.0 else []
        return [(float(time), "rigid_body", -1) for time in times]

    def hold(self) -> tuple[Any, ...]:
        """Let the body rest where it is; return what `release` takes."""
        record = self.moves, self.turns, self.table, self.state.copy()
        self.moves, self.turns, self.table = np.zeros((3, 3)), False, None
        self.state[VELOCITY], self.state[SPIN] = 0.0, 0.0
        self._cache = {}
        return record

    def release(self, record: tuple[Any, ...]) -> None:
        """Let the body go on with freedom, motion and state from before `hold`."""
        (self.moves, self.turns, self.table, self.state), self._cache = record, {}

    def slow(self, share: float) -> None:
        """Multiply velocity and angular momentum by a share."""
        self.state[VELOCITY] *= share
        self.state[SPIN] *= share

    def _project(self, axial: np.ndarray) -> np.ndarray:
        """Return the part of an angular momentum or torque (3,) that the body takes."""
        if not self.turns:
            return np.zeros(3)
        return axial if self.axis is None else self.axis * float(self.axis @ axial)

    def _rate(self, q: np.ndarray, spin: np.ndarray) -> np.ndarray:
        """Return the angular velocity (3,) [rad/s] at an orientation and angular momentum in space."""
        if not self.turns:
            return np.zeros(3)
        axes = rotation(q)
        return np.asarray(spin / self.inertia if self.axis is not None else axes @ ((spin @ axes) / self.inertia))

    def _flow(self, time: float) -> np.ndarray:
        q, spin = self.state[TURN], self.state[SPIN]
        if not self.turns or time == 0.0:
            return q
        if self.axis is not None:
            return turn_about(q, self.axis, time * float(self.axis @ spin) / self.inertia[0])
        return flow(q, spin, self.inertia, time)

    def _energy(self, q: np.ndarray) -> float:
        if not self.turns:
            return 0.0
        spin = self.state[SPIN]
        return 0.5 * float(spin @ self._rate(q, spin))

    def _predict(self, time: float, stage: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return centre, orientation, velocity and angular velocity predicted for `stage` [s] after `time`."""
        state, key = self.state, (time, stage, self.state[:AHEAD].tobytes())
        if key not in self._cache:  # shown at the end of a step, and seen by the kick of the next
            q = self._flow(stage).copy()
            rate, centre = self._rate(q, state[SPIN] + stage * state[TORQUE]), state[CENTRE] + stage * state[VELOCITY]
            velocity = state[VELOCITY] + stage * state[FORCE]
            if self.table is not None:
                centre = state[CENTRE] + in_space(self.table.displacement(time, time + stage)[None])[0]
                velocity = in_space(self.table.velocity(time + stage)[None])[0]
            self._cache = {key: (centre, q, velocity, rate)}
        return self._cache[key]

    def kick(self, stepper: Any, rows: np.ndarray, time: float, dt: float) -> tuple[np.ndarray, float, float]:
        """Advance the body from `time` by the step `dt` [s] with the forces on its particles `rows`, which it takes.

        Returns `impulse`, `work`, `rotation`: momentum (3,) [kg m/s] and work [J] of what supports or drives it; energy
        that its integration makes [J].
        """
        particles, exact, state = stepper.particles, stepper.totals.exact, self.state
        dim, mass, stage = particles.dim, self.mass.mass, float(state[AHEAD])
        centre, q, u_stage, w_stage = self._predict(time, stage)
        self._frame = np.vstack([state[CENTRE], self._axes(state[TURN])])
        terms = np.zeros((len(rows) + 1, 7))
        count = self._loops(stepper)[1](rows, stepper.place, stepper.rates, particles.data, stepper.rows, centre, terms)
        sums, columns = np.zeros(7), [*range(dim), *(range(3 if dim == 3 else 5, 6) if self.turns else ()), 6]
        for k in columns:
            sums[k] = exact(terms[:count, k])
        force, torque, power = sums[:3], sums[3:6], sums[6]
        weight, moment = self._pull(stepper, rows, centre)
        self.find_relaxation(stepper)
        u_start, rate, change = self.velocity, self._rate(q, state[SPIN]), self._energy(q) - self._energy(state[TURN])
        state[FORCE], state[TORQUE] = self.moves @ (force + weight) / mass, self._project(torque + moment)
        state[VELOCITY] += dt * state[FORCE]
        mean, shift = 0.5 * (u_start + state[VELOCITY]), centre - state[CENTRE] + (dt - stage) * state[VELOCITY]
        if self.table is not None:
            shift = in_space(self.table.displacement(time, time + dt)[None])[0]
            mean, state[VELOCITY] = shift / dt, in_space(self.table.velocity(time + dt)[None])[0]
        state[SPIN] += dt * state[TORQUE]
        mean_rate = 0.5 * (rate + self._rate(q, state[SPIN]))
        error = dt * float(force @ (mean - u_stage) + torque @ (mean_rate - w_stage) - power)
        error += float(weight @ (dt * mean - shift))  # gravity does its work on the way
        state[CENTRE] += shift
        energy, state[TURN] = self._energy(q), q
        state[TURN] = self._flow(dt - stage)
        kinetic = 0.5 * mass * float(state[VELOCITY] @ state[VELOCITY] - u_start @ u_start)
        work = kinetic - dt * float((force + weight) @ mean) if self.table is not None else 0.0
        impulse = mass * (state[VELOCITY] - u_start) - dt * (force + weight)
        return impulse, work, error + change + self._energy(state[TURN]) - energy

    def _pull(self, stepper: Any, rows: np.ndarray, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the force (3,) [N] of gravity on the body at the stage, and its torque (3,) [N m] about `centre`."""
        gravity, dim, exact = stepper.gravity, stepper.particles.dim, stepper.totals.exact
        if gravity is None:
            return np.zeros(3), np.zeros(3)
        if gravity.kind == UNIFORM:
            return self.mass.mass * in_space(np.array([gravity.vector]))[0], np.zeros(3)
        x, mass = stepper.rows[rows, :dim], stepper.particles["mass"][rows]
        pulls = in_space(mass[:, None] * gravity.acceleration(x))
        torques = cross(in_space(x) - centre, pulls) if self.turns else np.zeros((1, 3))
        return np.array([exact(row) for row in pulls.T]), np.array([exact(row) for row in torques.T])

    def _loops(self, stepper: Any) -> tuple[Any, ...]:
        row_slots, particles = stepper.row_slots, stepper.particles
        columns = tuple(particles.offsets[name] for name in ("mass", "density", "position", "velocity"))
        turn_rate, torque = row_slots.get("TURN_RATE", 0), slots(particles.dim)["R_SPIN"]
        torque = torque if turn_rate and stepper.rates.shape[1] > torque else 0
        return _loops(particles.dim, columns, row_slots["U"], turn_rate, torque, stepper.pairs.slots.get("N_RAW", 0))

    def note_contact(self, stepper: Any, rows: np.ndarray, time: float) -> None:
        """Note A (1/M + r_n^2/J) of particles beside others, after an evaluation, before other uses of sorted rows."""
        pairs, turns, (centre, q, _, _) = stepper.pairs, np.zeros((3, 3)), self._predict(time, float(self.state[AHEAD]))
        if "N_RAW" not in pairs.slots:
            return
        if self.axis is not None:
            turns = np.outer(self.axis, self.axis) / self.inertia[0]
        elif self.turns:
            axes = rotation(q)
            turns = (axes / self.inertia) @ axes.T
        terms, moves = np.empty(len(rows)), self.moves / self.mass.mass
        count = self._loops(stepper)[0](
            rows, stepper.place, pairs.sorted, stepper.particles.data, stepper.rows, centre, moves, turns, terms
        )
        self._compliances = terms[:count] / pairs.unit

    def find_relaxation(self, stepper: Any) -> None:
        """Find the rate [1/s] at which contact changes the velocity, Z times the sum of what was noted."""
        if self._compliances is not None:
            self.state[RELAXATION] = self._impedance * float(stepper.totals.exact(self._compliances))

    def _axes(self, q: np.ndarray) -> np.ndarray:
        return rotation(q) if self.turns else np.eye(3)

    def place(self, stepper: Any, rows: np.ndarray, time: float, stage: float) -> np.ndarray:
        """Write the motion of the body at `time` + `stage` [s]; return its energy [J] and momentum (dim,) [kg m/s]."""
        particles, state, dim = stepper.particles, self.state, stepper.particles.dim
        centre, q, velocity, rate = self._predict(time, stage)
        axes, frames, turns = self._axes(state[TURN]), np.zeros((3, 9)), np.stack([np.eye(3), np.eye(3)])
        if self._frame is not None:
            frames[0, :3] = self._frame[0]
            if self.turns:
                turns[0] = axes @ self._frame[1:].T
        frames[1, :3], frames[1, 3:6], frames[2, :3], frames[2, 3:6] = state[CENTRE], state[VELOCITY], centre, velocity
        if self.turns:
            turns[1] = rotation(q) @ axes.T
            frames[1, 6:], frames[2, 6:] = self.angular_velocity, rate
        self._loops(stepper)[2](rows, particles.data, stepper.rows, frames, turns, self._frame is not None)
        state[AHEAD], self._frame = stage, None
        u, mass = state[VELOCITY], self.mass.mass
        return np.array([0.5 * mass * float(u @ u) + self._energy(state[TURN]), *(mass * u[:dim])])
