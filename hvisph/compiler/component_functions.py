"""Functions of tuple components that are plain Python, and are unrolled in compiled loops."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_written: list[Any] = []
_readers: list[Callable[[Any], None]] = []


def operation(write: Any) -> Any:
    """Let compiled functions call `write`, a function of the components of tuples or of the items of rows.

    `write` remains a plain Python function. When a loop is compiled it is executed with symbolic arguments: literal
    integers are Python's, integers are row numbers, floats, lanes and tuples of them are numbers with +, -, *, /, and
    arrays are read and written by row and slot. It may branch on lengths and literals, never on values.
    """
    write.py_func = write  # as other compiled functions have it
    _written.append(write)
    for read in _readers:
        read(write)
    return write


def for_each_operation(read: Callable[[Any], None]) -> None:
    """Call `read` with every operation, present and future."""
    _readers.append(read)
    for write in _written:
        read(write)
