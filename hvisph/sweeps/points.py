"""From what a sweep varies to the values of each case."""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from hvisph.case import sweep as models
from hvisph.case.case import Case
from hvisph.case.units import parse_quantity
from hvisph.casefile.describe import walk
from hvisph.core.errors import CaseError

# A column of an experiment, carried along beside what is computed.
EXPERIMENT = "experiment."
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")

Values = dict[str, Any]


class Scale:
    """Numbers of one setting in one unit: the one that they are all written in, else SI.

    Parameters
    ----------
    path
        The setting.
    values
        Numbers, or text with units.
    base
        The case as read, which says what may stand at the path.

    Raises
    ------
    CaseError
        When one of them is no number, or of another dimension.
    """

    def __init__(self, path: str, values: Sequence[Any], base: Mapping[str, Any]):
        parts = [split(path, value) for value in values]
        units = {unit for _, unit in parts}
        if len(units) == 1:
            self.unit = units.pop()
            self.numbers = [number for number, _ in parts]
            return
        keys = tuple(int(key) if key.isdigit() else key for key in path.split("."))
        spot = walk(Case, keys, base)
        if spot is None or spot.quantity is None:
            raise CaseError(f"{', '.join(map(str, values))}: write all with the same unit", where=path)
        self.unit = ""
        try:
            self.numbers = [parse_quantity(str(value), spot.quantity.dimension) for value in values]
        except ValueError as error:
            raise CaseError(str(error), where=path) from None

    def value(self, number: float) -> float | str:
        """Return the value of the setting that `number` means."""
        short = float(f"{number:.8g}")
        return f"{short:.8g} {self.unit}" if self.unit else short


def split(path: str, value: Any) -> tuple[float, str]:
    """Return number and unit of a value; raises `CaseError` that names `path`."""
    match = _NUMBER.fullmatch(str(value))
    if match is None or isinstance(value, bool):
        raise CaseError(f"'{value}' is no number; write it like 3.1 km/s", where=path)
    return float(match[1]), match[2]


def points(vary: Any, base: Mapping[str, Any], folder: Path) -> list[Values]:
    """Return the values of each case that is known before anything runs.

    Parameters
    ----------
    vary
        What the sweep varies: a model of `hvisph.case.sweep`.
    base
        The case as read.
    folder
        Where a table that the sweep names is looked for.

    Returns
    -------
    For each case the values of its settings by path; a list's columns of an experiment among them.

    Raises
    ------
    CaseError
        With the key below `vary` that is to blame.
    """
    if isinstance(vary, models.Grid):
        found = product({path: list(_axis(path, axis, base)) for path, axis in vary.values.items()})
    elif isinstance(vary, models.Listed):
        found = [dict(case) for case in vary.cases] if vary.cases is not None else _table(folder / str(vary.file))
    elif isinstance(vary, models.Sample):
        from hvisph.sweeps.sampling import sampled

        found = sampled(vary, base)
    elif isinstance(vary, models.Converge):
        found = [{vary.path: value} for value in vary.values]
    else:
        scale = Scale(vary.path, [*vary.between, vary.until], base)
        if not scale.numbers[0] < scale.numbers[1] or not scale.numbers[2] > 0.0:
            raise CaseError("needs a lower and a higher value, and a width above 0", where="between")
        fixed = product(getattr(vary, "for"))
        found = [{**one, vary.path: scale.value(number)} for one in fixed for number in scale.numbers[:2]]
    if len(found) > models.MOST_CASES:
        raise CaseError(f"makes {len(found)} cases, more than {models.MOST_CASES}")
    return found


def product(axes: Mapping[str, Sequence[Any]]) -> list[Values]:
    """Return every combination of the values of several settings."""
    return [dict(zip(axes, one, strict=True)) for one in itertools.product(*axes.values())]


def _axis(path: str, axis: Any, base: Mapping[str, Any]) -> Iterator[Any]:
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
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or error
        raise CaseError(f"{path} cannot be read: {reason}", where="file") from None
    if not rows:
        raise CaseError(f"{path} has no rows below its heads", where="file")
    found = []
    for line, row in enumerate(rows, 2):
        if None in row or None in row.values():
            raise CaseError(f"{path}, line {line}: as many cells as heads are needed", where="file")
        found.append({head.strip(): plain(cell) for head, cell in row.items() if cell.strip()})
    return found


def plain(cell: str) -> Any:
    """Return a cell of a table as a number, a truth or text."""
    text = cell.strip()
    words = {"true": True, "false": False, "null": None}
    if text in words:
        return words[text]
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return text
