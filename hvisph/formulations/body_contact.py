"""The contact pass of bodies in pieces: forces, energy of its own, and whether bodies pass through each other."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hvisph.core.errors import RunError
from hvisph.core.exact import value_of, whole_parts
from hvisph.core.particles import Particles
from hvisph.integrators.update import ON_AXIS
from hvisph.materials.table import Material
from hvisph.sph.cells import Grid
from hvisph.sph.copies import Halo
from hvisph.sph.laws import contact as laws
from hvisph.sph.pairs import Pairs, Pass
from hvisph.sph.rows import RowLayout
from hvisph.sph.symmetry import AXIS, Plane

# Evaluations between two looks at whether bodies pass through each other.
LOOK_EVERY = 16
# A particle from within its body is inside another one where that fills more than this share of what is around it;
# behind a sound contact it is below 0.3, in two lattices that mix 1 and more.
INSIDE = 0.7
# So much of the inner particles of a body, and no fewer, means that the bodies pass through each other.
SHARE, FEWEST = 0.1, 3
# Particles are from within whose list at the start holds so much of what the fullest of their body holds.
FULL = 0.9


class BodyContact:
    """Contact forces between bodies.

    Parameters
    ----------
    particles, formulation, materials, h, planes
        As those of the stepper.
    power_unit
        Unit in which its power is counted [W], see `core.exact`.
    at
        Positions at the start (n, dim) [m].
    fullness
        Kernel sums of the reference lists at the start (n,), which show who stands within a body.

    Attributes
    ----------
    energy
        What the contact holds [J]: work against it since the start. A repulsion that starts unloaded keeps it apart
        from the bodies' heat, any other has put it there.
    starts
        Largest W/W(dx) of each particle with another body at the start, at least 1 (n,); beyond it pairs repel.
    omega
        Square of the frequency of each particle's contacts [1/s^2] (n,).
    passed
        Which particles stand inside a body that their own passes through (k,); none as long as none does.
    """

    def __init__(self, particles: Particles, formulation: Any, materials: list[Material], at: np.ndarray, h: float,
                 planes: tuple[Plane, ...], fullness: np.ndarray, power_unit: float):  # fmt: skip
        self.particles, self.law, self.h = particles, formulation.contact, h
        dim, kernel = particles.dim, formulation.kernel
        spacing = h / formulation.h_over_dx
        carried = self.law.carried_over_stiffness(kernel, formulation.h_over_dx, dim)
        stiffness = [self.law.of_material(m.density, m.bulk_sound_speed, spacing, dim, carried) for m in materials]
        self._of_material, self._power_unit = np.array(stiffness), power_unit
        self._volume = particles["mass"] / np.array([m.density for m in materials])[particles.material]
        self._revolved = particles.kinematics.revolved
        if self._revolved:  # areas of the section
            self._volume /= 2.0 * np.pi * np.maximum(at[:, 1], ON_AXIS * h)
            planes = tuple(plane for plane in planes if plane != AXIS)
        self._inner = fullness >= FULL * _of_body(fullness, particles.body)
        self._tell_apart()
        layout, constants = laws.row_layout(dim, self._revolved), self.law.coefficients(kernel, formulation.h_over_dx)
        options = {"EXPONENT": self.law.exponent, "UNLOADED": int(self.law.unloaded), "REVOLVED": int(self._revolved)}
        self.pairs, self._meeting = (
            Pairs(layout, kernel, [one], constants, at, h, planes)
            for one in (Pass(laws.accumulate, layout, options), Pass(laws.meet, layout, {}))
        )
        self.starts, self.omega = np.ones(particles.count), np.zeros(particles.count)
        self.energy = self._power = self._power_before = 0.0
        self.passed = np.zeros(0, np.int64)
        self._evaluations = 0
        self._bodies_in_all = int(particles.body.max()) + 1

    def _tell_apart(self) -> None:
        """Take note of what the particles are that there are now."""
        particles = self.particles
        self._stiffness = self._of_material[particles.material]
        self._bodies, self._numbers = particles.body.astype(np.float64), particles.numbers()

    def join(self, halo_for: Callable[[RowLayout], Halo]) -> None:
        """See what other processes have, by the halos that `halo_for` makes of layouts of rows."""
        for pairs in (self.pairs, self._meeting):
            pairs.halo = halo_for(pairs.layout)

    @property
    def stored(self) -> float:
        """Energy [J] that is in no particle."""
        return self.energy if self.law.unloaded else 0.0

    def begin(self, rows: np.ndarray, slots: dict[str, int]) -> None:
        """Take the state of `rows` as the unloaded one."""
        if self.law.unloaded:
            everyone = np.arange(self.particles.count)
            nearest = self._met(self._packed(everyone, rows, slots), self._numbers)[:, self.particles.dim + 1]
            # round-off must not load what touches
            self.starts = np.maximum(1.0, nearest * (1.0 + 1e-12))

    def add(self, chosen: np.ndarray, rows: np.ndarray, slots: dict[str, int], loose: np.ndarray,
            rates: np.ndarray) -> None:  # fmt: skip
        """Add the contact's accelerations, and power where it is heat, of the `chosen` particles to `rates`."""
        dim, mass, halo = self.particles.dim, self.particles["mass"], self.pairs.halo
        self.omega[:], self._power = 0.0, 0.0
        if not (len(chosen) if halo is None else halo.anywhere(len(chosen) > 0)):
            return
        packed = self._packed(chosen, rows, slots)
        self.pairs.rows, self.pairs.numbers = packed, self._numbers[chosen]
        try:
            self.pairs.evaluate(self.h)
        finally:  # other processes wait for this one's part, also where it has failed
            pushed = self.pairs.rates[self.pairs.place[: len(chosen)]]
            power = whole_parts(mass[chosen] * pushed[:, dim], self._power_unit)
            self._power = float(value_of(power if halo is None else halo.total(power), self._power_unit))
            if self._evaluations % LOOK_EVERY == 0:
                self._look(chosen, packed, loose)
            self._evaluations += 1
        rates[chosen, : dim + (not self.law.unloaded)] += pushed[:, : dim + (not self.law.unloaded)]
        self.omega[chosen] = pushed[:, dim + 1]

    def _look(self, chosen: np.ndarray, packed: np.ndarray, loose: np.ndarray) -> None:
        try:
            filled = self._met(packed, self._numbers[chosen])[:, self.particles.dim]
        except RunError:  # the contact's own pass has found the same
            filled = np.zeros(len(chosen))
        inside = chosen[(filled > INSIDE) & self._inner[chosen] & ~loose[chosen]]
        body, bodies = self.particles.body, self._bodies_in_all
        counts = np.stack([np.bincount(body[who], minlength=bodies) for who in (inside, self._inner)])
        if self._meeting.halo is not None:
            counts = self._meeting.halo.total(counts)
        through = counts[0] >= np.maximum(FEWEST, SHARE * counts[1])
        self.passed = inside[through[body[inside]]]

    def _met(self, packed: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        self._meeting.rows, self._meeting.numbers = packed, numbers
        self._meeting.evaluate(self.h)
        return self._meeting.rates[self._meeting.place[: len(packed)]]

    def _packed(self, chosen: np.ndarray, rows: np.ndarray, slots: dict[str, int]) -> np.ndarray:
        dim, to = self.particles.dim, self.pairs.slots
        own, packed = rows[chosen], np.zeros((len(chosen), self.pairs.layout.width))
        packed[:, :dim] = own[:, :dim]
        packed[:, to["U"] : to["U"] + dim] = own[:, slots["U"] : slots["U"] + dim]
        packed[:, to["H"]] = self.h
        packed[:, to["M"]] = own[:, slots["M"]]
        # an energy of the places alone gives back all that it took: with volumes that stay
        packed[:, to["V"]] = self._volume[chosen] if self.law.unloaded else own[:, slots["M"]] / own[:, slots["RHO"]]
        packed[:, to["BODY"]] = self._bodies[chosen]
        packed[:, to["K"]] = self._stiffness[chosen]
        packed[:, to["START"]] = self.starts[chosen]
        if self._revolved:
            packed[:, to["RING"]] = own[:, slots["RING"]]
        return packed

    def complete(self, dt: float, averaged: bool) -> None:
        """Take account of a step [s] with the last forces, or with the mean of them and of those before."""
        self.energy += dt * (0.5 * (self._power + self._power_before) if averaged else self._power)
        self._power_before = self._power

    def history(self) -> dict[str, np.ndarray]:
        """Return what the next step needs of the whole, by name."""
        return {"contact": np.array([self.energy, self._power, self._power_before, float(self._evaluations)])}

    def carried(self) -> dict[str, np.ndarray]:
        """Return what the next step needs of each particle, by name."""
        return {"contact_starts": self.starts, "contact_omega": self.omega, "contact_volume": self._volume,
                "contact_inner": self._inner}  # fmt: skip

    def hold(self, carried: dict[str, np.ndarray]) -> None:
        """Take what is `carried` of the particles that there are now."""
        self.starts, self.omega, self._volume, self._inner = (
            np.array(carried[f"contact_{name}"]) for name in ("starts", "omega", "volume", "inner")
        )
        self._inner = self._inner.astype(bool)
        self.passed = np.zeros(0, np.int64)
        self._tell_apart()

    def fit_grid(self) -> None:
        """Make the grids of cells anew, around the particles that there are now."""
        for pairs in (self.pairs, self._meeting):
            pairs.grid = Grid.around(self.particles["position"], pairs.grid.edge)

    def restore(self, history: dict[str, np.ndarray]) -> None:
        """Go back to where `history` was taken."""
        self.energy, self._power, self._power_before, evaluations = (float(one) for one in history["contact"])
        self._evaluations = int(evaluations)


def _of_body(values: np.ndarray, bodies: np.ndarray) -> np.ndarray:
    """Return for each particle the largest value of its body."""
    largest = np.zeros(int(bodies.max()) + 1)
    np.maximum.at(largest, bodies.astype(np.int64), values)
    return np.asarray(largest[bodies.astype(np.int64)])
