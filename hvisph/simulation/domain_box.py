"""Domain box: particles that leave it are retired; their mass, momentum and energy remain in the balance.

A retired particle keeps its place in the arrays, without mass, at rest, at a distant position without neighbours.
Snapshots omit it.
"""

import numpy as np

from hvisph.case.output import BoxRegion
from hvisph.compiler.exact_sum import decode_sum, encode_terms
from hvisph.core.particles import CLAMPED, FLAGS, RETIRED
from hvisph.diagnostics.budgets import Budget
from hvisph.integrators.sums import INTERNAL, MOMENTUM, SLIPPING, SUPPORT
from hvisph.materials.slots import RHO0
from hvisph.setup.build import Setup

# From the box to the first retired particle, in supports: more than particles move between two calls of `retire`.
PARKING_DISTANCE = 64.0
PARKING_SPACING = 3.0  # of retired particles, in supports; odd, so that they spread evenly over the periodic cells


class Domain:
    """Box that particles may not leave: the case's `domain`, None for none."""

    def __init__(self, setup: Setup, box: BoxRegion | None):
        self._setup = setup
        dim = setup.particles.dim
        self._low, self._high = np.full(dim, -np.inf), np.full(dim, np.inf)
        for corner, limit in ((box.min, self._low), (box.max, self._high)) if box is not None else ():
            for axis, value in enumerate(corner):
                if value is not None:
                    limit[axis] = value
        sides = [
            (axis, limit[axis], sign)
            for limit, sign in ((self._low, -1.0), (self._high, 1.0))
            for axis in range(dim)
            if np.isfinite(limit[axis])
        ]
        self._parking = sides[0] if sides else None

    def _is_outside(self) -> np.ndarray:
        position = self._setup.particles["position"]
        return np.asarray(np.logical_or(position < self._low, position > self._high).any(axis=1))

    def retire(self, budget: Budget, following: float) -> int:
        """Retire the free particles outside, add them to `budget`, predict stage `following`; return their number."""
        if self._parking is None:
            return 0
        setup = self._setup
        particles, stepper = setup.particles, setup.stepper
        outside = np.flatnonzero(self._is_outside() & ((particles.tags[:, FLAGS] & (CLAMPED | RETIRED)) == 0))
        share = setup.subdomain
        count = int(share.total(np.array([len(outside)]))[0])
        if not count:
            return 0

        def total(terms: np.ndarray, unit: float) -> np.ndarray:
            return decode_sum(share.total(encode_terms(terms, unit)), unit)

        mass, velocity = particles["mass"][outside], particles["velocity"][outside]
        budget.retired[0] += count
        units = stepper.totals.units
        budget.retired[1] += total(mass, units[MOMENTUM])
        budget.retired[2 : 2 + particles.dim] += total(mass[:, None] * velocity, units[MOMENTUM])
        energy = 0.5 * (velocity**2).sum(axis=1) + particles["internal_energy"][outside]
        if budget.gravity is not None:
            energy += budget.gravity.potential(particles["position"][outside])
        budget.retired[5] += total(mass * energy, units[INTERNAL])
        if particles.has_previous:  # the step under way still gives the others half of what the last forces did
            force = mass[:, None] * particles["previous_acceleration"][outside]
            power = mass * particles["previous_power"][outside]
            power += (force * particles["previous_velocity"][outside]).sum(axis=1)
            budget.pending[: particles.dim] += 0.5 * total(force, units[SUPPORT])
            budget.pending[3] += 0.5 * total(power, units[SLIPPING])
        length = particles["smoothing_length"][outside]
        particles.begin(outside)
        particles["smoothing_length"][outside] = length
        particles["density"][outside] = stepper.table[particles.material[outside], RHO0]
        particles["position"][outside] = self._parking_places(particles.id[outside])
        particles.tags[outside, FLAGS] |= RETIRED
        stepper.rates[stepper.place[outside]] = 0.0
        stepper.predict(following)
        return count

    def _parking_places(self, number: np.ndarray) -> np.ndarray:
        """Return the positions (n, dim) [m] of retired particles by their permanent numbers."""
        assert self._parking is not None
        axis, edge, sign = self._parking
        particles, support = self._setup.particles, self._setup.stepper.support
        side = int(np.ceil(self._setup.subdomain.count ** (1.0 / particles.dim)))
        places = np.empty((len(number), particles.dim))
        index = number.astype(np.int64)
        for k in range(particles.dim):
            places[:, k] = PARKING_SPACING * support * (index % side)
            index //= side
        if particles.kinematics.axisymmetric:  # the second coordinate is a radius
            places[:, 1] += PARKING_DISTANCE * support
        places[:, axis] = edge + sign * (PARKING_DISTANCE * support + places[:, axis])
        return places
