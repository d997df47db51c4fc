"""The mean of a particle field over the time just past, for fields whose single values say little."""

from __future__ import annotations

import numpy as np

# Parts of the window: it moves on by whole ones, and is shorter than asked for by less than one.
PARTS = 20


class TrailingMean:
    """Mean over a window that ends now; before the run the field was zero.

    Parameters
    ----------
    count
        Number of particles.
    window
        Length of the window [s].
    """

    def __init__(self, count: int, window: float):
        self._part_length = window / PARTS
        self._parts = np.zeros((PARTS - 1, count))  # integrals over full parts, by permanent number
        self._times = np.zeros(PARTS - 1)
        self._full = np.zeros(count)  # their sum
        self._now = np.zeros(count)  # integral over the part under way, in the order of the state
        self._time = 0.0

    def add(self, values: np.ndarray, dt: float, ids: np.ndarray) -> None:
        """Take account of the `values` (n,) that held for `dt` [s], of the particles numbered `ids`."""
        self._now += dt * values
        self._time += dt
        # a part that ends on a step must not wait for the next by round-off
        if self._time >= self._part_length * (1.0 - 1e-9):
            self._parts[1:], self._times[1:] = self._parts[:-1].copy(), self._times[:-1].copy()
            self._parts[0, ids], self._times[0] = self._now, self._time
            self._full = self._parts.sum(axis=0)
            self._now[:], self._time = 0.0, 0.0

    def mean(self, ids: np.ndarray) -> np.ndarray:
        """Return the mean of each particle (n,)."""
        time = max(float(self._times.sum()) + self._time, (PARTS - 1) * self._part_length)
        mean: np.ndarray = (self._full[ids] + self._now) / time
        return mean

    def permute(self, order: np.ndarray) -> None:
        """Follow the state into a new order."""
        self._now = self._now[order]

    def carried(self, ids: np.ndarray) -> dict[str, np.ndarray]:
        """Return what there is of each of the particles numbered `ids`, by name, a row a particle."""
        return {"parts": self._parts.T[ids], "part": self._now}

    def history(self) -> dict[str, np.ndarray]:
        """Return the times of the parts, by name."""
        return {"part_times": self._times, "part_time": np.array([self._time])}

    def restore(self, carried: dict[str, np.ndarray], history: dict[str, np.ndarray], ids: np.ndarray) -> None:
        """Go back to where `carried`, of the particles numbered `ids`, and `history` were taken."""
        self._parts[:, ids], self._times[...] = carried["parts"].T, history["part_times"]
        self._now[...], self._time = carried["part"], float(history["part_time"][0])
        self._full = self._parts.sum(axis=0)
