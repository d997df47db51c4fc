"""Reference configuration: creation, removal of particles, and update to present positions.

remove  the list of a particle is cut. Its chi is multiplied by det F(list before)/det F(list after) at the same
        positions, so that J = chi det F is continuous. A neighbour whose remaining list spans no volume is removed,
        too.
update  V0 = V0 J, X0 = x, new lists and corrections, chi = 1: density, stress and energy are continuous.

Removed particles stay out of the lists. The strain before an update is stored as a deformation gradient of the
reference, so that conversion by strain counts from the start of the run.
"""

from typing import Any

import numpy as np

from hvisph.core.particles import Particles
from hvisph.integrators.particle_steps import ON_AXIS
from hvisph.materials.material_table import Material
from hvisph.schemes.adaptive.passes import Loops, motion_width
from hvisph.sph.neighbours.ghost_rows import FixedCopies, Plane
from hvisph.sph.neighbours.particle_layout import RowLayout, aligned_zeros
from hvisph.sph.neighbours.reference_neighbours import Reference
from hvisph.sph.neighbours.traversal import FAR

LARGEST_JUMP = 5.0  # largest ratio of det F before and after a list is cut; beyond it the list spans no volume
STAND_OFF = 1e-6  # particles stop so far before a plane of symmetry [h]


class ReferenceChanges:
    """Creation, cutting and renewal of the reference lists of `CompositeStepper`."""

    particles: Particles
    formulation: Any
    reference: Reference
    copies: FixedCopies
    rows_: np.ndarray
    _motions: np.ndarray
    layout: RowLayout
    slots: dict[str, int]
    sequence: np.ndarray
    h: float
    loose: np.ndarray
    swellings: np.ndarray
    f_start: np.ndarray
    volume: np.ndarray
    alone: np.ndarray
    latest: np.ndarray
    materials: list[Material]
    _hourglass_limits: list[tuple[float, str, int]]
    _numbers: np.ndarray
    _loops: Loops
    _moduli: np.ndarray
    _bodies_in_all: int
    _lagrangian: np.ndarray
    _tied: np.ndarray

    @property
    def dim(self) -> int:
        """Number of dimensions."""
        return self.particles.dim

    def any_process(self, condition: bool | np.bool_) -> bool:
        """Return whether a condition holds on any process."""
        return bool(condition) if self.copies.halo is None else self.copies.halo.any_process(bool(condition))

    def get_maxima(self, values: np.ndarray) -> np.ndarray:
        """Return the maximum of each float over all processes."""
        return values if self.copies.halo is None else self.copies.halo.get_maxima(values)

    def neighbours_of(self, mask: np.ndarray) -> np.ndarray:
        """Return which particles have one of `mask` (n,) among their reference neighbours (n,), bool."""
        return self.reference.neighbours_of(self.copies.extend_rows(mask))

    def _mirror(self) -> None:
        raise NotImplementedError

    def _build_reference(self) -> None:
        """Build lists, images and rows of the reference from positions, `volume` and `alone`."""
        particles, formulation, slots, dim = self.particles, self.formulation, self.slots, self.particles.dim
        count, kernel = particles.count, formulation.kernel
        reach = kernel.reach * self.h
        positions, numbers = self.copies.find(particles["reference_position"], self.sequence, reach, self.alone)
        rows, x0 = aligned_zeros(len(positions) + 1, self.layout.width), slots["X0"]
        rows[:count] = self.rows_[:count]
        rows[:-1, x0 : x0 + dim] = positions
        rows[-1, :dim] = rows[-1, x0 : x0 + dim] = FAR
        rows[-1, slots["RHO"]] = 1.0
        if "RING0" in slots:
            rows[:-1, slots["RING0"]] = np.copysign(self._ring_radius(positions), positions[:, 1])
        if "EM" in slots:
            rows[:-1, slots["EM"]] = self.copies.extend_rows(self._moduli[particles.material, 0])
        self.rows_, self._motions = rows, aligned_zeros(len(rows), motion_width(dim))
        bodies = particles.body.astype(np.int64)
        bodies[self.alone] = self._bodies_in_all + np.flatnonzero(self.alone)
        volume, bodies = self.copies.extend_rows(self.volume), self.copies.extend_rows(bodies)
        corrections = formulation.correction.shepard, formulation.correction.gradient
        self.reference = Reference(positions, volume, bodies, numbers, count, kernel, self.h, *corrections)
        # neighbours that move against each other under hourglass control, in the mean over directions; cuts soften it
        factors = [
            2.0 * formulation.hourglass * material.young_modulus / (dim * material.density)
            for material in self.materials
        ]
        self._hourglass_limits = self._oscillation_limits(
            "hourglass", np.array(factors)[particles.material] * self.reference.hourglass_sums
        )

    def _oscillation_limits(self, name: str, omega: np.ndarray) -> list[tuple[float, str, int]]:
        """Return 2/omega [s] of the highest frequency, from squares of frequencies (n,) [1/s^2], as a limit."""
        largest = float(omega.max(initial=0.0))
        if largest == 0.0:
            return []
        time = 2.0 / np.sqrt(largest)
        candidates = np.flatnonzero(omega > largest * (1.0 - 1e-12))
        return [(float(time), name, self._first(candidates[2.0 / np.sqrt(omega[candidates]) == time]))]

    def _first(self, indices: np.ndarray) -> int:
        """Return the particle of smallest permanent number among `indices`."""
        return int(indices[self._numbers[indices].argmin()])

    def _ring_radius(self, position: np.ndarray) -> np.ndarray:
        """Return the radius [m] of axisymmetric particles at `position` (n, dim) [m]."""
        return np.maximum(np.abs(position[:, 1]), ON_AXIS * self.h)

    def _current_rows(self) -> np.ndarray:
        """Return displacements [m] and velocities [m/s] of the rows, (rows, `motion_width`)."""
        self._loops.move(len(self.rows_), self.rows_, self._motions)
        return self._motions

    def _maps(self, indices: np.ndarray) -> np.ndarray:
        """Return F of the particles `indices` by the present lists, (k, dim, dim)."""
        dim = self.particles.dim
        maps = np.zeros((len(indices), dim * dim))
        self._loops.map_particles(len(indices), indices.astype(np.uint64), self._current_rows(), self.reference.lists,
                                  self.reference.corrections, maps)  # fmt: skip
        return maps.reshape(-1, dim, dim)

    def _leave(self, mask: np.ndarray) -> None:
        """Remove the particles `mask` (n,), bool, and those left without neighbours, from all lists."""
        ref = self.reference
        if not self.formulation.keeps_volume:
            ref.remove(self.copies.extend_rows(mask))
            self.loose |= mask
            return
        self._mirror()
        while self.any_process(mask.any()):
            extended = self.copies.extend_rows(mask)
            indices = np.flatnonzero(ref.neighbours_of(extended) & ~mask & ~self.loose)
            determinants = np.linalg.det(self._maps(indices))
            ref.remove(extended)
            self.loose |= mask
            with np.errstate(divide="ignore", invalid="ignore"):
                chi = self.swellings[indices] * determinants / np.linalg.det(self._maps(indices))
            valid = (chi > 1.0 / LARGEST_JUMP) & (chi < LARGEST_JUMP)
            self.swellings[indices[valid]] = chi[valid]
            mask = np.zeros_like(mask)
            mask[indices[~valid & self._lagrangian[indices]]] = True  # Eulerian ones have the fallback

    def _renew(self) -> None:
        """Take the present positions as the reference."""
        particles, count = self.particles, self.particles.count
        self._mirror()
        tied = np.zeros(count, bool)
        tied[self._tied] = True
        f = self._maps(np.flatnonzero(tied))
        density = self.rows_[:count, self.slots["RHO"]]
        self.volume = self.rows_[:count, self.slots["M"]] / density  # mass of the section if axisymmetric
        self.volume[tied] = self.reference.volume[:count][tied] * np.linalg.det(f) * self.swellings[tied]
        dim = particles.dim
        gradients = self.f_start[:, : dim * dim]
        gradients[tied] = (f @ gradients[tied].reshape(-1, dim, dim)).reshape(-1, dim * dim)
        if "RING0" in self.slots:
            radii, radii0 = (self.rows_[:count, self.slots[name]] for name in ("RING", "RING0"))
            self.f_start[tied, dim * dim] *= (radii / radii0)[tied]
        particles["reference_position"] = self.rows_[:count, :dim]
        self.swellings[:], self.latest[:] = 1.0, 0.0
        self.alone = self.loose.copy()
        self._build_reference()


def stop_at_planes(particles: Particles, planes: tuple[Plane, ...], h: float) -> bool:
    """Stop particles beyond a plane at it, their relative energy becoming heat; return whether there were any."""
    result = False
    x, u = particles["position"], particles["velocity"]
    for plane in planes:
        mask = plane.distance_beyond(x) > plane.side * plane.ahead
        if not mask.any():
            continue
        result = True
        a = plane.axis
        inward = mask & (plane.side * (u[:, a] - plane.velocity) < 0.0)
        particles["internal_energy"][inward] += 0.5 * (u[inward, a] - plane.velocity) ** 2
        u[inward, a] = plane.velocity
        x[mask, a] = plane.at - plane.ahead + plane.side * STAND_OFF * h
    return result
