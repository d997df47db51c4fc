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
    """A published scheme whose step is one evaluation of pair laws and one pass over single particles."""

    @property
    def smoothing(self) -> Smoothing:
        """How its smoothing length follows the flow."""

    @property
    def switch(self) -> int:
        """Which share of the viscosity particles take, of those in `integrators.particle_steps`."""

    @property
    def softens(self) -> bool:
        """Whether particles in shear flow show their neighbours less of the linear viscosity."""

    @property
    def fragment_contact(self) -> bool:
        """Whether pieces that have come apart from a body are told from it."""

    def layout(self, dim: int) -> RowLayout:
        """Return the widest row that its passes need."""

    def passes(self, dim: int) -> Sequence[Pass]:
        """Return its passes over the pairs, in order."""

    def coefficients(self) -> np.ndarray:
        """Return the numbers that its laws and its `pack` read."""

    def pack(self, dim: int) -> tuple[Any, dict[str, Any]]:
        """Return the function that packs a particle's row, and the constants to bind into it."""

    def sparsest(self, dim: int) -> float:
        """Return the least rho h^dim/m of a particle, 0 where nothing keeps density from falling."""

    def limits(self) -> tuple[Any, dict[str, Any]] | None:
        """Return the function that packs what a particle bears, and its constants; None where no law asks for it."""

    def separating(self, h: float, particles: Particles, planes: tuple[Plane, ...]) -> NoContact | SeparatingContact:
        """Return the contact between bodies beside its passes, at the smoothing length `h` [m]."""

    def keep(self, pairs: Pairs, lengths: np.ndarray) -> None:
        """Keep in the packed rows what the next evaluation asks of this one; `lengths` (n,) are smoothing lengths."""


@dataclass(frozen=True)
class Smoothing:
    """How the smoothing length follows the flow.

    Parameters
    ----------
    variable
        Whether dh/dt = h/d div u (Farahani 2009 eq. 19; Zisis 2013 eq. 20) or h stays.
    smallest, largest
        Limits of h over its start.
    """

    variable: bool = False
    smallest: float = 0.5
    largest: float = 2.0
