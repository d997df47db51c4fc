"""Random values of a sample: points of the unit cube, and the distribution that each coordinate stands for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hvisph.case import sweep as models

from .parameters import Scale, Values


def draw_sample(vary: models.Sample, base: Mapping[str, object]) -> list[Values]:
    """Return the values of the cases of a sample; the same for the same seed.

    More cases with the same seed begin with the same ones for `sobol` and `random`; a Latin hypercube is
    another for another count.
    """
    draws = {path: _distribution(path, one, base) for path, one in vary.values.items()}
    cube = _unit_cube(vary.method, len(draws), vary.count, vary.seed)
    return [{path: draw(float(u)) for (path, draw), u in zip(draws.items(), row, strict=True)} for row in cube]


def _unit_cube(method: str, dimensions: int, count: int, seed: int) -> np.ndarray:
    """Return points of the unit cube, (count, dimensions)."""
    from scipy.stats import qmc

    rng = np.random.default_rng(seed)
    if method == "random":
        return rng.random((count, dimensions))
    if method == "latin_hypercube":
        return qmc.LatinHypercube(dimensions, rng=rng).random(count)
    power = int(np.ceil(np.log2(count))) if count > 1 else 0
    return qmc.Sobol(dimensions, rng=rng).random_base2(power)[:count]


def _distribution(path: str, one: Any, base: Mapping[str, Any]) -> Any:
    """Return a function from a probability to a value of the setting."""
    if isinstance(one, models.Choice):
        return lambda u: one.choice[min(int(u * len(one.choice)), len(one.choice) - 1)]
    scale, drawn = distribution(path, one, base)
    return lambda u: scale.value(float(drawn.ppf(min(max(u, 1e-12), 1.0 - 1e-12))))


def distribution(path: str, one: Any, base: Mapping[str, Any]) -> tuple[Scale, Any]:
    """Return the scale of a setting and its distribution in that scale, a frozen one of `scipy.stats`."""
    from scipy.stats import norm, uniform

    if isinstance(one, models.Uniform):
        scale = Scale(path, one.uniform, base)
        low, high = scale.numbers
        return scale, uniform(low, high - low)
    scale = Scale(path, [one.normal.mean, one.normal.sd], base)
    return scale, norm(*scale.numbers)
