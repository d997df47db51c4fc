"""Values of the varied settings: grids, lists and random samples."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from hvisph.case import sweep as models
from hvisph.casefile.loader import read_table
from hvisph.core.errors import CaseError, locate
from hvisph.core.text import PlainMapping

from .calibration import Calibration
from .parameters import Scale, Values, plain, product
from .statistics import perturbations


def draw_sample(vary: models.Sample, base: Mapping[str, object]) -> list[Values]:
    """Return the cases of a sample by its seed; more cases extend `sobol` and `random`, not a hypercube."""
    draws = {path: _distribution(path, setting, base) for path, setting in vary.values.items()}
    cube = _unit_cube(vary.method, len(draws), vary.count, vary.seed)
    return [{path: draw(float(u)) for (path, draw), u in zip(draws.items(), row, strict=True)} for row in cube]


def _unit_cube(method: str, dimensions: int, count: int, seed: int) -> np.ndarray:
    """Return points of the unit cube, (count, dimensions)."""
    rng = np.random.default_rng(seed)
    if method == "random":
        return rng.random((count, dimensions))
    if method == "latin_hypercube":
        return scipy.stats.qmc.LatinHypercube(dimensions, rng=rng).random(count)
    power = int(np.ceil(np.log2(count))) if count > 1 else 0
    return scipy.stats.qmc.Sobol(dimensions, rng=rng).random_base2(power)[:count]


def _distribution(path: str, setting: Any, base: PlainMapping) -> Any:
    """Return a function from a probability to a value of the setting."""
    if isinstance(setting, models.Choice):
        return lambda u: setting.choice[min(int(u * len(setting.choice)), len(setting.choice) - 1)]
    scale, law = distribution(path, setting, base)
    return lambda u: scale.value(float(law.ppf(min(max(u, 1e-12), 1.0 - 1e-12))))


def distribution(path: str, setting: Any, base: PlainMapping) -> tuple[Scale, Any]:
    """Return the scale of a setting and its distribution in that scale, a frozen one of `scipy.stats`."""
    if isinstance(setting, models.Uniform):
        scale = Scale(path, setting.uniform, base)
        low, high = scale.numbers
        return scale, scipy.stats.uniform(low, high - low)
    scale = Scale(path, [setting.normal.mean, setting.normal.sd], base)
    return scale, scipy.stats.norm(*scale.numbers)


def points(vary: Any, base: PlainMapping, folder: Path) -> list[Values]:
    """Return the values by path of each case that is known before anything runs, columns of experiments included.

    Tables are read from `folder`. Raises `CaseError` with the invalid key below `vary`.
    """
    if isinstance(vary, models.Grid):
        cases = product({path: list(_axis(path, axis, base)) for path, axis in vary.values.items()})
    elif isinstance(vary, models.Listed):
        cases = [dict(case) for case in vary.cases] if vary.cases is not None else _table(folder / str(vary.file))
    elif isinstance(vary, models.Sample):
        cases = draw_sample(vary, base)
    elif isinstance(vary, models.Converge):
        cases = converge_cases(vary, base)
    elif isinstance(vary, models.Fit):
        cases = Calibration(vary, base).first()
    else:
        scale = Scale(vary.path, [*vary.bracket, vary.tolerance], base)
        if scale.numbers[0] == scale.numbers[1] or not scale.numbers[2] > 0.0:
            raise CaseError("needs two values that differ, and a width above 0", where="bracket")
        fixed = [values | variant for values in product(vary.parameters) for variant in variants(vary, base)]
        cases = [{**values, vary.path: scale.value(number)} for values in fixed for number in scale.numbers[:2]]
    if len(cases) > models.MOST_CASES:
        raise CaseError(f"makes {len(cases)} cases, more than {models.MOST_CASES}")
    return cases


def converge_cases(vary: models.Converge, base: PlainMapping) -> list[Values]:
    """Return the spacings of a convergence study, and the coarsest with each parameter of the material raised."""
    numbers = Scale(vary.path, vary.values, base).numbers
    for value, number in zip(vary.values, numbers, strict=True):
        if numbers.count(number) > 1:
            raise CaseError(f"has {value} twice: what does not change shows no convergence", where="values")
    return _spacings(vary.path, vary.values, numbers, perturbations(vary.fit, base))


def _spacings(path: str, values: Any, numbers: list[float], raised: list[Values]) -> list[Values]:
    """Return a setting for each spacing, and the coarsest one with each of the `raised` parameters."""
    coarsest = values[numbers.index(max(numbers))]
    return [{path: value} for value in values] + [{path: coarsest} | perturbed for perturbed in raised]


def variants(vary: models.Bisect, base: PlainMapping) -> list[Values]:
    """Return the settings with which the limit is computed for its uncertainty; a single empty one without any."""
    if not vary.resolutions:
        return [{}, *perturbations(vary.fit, base)]
    numbers = Scale("resolution", vary.resolutions, base).numbers
    return _spacings("resolution", vary.resolutions, numbers, perturbations(vary.fit, base))


def _axis(path: str, axis: Any, base: PlainMapping) -> Iterator[Any]:
    if isinstance(axis, list):
        if not axis:
            raise CaseError("needs at least one value", where=f"values.{path}")
        yield from axis
        return
    scale = Scale(path, [getattr(axis, "from"), axis.to], base)
    first, last = scale.numbers
    for k in range(axis.count):
        yield scale.value(first + (last - first) * k / (axis.count - 1))


def _table(path: Path) -> list[Values]:
    """Return the rows of a CSV file whose heads are paths of settings."""
    with locate("file"):
        rows = read_table(path)
    if not rows:
        raise CaseError(f"{path} has no rows below its heads", where="file")
    return [{head: plain(cell) for head, cell in row.items() if cell.strip()} for row in rows]
