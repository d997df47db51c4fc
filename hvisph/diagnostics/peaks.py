"""Particle histories for output: maximum pressure and initial position."""

from __future__ import annotations

import numpy as np

from hvisph.setup.build import Setup


class Followed:
    """Rows that follow the particles, into new orders and to other processes.

    Parameters
    ----------
    setup
        The run.
    rows
        One row a particle (n, ...).

    Attributes
    ----------
    rows
        The rows in the order that the particles have.
    """

    def __init__(self, setup: Setup, rows: np.ndarray):
        self.rows = rows
        setup.subdomain.follow(lambda: self.rows, self._replace)

    def permute(self, order: np.ndarray) -> None:
        """Follow the particles into a new order."""
        self.rows[:] = self.rows.take(order, axis=0)

    def _replace(self, rows: np.ndarray) -> None:
        self.rows = rows.copy()


class Peaks(Followed):
    """Highest pressures [Pa].

    Parameters
    ----------
    setup
        The run, evaluated at its start.
    """

    def __init__(self, setup: Setup):
        super().__init__(setup, np.full(setup.particles.count, -np.inf))
        self._setup = setup

    @property
    def highest(self) -> np.ndarray:
        """One of each particle [Pa]."""
        return self.rows

    def record(self) -> None:
        """Take account of the pressures of the last evaluation."""
        np.maximum(self.rows, self._setup.stepper.pressures, out=self.rows)
