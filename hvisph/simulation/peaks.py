"""The highest pressure that every particle has had so far."""

from __future__ import annotations

import numpy as np

from hvisph.simulation.build import Setup


class Peaks:
    """Highest pressures, in the order that the particles have.

    Parameters
    ----------
    setup
        The run, evaluated at its start.

    Attributes
    ----------
    highest
        One of each particle [Pa].
    """

    def __init__(self, setup: Setup):
        self._setup = setup
        self.highest = np.full(setup.particles.count, -np.inf)

    def record(self) -> None:
        """Take account of the pressures of the last evaluation."""
        np.maximum(self.highest, self._setup.stepper.pressures, out=self.highest)

    def permute(self, order: np.ndarray) -> None:
        """Follow the particles into a new order."""
        self.highest[:] = self.highest.take(order)

    def of(self, numbers: np.ndarray) -> np.ndarray:
        """Return the highest pressures of particles by their permanent numbers."""
        particles = self._setup.particles
        highest = np.full(int(max(particles.id.max(), numbers.max())) + 1, -np.inf)
        highest[particles.id] = self.highest
        return highest[numbers]
