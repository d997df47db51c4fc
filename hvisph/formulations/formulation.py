"""What a formulation declares: its passes over the pairs and what a particle packs for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from hvisph.sph.pairs import Pass
from hvisph.sph.rows import RowLayout

from .protocol import AnyFormulation


class Formulation(AnyFormulation, Protocol):
    """A published scheme whose step is one evaluation of pair laws and one pass over single particles."""

    @property
    def smoothing(self) -> Smoothing:
        """How its smoothing length follows the flow."""

    @property
    def switch(self) -> str:
        """Which share of the viscosity particles take, of those in `update`."""

    @property
    def softens(self) -> bool:
        """Whether particles in shear flow show their neighbours less of the linear viscosity."""

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
