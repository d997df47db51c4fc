"""Numba functions for the objects of `compiler.lazy_import`: loops, which are cached, and scalar functions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numba
from numba.core.base import BaseContext
from numba.extending import typeof_impl

from .cache import LoopCache
from .codegen import LoopDispatcher
from .lazy_import import CompiledFunction, LazyFunction, prange

# No fastmath: with it the bits of a loop may depend on whether it is compiled or read from the cache. The vectors of
# `compiler.vector.lanes`, which take most of the time, have flags of their own.
OPTIONS: dict[str, Any] = {"nopython": True, "error_model": "numpy", "boundscheck": False}

# Scalar functions are called by loops only. Entries for Python would take half of their compilation time.
LEAN = OPTIONS | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}

_listeners: list[Callable[[str], None]] = []


@typeof_impl.register(CompiledFunction)
def _type_of_compiled(one: CompiledFunction, context: BaseContext) -> Any:
    return numba.types.Dispatcher(one.made)


@typeof_impl.register(LazyFunction)
def _type_of_later(one: LazyFunction, context: BaseContext) -> Any:
    return LoopDispatcher.targetdescr.typing_context.resolve_value_type(one.made)


class _Loop(LoopDispatcher):
    """A compiled loop that Python calls."""

    def _compilation_chain_init_hook(self) -> None:
        """Skip the search for extensions of numba among the installed packages."""

    def compile(self, sig: Any) -> Any:
        """Return the loop's entry for these types, from the cache or compiled."""
        try:
            return super().compile(sig)
        finally:
            self._cache.end_compilation()


def make_loop(one: CompiledFunction, parallel: bool, register_operations: Callable[[], None]) -> Any:
    """Return the numba function of a loop; `register_operations` is called before it is compiled."""
    function = one.py_func
    own = function.__globals__  # `specialise` copied them
    own.update({name: numba.prange for name, value in own.items() if value is prange})
    loop = _Loop(function, targetoptions=OPTIONS | {"parallel": parallel, "nogil": True, "no_cfunc_wrapper": True})

    def prepare() -> None:
        register_operations()
        for listener in _listeners:
            listener(function.__name__)

    loop._cache = LoopCache(function, prepare)
    return loop


@contextmanager
def report_compilation(listener: Callable[[str], None]) -> Iterator[None]:
    """See `compiler.jit`."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)
