"""Forces at faces: pressures over time, and open edges, through which waves leave.

A face gives each particle a of its outermost row, with the share A_a of the face and the outward normal n, the force

    F_a = A_a [t0 - p(t) n - Z_n (u - u0)_n n - Z_t (u - u0)_t]

A pressure load has only p. A viscous edge has the initial traction t0 and velocity u0, and the impedances rho c_l and
rho c_t: it absorbs plane waves of normal incidence, and most of the energy of others.

In contact SPH an ambient layer in the initial state continues the body beyond the edge, as deep as the kernel support.
It has the impedances of its partner a in a pair, no slopes, and the traction of an outgoing wave in place of
Z (u0 - u_a) (`sph.terms.riemann_solver.outgoing_jump`). For a wave along the normal of the edge then

    t* = (t_a + t0)/2 + (t_a - t0)/2 = t_a,        u* = u_a

so that nothing is reflected, for any direction of the pair. Positions of the layer follow the mean displacement of the
particles beside the edge. Momentum and energy that its particles would receive from their pairs are those that leave.

Source: Lysmer & Kuhlemeyer 1969 (viscous edge).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from hvisph.sph.neighbours.ghost_rows import Plane

from .prescribed_motion import Motion

# Strength [Pa]: its partner in a pair is the weaker one.
UNLIMITED = 1e30
# A row that moves faster than this share of the speed of sound for so many transit times is under a lasting load.
STEADY, TRANSITS = 1e-3, 10.0
# Rows and columns of the stress whose components the field of deviators has.
COMPONENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@dataclass(frozen=True)
class Face:
    """Particles behind a face."""

    numbers: np.ndarray  # permanent numbers (k,)
    areas: np.ndarray  # shares of the face (k,) [m^2]
    normal: np.ndarray  # outward normal (dim,)
    times: np.ndarray  # times of the pressures (m,) [s]
    pressures: np.ndarray  # (m,) [Pa]: linear between the times, constant beyond them
    impedances: np.ndarray | None = None  # of an edge: normal and tangential impedance (k, 2) [kg/(m^2 s)]
    velocity: np.ndarray | None = None  # of an edge: velocity of the start (k, dim) [m/s]
    lag: float = 0.0  # distance over which the velocity of the face is extrapolated from that of the particles [m]

    def tractions(self, time: float, u: np.ndarray, indices: np.ndarray, t0: np.ndarray) -> np.ndarray:
        """Return tractions (k, dim) [Pa] on particles `indices` at a time [s] by velocities and initial tractions."""
        pressure = float(np.interp(time, self.times, self.pressures))
        if self.impedances is None or self.velocity is None:
            return np.tile(-pressure * self.normal, (len(u), 1))
        du = u - self.velocity[indices]
        normal = (du @ self.normal)[:, None] * self.normal
        z = self.impedances[indices]
        return np.asarray(t0 - z[:, :1] * normal - z[:, 1:] * (du - normal))


@dataclass(frozen=True)
class AmbientLayer:
    """Particles beyond the edges of contact SPH."""

    numbers: np.ndarray  # permanent numbers (k,)
    positions: np.ndarray  # places at the start (k, dim) [m]
    sources: np.ndarray  # permanent numbers of the particles beside the edges (m,)
    source_positions: np.ndarray  # their places at the start (m, dim) [m]
    starts: np.ndarray  # first term of the mean of each particle (k,)
    terms: np.ndarray  # index among the sources of each term (n,)
    weights: np.ndarray  # weight of each term (n,)
    signs: np.ndarray  # signs of each term (n, dim), negative along the normal of a mirror
    normals: np.ndarray  # outward normal of the edge before each particle (k, dim)

    def follow(self, positions: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """Return positions (k, dim) [m] from those of the sources; planes of symmetry have `offset` (dim,) [m]."""
        displacement = (positions - self.source_positions)[self.terms] * self.signs + (1.0 - self.signs) * offset
        return np.asarray(self.positions + np.add.reduceat(displacement * self.weights[:, None], self.starts, axis=0))


@dataclass
class EdgeRow:
    """Particles beside an open edge, which a lasting load drives through it."""

    name: str  # of the edge in the case
    numbers: np.ndarray  # permanent numbers (k,)
    normal: np.ndarray  # outward normal (dim,)
    velocity: np.ndarray  # velocity at the start (k, dim) [m/s]
    sound_speed: float  # [m/s]
    transit: float  # time of sound through the body along the normal [s]
    start: float = -1.0  # time from which on the row has moved [s], below zero while it rests

    def watch(self, time: float, u: np.ndarray) -> None:
        """Note whether the row moves at a time [s] with velocities `u` (k, dim) [m/s]."""
        speed = abs(float(((u - self.velocity) @ self.normal).mean()))
        if not speed > STEADY * self.sound_speed:
            self.start = -1.0
        elif self.start < 0.0:
            self.start = time


@dataclass
class MovingPlane:
    """A plane of symmetry that moves: its images have the velocity 2 w - u_n along its normal."""

    plane: Plane
    motion: Motion  # of one component, the velocity w along the normal
    place: float  # coordinate at the time `start` [m]
    start: float  # [s]

    def place_at(self, time: float) -> float:
        """Return the coordinate of the plane [m] at a time [s]."""
        return self.place + float(self.motion.displacement(self.start, time)[0])

    def move(self, time: float, ahead: float) -> None:
        """Put the plane where it is `ahead` [s] of a time [s]."""
        self.plane.at = self.place_at(time + ahead)
        self.plane.ahead = self.plane.at - self.place_at(time)


class Boundaries:
    """Faces, edges and moving planes of symmetry of a run.

    `work` [J] and `momentum` (dim,) [kg m/s] are what the pressures gave in the last step, `edge_energy` [J] and
    `edge_momentum` (dim,) what left through the edges in it; `speeds` are axes and velocities [m/s] of the moving
    planes at its stage; `time` [s] is that of the state. `share` finds particles
    by their numbers (`parallel.collectives`).
    """

    share: Any

    def __init__(self, faces: tuple[Face, ...], layer: AmbientLayer | None, dim: int, start: float = 0.0):
        self.moving: tuple[MovingPlane, ...] = ()
        self.edge_rows: tuple[EdgeRow, ...] = ()
        self.faces, self.layer, self.time, self._ahead = faces, layer, start, 0.0
        self.work, self.momentum, self.edge_energy, self.edge_momentum = 0.0, np.zeros(dim), 0.0, np.zeros(dim)
        self.speeds: list[tuple[int, float]] = []
        self._is_paused = False
        self._face_forces: list[tuple[bool, np.ndarray, np.ndarray]] = []
        self._layer_rates = (np.zeros((0, dim)), np.zeros(0))
        self._t0: list[np.ndarray] = []

    @property
    def is_open(self) -> bool:
        """Whether there is an edge."""
        return self.layer is not None or any(face.impedances is not None for face in self.faces)

    def drifting(self) -> list[str]:
        """Return the names of the edges through which a lasting load drives a body."""
        rows = [row for row in self.edge_rows if 0.0 <= row.start < self.time - TRANSITS * row.transit]
        return list(dict.fromkeys(row.name for row in rows))

    def wait(self, paused: bool) -> None:
        """Stop time and moving planes (`paused`), or release them."""
        self._is_paused, self._ahead = paused, 0.0
        for moving_plane in self.moving:
            moving_plane.plane.velocity = 0.0 if paused else float(moving_plane.motion.velocity(self.time)[0])

    def act(self, stepper: Any) -> None:
        """Add the forces of the faces to the rates of the stage, and take from them what the layer would receive."""
        if not self._t0:
            self._t0 = [self._initial_traction(stepper, face) for face in self.faces]
        particles, dim, self._face_forces = stepper.particles, stepper.particles.dim, []
        first = stepper.row_slots["U"]
        for face, t0 in zip(self.faces, self._t0, strict=True):
            rows, indices = self._locate(face.numbers)
            u, places = stepper.rows[rows, first : first + dim], stepper.place[rows]
            if face.lag:
                gradient = stepper.rates[places, dim + 2 : dim + 2 + dim * dim].reshape(-1, dim, dim)
                u = u + face.lag * (gradient @ face.normal)
            force = face.areas[indices, None] * face.tractions(self.time + self._ahead, u, indices, t0[indices])
            mass = particles["mass"][rows]
            mask = mass > 0.0  # else it has left the domain
            force[~mask] = 0.0
            stepper.rates[places, :dim] += force / np.where(mask, mass, 1.0)[:, None]
            self._face_forces.append((face.impedances is not None, force, rows))
        if self.layer is not None:
            rows, _ = self._locate(self.layer.numbers)
            rates, mass = stepper.rates[stepper.place[rows]], particles["mass"][rows]
            power = rates[:, dim] + (rates[:, :dim] * stepper.rows[rows, first : first + dim]).sum(axis=1)
            self._layer_rates = mass[:, None] * rates[:, :dim], mass * power
            stepper.rates[stepper.place[rows]] = 0.0

    def begin(self, stepper: Any, dt: float) -> None:
        """Add up work and momentum of the last forces over the step `dt` [s], and correct the power of the particles.

        The work is done at the mean velocity of the step, the power was that at the velocity of the stage.
        """
        exact, particles, dim = stepper.totals.exact, stepper.particles, stepper.particles.dim
        first, sums = stepper.row_slots["U"], np.zeros((2, 1 + dim))
        for is_edge, force, rows in self._face_forces:
            places, mass = stepper.place[rows], particles["mass"][rows]
            a = stepper.rates[places, :dim]
            if stepper.gravity is not None:
                a = a + stepper.gravity.acceleration(stepper.rows[rows, :dim])
            mean = particles["velocity"][rows] + 0.5 * dt * a
            du = mean - stepper.rows[rows, first : first + dim]
            stepper.rates[places, dim] += (force * du).sum(axis=1) / np.where(mass > 0.0, mass, 1.0)
            sums[int(is_edge)] += _sums(exact, (force * mean).sum(axis=1), force)
        if self.layer is not None:
            sums[1] -= _sums(exact, self._layer_rates[1], self._layer_rates[0])
        sums *= dt
        self.work, self.momentum = float(sums[0, 0]), sums[0, 1:]
        self.edge_energy, self.edge_momentum = float(-sums[1, 0]), -sums[1, 1:]
        if self._is_paused:
            return
        self.time += dt
        self.speeds = [(moving_plane.plane.axis, moving_plane.plane.velocity) for moving_plane in self.moving]
        for row in self.edge_rows:
            row.watch(self.time, self.share.gather_values(row.numbers, particles["velocity"]))
        for moving_plane in self.moving:  # particles beyond the plane receive it, as in the pairs of the next stage
            moving_plane.plane.velocity = float(moving_plane.motion.velocity(self.time)[0])

    def finish(self, stepper: Any, stage: float) -> None:
        """Write the positions of the layer into the state, and into the packed rows, which are `stage` [s] ahead."""
        if not self._is_paused:
            self._ahead = stage
            for moving_plane in self.moving:
                moving_plane.move(self.time, stage)
        if self.layer is None:
            return
        rows, indices = self._locate(self.layer.numbers)
        dim, slots, gather = stepper.particles.dim, stepper.row_slots, self.share.gather_values
        position, stage_x = stepper.particles["position"], stepper.rows[:, :dim]
        offsets = np.zeros((2, dim))
        for moving_plane in self.moving:
            offsets[:, moving_plane.plane.axis] = moving_plane.plane.at - moving_plane.place
            offsets[0, moving_plane.plane.axis] -= moving_plane.plane.ahead
        position[rows] = self.layer.follow(gather(self.layer.sources, position), offsets[0])[indices]
        stepper.rows[rows, :dim] = self.layer.follow(gather(self.layer.sources, stage_x), offsets[1])[indices]
        normals = stepper.rows[:, slots["AMBIENT"] : slots["AMBIENT"] + dim]
        normals[:] = 0.0  # nothing else writes them, and sorting moves rows
        normals[rows] = self.layer.normals[indices]
        for name, value in (("LATTICE_ORDER", 0.0), ("TENSION_LIMIT", UNLIMITED), ("SHEAR_LIMIT", UNLIMITED)):
            if name in slots:
                stepper.rows[rows, slots[name]] = value

    def history(self) -> dict[str, np.ndarray]:
        """Return the times of state and stage, velocities of planes, and since when rows move, by name."""
        speeds, starts = (
            [moving_plane.plane.velocity for moving_plane in self.moving],
            [row.start for row in self.edge_rows],
        )
        return {"boundaries": np.array([self.time, self._ahead, *speeds, *starts])}

    def restore(self, history: dict[str, np.ndarray]) -> None:
        """Restore what `history` returned."""
        self.time, self._ahead, *values = (float(value) for value in history["boundaries"])
        for row, start in zip(self.edge_rows, values[len(self.moving) :], strict=True):
            row.start = start
        for moving_plane, velocity in zip(self.moving, values, strict=False):
            moving_plane.plane.velocity = velocity
            moving_plane.move(self.time, self._ahead)

    def _locate(self, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the rows of the particles of this process, and their indices among `numbers`."""
        rows = self.share.find_rows(numbers)
        indices = np.flatnonzero(rows >= 0)
        return rows[indices], indices

    def _initial_traction(self, stepper: Any, face: Face) -> np.ndarray:
        """Return the tractions of the initial stress on a face (k, dim) [Pa]."""
        particles, axis = stepper.particles, int(np.abs(face.normal).argmax())
        pressure = self.share.gather_values(face.numbers, stepper.pressures)
        deviator = self.share.gather_values(face.numbers, particles["deviator"])
        traction = -pressure[:, None] * face.normal
        for column, pair in enumerate(COMPONENTS[: deviator.shape[1]]):
            if axis in pair and max(pair) < particles.dim:
                component = pair[1] if pair[0] == axis else pair[0]
                traction[:, component] += deviator[:, column] * face.normal[axis]
        return np.asarray(traction)


def _sums(exact: Any, power: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return the exact sums of powers (k,) and forces (k, dim)."""
    return np.array([exact(power), *(exact(component) for component in force.T)])
