"""Interfaces of formulations and steppers to the step loop."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from hvisph.core.particles import Particles
from hvisph.integrators.sums import Sums
from hvisph.sph.kernels import Kernel
from hvisph.sph.neighbours.ghost_rows import Halo
from hvisph.sph.neighbours.particle_layout import RowLayout


class AnyStepper(Protocol):
    """Particles, and what carries them on from step to step.

    Made from the particles at the start, the formulation, the materials, the integrator's two shares, the
    smoothing length at the start and the planes of symmetry. Its step is `evaluate`, then `complete`.

    Attributes
    ----------
    particles, formulation
        The state, and the published scheme.
    table, models
        Packed materials.
    lengths, sums, totals
        Smoothing lengths (n,) [m]; sums over the completed state, columns as named in `integrators.sums`, and what
        makes them.
    h_max
        The largest smoothing length of all processes [m].
    has_energy
        Whether the scheme has an energy equation, so that total energy can be kept account of.
    keeps_order
        Whether particles stay with their process until space is cut anew.
    """

    particles: Particles
    table: np.ndarray
    models: np.ndarray
    lengths: np.ndarray
    signals: np.ndarray
    sums: np.ndarray
    totals: Sums
    h_max: float
    has_energy: bool
    keeps_order: bool

    @property
    def formulation(self) -> AnyFormulation:
        """The published scheme."""

    @property
    def stored_energy(self) -> float:
        """Energy that is in no particle [J]."""

    @property
    def contact_energy(self) -> float:
        """Work against a contact algorithm since the start [J]."""

    @property
    def support(self) -> float:
        """The largest distance at which two particles can ever be neighbours [m]."""

    @property
    def pressures(self) -> np.ndarray:
        """Pressure of every particle, as the history records it (n,) [Pa]."""

    @property
    def workspace(self) -> np.ndarray | None:
        """Numbers (k,) that nobody reads from an evaluation to the next; None where there are none."""

    @property
    def rates(self) -> np.ndarray:
        """Rows of rates as `hvisph.sph.neighbours.particle_layout` lays them out."""

    @property
    def place(self) -> np.ndarray:
        """Row of each particle's rates (n,)."""

    def start(self) -> None:
        """Prepare the first step from the state as it stands."""

    def evaluate(self) -> None:
        """Evaluate the rates of the step that was announced last."""

    def complete(self, dt: float, following: float) -> None:
        """Carry the state over `dt` [s] with these rates, and announce the step `following`."""

    def predict(self, following: float) -> None:
        """Announce the step `following` [s] from a state that may have been changed."""

    def limits(self) -> list[tuple[float, str, int]]:
        """Return further limits: times [s] of which a step takes the Courant share, names, particles."""

    def permute(self) -> np.ndarray:
        """Put the state into cell order; return the order taken. Call it between steps only."""

    def get_carried(self) -> dict[str, np.ndarray]:
        """Return all that the next step needs of each particle beside its state, between steps, a row a particle."""

    def history(self) -> dict[str, np.ndarray]:
        """Return what the next step needs of the whole, between steps, by name."""

    @property
    def owner_positions(self) -> np.ndarray:
        """Places (n, dim) [m] by which particles belong to a part of space."""

    def attach_halo(self, halo_for: Callable[[RowLayout], Halo]) -> None:
        """See what other processes have, by the halos that `halo_for` makes of layouts of rows."""

    def replace_particles(self, data: np.ndarray, tags: np.ndarray, carried: dict[str, np.ndarray]) -> None:
        """Have these particles in place of all others, between steps; see `get_carried`."""

    def fit_grid(self) -> None:
        """Make the grids of cells anew, around the particles that there are now."""

    def restore(self, carried: dict[str, np.ndarray], history: dict[str, np.ndarray]) -> None:
        """Restore the state of `carried` and `history`; the particles must be the same, in the same order."""


class AnyFormulation(Protocol):
    """A published scheme, ready for the step loop."""

    @property
    def name(self) -> str:
        """Name in case files."""

    @property
    def kernel(self) -> Kernel:
        """The smoothing kernel."""

    @property
    def h_over_dx(self) -> float:
        """Smoothing length over spacing at the start."""

    @property
    def fields(self) -> tuple[str, ...]:
        """State fields that it needs beside `hvisph.core.particles.BASE_FIELDS`."""

    @property
    def viscous_factor(self) -> float:
        """Factor of max|mu| in the signal speed."""

    @property
    def corrects(self) -> bool:
        """Whether its kernels are corrected in the current configuration, so that fall-backs can be counted."""

    @property
    def slips(self) -> bool:
        """Whether bodies slide on each other, so that slip does work."""

    @property
    def repels(self) -> bool:
        """Whether bodies meet by a contact algorithm whose work is kept account of."""

    @property
    def stepper(self) -> Any:
        """What moves its particles: a class, made as `AnyStepper` says."""
