"""Sets of experiments from folders with `set.yaml`, `shots.csv` and `measured.csv`."""

from __future__ import annotations

import csv
from pathlib import Path

from pydantic import ValidationError

from hvisph.case.experiments import ExperimentSet
from hvisph.core.errors import CaseError

from .errors import raise_all, translate
from .paths import SET, data_folder
from .yaml_reader import read_yaml


def bundled_sets() -> dict[str, Path]:
    """Return the folders of the bundled sets of experiments by name."""
    return {path.parent.name: path.parent for path in sorted((data_folder("cases") / "validation").glob(f"*/{SET}"))}


def load_set(folder: Path) -> ExperimentSet:
    """Load a set of experiments; raises `CaseError` for invalid input."""
    document = read_yaml(folder / SET)
    try:
        return ExperimentSet.model_validate(document.value)
    except ValidationError as error:
        raise_all(translate(error, ExperimentSet, document.value, document.places))
        raise


def read_table(path: Path) -> list[dict[str, str]]:
    """Return the rows of a CSV file by its heads; raises `CaseError` where it cannot be read."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise CaseError(f"{path} cannot be read: {error}") from None
    for line, row in enumerate(rows, 2):
        if None in row or None in row.values():
            raise CaseError(f"{path}, line {line}: as many cells as heads are needed")
    return rows
