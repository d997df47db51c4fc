"""Running time mean of a particle field."""

from __future__ import annotations

import numpy as np

# Parts of the window: it moves on by whole ones, and is shorter than asked for by less than one.
PARTS = 20


class TrailingMean:
    """Mean over the last `window` [s]; the field is zero before the run."""

    def __init__(self, count: int, window: float):
        self._part_length = window / PARTS
        self._parts = np.zeros((PARTS - 1, count))  # integrals over full parts
        self._times = np.zeros(PARTS - 1)
        self._full = np.zeros(count)  # their sum
        self._now = np.zeros(count)  # integral over the part under way
        self._time = 0.0

    def add(self, values: np.ndarray, dt: float) -> None:
        """Add `values` (n,) that applied for `dt` [s]."""
        self._now += dt * values
        self._time += dt
        # a part that ends on a step must not wait for the next by round-off
        if self._time >= self._part_length * (1.0 - 1e-9):
            self._parts[1:], self._times[1:] = self._parts[:-1].copy(), self._times[:-1].copy()
            self._parts[0], self._times[0] = self._now, self._time
            self._full = self._parts.sum(axis=0)
            self._now[:], self._time = 0.0, 0.0

    def mean(self) -> np.ndarray:
        """Return the mean of each particle (n,)."""
        time = max(float(self._times.sum()) + self._time, (PARTS - 1) * self._part_length)
        mean: np.ndarray = (self._full + self._now) / time
        return mean

    def permute(self, order: np.ndarray) -> None:
        """Reorder with the state."""
        self._parts = self._parts.take(order, axis=1)
        self._full, self._now = self._full[order], self._now[order]

    def get_carried(self) -> dict[str, np.ndarray]:
        """Return the data of each particle by name, a row a particle."""
        return {"parts": self._parts.T, "part": self._now}

    def history(self) -> dict[str, np.ndarray]:
        """Return the durations of the window's intervals, by name."""
        return {"part_times": self._times, "part_time": np.array([self._time])}

    def replace_particles(self, carried: dict[str, np.ndarray]) -> None:
        """Set the data of `get_carried` for the present particles."""
        self._parts, self._now = np.ascontiguousarray(carried["parts"].T), np.array(carried["part"])
        self._full = self._parts.sum(axis=0)

    def restore(self, history: dict[str, np.ndarray]) -> None:
        """Restore the data of `history`."""
        self._times[...], self._time = history["part_times"], float(history["part_time"][0])
