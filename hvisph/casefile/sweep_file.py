"""Loading of sweep files."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from hvisph.case.sweep import Sweep
from hvisph.core.errors import CaseError

from .errors import locate_error, raise_all, translate
from .loader import case_document, validate
from .mapping import plain_document
from .yaml_reader import read_yaml
from .yaml_text import Document


def load_sweep(source: str | os.PathLike[str] | Mapping[str, Any]) -> tuple[Sweep, Document, Document, Path]:
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
