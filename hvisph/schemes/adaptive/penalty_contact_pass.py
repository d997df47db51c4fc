"""Penalty contact pass of connected components: forces, contact energy and detection of interpenetration.

A body is in contact with other bodies, with its own detached particles, and with distant parts of its own surface;
particles near such a part are searched every `SEARCH_EVERY` evaluations.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from hvisph.compiler.exact_sum import decode_sum, encode_terms
from hvisph.core.errors import RunError
from hvisph.core.particles import Particles
from hvisph.integrators.prescribed_motion import is_rigid_particle
from hvisph.materials.material_table import Material
from hvisph.sph.contact import penalty_contact
from hvisph.sph.neighbours import particle_layout as rate_slots
from hvisph.sph.neighbours.cells import Grid
from hvisph.sph.neighbours.ghost_rows import Halo, Plane
from hvisph.sph.neighbours.pairs import Pairs
from hvisph.sph.neighbours.particle_layout import RowLayout

# Evaluations between two checks for penetration of bodies, and for particles near another part of their body.
SEARCH_EVERY = 16
# An inner particle has penetrated another body where the volume fraction of that exceeds this value; it is below 0.3
# behind an intact contact, and 1 or more in mixed lattices.
INSIDE = 0.7
# Share, and number, of inner particles of a body that have penetrated another one when the run stops.
SHARE, FEWEST = 0.1, 3
FULL = 0.9  # inner particles have a reference kernel sum above this share of the largest one of their body


class BodyContact:
    """Contact forces between bodies.

    `x0` are initial positions [m]; `fullness` are the kernel sums of the reference lists (n,) and their maxima by body.

    `energy`: work against the contact since the start [J].
    `starts`: phi0 of each particle, see `sph.contact.penalty_contact` (n,); decreases with phi.
    `folded`, `leaving`: particles near a distant part of their own body, and those just detached (n,), bool.
    `omega`: square of the frequency of each particle's contacts [1/s^2] (n,).
    `penetrations`: indices of particles inside a body that their own interpenetrates (k,); None if there are none.
    """

    def __init__(self, particles: Particles, formulation: Any, materials: list[Material], x0: np.ndarray, h: float,
                 planes: tuple[Plane, ...], fullness: tuple[np.ndarray, np.ndarray], power_unit: float):  # fmt: skip
        self.particles, self.law, self.h = particles, formulation.contact, h
        dim, kernel = particles.dim, formulation.kernel
        spacing = h / formulation.h_over_dx
        ratio = self.law.carried_over_stiffness(kernel, formulation.h_over_dx, dim)
        stiffness = [self.law.of_material(m.density, m.bulk_sound_speed, spacing, dim, ratio) for m in materials]
        self._of_material, self._power_unit = np.array(stiffness), power_unit
        self._volume = particles["mass"] / np.array([m.density for m in materials])[particles.material]
        self._revolved = particles.kinematics.axisymmetric
        sums, maxima = fullness
        self._inner = sums >= FULL * maxima[particles.body]
        self._update_arrays()
        coefficients = self.law.coefficients(kernel, formulation.h_over_dx, dim)
        passes = self.law.passes(dim, self._revolved)
        self.pairs = Pairs(self.law.row_layout(dim, self._revolved), kernel, passes, coefficients, x0, h, planes)
        layout, constants, search = penalty_contact.contact_search(dim, kernel)
        self._overlap_pairs = Pairs(layout, kernel, [search], constants, x0, h, planes)
        self._contact_phi = self.law.touching(kernel, formulation.h_over_dx, dim) * (1.0 + 1e-12)
        self._slip, self._slips = rate_slots.slots(dim)["R_SLIP"], formulation.has_friction
        self.starts, self.omega = np.full(particles.count, self._contact_phi), np.zeros(particles.count)
        self.folded, self.leaving = np.zeros((2, particles.count), bool)
        self._pieces = self._bodies.copy()
        self.energy = self._power = self._power_before = 0.0
        self.penetrations = np.zeros(0, np.int64)
        self._evaluations = 0
        self._bodies_in_all = len(maxima)

    def _update_arrays(self) -> None:
        """Update the arrays for the present particles."""
        particles = self.particles
        self._stiffness = self._of_material[particles.material]
        self._bodies, self._numbers = particles.body.astype(np.float64), particles.numbers()

    def attach_halo(self, halo_for: Callable[[RowLayout], Halo]) -> None:
        for pairs in (self.pairs, self._overlap_pairs):
            pairs.halo = halo_for(pairs.layout)

    @property
    def stored_energy(self) -> float:
        return self.energy if self.law.stores_energy else 0.0

    def begin(self, rows: np.ndarray, slots: dict[str, int]) -> None:
        """Take the state of `rows` as the unloaded one."""
        if self.law.stores_energy:
            indices = np.arange(self.particles.count)
            phi, _ = self._find_overlap(indices, rows, slots, self._bodies)
            self.starts = np.maximum(self._contact_phi, phi * (1.0 + 1e-12))  # round-off must not load what touches

    def leave(self, mask: np.ndarray) -> None:
        """Detach the particles `mask` (n,), bool, from their bodies."""
        self.leaving |= mask
        self._pieces[mask] = self._bodies_in_all + self.particles.id[mask]

    def add(
        self, indices: np.ndarray, rows: np.ndarray, slots: dict[str, int], loose: np.ndarray, rates: np.ndarray
    ) -> None:
        """Add contact accelerations and heat to `rates` of the particles `indices`; `loose` (n,) bool are detached."""
        halo = self.pairs.halo
        self.omega[:], self._power = 0.0, 0.0
        is_search_due = self._evaluations % SEARCH_EVERY == 0
        self._evaluations += 1
        if is_search_due and self.law.self_contact:
            self._find_folded(rows, slots, loose)
        if self.folded.any():
            indices = np.union1d(indices, np.flatnonzero(self.folded))
        if not (len(indices) if halo is None else halo.any_process(len(indices) > 0)):
            return
        if self.leaving.any() if halo is None else halo.any_process(bool(self.leaving.any())):
            self._unload(indices, rows, slots)
        self.pairs.rows, self.pairs.numbers = self._pack_rows(indices, rows, slots, loose), self._numbers[indices]
        try:
            self.pairs.evaluate(self.h)
        finally:  # other processes wait for this one, also after an error
            self._add_rates(indices, rates)
            if is_search_due:
                self._find_penetrated(indices, rows, slots, loose)

    def _add_rates(self, indices: np.ndarray, rates: np.ndarray) -> None:
        dim, mass, halo, place = self.particles.dim, self.particles["mass"], self.pairs.halo, self.pairs.place
        contact_rates = self.pairs.rates[place[: len(indices)]]
        power = encode_terms(mass[indices] * contact_rates[:, dim], self._power_unit)
        self._power = float(decode_sum(power if halo is None else halo.total(power), self._power_unit))
        rates[indices, : dim + (not self.law.stores_energy)] += contact_rates[:, : dim + (not self.law.stores_energy)]
        if self._slips:
            rates[indices, dim] += contact_rates[:, self._slip]
            rates[indices, self._slip] = contact_rates[:, self._slip]
        self.omega[indices] = contact_rates[:, dim + 1]
        if self.law.stores_energy:
            phi, starts = self.pairs.sorted[place[: len(indices)], self.pairs.slots["START"]], self.starts[indices]
            self.starts[:] = self._contact_phi
            self.starts[indices] = np.maximum(self._contact_phi, np.minimum(starts, phi))

    def _find_penetrated(self, indices: np.ndarray, rows: np.ndarray, slots: dict[str, int], loose: np.ndarray) -> None:
        try:
            fractions, _ = self._find_overlap(indices, rows, slots, self._bodies)
        except RunError:  # the contact's own pass has found the same
            fractions = np.zeros(len(indices))
        inside = indices[(fractions > INSIDE) & self._inner[indices] & ~loose[indices]]
        body, bodies = self.particles.body, self._bodies_in_all
        counts = np.stack([np.bincount(body[members], minlength=bodies) for members in (inside, self._inner)])
        if self._overlap_pairs.halo is not None:
            counts = self._overlap_pairs.halo.total(counts)
        is_penetrated = counts[0] >= np.maximum(FEWEST, SHARE * counts[1])
        self.penetrations = inside[is_penetrated[body[inside]]]

    def _find_folded(self, rows: np.ndarray, slots: dict[str, int], loose: np.ndarray) -> None:
        indices = np.flatnonzero((rows[: len(loose), slots["KIND"]] == 1.0) & ~loose)
        self.folded[:] = False
        self.folded[indices] = self._find_overlap(indices, rows, slots, self._bodies)[1] > 0.0

    def _unload(self, indices: np.ndarray, rows: np.ndarray, slots: dict[str, int]) -> None:
        """Take the present overlap of particles that leave their bodies as unloaded."""
        old_bodies = np.where(self.leaving, self._bodies, self._pieces)
        phi_before, phi_after = (
            self._find_overlap(indices, rows, slots, bodies)[0] for bodies in (old_bodies, self._pieces)
        )
        self.starts[indices] += (phi_after - phi_before) * (1.0 + 1e-12)
        self.leaving[:] = False

    def _find_overlap(
        self, indices: np.ndarray, rows: np.ndarray, slots: dict[str, int], bodies: np.ndarray
    ) -> np.ndarray:
        """Return phi and whether a distant part is near (2, k) of the particles `indices`."""
        dim, pairs, target = self.particles.dim, self._overlap_pairs, self._overlap_pairs.slots
        packed = np.zeros((len(indices), pairs.layout.used_width))
        self._place(indices, rows, slots, packed, target)
        packed[:, target["BODY"]] = bodies[indices]
        packed[:, target["D"] : target["D"] + dim] = self._get_displacements(indices, rows, slots)
        pairs.rows, pairs.numbers = packed, self._numbers[indices]
        pairs.evaluate(self.h)
        return pairs.rates[pairs.place[: len(indices)], dim : dim + 2].T

    def _place(
        self, indices: np.ndarray, rows: np.ndarray, slots: dict[str, int], packed: np.ndarray, target: dict[str, int]
    ) -> None:
        """Write positions, lengths and volumes of the particles `indices` into `packed` rows."""
        dim, part = self.particles.dim, rows[indices]
        packed[:, :dim] = part[:, :dim]
        packed[:, target["H"]] = self.h
        if not self.law.stores_energy:
            packed[:, target["V"]] = part[:, slots["M"]] / part[:, slots["RHO"]]
            return
        # the contact energy is a potential of the positions: volumes are reference volumes, whole ones if axisymmetric
        packed[:, target["V"]] = self._volume[indices]
        if self._revolved:
            packed[:, target["V"]] /= 2.0 * np.pi * part[:, slots["RING"]]

    def _get_displacements(self, indices: np.ndarray, rows: np.ndarray, slots: dict[str, int]) -> np.ndarray:
        """Return the displacements of the particles `indices` from the reference (k, dim) [m]."""
        dim, x0 = self.particles.dim, slots["X0"]
        return np.asarray(rows[indices, :dim] - rows[indices, x0 : x0 + dim])

    def _pack_rows(self, indices: np.ndarray, rows: np.ndarray, slots: dict[str, int], loose: np.ndarray) -> np.ndarray:
        dim, target = self.particles.dim, self.pairs.slots
        part, packed = rows[indices], np.zeros((len(indices), self.pairs.layout.used_width))
        self._place(indices, rows, slots, packed, target)
        packed[:, target["U"] : target["U"] + dim] = part[:, slots["U"] : slots["U"] + dim]
        packed[:, target["M"]] = part[:, slots["M"]]
        packed[:, target["BODY"]] = self._pieces[indices]
        packed[:, target["K"]] = self._stiffness[indices]
        if self._revolved:
            packed[:, target["RING"]] = part[:, slots["RING"]]
        if "RIGID_SIDE" in target:
            packed[:, target["RIGID_SIDE"]] = is_rigid_particle(self.particles.tags[indices])
        if self.law.stores_energy:
            packed[:, target["START"]] = self.starts[indices]
        if self.law.self_contact:
            packed[:, target["D"] : target["D"] + dim] = self._get_displacements(indices, rows, slots)
            # only particles near a distant part of their body: which others are chosen depends on the cells
            packed[:, target["TIED"]] = part[:, slots["KIND"]] * (self.folded[indices] & ~loose[indices])
        return packed

    def complete(self, dt: float, use_mean: bool) -> None:
        """Add the work of a step [s] by the last forces, or by the mean with the previous ones."""
        self.energy += dt * (0.5 * (self._power + self._power_before) if use_mean else self._power)
        self._power_before = self._power

    def history(self) -> dict[str, np.ndarray]:
        return {"contact": np.array([self.energy, self._power, self._power_before, float(self._evaluations)])}

    def get_carried(self) -> dict[str, np.ndarray]:
        return {
            "contact_starts": self.starts,
            "contact_omega": self.omega,
            "contact_volume": self._volume,
            "contact_inner": self._inner,
            "contact_pieces": self._pieces,
            "contact_folded": self.folded,
            "contact_leaving": self.leaving,
        }

    def replace_particles(self, arrays: dict[str, np.ndarray]) -> None:
        self.starts, self.omega, self._volume, self._inner = (
            np.array(arrays[f"contact_{name}"]) for name in ("starts", "omega", "volume", "inner")
        )
        self._inner = self._inner.astype(bool)
        self._pieces = np.array(arrays["contact_pieces"])
        self.folded, self.leaving = (np.array(arrays[f"contact_{name}"], bool) for name in ("folded", "leaving"))
        self.penetrations = np.zeros(0, np.int64)
        self._update_arrays()

    def fit_grid(self) -> None:
        for pairs in (self.pairs, self._overlap_pairs):
            pairs.grid = Grid.from_positions(self.particles["position"], pairs.grid.edge)

    @property
    def pieces(self) -> np.ndarray:
        """Components (n,) uint32; each detached particle is one."""
        return self._pieces.astype(np.uint32)

    def restore(self, history: dict[str, np.ndarray]) -> None:
        self.energy, self._power, self._power_before, evaluations = (float(value) for value in history["contact"])
        self._evaluations = int(evaluations)
