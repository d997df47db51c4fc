"""Rigid bodies: centre, velocity, orientation and angular momentum of a body whose particles keep their places in it.

    M = sum m_a,   X = sum m_a x_a / M,   J = sum m_a [(r^2 + s^2/6) 1 - r (x) r]      s: spacing, of a cube
    step   free flow over dt/2;  forces and torques there;  M U += dt F,  L += dt T;  free flow over dt/2

The free flow keeps L in space and turns the body about its principal axes one after another, 1 (h/2), 2 (h/2), 3 (h),
2 (h/2), 1 (h/2), by the angle h L_k/I_k: of second order and reversible; its energy oscillates by O(dt^2). A body that
may turn about one axis only, as in a plane, has one angle, which is exact.

The reaction of a deformable particle a acts at x_a, where the body has the velocity U + w x (x_a - X): forces and
torques of both sides cancel, whatever the direction of the force. The pairs do their work at the velocities of the
stage, the kick at the mean of those before and after it. `rotation` is that difference and the oscillation of the flow.

Source: Dullweber, Leimkuhler & McLachlan 1997.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hvisph.sph.neighbours.particle_layout import slots

from .gravity import UNIFORM

# Parts of the state: centre, velocity, quaternion, angular momentum in space, the last acceleration and torque, how far
# the stage is ahead [s], and the rate at which the velocity of the contact relaxes [1/s].
CENTRE, VELOCITY, TURN, SPIN = slice(0, 3), slice(3, 6), slice(6, 10), slice(10, 13)
FORCE, TORQUE, AHEAD, RELAXATION, STATE = slice(13, 16), slice(16, 19), 19, 20, 21
# Axes of the turns of a free flow, and their shares of it.
SPLITTING = ((0, 0.5), (1, 0.5), (2, 1.0), (1, 0.5), (0, 0.5))
# Largest step times the rate at which the velocity of a contact relaxes: velocities of the stage are predicted.
RELAXED = 0.5
# Largest way of a particle by rotation in a step, over the spacing.
TURNED = 0.1


@dataclass(frozen=True)
class MassProperties:
    """Mass [kg], centre (3,) [m] and inertia (3, 3) [kg m^2] about it, and that of the particles as points."""

    mass: float
    centre: np.ndarray
    inertia: np.ndarray
    of_points: np.ndarray


def mass_properties(mass: np.ndarray, position: np.ndarray, spacing: np.ndarray, exact: Any) -> MassProperties:
    """Return the mass properties of particles; `exact` sums terms (n,) the same in any order."""
    whole, x = exact(mass), in_space(position)
    centre = np.array([exact(mass * component) for component in x.T]) / whole
    r, of_points = x - centre, np.empty((3, 3))
    square = (r * r).sum(axis=1)
    for i in range(3):
        for j in range(3):
            of_points[i, j] = exact(mass * ((i == j) * square - r[:, i] * r[:, j]))
    return MassProperties(whole, centre, of_points + np.eye(3) * exact(mass * spacing**2) / 6.0, of_points)


def in_space(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (n, dim) with three components, (n, 3)."""
    space = np.zeros((len(vectors), 3))
    space[:, : vectors.shape[1]] = vectors
    return space


def rotation(q: np.ndarray) -> np.ndarray:
    """Return the matrix (3, 3), body to space, of the unit quaternion `q` (4,)."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion(axes: np.ndarray) -> np.ndarray:
    """Return the unit quaternion (4,) of a rotation matrix (3, 3), by the largest of its four numbers."""
    diagonal = np.diag(axes)
    squares = np.array([diagonal.sum(), *(2.0 * diagonal - diagonal.sum())]) + 1.0  # 4 q^2
    odd = [axes[2, 1] - axes[1, 2], axes[0, 2] - axes[2, 0], axes[1, 0] - axes[0, 1]]
    k = int(np.argmax(squares))
    q = np.array([0.0, *odd] if k == 0 else [odd[k - 1], *(axes[k - 1] + axes[:, k - 1])])
    q[k] = squares[k]
    return q / np.sqrt((q * q).sum())


def turn_about(q: np.ndarray, axis: np.ndarray, angle: float) -> np.ndarray:
    """Return the quaternion `q` (4,), turned before by `angle` about `axis` (3,) in the body, of length 1."""
    w, v = np.cos(0.5 * angle), np.sin(0.5 * angle) * axis
    after = np.array(
        [
            q[0] * w - q[1] * v[0] - q[2] * v[1] - q[3] * v[2],
            q[0] * v[0] + q[1] * w + q[2] * v[2] - q[3] * v[1],
            q[0] * v[1] - q[1] * v[2] + q[2] * w + q[3] * v[0],
            q[0] * v[2] + q[1] * v[1] - q[2] * v[0] + q[3] * w,
        ]
    )
    return after / np.sqrt((after * after).sum())


def flow(q: np.ndarray, spin: np.ndarray, inertia: np.ndarray, time: float) -> np.ndarray:
    """Return the quaternion after a free rotation over `time` [s].

    `q`: unit quaternion (4,), principal axes to space
    `spin`, `inertia`: angular momentum in space (3,) [kg m^2/s], and principal moments (3,) [kg m^2]
    """
    own = spin @ rotation(q)
    for k, share in SPLITTING:
        angle = share * time * own[k] / inertia[k]
        q = turn_about(q, np.eye(3)[k], angle)
        i, j, c, s = (k + 1) % 3, (k + 2) % 3, np.cos(angle), np.sin(angle)
        own[i], own[j] = c * own[i] + s * own[j], c * own[j] - s * own[i]
    return q


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the vector products of rows (n, 3)."""
    x, y, z = (a[:, (k + 1) % 3] * b[:, (k + 2) % 3] - a[:, (k + 2) % 3] * b[:, (k + 1) % 3] for k in range(3))
    return np.stack([x, y, z], axis=1)


def multiply_rows(matrix: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Return the products (n, 3) of a matrix with rows, with the same bits for any number of them."""
    return np.stack([row[0] * r[:, 0] + row[1] * r[:, 1] + row[2] * r[:, 2] for row in matrix], axis=1)


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
        self._of_points = axes.T @ mass.of_points @ axes
        self.state = np.zeros(STATE)
        self.state[CENTRE], self.state[VELOCITY], self.state[TURN] = mass.centre, velocity, quaternion(axes)
        self.state[SPIN] = self._project(mass.inertia @ rate)
        self._places: np.ndarray | None = None
        self._near: tuple[np.ndarray, np.ndarray] | None = None

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
        return np.asarray(self.state[SPIN] - axes @ (self._of_points @ (axes.T @ self.angular_velocity)))

    def limits(self) -> list[tuple[float, str, int]]:
        """Return what limits the step, see `Stepper.limits`."""
        speed = float(np.linalg.norm(self.angular_velocity)) * self._radius
        times = [TURNED * self._spacing / speed] if speed > 0.0 else []
        times += [RELAXED / self.state[RELAXATION]] if self.state[RELAXATION] > 0.0 else []
        return [(float(time), "rigid_body", -1) for time in times]

    def hold(self) -> tuple[Any, ...]:
        """Let the body rest where it is; return what `release` takes."""
        kept = self.moves, self.turns, self.table, self.state.copy()
        self.moves, self.turns, self.table = np.zeros((3, 3)), False, None
        self.state[VELOCITY], self.state[SPIN] = 0.0, 0.0
        return kept

    def release(self, kept: tuple[Any, ...]) -> None:
        """Let the body go on with freedom, motion and state from before `hold`."""
        self.moves, self.turns, self.table, self.state = kept

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

    def _ahead(self, now: float, stage: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return centre, orientation, velocity and angular velocity predicted for `stage` [s] after `now`."""
        state, q = self.state, self._flow(stage)
        rate = self._rate(q, state[SPIN] + stage * state[TORQUE])
        if self.table is not None:
            moved = in_space(self.table.displacement(now, now + stage)[None])[0]
            return state[CENTRE] + moved, q, in_space(self.table.velocity(now + stage)[None])[0], rate
        return state[CENTRE] + stage * state[VELOCITY], q, state[VELOCITY] + stage * state[FORCE], rate

    def kick(self, stepper: Any, rows: np.ndarray, now: float, dt: float) -> tuple[np.ndarray, float, float]:
        """Advance the body from `now` by the step `dt` [s] with the forces on its particles `rows`, which it takes.

        Returns `given`, `work`, `rotation`: momentum (3,) [kg m/s] and work [J] of what supports or drives it; energy
        that its integration makes [J].
        """
        particles, exact, state = stepper.particles, stepper.totals.exact, self.state
        dim, at, whole, stage = particles.dim, stepper.place[rows], self.mass.mass, float(state[AHEAD])
        centre, q, seen, seen_rate = self._ahead(now, stage)
        self._keep_places(particles, rows)
        touched = rows[(stepper.rates[at, : dim + 1] != 0.0).any(axis=1)]
        mass, rates = particles["mass"][touched], stepper.rates[stepper.place[touched]]
        forces, torque = mass[:, None] * rates[:, :dim], np.zeros(3)
        force = np.array([*(exact(one) for one in forces.T), 0.0, 0.0][:3])
        if self.turns:
            moments = cross(in_space(stepper.rows[touched, :dim]) - centre, in_space(forces))
            spin = slots(dim)["R_SPIN"]
            if rates.shape[1] > spin and "TURN_RATE" in stepper.row_slots:
                axial = rates[:, spin : spin + (3 if dim == 3 else 1)]
                moments[:, 3 - axial.shape[1] :] += mass[:, None] * axial
            torque = np.array([exact(one) for one in moments.T])
        weight, tilt = self._pull(stepper, rows, centre)
        counted = exact(mass * rates[:, dim])
        self.find_relaxation(stepper, centre, q)
        before, rate, swing = self.velocity, self._rate(q, state[SPIN]), self._energy(q) - self._energy(state[TURN])
        state[FORCE], state[TORQUE] = self.moves @ (force + weight) / whole, self._project(torque + tilt)
        state[VELOCITY] += dt * state[FORCE]
        mean, after = 0.5 * (before + state[VELOCITY]), centre - state[CENTRE] + (dt - stage) * state[VELOCITY]
        if self.table is not None:
            after = in_space(self.table.displacement(now, now + dt)[None])[0]
            mean, state[VELOCITY] = after / dt, in_space(self.table.velocity(now + dt)[None])[0]
        state[SPIN] += dt * state[TORQUE]
        mean_rate = 0.5 * (rate + self._rate(q, state[SPIN]))
        made = dt * float(force @ (mean - seen) + torque @ (mean_rate - seen_rate) - counted)
        made += float(weight @ (dt * mean - after))  # gravity does its work on the way
        state[CENTRE] += after
        energy, state[TURN] = self._energy(q), q
        state[TURN] = self._flow(dt - stage)
        gained = 0.5 * whole * float(state[VELOCITY] @ state[VELOCITY] - before @ before)
        work = gained - dt * float((force + weight) @ mean) if self.table is not None else 0.0
        given = whole * (state[VELOCITY] - before) - dt * (force + weight)
        return given, work, made + swing + self._energy(state[TURN]) - energy

    def _pull(self, stepper: Any, rows: np.ndarray, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the force (3,) [N] of gravity on the body at the stage, and its torque (3,) [N m] about `centre`."""
        gravity, dim, exact = stepper.gravity, stepper.particles.dim, stepper.totals.exact
        if gravity is None:
            return np.zeros(3), np.zeros(3)
        if gravity.kind == UNIFORM:
            return self.mass.mass * in_space(np.array([gravity.vector]))[0], np.zeros(3)
        x, mass = stepper.rows[rows, :dim], stepper.particles["mass"][rows]
        pulls = in_space(mass[:, None] * gravity.acceleration(x))
        tilt = cross(in_space(x) - centre, pulls) if self.turns else np.zeros((1, 3))
        return np.array([exact(one) for one in pulls.T]), np.array([exact(one) for one in tilt.T])

    def note_contact(self, stepper: Any, rows: np.ndarray) -> None:
        """Note which particles are near others, and where those lie, before other uses of the sorted rows."""
        pairs, dim = stepper.pairs, stepper.particles.dim
        if "N_RAW" in pairs.slots:
            first = pairs.slots["N_RAW"]
            normal = pairs.sorted[stepper.place[rows], first : first + dim]
            near = normal.any(axis=1)
            self._near = rows[near], in_space(normal[near])

    def find_relaxation(self, stepper: Any, centre: np.ndarray, q: np.ndarray) -> None:
        """Find the rate [1/s] at which contact changes its velocity: the sum of A Z (1/M + r_n^2/J)."""
        if self._near is None:
            return
        (rows, normal), dim = self._near, stepper.particles.dim
        size = np.sqrt((normal * normal).sum(axis=1))
        normal = normal / size[:, None]
        weights = (multiply_rows(self.moves, normal) * normal).sum(axis=1) / self.mass.mass
        if self.turns:
            arms = cross(in_space(stepper.rows[rows, :dim]) - centre, normal)
            arms = multiply_rows(rotation(q).T, arms) if self.axis is None else arms * self.axis
            weights = weights + (arms * arms / self.inertia).sum(axis=1)
        area = 2.0 * stepper.particles["mass"][rows] / stepper.particles["density"][rows] * size
        self.state[RELAXATION] = self._impedance * float(stepper.totals.exact(area * weights))

    def _keep_places(self, particles: Particles, rows: np.ndarray) -> None:
        """Note the places of the particles in the body, from their positions."""
        self._places = self._from_centre(particles["position"][rows])
        if self.turns:
            self._places = multiply_rows(rotation(self.state[TURN]).T, self._places)

    def _from_centre(self, x: np.ndarray) -> np.ndarray:
        """Return positions (n, dim) [m] from the centre on, with three components where the body turns."""
        return np.asarray(in_space(x) - self.state[CENTRE] if self.turns else x - self.state[CENTRE][: x.shape[1]])

    def place(self, stepper: Any, rows: np.ndarray, now: float, stage: float) -> np.ndarray:
        """Write the motion of the body at `now` + `stage` [s]; return its energy [J] and momentum (dim,) [kg m/s]."""
        particles, state, dim = stepper.particles, self.state, stepper.particles.dim
        turned = rotation(state[TURN]) if self.turns else None
        here = slice(0, 3 if self.turns else dim)
        if self._places is not None:  # a step was completed
            r = self._places if turned is None else multiply_rows(turned, self._places)
            particles["position"][rows] = (state[CENTRE][here] + r)[:, :dim]
        r = self._from_centre(particles["position"][rows])
        velocity, rate = state[VELOCITY], self.angular_velocity
        particles["velocity"][rows] = (velocity + cross(rate[None], r) if self.turns else velocity)[..., :dim]
        centre, q, velocity, rate = self._ahead(now, stage)
        if turned is not None:
            r = multiply_rows(rotation(q), multiply_rows(turned.T, r))
            velocity = velocity + cross(rate[None], r)
        first, to = stepper.row_slots["U"], stepper.row_slots.get("TURN_RATE")
        stepper.rows[rows, :dim] = (centre[here] + r)[:, :dim]
        stepper.rows[rows, first : first + dim] = velocity[..., :dim]
        if to is not None:
            stepper.rows[rows, to : to + 2 * dim - 3] = rate if dim == 3 else rate[2]
        state[AHEAD], self._places = stage, None
        u, whole = state[VELOCITY], self.mass.mass
        return np.array([0.5 * whole * float(u @ u) + self._energy(state[TURN]), *(whole * u[:dim])])
