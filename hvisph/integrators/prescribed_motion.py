"""Prescribed motion of clamped particles: a velocity over time, and the work that it takes.

Over a step from t to t + dt the particles of a group move by the integral of their table v(t), whatever the step. With
the forces F that the others exert on the group, what drives it does the work

    W = M (v(t + dt)^2 - v(t)^2)/2 - F . integral of v

and gives it the momentum M (v(t + dt) - v(t)) - dt F. With W the energy of all particles is balanced to round-off.

A rigid body is a group, too, with the velocity M dU/dt = F along its free axis. Its particles have neither stress nor
strain, and an impedance beyond that of any material: the Riemann problem of a pair with one of them then has the
velocity of the body and the traction of a rigid wall, which is returned to it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from hvisph.core.particles import FLAGS
from hvisph.sph.neighbours.particle_layout import slots

from .sums import KINETIC, MOMENTUM

# Bits of the column FLAGS from this one on are the group of a driven particle, 0 for none.
GROUP_SHIFT = 2
# Group of the particles of the rigid body; clamps have those below.
RIGID_GROUP = 1000
# Impedance of a rigid particle over that of its material: what a contact differs from that with a rigid wall.
STIFFER = 1e9
# Shear that it bears [Pa].
UNLIMITED = 1e30


@dataclass(frozen=True)
class Motion:
    """Velocity of the particles of `group`: `velocities` (k, dim) [m/s] at `times` (k,) [s].

    It is linear between the times and constant beyond them; two rows at one time are a jump.
    """

    group: int
    times: np.ndarray
    velocities: np.ndarray

    def velocity(self, time: float) -> np.ndarray:
        """Return the velocity (dim,) [m/s] at a time [s]; at a jump that after it."""
        times, values = self.times, self.velocities
        k = int(np.searchsorted(times, time, side="right"))
        if k in (0, len(times)):
            return np.asarray(values[min(k, len(times) - 1)])
        share = (time - times[k - 1]) / (times[k] - times[k - 1])
        return np.asarray(values[k - 1] + share * (values[k] - values[k - 1]))

    def displacement(self, first: float, last: float) -> np.ndarray:
        """Return the displacement (dim,) [m] between two times [s]: the integral of the velocity."""
        inside = self.times[(self.times > first) & (self.times < last)]
        ends = np.unique(np.concatenate([[first], inside, [last]]))
        moved = np.zeros(self.velocities.shape[1])
        for start, end in pairwise(ends):  # linear within each: the mid-point rule is exact
            moved += (end - start) * self.velocity(0.5 * (start + end))
        return moved


@dataclass
class RigidMotion:
    """Motion of the rigid body: `velocity_now` (dim,) [m/s], `free` (dim,) 1 along its axis; `rate` as of last."""

    group: int
    velocity_now: np.ndarray
    free: np.ndarray

    def __post_init__(self) -> None:
        """Begin without acceleration."""
        self.rate = np.zeros(len(self.free))


class PrescribedMotion:
    """Groups of driven particles of a run.

    `work` [J] and `momentum` (dim,) [kg m/s] are what the last step took; `time` [s] is that of the state.
    """

    def __init__(self, motions: tuple[Motion | RigidMotion, ...], dim: int):
        self._motions, self.time, self.work, self.momentum = motions, 0.0, 0.0, np.zeros(dim)
        self._excess, self._packed = np.zeros(1 + dim), False
        self._kept: np.ndarray | None = None

    def begin(self, stepper: Any, dt: float) -> None:
        """Give all groups their mean velocity of the step `dt` [s], and find work and momentum by the last forces."""
        particles, exact = stepper.particles, stepper.totals.exact
        mass, dim, end = particles["mass"], particles.dim, self.time + dt
        self.work, self.momentum, self._excess = 0.0, np.zeros(dim), np.zeros(1 + dim)
        for motion in self._motions:
            rows = self._rows(particles, motion)
            whole = exact(mass[rows])
            forces = mass[rows, None] * stepper.rates[stepper.place[rows], :dim]
            force = np.array([exact(component) for component in forces.T])
            if isinstance(motion, RigidMotion):
                motion.rate = motion.free * force / whole
                before, after = motion.velocity_now, motion.velocity_now + dt * motion.rate
                mean, motion.velocity_now = 0.5 * (before + after), after
            else:
                before, after = motion.velocity(self.time), motion.velocity(end)
                mean = motion.displacement(self.time, end) / dt
            self.work += float(0.5 * whole * (after @ after - before @ before) - dt * (force @ mean))
            self.momentum += whole * (after - before)
            self._excess[0] += 0.5 * whole * (after @ after - mean @ mean)
            self._excess[1:] += whole * (after - mean)
            particles["velocity"][rows] = mean
        self.time = end

    def finish(self, stepper: Any, stage: float) -> None:
        """Give all groups their velocity, that of the time `stage` [s] ahead in the packed rows."""
        particles, first = stepper.particles, stepper.pairs.slots["U"]
        for motion in self._motions:
            rows = self._rows(particles, motion)
            if isinstance(motion, RigidMotion):
                particles["velocity"][rows] = motion.velocity_now
                self._show_rigid(stepper, rows)
                moved = stage * (motion.velocity_now + 0.5 * stage * motion.rate)
                stepper.rows[rows, : particles.dim] = particles["position"][rows] + moved
                stepper.rows[rows, first : first + particles.dim] = motion.velocity_now + stage * motion.rate
                continue
            particles["velocity"][rows] = motion.velocity(self.time)
            stepper.rows[rows, first : first + particles.dim] = motion.velocity(self.time + stage)

    def free_of_strain(self, stepper: Any) -> None:
        """Take the strain from the rates of rigid particles, and keep their packed rows, before these are packed."""
        for motion in self._motions:
            if isinstance(motion, RigidMotion):
                rows, places = self._rows(stepper.particles, motion), slots(stepper.particles.dim)
                self._kept = stepper.rows[rows].copy()
                of_strain = [
                    *range(places["R_GRADIENT"], places["R_SLIP"]),
                    *range(places["R_HOOP"], stepper.rates.shape[1]),
                ]
                stepper.rates[np.ix_(stepper.place[rows], of_strain)] = 0.0

    def _show_rigid(self, stepper: Any, rows: np.ndarray) -> None:
        """Write the packed rows of rigid particles: those of the start, which has no stress, with their impedance."""
        if self._packed:
            stepper.rows[rows] = self._kept
        else:
            at = stepper.pairs.slots
            for name, width in (("ZN", 1), ("ZT", 1), ("Z_SQUARED", {1: 1, 2: 3, 3: 6}[stepper.particles.dim])):
                if name in at:
                    stepper.rows[rows, at[name] : at[name] + width] *= STIFFER**2 if width > 1 else STIFFER
            if "SHEAR_LIMIT" in at:  # that of the other side counts
                stepper.rows[rows, at["SHEAR_LIMIT"]] = UNLIMITED
            self._packed = True
        stepper.pressures[rows] = 0.0

    def complete_sums(self, sums: np.ndarray) -> None:
        """Add to `sums`, which counted the mean velocities of a step, what those at its end have more."""
        sums[KINETIC] += self._excess[0]
        sums[MOMENTUM : MOMENTUM + len(self.momentum)] += self._excess[1:]

    def forget_step(self) -> None:
        """Take the sums for those of the state, not of a step."""
        self._excess[:] = 0.0

    def history(self) -> dict[str, np.ndarray]:
        """Return time and correction of the sums, by name."""
        return {"prescribed_motion": np.array([self.time, *self._excess, *self._rigid_state()])}

    def restore(self, history: dict[str, np.ndarray]) -> None:
        """Restore what `history` returned."""
        kept = history["prescribed_motion"]
        self.time, self._excess = float(kept[0]), kept[1 : 1 + len(self._excess)].copy()
        numbers = kept[1 + len(self._excess) :]
        for motion in self._motions:
            if isinstance(motion, RigidMotion):
                motion.velocity_now, motion.rate = np.split(numbers.copy(), 2)

    def _rigid_state(self) -> list[float]:
        rigid = [motion for motion in self._motions if isinstance(motion, RigidMotion)]
        return [float(one) for motion in rigid for one in (*motion.velocity_now, *motion.rate)]

    @staticmethod
    def _rows(particles: Any, motion: Motion | RigidMotion) -> np.ndarray:
        return np.flatnonzero(particles.tags[:, FLAGS] >> GROUP_SHIFT == motion.group)
