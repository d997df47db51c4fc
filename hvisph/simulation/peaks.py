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
        setup.share.follow(lambda: self.highest, self._replace)

    def record(self) -> None:
        """Take account of the pressures of the last evaluation."""
        np.maximum(self.highest, self._setup.stepper.pressures, out=self.highest)

    def permute(self, order: np.ndarray) -> None:
        """Follow the particles into a new order."""
        self.highest[:] = self.highest.take(order)

    def _replace(self, highest: np.ndarray) -> None:
        self.highest = highest.copy()
