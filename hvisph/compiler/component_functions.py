"""One text for Python and for the compiler: functions over the components of tuples, unrolled where loops call them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_written: list[Any] = []
_readers: list[Callable[[Any], None]] = []


def operation(write: Any) -> Any:
    """Let compiled functions call `write`, which computes with components of tuples, or with items of rows.

    `write` stays the plain Python function that it is. In compiled code its literal integers are Python's, its
    integers row numbers, its floats, lanes and tuples of them numbers with +, -, *, /, and its arrays what one
    reads and writes by row and slot. It may decide by lengths and literals, never by values.
    """
    write.py_func = write  # as compiled functions have it: the text that is compiled
    _written.append(write)
    for read in _readers:
        read(write)
    return write


def each_operation(read: Callable[[Any], None]) -> None:
    """Call `read` with every operation that there is, and from now on with every further one."""
    _readers.append(read)
    for write in _written:
        read(write)
