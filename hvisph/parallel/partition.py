"""Domain decomposition by recursive bisection of (coordinate, number)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Cut:
    """Bisection of a region, or a part (`count` 1).

    The lower side contains the particles whose (coordinate, number) is below (`at`, `number`); `upper` is the index of
    the upper side in the list of cuts, and the lower side follows this cut.
    """

    first: int
    count: int
    axis: int = 0
    at: float = 0.0
    number: int = 0
    upper: int = -1


class Parts:
    """Boxes of equal work, unbounded outwards, for any number of parts.

    The number breaks ties, so that a plane of a lattice can be divided.  `weights` are the work of each particle.
    """

    def __init__(self, count: int, positions: np.ndarray, numbers: np.ndarray, weights: np.ndarray | None = None):
        self.cuts: list[Cut] = []
        weights = np.ones(len(positions)) if weights is None else weights
        self._cut(positions, numbers.astype(np.int64), weights, 0, count)

    def _cut(self, at: np.ndarray, numbers: np.ndarray, weights: np.ndarray, first: int, count: int) -> None:
        place = len(self.cuts)
        self.cuts.append(Cut(first, count))
        if count == 1:
            return
        lower = count // 2
        if not len(at):  # nobody: all to the first part
            self._sides(place, Cut(first, count, 0, np.inf, 0), (at, numbers, weights), np.zeros(0, bool), lower)
            return
        axis = int(np.ptp(at, axis=0).argmax())
        order = np.lexsort((numbers, at[:, axis]))
        cumulated = np.cumsum(weights[order])
        k = int(np.searchsorted(cumulated, cumulated[-1] * lower / count))
        first_above = order[min(max(k, 1), len(order) - 1)]
        cut = Cut(first, count, axis, float(at[first_above, axis]), int(numbers[first_above]))
        self._sides(place, cut, (at, numbers, weights), _lies_below(at, numbers, cut), lower)

    def _sides(self, place: int, cut: Cut, held: tuple[np.ndarray, np.ndarray, np.ndarray], below: np.ndarray,
               lower: int) -> None:  # fmt: skip
        at, numbers, weights = held
        self._cut(at[below], numbers[below], weights[below], cut.first, lower)
        upper = len(self.cuts)
        self._cut(at[~below], numbers[~below], weights[~below], cut.first + lower, cut.count - lower)
        self.cuts[place] = Cut(cut.first, cut.count, cut.axis, cut.at, cut.number, upper)

    def owner(self, positions: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        """Return the part (n,) of each particle."""
        owners = np.zeros(len(positions), np.int64)
        numbers = numbers.astype(np.int64)
        stack = [(0, np.arange(len(positions)))]
        while stack:
            place, chosen = stack.pop()
            cut = self.cuts[place]
            if cut.count == 1:
                owners[chosen] = cut.first
                continue
            below = _lies_below(positions[chosen], numbers[chosen], cut)
            stack += [(place + 1, chosen[below]), (cut.upper, chosen[~below])]
        return owners


def _lies_below(positions: np.ndarray, numbers: np.ndarray, cut: Cut) -> np.ndarray:
    x = positions[:, cut.axis]
    below: np.ndarray = (x < cut.at) | ((x == cut.at) & (numbers < cut.number))
    return below
