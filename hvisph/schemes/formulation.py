"""Declaration of a formulation: its passes over the pairs and its particle rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from hvisph.core.particles import Particles
from hvisph.schemes.standard.frictional_contact import NoContact, SeparatingContact
from hvisph.sph.neighbours.pairs import Pairs, Pass
from hvisph.sph.neighbours.particle_layout import RowLayout
from hvisph.sph.neighbours.symmetry_planes import Plane

from .protocol import AnyFormulation


class Formulation(AnyFormulation, Protocol):
    """Published scheme with one evaluation of pair laws and one particle update a step."""

    @property
    def smoothing(self) -> Smoothing:
        """Evolution of the smoothing length."""

    @property
    def switch(self) -> int:
        """Viscosity switch, of those in `integrators.particle_steps`."""

    @property
    def softens(self) -> bool:
        """Whether the linear viscosity is reduced in shear flow."""

    @property
    def fragment_contact(self) -> bool:
        """Whether detached components of a body are in contact with it."""

    def layout(self, dim: int) -> RowLayout:
        """Return the widest row of the passes."""

    def passes(self, dim: int) -> Sequence[Pass]:
        """Return the passes over the pairs, in order."""

    def coefficients(self) -> np.ndarray:
        """Return the parameters of the laws and of `pack`."""

    def pack(self, dim: int) -> tuple[Any, dict[str, Any]]:
        """Return the packing function and its bound constants."""

    def sparsest(self, dim: int) -> float:
        """Return the least rho h^dim/m of a particle, 0 for no limit."""

    def limits(self) -> tuple[Any, dict[str, Any]] | None:
        """Return the packing function of strength limits and its constants, or None."""

    def separating(self, h: float, particles: Particles, planes: tuple[Plane, ...]) -> NoContact | SeparatingContact:
        """Return the contact between bodies beside the passes, at smoothing length `h` [m]."""

    def keep(self, pairs: Pairs, lengths: np.ndarray) -> None:
        """Store data of this evaluation in the rows for the next one; `lengths` (n,) are smoothing lengths."""


@dataclass(frozen=True)
class Smoothing:
    """Evolution of the smoothing length: dh/dt = h/d div u if `variable`, within limits relative to the start.

    Sources: Farahani 2009 eq. 19; Zisis 2013 eq. 20.
    """

    variable: bool = False
    smallest: float = 0.5
    largest: float = 2.0
