"""An elastic cantilever that swings: its period by Timoshenko, and how much of the swing is left."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from hvisph_validation.structures import Cantilever

from hvisph.core.particles import Particles
from hvisph.verification.problem import (
    ELASTIC,
    POISSON_RATIO,
    RHO,
    YOUNGS_MODULUS,
    Figure,
    Options,
    Problem,
    Ran,
    Start,
    Trial,
    limit,
)
from hvisph.visualization.curves import Curve

LENGTH, HEIGHT, HELD = 32e-3, 4e-3, 2e-3  # [m]
TIP = 5.0  # speed of the tip at the start [m/s]
PERIODS = 5.0
EXACT = Cantilever(LENGTH, HEIGHT, RHO, YOUNGS_MODULUS, POISSON_RATIO)


def _trials(options: Options) -> Iterator[Trial]:
    dx = options.dx(0.4e-3, 0.5e-3)
    periods = 1.0 if options.quick else PERIODS
    case = {
        "title": "cantilever",
        "kinematics": "plane_strain",
        "resolution": dx,
        "bodies": {"beam": {"material": ELASTIC, "shape": {"type": "box", "size": [HELD + LENGTH, HEIGHT]},
                            "position": [0.5 * (LENGTH - HELD), 0.0]}},
        "clamped": [{"box": {"max": [0.0, None]}}],
        "gauges": {"tip": {"type": "material", "at": [LENGTH, 0.0], "fields": ["velocity"]}},
        "time": {"end": (periods + 0.05) * EXACT.period},
        "output": {"history_every": 10},
    }  # fmt: skip

    def swinging(particles: Particles) -> None:
        x = particles["position"][:, 0]
        particles["velocity"][:, 1] = np.where(x > 0.0, TIP * EXACT.shape(x), 0.0)

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        time, speed = runs[0].history["time"], runs[0].history["gauge.tip.velocity_y"]
        period, amplitude = swing(time, speed, EXACT.period, periods)
        yield Figure("period", period, EXACT.period, 0.05, "s", why="10 particles across")
        yield limit("amplitude loss per period", 1.0 - amplitude ** (1.0 / periods), 1.0 - 0.9 ** (1.0 / PERIODS),
                    why="a tenth of the tip's speed in five periods")  # fmt: skip

    def curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
        time, speed = runs[0].history["time"], runs[0].history["gauge.tip.velocity_y"]
        exact = TIP * np.cos(2.0 * np.pi * time / EXACT.period)
        return {"velocity_y": [Curve("tip", time, speed), Curve("first mode", time, exact, exact=True)]}

    yield Trial(f"dx {1e3 * dx:g} mm", [Start(case, state=swinging)], figures, curves, across="time")


def swing(time: np.ndarray, speed: np.ndarray, expected: float, periods: float) -> tuple[float, float]:
    """Return the period, and the amplitude at the end over that at the start, of a damped cosine.

    Both from a fit of exp(-k t) cos(2 pi t / T + phi), which higher modes do not disturb; not a number where the
    beam does not swing at all.

    `time`, `speed`: the record [s], [m/s].
    `expected`: period to begin from [s].
    `periods`: length of the record in periods.
    """
    from scipy.optimize import curve_fit

    def damped(t: np.ndarray, a: float, b: float, k: float, period: float) -> np.ndarray:
        angle = 2.0 * np.pi * t / period
        return np.asarray(np.exp(-k * t / expected) * (a * np.cos(angle) + b * np.sin(angle)))

    try:
        (_, _, k, period), _ = curve_fit(damped, time, speed, (speed[0], 0.0, 0.1, expected), maxfev=4000)
    except RuntimeError:
        return float("nan"), float("nan")
    amplitude = float(np.exp(-k * periods))
    return (abs(float(period)), amplitude) if 0.2 < abs(period) / expected < 5.0 else (float("nan"), amplitude)


PROBLEM = Problem("cantilever", "elastic cantilever: period and loss over five periods", _trials, slow=True)
