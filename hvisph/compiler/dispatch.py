"""What numba makes of `compiler.lazy_import`: loops, from the cache where they are there, and scalar functions.

The one place with numba's options.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import numba
from numba.core import event
from numba.core.registry import CPUDispatcher, cpu_target
from numba.extending import typeof_impl

from . import cache, codegen
from .cache import LoopCache, MadeElsewhereError, cache_folder
from .lazy_import import Compiled, Later, prange

codegen.install()

# No fastmath here: with it the same loop, compiled in this process or taken from the cache, may round
# differently. The vectors of `compiler.vector.lanes`, where the time goes, carry flags of their own.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "boundscheck": False}

# Scalar functions are called by loops: what would let Python call them takes half of their compilation.
LEAN = OPTIONS | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


@typeof_impl.register(Compiled)
def _of_compiled(one: Compiled, context: Any) -> Any:
    return numba.types.Dispatcher(one.made)


@typeof_impl.register(Later)
def _of_later(one: Later, context: Any) -> Any:
    return cpu_target.typing_context.resolve_value_type(one.made)


class _Loop(CPUDispatcher):
    """A compiled loop that Python calls."""

    def _compilation_chain_init_hook(self) -> None:
        """Look for no extensions of numba among all that is installed."""

    def compile(self, sig: Any) -> Any:
        """Return the loop's entry for these types, from the cache or compiled."""
        try:
            return super().compile(sig)
        finally:
            if isinstance(self._cache, LoopCache):
                self._cache.end_turn()


class _Rehearsed(_Loop):
    """A loop that is compiled when it is called, and computes nothing."""

    def __call__(self, *arguments: Any) -> None:
        types_of_them = tuple(map(self.typeof_pyval, arguments))
        if types_of_them not in self.overloads:
            with suppress(MadeElsewhereError):
                self.compile(types_of_them)


_kind: type[_Loop] = _Loop


def rehearse(loops: list[Any]) -> None:
    """From now on only compile the loops that are called, those that are made included."""
    global _kind
    _kind, cache.in_passing = _Rehearsed, True
    for made in loops:
        made.__class__ = _Rehearsed
        if isinstance(made._cache, LoopCache):
            made._cache.forget_turn()


def made_loop(one: Compiled, parallel: bool, compiling: Callable[[], None]) -> Any:
    """Return what numba makes of a loop; `compiling` is called before it compiles, not where the cache has the loop."""
    function = one.py_func
    own = function.__globals__  # `specialise` copied them
    own.update({name: numba.prange for name, value in own.items() if value is prange})
    made = numba.njit(parallel=parallel, nogil=True, no_cfunc_wrapper=True, **OPTIONS)(function)
    made.__class__ = _kind
    folder = cache_folder()
    if folder is None:
        compiling()
    else:
        made._cache = LoopCache(function, folder, compiling)
    return made


@contextmanager
def heard_compiling(listener: Callable[[str], None]) -> Iterator[None]:
    """See `compiler.jit`."""
    here = os.getpid()

    class Heard(event.Listener):
        def on_start(self, event: Any) -> None:
            if os.getpid() == here:
                listener(event.data["dispatcher"].py_func.__name__)

        def on_end(self, event: Any) -> None:
            pass

    heard = Heard()
    event.register("numba:compile", heard)
    try:
        yield
    finally:
        event.unregister("numba:compile", heard)
