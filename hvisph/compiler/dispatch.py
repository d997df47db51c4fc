"""Numba functions for the objects of `compiler.lazy_import`: loops, which are cached, scalar functions, operations."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numba
from numba import types
from numba.core.base import BaseContext
from numba.core.sigutils import normalize_signature
from numba.core.typing.templates import Signature
from numba.extending import typeof_impl

from hvisph.compiler.vector.lane_masks import mask
from hvisph.compiler.vector.lanes import strict
from hvisph.compiler.vector.memory_access import Many

from . import if_conversion, thread_primitives  # noqa: F401  registers its functions
from .cache import LoopCache
from .codegen import LoopDispatcher
from .fingerprint import ATTRIBUTE, read_names
from .lazy_import import CompiledFunction, LazyFunction, for_each_operation, prange
from .unroll import register_operation
from .vector import intrinsics, memory_access, neighbour_filter  # noqa: F401  registers their functions

Types = tuple[types.Type, ...]

# No fastmath: with it the bits of a loop may depend on whether it is compiled or read from the cache. The vectors of
# `compiler.vector.lanes`, which take most of the time, have flags of their own.
OPTIONS: dict[str, bool | str] = {"nopython": True, "error_model": "numpy", "boundscheck": False}

# Scalar functions are called by loops only. Entries for Python would take half of their compilation time.
LEAN = OPTIONS | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}

# Functions that allocate arrays need reference counts. All others do without: counting each array in and out of a call
# takes 10 ns, because threads share the counters.
_ALLOCATING = {"empty", "zeros"}

for_each_operation(register_operation)


@typeof_impl.register(CompiledFunction)
def _type_of_compiled(function: CompiledFunction, context: BaseContext) -> types.Type:
    return types.Dispatcher(function.function)


@typeof_impl.register(LazyFunction)
def _type_of_later(function: LazyFunction, context: BaseContext) -> types.Type:
    return LoopDispatcher.targetdescr.typing_context.resolve_value_type(function.function)


class _Loop(LoopDispatcher):
    """A compiled loop that Python calls."""

    def _compilation_chain_init_hook(self) -> None:
        """Skip the search for extensions of numba among the installed packages."""

    def compile(self, sig: Signature) -> object:
        """Return the loop's entry for these types, from the cache or compiled."""
        try:
            return super().compile(sig)
        finally:
            self._cache.end_compilation()


def make_loop(source: CompiledFunction, parallel: bool, report: Callable[[str], None]) -> LoopDispatcher:
    """Return the numba function of a loop; `report` is called with its name before it is compiled."""
    function = source.py_func
    namespace = function.__globals__  # `specialise` copied them
    namespace.update({name: numba.prange for name, value in namespace.items() if value is prange})
    loop = _Loop(function, targetoptions=OPTIONS | {"parallel": parallel, "nogil": True, "no_cfunc_wrapper": True})
    loop._cache = LoopCache(function, lambda: report(function.__name__))
    return loop


class Scalar(LoopDispatcher):
    """A compiled scalar function; Python calls it through a second one that is made on demand.

    Loops may call it with strict lanes, several particles at once, see `compiler.if_conversion`.
    """

    def __call__(self, *arguments: Any) -> Any:
        """Call it from Python."""
        return _entry(self)(*arguments)

    def get_call_template(self, args: Types, kws: dict[str, types.Type]) -> object:
        """Return the call template for arguments of these types."""
        lane_arguments = _wide(args)
        if lane_arguments:
            return _in_lanes(self, lane_arguments).get_call_template(args, kws)
        return super().get_call_template(args, kws)

    def get_overload(self, sig: Signature) -> object:
        """Return the compiled form for a signature."""
        lane_arguments = _wide(normalize_signature(sig)[0])
        return _in_lanes(self, lane_arguments).get_overload(sig) if lane_arguments else super().get_overload(sig)


def _wide(kinds: Types) -> tuple[int, ...]:
    """Return the indices of the types that contain strict lanes."""
    return tuple(k for k, kind in enumerate(kinds) if _holds_lanes(kind))


def _holds_lanes(kind: types.Type) -> bool:
    if isinstance(kind, types.BaseTuple):
        return any(map(_holds_lanes, kind))
    return kind in (strict, mask) or isinstance(kind, Many)


def make_scalar(function: CompiledFunction) -> Scalar:
    """Return the numba function of a scalar function."""
    allocates = any(kind == ATTRIBUTE and name in _ALLOCATING for kind, name in read_names(function.py_func.__code__))
    options = {"forceinline": True} if function.inlined else {}
    return Scalar(function.py_func, targetoptions=LEAN | options | {"_nrt": allocates})


@cache
def _in_lanes(function: Scalar, lane_arguments: tuple[int, ...]) -> LoopDispatcher:
    """Return the function that applies `function` to each lane of the arguments `lane_arguments`."""
    if function.targetoptions.get("forceinline"):
        try:
            text = if_conversion.convert(function.py_func, lane_arguments)
            return LoopDispatcher(text, targetoptions=LEAN | {"forceinline": True})
        except if_conversion.UnsuitableError:
            function = make_scalar(CompiledFunction(function.py_func, False, make_scalar))
    return LoopDispatcher(if_conversion.apply_per_lane(function), targetoptions=LEAN)


@cache
def _entry(function: Scalar) -> LoopDispatcher:
    return LoopDispatcher(lambda *arguments: function(*arguments), targetoptions=OPTIONS)
