"""Eulerian SPH with corrected kernels (Young 2021): Shepard's correction, the gradient's, or both.

Passes: the corrections into each row, then all rates at once (`sph.laws.corrections`,
`sph.laws.standard`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hvisph.sph.laws import corrections, standard
from hvisph.sph.pairs import Pass
from hvisph.sph.rows import RowLayout

from .eulerian import Eulerian


@dataclass(frozen=True)
class Corrected(Eulerian):
    """Standard SPH of solids with a correction; what a particle packs is that of `Eulerian`.

    Parameters
    ----------
    correction
        ``shepard``, ``gradient`` or ``mixed``.
    factor
        C_f, above 1: a pair with a component of its corrected gradient more than this many times the
        plain one, or less than its inverse, takes the plain gradient; infinity for no limit.
    """

    correction: str = "mixed"
    factor: float = 7.5

    def passes(self, dim: int) -> list[Pass]:
        """Return the passes: corrections, and rates."""
        plain = super().layout(dim)
        parts = {"SHEPARD": int(self.correction != "gradient"), "GRADIENT": int(self.correction != "shepard")}
        options = self._options() | {
            "CORRECTED": 1,
            "PRODUCT": 1,  # each side's stress over rho_a rho_b, as published
            "FACTOR": len(super().coefficients()),
            "EXPONENT": self.stress_exponent,
        }
        return [
            Pass(corrections.corrections, plain, parts, into_rows=True),
            Pass(standard.accumulate, corrections.pair_layout(plain), options, density_rate=self.density_rate),
        ]

    def layout(self, dim: int) -> RowLayout:
        """Return the row of the standard law with the corrections."""
        return corrections.row_layout(super().layout(dim))

    def coefficients(self) -> np.ndarray:
        """Return those of the standard law, then C_f."""
        return np.concatenate([super().coefficients(), standard.safeguard(self.factor)])


def fallbacks(stepper: Any) -> int:
    """Return how many gradients, two a pair, were plain in the last evaluation of a corrected `stepper`."""
    pairs = stepper.pairs
    return round(float(pairs.sorted[stepper.paired, pairs.slots["FALLBACKS"]].sum()))
