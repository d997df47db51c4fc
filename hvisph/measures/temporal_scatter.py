"""How far measures still swing at the end of a run: a number that moves is not known better than it moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from .result import Result

LATELY = 0.1  # share of the run over which a swing counts
MOST = 3  # earlier moments that are measured for it
LARGE = 300_000  # particles from which on one has to do


def lately(times: Sequence[float], end: float) -> list[int]:
    """Return which moments before the last tell the swing: those of the last tenth, at most three, at least one.

    Parameters
    ----------
    times
        Of the moments before the end [s], in order.
    end
        Time of the end [s].
    """
    recent = [number for number, time in enumerate(times) if time >= end * (1.0 - LATELY) * (1.0 - 1e-9)]
    if not recent:
        return [len(times) - 1] if len(times) else []
    step = max(1, -(-len(recent) // MOST))
    return recent[::step]


def swinging(results: Mapping[str, Result], end: float, earlier: Sequence[tuple[float, Mapping[str, Result]]]
             ) -> dict[str, Result]:  # fmt: skip
    """Return the results with their swing: half of what they ranged over in the last tenth of the run.

    A single earlier moment that lies further back tells a drift, of which the share of a tenth of the run counts.

    Parameters
    ----------
    results
        At the end.
    end
        Time of the end [s].
    earlier
        Time [s] and results of earlier moments.
    """
    swung = dict(results)
    for name, result in results.items():
        if result.value is None or result.time is not None or name in ("perforated", "perforation_time"):
            continue
        known = [(time, one[name].value) for time, one in earlier if name in one]
        values = [value for _, value in known if value is not None]
        if not values:
            continue
        span = end - min(time for time, _ in known)
        share = min(1.0, LATELY * end / span) if span > 0.0 else 1.0
        swung[name] = result.swinging(0.5 * share * (max(*values, result.value) - min(*values, result.value)))
    return swung
