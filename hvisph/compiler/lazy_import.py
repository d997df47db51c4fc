"""What numba is told of when it compiles: until then nothing here needs it, a quarter of the time of a `check`.

Compiled functions name others as Python does, so numba meets these objects among their globals; `compiler.dispatch`
tells it what they stand for.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from importlib import import_module
from typing import Any


class Later:
    """A function of a module of `core` that writes machine code, imported when a loop is compiled."""

    def __init__(self, module: str, name: str) -> None:
        self._place = f"{__package__}.{module}", name

    def __repr__(self) -> str:
        return ".".join(self._place)

    @cached_property
    def made(self) -> Any:
        """The function itself."""
        module, name = self._place
        return getattr(import_module(module), name)


class Compiled:
    """A function that numba compiles, `py_func`; `inlined` is None for a loop, which Python calls."""

    def __init__(self, function: Callable[..., Any], inlined: bool | None, make: Callable[[Any], Any]) -> None:
        self.py_func, self.inlined, self._make = function, inlined, make
        self.__name__, self.__doc__, self.__module__ = function.__name__, function.__doc__, function.__module__

    def __call__(self, *arguments: Any) -> Any:
        """Call what numba makes of it."""
        return self.made(*arguments)

    def __reduce__(self) -> str:
        """Return its name: another process that it is sent to has its own."""
        return self.py_func.__qualname__

    @cached_property
    def made(self) -> Any:
        """What numba makes of it."""
        return self._make(self)

    @property
    def is_made(self) -> bool:
        """Whether anything has asked for it yet."""
        return "made" in vars(self)


class prange:  # noqa: N801  as numba has it, which takes its place in compiled loops
    """A range that threads share."""

    def __new__(cls, *bounds: Any) -> Any:
        """Return Python's."""
        return range(*bounds)
