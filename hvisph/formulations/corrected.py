"""Eulerian SPH with corrected kernels (Young 2021): Shepard's correction, the gradient's, or both.

Passes: the corrections into each row, then all rates at once (`sph.laws.corrections`,
`sph.laws.corrected`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hvisph.sph.laws import corrected, corrections
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
        standard = super().layout(dim)
        parts = {"SHEPARD": int(self.correction != "gradient"), "GRADIENT": int(self.correction != "shepard")}
        options = {
            "ARTIFICIAL_STRESS": int(self.stress_eps != 0.0),
            "FACTOR": len(super().coefficients()),
            "EXPONENT": self.stress_exponent,
            "COUPLED": 0,
        }
        return [
            Pass(corrections.corrections, standard, parts | {"COUPLED": 0}, into_rows=True),
            Pass(corrected.accumulate, corrections.pair_layout(standard), options),
        ]

    def layout(self, dim: int) -> RowLayout:
        """Return the row of the standard law with the corrections."""
        return corrections.row_layout(super().layout(dim))

    def coefficients(self) -> np.ndarray:
        """Return those of the standard law, then C_f."""
        return np.concatenate([super().coefficients(), corrected.coefficients(self.factor)])


def fallbacks(stepper: Any) -> int:
    """Return how many gradients, two a pair, were plain in the last evaluation of a corrected `stepper`."""
    pairs = stepper.pairs
    return round(float(pairs.sorted[stepper.paired, pairs.slots["FALLBACKS"]].sum()))
