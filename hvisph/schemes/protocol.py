"""Interfaces of formulations and steppers to the step loop, and declaration of a formulation by passes over pairs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from hvisph.compiler.jit import Options, PythonFunction
from hvisph.core.particles import Particles
from hvisph.integrators.sums import Sums
from hvisph.schemes.standard.frictional_contact import NoContact, SeparatingContact
from hvisph.sph.kernels import Kernel
from hvisph.sph.neighbours.ghost_rows import Halo, Plane
from hvisph.sph.neighbours.pairs import Pairs, Pass
from hvisph.sph.neighbours.particle_layout import RowLayout


class AnyStepper(Protocol):
    """Particles, and the algorithm that advances them by steps of `evaluate` and `complete`.

    Created from initial particles, formulation, materials, the integrator's stage and weight, smoothing length and
    planes of symmetry. `table` and `models` are the packed materials, `lengths` (n,) smoothing lengths [m], `sums` the
    columns of `integrators.sums` from `totals`, `h_max` the largest smoothing length of all processes [m]. With
    `keeps_order` particles migrate only when the decomposition is repeated. `late` is the energy that softer moduli of
    late stages give back [J], then their bulk moduli [Pa].
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
    late: np.ndarray

    @property
    def formulation(self) -> AnyFormulation: ...  # the published scheme
    @property
    def stored_energy(self) -> float: ...  # energy outside of the particles [J]
    @property
    def contact_energy(self) -> float: ...  # work against a contact algorithm since the start [J]
    @property
    def support(self) -> float: ...  # largest distance of two neighbours [m]
    @property
    def pressures(self) -> np.ndarray: ...  # pressure of every particle for the history (n,) [Pa]
    @property
    def workspace(self) -> np.ndarray | None: ...  # unused storage (k,) between evaluations; None if there is none
    @property
    def rates(self) -> np.ndarray: ...  # rows of rates in the layout of `hvisph.sph.neighbours.particle_layout`
    @property
    def place(self) -> np.ndarray: ...  # row of each particle's rates (n,)
    def start(self) -> None: ...  # prepare the first step
    def evaluate(self) -> None: ...  # evaluate the rates of the step announced last
    # advance the state by `dt` [s] with these rates, and announce the step `next_dt`
    def complete(self, dt: float, next_dt: float) -> None: ...
    def predict(self, next_dt: float) -> None: ...  # announce the step `next_dt` [s] after a change of the state
    # further limits: times [s] to be multiplied by the Courant number, names, particles
    def limits(self) -> list[tuple[float, str, int]]: ...
    def permute(self) -> np.ndarray: ...  # sort the state into cell order between steps; return the order
    # the data of each particle beside its state that the next step needs, a row a particle
    def get_carried(self) -> dict[str, np.ndarray]: ...
    def history(self) -> dict[str, np.ndarray]: ...  # the global data that the next step needs, by name
    @property
    def owner_positions(self) -> np.ndarray: ...  # positions (n, dim) [m] that decide the owner of each particle
    # connect to other processes by the halos that `halo_for` makes of row layouts
    def attach_halo(self, halo_for: Callable[[RowLayout], Halo]) -> None: ...
    # replace all particles between steps; `arrays` as of `get_carried`
    def replace_particles(self, data: np.ndarray, tags: np.ndarray, arrays: dict[str, np.ndarray]) -> None: ...
    def fit_grid(self) -> None: ...  # fit the cell grids to the positions of the particles
    # restore `arrays` and `history` of the same particles in the same order
    def restore(self, arrays: dict[str, np.ndarray], history: dict[str, np.ndarray]) -> None: ...


class AnyFormulation(Protocol):
    """Published scheme, ready for the step loop."""

    @property
    def name(self) -> str: ...  # name in case files
    @property
    def kernel(self) -> Kernel: ...  # the smoothing kernel
    @property
    def h_over_dx(self) -> float: ...  # smoothing length over spacing at the start
    @property
    def fields(self) -> tuple[str, ...]: ...  # state fields beside `hvisph.core.particles.BASE_FIELDS`
    @property
    def viscous_factor(self) -> float: ...  # factor of max|mu| in the signal speed
    @property
    def corrects_kernels(self) -> bool: ...  # whether kernels are corrected in the current configuration
    @property
    def has_friction(self) -> bool: ...  # whether bodies slide on each other with friction
    @property
    def stores_contact_energy(self) -> bool: ...  # whether contact stores energy
    @property
    def stepper(self) -> Any: ...  # stepper class


class Formulation(AnyFormulation, Protocol):
    """Published scheme with one evaluation of pair laws and one particle update a step."""

    @property
    def smoothing(self) -> Smoothing: ...  # evolution of the smoothing length
    @property
    def switch(self) -> int: ...  # viscosity switch, of those in `integrators.particle_steps`
    @property
    def reduces_shear_viscosity(self) -> bool: ...  # whether the linear viscosity is reduced in shear flow
    @property
    def single(self) -> bool: ...  # whether pairs are evaluated in single precision
    @property
    def fragment_contact(self) -> bool: ...  # whether detached components of a body are in contact with it
    def layout(self, dim: int) -> RowLayout: ...  # the widest row of the passes
    def passes(self, dim: int) -> Sequence[Pass]: ...  # the passes over the pairs, in order
    def coefficients(self) -> np.ndarray: ...  # the parameters of the laws and of `pack`
    def pack(self, dim: int) -> tuple[PythonFunction, Options]: ...  # the packing function and its bound constants
    def isolated_density(self, dim: int) -> float: ...  # the least rho h^dim/m of a particle, 0 for no limit
    # the packing function of strength limits and its constants, or None
    def limits(self) -> tuple[PythonFunction, Options] | None: ...
    # the contact between bodies beside the passes, at smoothing length `h` [m]
    def body_contact(
        self, h: float, particles: Particles, planes: tuple[Plane, ...]
    ) -> NoContact | SeparatingContact: ...
    # store data of this evaluation in the rows for the next one; `lengths` (n,) are smoothing lengths
    def keep(self, pairs: Pairs, lengths: np.ndarray) -> None: ...


@dataclass(frozen=True)
class Smoothing:
    """dh/dt = h/d div u if `variable`, within limits over the start (Farahani 2009 eq. 19; Zisis 2013 eq. 20)."""

    variable: bool = False
    smallest: float = 0.5
    largest: float = 2.0
