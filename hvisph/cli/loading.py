"""The case that a command is given, and the place in its file of whatever is found wrong later."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hvisph.core.errors import CaseError


def load(case: str, settings: Sequence[str] | None, resolution: str | None) -> Any:
    """Return the validated case that the arguments of a command mean."""
    from hvisph.casefile.loader import load_case

    return load_case(case, settings or (), resolution)


@contextmanager
def locate_errors(case: str) -> Iterator[None]:
    """Add file and line to a `CaseError` that names a field of the case, raised in this block.

    What shows only when particles are made, such as bodies that overlap, knows the field alone.
    """
    try:
        yield
    except CaseError as error:
        keys = tuple(int(key) if key.isdecimal() else key for key in error.where.split("."))
        if error.file or error.where.startswith("-") or not error.where:
            raise
        from hvisph.casefile.document import read_yaml
        from hvisph.casefile.errors import locate_error
        from hvisph.casefile.loader import find_case

        raise locate_error(keys, error.message, read_yaml(find_case(case)).places) from None


def run_folder(case: str) -> Path:
    """Return where a case runs unless told otherwise: under ``runs``, by its file's or its bundled name.

    Raises `CaseError` where that makes no name for a folder.
    """
    from hvisph.casefile.paths import bundled_cases, run_name

    bundled = case in bundled_cases() and not Path(case).is_file()
    return Path("runs") / (case if bundled else run_name(case))
