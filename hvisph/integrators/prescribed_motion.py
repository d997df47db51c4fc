"""Prescribed motion of clamped particles: a velocity over time, and the work that it takes.

In a step from t to t + dt the particles of a group move by the integral of their table v(t), for any step. If other
particles exert the force F on the group, the drive does the work

    W = M (v(t + dt)^2 - v(t)^2)/2 - F . integral of v

and adds the momentum M (v(t + dt) - v(t)) - dt F. With W the energy of all particles is balanced to round-off.

A rigid body is a group, too (`integrators.rigid_body`). Its particles have neither stress nor strain, and an impedance
far above that of any material: the Riemann problem of a pair with one of them then has the velocity of the body and the
traction of a rigid wall, which acts on the body. In packed rows, all rigid particles have the body number `RIGID`.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from hvisph.core.particles import FLAGS, Particles
from hvisph.sph.contact.contact_normal import RIGID

from .rigid_body import RigidMotion
from .sums import KINETIC, MOMENTUM

# Bits of the column FLAGS from this one on are the group of a driven particle, 0 for none.
GROUP_SHIFT = 2
# Group of the particles of the first rigid body; clamps have those below.
RIGID_GROUP = 1000
# Group of the particles of an ambient layer beyond an open edge.
LAYER_GROUP = 2000
# Impedance of rigid particles [kg/(m^2 s)] with pairs in double and in single precision: a contact differs from a rigid
# wall by round-off only. Products with powers of two are exact, and their squares are within range.
RIGID_IMPEDANCES = 2.0**83, 2.0**56
# Shear strength [Pa].
UNLIMITED = 1e30
# Speed of its signals [m/s]: it limits no step.
SLOWEST_SIGNAL = 1e-30


@dataclass(frozen=True)
class Motion:
    """Velocities (k, dim) [m/s] of a `group` at times (k,) [s]: linear between, constant beyond, or jumps."""

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
        times = self.times[(self.times > first) & (self.times < last)]
        ends = np.unique(np.concatenate([[first], times, [last]]))
        result = np.zeros(self.velocities.shape[1])
        for start, end in pairwise(ends):  # linear within each: the mid-point rule is exact
            result += (end - start) * self.velocity(0.5 * (start + end))
        return result


def is_rigid_particle(tags: np.ndarray) -> np.ndarray:
    """Return which particles with these tags (n, 4) belong to a rigid body (n,)."""
    group = tags[:, FLAGS] >> GROUP_SHIFT
    return np.asarray((group >= RIGID_GROUP) & (group < LAYER_GROUP))


class PrescribedMotion:
    """Groups of driven particles of a run, and rigid bodies.

    `work` [J] and `momentum` (dim,) [kg m/s] are what the last step took, `rotation` [J] is the energy that the
    integration of rigid bodies made in it, `time` [s] that of the state.
    """

    def __init__(self, motions: tuple[Motion | RigidMotion, ...], dim: int):
        self._motions, self.time, self.work, self.momentum = motions, 0.0, 0.0, np.zeros(dim)
        self.rotation, self._excess = 0.0, np.zeros(1 + dim)
        self._members: dict[int, np.ndarray] = {}  # rows of each group, as long as the particles lie as they do

    @property
    def rigid(self) -> list[RigidMotion]:
        """Rigid bodies."""
        return [motion for motion in self._motions if isinstance(motion, RigidMotion)]

    def look_ahead(self, stepper: Any) -> None:
        """Find the step limit of rigid bodies for the first step, from the first evaluation."""
        for motion in self.rigid:
            motion.find_relaxation(stepper)

    def note_contacts(self, stepper: Any) -> None:
        """Record the particles in contact with rigid bodies, after an evaluation."""
        self._members.clear()
        for motion in self.rigid:
            motion.note_contact(stepper, self._rows(stepper.particles, motion), self.time)

    def begin(self, stepper: Any, dt: float) -> None:
        """Give all groups their mean velocity of the step `dt` [s], and find work and momentum by the last forces."""
        self._members.clear()
        particles, exact = stepper.particles, stepper.totals.exact
        mass, dim, end = particles["mass"], particles.dim, self.time + dt
        self.work, self.rotation, self.momentum, self._excess = 0.0, 0.0, np.zeros(dim), np.zeros(1 + dim)
        for motion in self._motions:
            rows = self._rows(particles, motion)
            if isinstance(motion, RigidMotion):
                impulse, work, rotation = motion.kick(stepper, rows, self.time, dt)
                self.momentum += impulse[:dim]
                self.work += work
                self.rotation += rotation
                continue
            total = exact(mass[rows])
            forces = mass[rows, None] * stepper.rates[stepper.place[rows], :dim]
            force = np.array([exact(component) for component in forces.T])
            u_start, u_end = motion.velocity(self.time), motion.velocity(end)
            mean = motion.displacement(self.time, end) / dt
            self.work += float(0.5 * total * (u_end @ u_end - u_start @ u_start) - dt * (force @ mean))
            self.momentum += total * (u_end - u_start)
            self._excess[0] += 0.5 * total * (u_end @ u_end - mean @ mean)
            self._excess[1:] += total * (u_end - mean)
            particles["velocity"][rows] = mean
        self.time = end

    def hide_rigid(self, stepper: Any) -> None:
        """Set velocities and rates of rigid particles to zero while rows are packed, so that no sum counts them."""
        for motion in self.rigid:
            rows = self._rows(stepper.particles, motion)
            stepper.rates[stepper.place[rows]] = 0.0
            stepper.particles["velocity"][rows] = 0.0

    def finish(self, stepper: Any, stage: float, repack: bool) -> None:
        """Set the velocity of all groups; in packed rows that `stage` [s] later. `repack`: rows are packed anew.

        The update packs no rows of rigid particles when it completes a step: they stay as they were.
        """
        particles, first = stepper.particles, stepper.row_slots["U"]
        for motion in self._motions:
            rows = self._rows(particles, motion)
            if isinstance(motion, RigidMotion):
                if repack:
                    self._show_rigid(stepper, rows)
                self._excess += motion.place(stepper, rows, self.time, stage)
                continue
            particles["velocity"][rows] = motion.velocity(self.time)
            stepper.rows[rows, first : first + particles.dim] = motion.velocity(self.time + stage)

    def _show_rigid(self, stepper: Any, rows: np.ndarray) -> None:
        """Write impedance, strength and body of rigid particles into their packed rows, which have no stress."""
        slots, packed, impedance = stepper.row_slots, stepper.rows, RIGID_IMPEDANCES[stepper.pairs.single]
        if "ZN" in slots:
            packed[rows, slots["ZN"]] = packed[rows, slots["ZT"]] = impedance
        if "Z_SQUARED" in slots:
            packed[rows, slots["Z_SQUARED"] : slots["Z_SQUARED"] + stepper.particles.dim] = impedance**2
        if "SHEAR_LIMIT" in slots:  # that of the other side counts
            packed[rows, slots["SHEAR_LIMIT"]] = UNLIMITED
        if "BODY" in slots:
            packed[rows, slots["BODY"]] = RIGID
        stepper.pressures[rows], stepper.signals[rows] = 0.0, SLOWEST_SIGNAL

    def complete_sums(self, sums: np.ndarray) -> None:
        """Correct `sums`, computed with mean velocities of a step, to the velocities at its end."""
        sums[KINETIC] += self._excess[0]
        sums[MOMENTUM : MOMENTUM + len(self.momentum)] += self._excess[1:]

    def forget_step(self) -> None:
        """Forget the correction of the last step: sums are those of the state."""
        self._members.clear()
        self._excess[:] = 0.0

    def history(self) -> dict[str, np.ndarray]:
        """Return time, correction of the sums, and the states of rigid bodies."""
        states = [motion.state for motion in self.rigid]
        return {"prescribed_motion": np.concatenate([[self.time], self._excess, *states])}

    def restore(self, history: dict[str, np.ndarray]) -> None:
        """Restore what `history` returned."""
        values = history["prescribed_motion"]
        self.time, self._excess = float(values[0]), values[1 : 1 + len(self._excess)].copy()
        numbers = values[1 + len(self._excess) :]
        for motion in self.rigid:
            motion.state, numbers = numbers[: len(motion.state)].copy(), numbers[len(motion.state) :]

    def _rows(self, particles: Particles, motion: Motion | RigidMotion) -> np.ndarray:
        if motion.group not in self._members:
            self._members[motion.group] = np.flatnonzero(particles.tags[:, FLAGS] >> GROUP_SHIFT == motion.group)
        return self._members[motion.group]
