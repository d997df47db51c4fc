"""Conversion of Total Lagrangian particles to Eulerian ones (Young 2021 sec. 2.3).

    strain   deviatoric Green-Lagrange equivalent strain sqrt(2/3 E':E') at or above a limit (eps_33 = 0 in 2D)
    damage   damage of 1

with or without their reference neighbours. The fallback keeps the interface sound: an Eulerian particle whose
deformation gradient has J outside [0.2, 5] or a strain above its limit, because neighbours were torn off,
turns its Total Lagrangian reference neighbours; so does one that fails later than it turned, because its place says
nothing of their deformation; a Total Lagrangian particle with J below 0.2 turns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np


class Neighbours(Protocol):
    """Queries of reference neighbours, and of other processes."""

    @property
    def dim(self) -> int:
        """Number of dimensions."""

    def anywhere(self, here: bool | np.bool_) -> bool:
        """Return whether a condition holds on any process."""

    def neighbours_of(self, chosen: np.ndarray) -> np.ndarray:
        """Return which particles have one of `chosen` (n,) among their reference neighbours (n,), bool."""


@dataclass(frozen=True)
class Conversion:
    """Parameters of the conversion to Eulerian particles."""

    # limit of the equivalent strain, None for none, 0 for Eulerian from the start; whether failed particles convert
    strain: float | None = None
    damage: bool = False
    neighbours: bool = True  # whether reference neighbours of a converted particle convert, too
    bodies: tuple[int, ...] | None = None  # indices of the bodies that convert; None for all
    # whether the fallback is active, and above which strain; None for 1.5 in 1D and 2D and 1.0 in 3D
    fallback: bool = True
    fallback_strain: float | None = None
    # whether it acts on the neighbours of failed Eulerian particles, where failed particles convert
    fallback_damage: bool = True
    smallest: float = 0.2
    largest: float = 5.0

    @property
    def is_off(self) -> bool:
        """Whether no particle converts by itself."""
        return self.strain is None and not self.damage

    def turning(self, lagrangian: np.ndarray, convertible: np.ndarray, active: np.ndarray, jacobians: np.ndarray,
                strains: np.ndarray, damage: np.ndarray, beside: Neighbours) -> np.ndarray:  # fmt: skip
        """Return which particles convert to Eulerian now (n,), bool.

        `convertible` may convert by their own strain or damage; the deformation gradient of `active` ones is known.
        `jacobians`, `strains` and `damage` are J, equivalent strain and damage (n,).
        """
        turns = np.zeros(len(lagrangian), bool)
        own = lagrangian & convertible
        if self.strain is not None:
            turns |= own & (strains >= self.strain)
        if self.damage:
            turns |= own & (damage >= 1.0)
        guarded = self.fallback and (not self.is_off or beside.anywhere(not lagrangian.all()))
        torn = np.zeros_like(turns)
        if guarded:
            turns |= lagrangian & active & (jacobians < self.smallest)
            limit = self.fallback_strain or (1.0 if beside.dim == 3 else 1.5)
            torn = (jacobians < self.smallest) | (jacobians > self.largest) | (strains > limit)
            if self.damage and self.fallback_damage:
                torn |= damage >= 1.0
            torn &= active & ~lagrangian
        if beside.anywhere(turns.any() or torn.any()):
            theirs = torn | turns if self.neighbours else torn
            turns |= lagrangian & beside.neighbours_of(theirs)
        return turns
