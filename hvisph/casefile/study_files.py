"""Loading of sweep files, and of sets of experiments from folders with `set.yaml`, `shots.csv` and `measured.csv`."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping
from pathlib import Path

from pydantic import ValidationError

from hvisph.case.expectations import ExperimentSet
from hvisph.case.sweep import Sweep
from hvisph.core.errors import CaseError

from .document import Document, plain_document, read_yaml
from .errors import locate_error, raise_all, translate
from .loader import case_document, validate
from .paths import SET, data_folder


def load_sweep(source: str | os.PathLike[str] | Mapping[str, object]) -> tuple[Sweep, Document, Document, Path]:
    """Return a sweep's model, its text, the case that it starts from, and the folder that its paths are relative to.

    Parameters
    ----------
    source
        Path of the file, or a mapping with its keys, whose paths are relative to the present folder.

    Raises
    ------
    CaseError
        For anything wrong with it or with the case that it names.
    """
    if isinstance(source, Mapping):
        document, folder = plain_document(source), Path()
    else:
        document, folder = read_yaml(Path(source)), Path(source).parent
    try:
        sweep = Sweep.model_validate(document.value)
    except ValidationError as error:
        raise_all(translate(error, Sweep, document.value, document.places))
        raise
    near = folder / sweep.case
    try:
        base = case_document(near if near.is_file() else sweep.case)
        validate(base)
    except CaseError as error:
        raise locate_error(("case",), str(error), document.places) from None
    return sweep, document, base, folder


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
