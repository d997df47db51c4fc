"""A gauge against its exact history: plateaus, arrivals, mean difference.

The exact history holds values from certain times on. Where it holds one for long it has a plateau, and
the gauge is compared over the middle of it; between two plateaus it has a rise or a fall, and its arrival
is when the mean of the two is passed.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hvisph.measures.compare import mean_difference

# Share of a plateau at either end that is left out: numerical fronts are a few h wide.
EDGE = 0.25


@dataclass(frozen=True)
class Plateau:
    """A stretch on which the exact history is constant.

    Parameters
    ----------
    begin, end
        When [s].
    exact, found
        The exact value, and the gauge's mean over the middle half.
    """

    begin: float
    end: float
    exact: float
    found: float


@dataclass(frozen=True)
class Arrival:
    """A change between two plateaus: when the mean of both is passed, exactly and by the gauge [s]."""

    exact: float
    found: float


@dataclass(frozen=True)
class Comparison:
    """A gauge beside its exact history.

    Parameters
    ----------
    plateaus, arrivals
        In order of time.
    mean_difference
        Mean over time of the difference's size.
    """

    plateaus: tuple[Plateau, ...]
    arrivals: tuple[Arrival, ...]
    mean_difference: float


def compare_gauge(
    times: np.ndarray,
    values: np.ndarray,
    exact_times: np.ndarray,
    exact_values: np.ndarray,
    *,
    shortest: float,
    smallest: float,
) -> Comparison:
    """Compare a gauge with its exact history.

    Parameters
    ----------
    times, values
        What the gauge recorded.
    exact_times, exact_values
        Times from which on the exact values hold, the first at or before the gauge's.
    shortest
        Shortest stretch that counts as a plateau [s].
    smallest
        Smallest difference of two plateaus that counts as an arrival; changes below a tenth of it do not
        end a plateau.
    """
    end = float(times[-1])
    stretches = _stretches(exact_times, exact_values, end, 0.1 * smallest)
    long = [s for s in stretches if s[1] - s[0] >= shortest]
    plateaus = []
    for begin, finish, value in long:
        inner = EDGE * (finish - begin)
        middle = (times >= begin + inner) & (times <= finish - inner)
        if middle.any():
            plateaus.append(Plateau(begin, finish, value, float(values[middle].mean())))
    arrivals = []
    for before, after in pairwise(plateaus):
        if abs(after.exact - before.exact) < smallest:
            continue
        mean = 0.5 * (before.exact + after.exact)
        start, finish = 0.5 * (before.begin + before.end), 0.5 * (after.begin + after.end)
        rising = after.exact > before.exact
        there = (times >= start) & (times <= finish)
        exact = _passing(*_corners(exact_times, exact_values, end), mean, start, finish, rising)
        arrivals.append(Arrival(exact, _passing(times[there], values[there], mean, start, finish, rising)))
    sampled = exact_values[np.searchsorted(exact_times, times, side="right") - 1]
    return Comparison(tuple(plateaus), tuple(arrivals), mean_difference(times, values, sampled))


def _stretches(times: np.ndarray, values: np.ndarray, end: float, alike: float) -> list[tuple[float, float, float]]:
    """Return (begin, end, value) of the stretches over which the value changes by less than `alike`."""
    stretches: list[list[float]] = []
    bounds = np.append(times, end)
    for begin, finish, value in zip(bounds[:-1], bounds[1:], values, strict=True):
        if stretches and abs(value - stretches[-1][2]) < alike:
            stretches[-1][1] = float(finish)
        else:
            stretches.append([float(begin), float(finish), float(value)])
    return [(a, b, c) for a, b, c in stretches]


def _corners(times: np.ndarray, values: np.ndarray, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the exact history's jumps as a line through the middles of its stretches: fans become straight."""
    corners = np.append(np.repeat(times, 2)[1:], end)
    return corners, np.repeat(values, 2)


def _passing(times: np.ndarray, values: np.ndarray, level: float, start: float, finish: float, rising: bool) -> float:
    """Return when a curve first passes `level` between `start` and `finish`; NaN where it does not."""
    inside = (times >= start) & (times <= finish)
    times, values = times[inside], values[inside]
    beyond = values >= level if rising else values <= level
    if not beyond.any():
        return float("nan")
    after = int(beyond.argmax())
    if after == 0:
        return float(times[0])
    low, high = values[after - 1], values[after]
    share = (level - low) / (high - low) if high != low else 1.0
    return float(times[after - 1] + share * (times[after] - times[after - 1]))
