"""Placeholders for compiled functions, and component functions, which do not need numba.

Compiled functions call each other by name, so numba finds these objects among their globals. `compiler.dispatch`
defines their types. Without numba a `check` takes three quarters of the time.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from importlib import import_module
from typing import Any

# A function in plain Python: a template, or one that numba compiles.
PythonFunction = Callable[..., Any]
# Constants and compiled functions bound to the free names of a template.
Options = dict[str, Any]


class LazyFunction:
    """A function of this package that emits machine code, imported when a loop is compiled."""

    def __init__(self, module: str, name: str) -> None:
        self._place = f"{__package__}.{module}", name

    def __repr__(self) -> str:
        return ".".join(self._place)

    @cached_property
    def function(self) -> Any:
        """The function itself."""
        module, name = self._place
        return getattr(import_module(module), name)


class CompiledFunction:
    """A function that numba compiles, `py_func`; `inlined` is None for a loop that Python calls."""

    def __init__(
        self, function: PythonFunction, inlined: bool | None, make: Callable[[CompiledFunction], object]
    ) -> None:
        self.py_func, self.inlined, self._make = function, inlined, make
        self.__name__, self.__doc__, self.__module__ = function.__name__, function.__doc__, function.__module__

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled function."""
        return self.function(*arguments)

    def __reduce__(self) -> str:
        """Return its name, by which another process finds its own copy."""
        return self.py_func.__qualname__

    @cached_property
    def function(self) -> Any:
        """The numba function."""
        return self._make(self)


class prange:  # noqa: N801  numba's name; numba's class replaces it in compiled loops
    """A range that is shared between threads."""

    def __new__(cls, *bounds: Any) -> Any:
        """Return Python's."""
        return range(*bounds)


_written: list[PythonFunction] = []
_readers: list[Callable[[PythonFunction], None]] = []


def operation(write: PythonFunction) -> Any:
    """Let compiled functions call `write`, a function of the components of tuples or of the items of rows.

    `write` remains a plain Python function. When a loop is compiled it is executed with symbolic arguments: literal
    integers are Python's, integers are row numbers, floats, lanes and tuples of them are numbers with +, -, *, /, and
    arrays are read and written by row and slot. It may branch on lengths and literals, never on values.
    """
    vars(write)["py_func"] = write  # as other compiled functions have it
    _written.append(write)
    for read in _readers:
        read(write)
    return write


def for_each_operation(read: Callable[[PythonFunction], None]) -> None:
    """Call `read` with every operation, present and future."""
    _readers.append(read)
    for write in _written:
        read(write)
