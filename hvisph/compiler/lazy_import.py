"""Placeholders for compiled functions, which do not need numba.

Compiled functions call each other by name, so numba finds these objects among their globals. `compiler.dispatch`
defines their types. Without numba a `check` takes three quarters of the time.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from importlib import import_module
from typing import Any


class LazyFunction:
    """A function of this package that emits machine code, imported when a loop is compiled."""

    def __init__(self, module: str, name: str) -> None:
        self._place = f"{__package__}.{module}", name

    def __repr__(self) -> str:
        return ".".join(self._place)

    @cached_property
    def made(self) -> Any:
        """The function itself."""
        module, name = self._place
        return getattr(import_module(module), name)


class CompiledFunction:
    """A function that numba compiles, `py_func`; `inlined` is None for a loop that Python calls."""

    def __init__(self, function: Callable[..., Any], inlined: bool | None, make: Callable[[Any], Any]) -> None:
        self.py_func, self.inlined, self._make = function, inlined, make
        self.__name__, self.__doc__, self.__module__ = function.__name__, function.__doc__, function.__module__

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled function."""
        return self.made(*arguments)

    def __reduce__(self) -> str:
        """Return its name, by which another process finds its own copy."""
        return self.py_func.__qualname__

    @cached_property
    def made(self) -> Any:
        """The numba function."""
        return self._make(self)


class prange:  # noqa: N801  numba's name; numba's class replaces it in compiled loops
    """A range that is shared between threads."""

    def __new__(cls, *bounds: Any) -> Any:
        """Return Python's."""
        return range(*bounds)
