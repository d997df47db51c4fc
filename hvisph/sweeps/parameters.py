"""Values of settings: numbers with units, combinations, cells of tables."""

import itertools
import re
from collections.abc import Mapping, Sequence

from hvisph.case.case import Case
from hvisph.case.units import parse_quantity
from hvisph.casefile.model_fields import walk
from hvisph.core.errors import CaseError
from hvisph.core.text import Plain

EXPERIMENT = "experiment."  # a column of an experiment, carried along beside the computed values
MATERIAL = "material."  # begins the path of a parameter of a fitted material
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")

FACTORS = {"": 1.0, "m/s": 1.0, "km/s": 1000.0, "mm/us": 1000.0}  # of velocities [m/s]

Values = Plain


class Scale:
    """Numbers of one setting in the unit that all `values` are written in, else in SI.

    `base`: case by which the dimension of the setting is found. Raises `CaseError` for text that is no number, or of
    another dimension.
    """

    def __init__(self, path: str, values: Sequence[object], base: Mapping[str, object]):
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


def split(path: str, value: object) -> tuple[float, str]:
    """Return number and unit of a value; raises `CaseError` that names `path`."""
    match = _NUMBER.fullmatch(str(value))
    if match is None or isinstance(value, bool):
        raise CaseError(f"'{value}' is no number; write it like 3.1 km/s", where=path)
    return float(match[1]), match[2]


def product(axes: Mapping[str, Sequence[object]]) -> list[Values]:
    """Return every combination of the values of several settings."""
    return [dict(zip(axes, combination, strict=True)) for combination in itertools.product(*axes.values())]


def plain(cell: str) -> object:
    """Return a cell of a table as a number, a truth or text."""
    text = cell.strip()
    words = {"true": True, "false": False, "null": None}
    if text in words:
        return words[text]
    for number_type in (int, float):
        try:
            return number_type(text)
        except ValueError:
            pass
    return text
