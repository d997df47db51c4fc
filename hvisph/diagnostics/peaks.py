"""Particle histories for output: maximum pressure and initial position."""

from __future__ import annotations

import numpy as np

from hvisph.setup.build import Setup


class Followed:
    """Rows `rows` (n, ...), one a particle, that are reordered and migrate with the particles."""

    def __init__(self, setup: Setup, rows: np.ndarray):
        self.rows = rows
        setup.subdomain.follow(lambda: self.rows, self._replace)

    def permute(self, order: np.ndarray) -> None:
        """Reorder the rows with the particles."""
        self.rows[:] = self.rows.take(order, axis=0)

    def _replace(self, rows: np.ndarray) -> None:
        self.rows = rows.copy()


class Peaks(Followed):
    """Maximum pressure of each particle [Pa]."""

    def __init__(self, setup: Setup):
        super().__init__(setup, np.full(setup.particles.count, -np.inf))
        self._setup = setup

    @property
    def highest(self) -> np.ndarray:
        """Maximum of each particle [Pa]."""
        return self.rows

    def record(self) -> None:
        """Update the maxima with the last pressures."""
        np.maximum(self.rows, self._setup.stepper.pressures, out=self.rows)
