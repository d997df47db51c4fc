"""Scalar functions under compilation, and the registration of all operations of this package with numba."""

from __future__ import annotations

from functools import cache
from typing import Any

import numba
from numba.core.sigutils import normalize_signature

from hvisph.compiler.vector.gather import Many
from hvisph.compiler.vector.lane_masks import mask
from hvisph.compiler.vector.lanes import strict

from . import if_conversion
from .codegen import LoopDispatcher
from .component_functions import for_each_operation
from .dispatch import LEAN, OPTIONS
from .fingerprint import ATTRIBUTE, read_names
from .lazy_import import CompiledFunction
from .threads import primitives as sharing  # noqa: F401  registers its functions
from .unroll import register_operation
from .vector import contiguous_load, intrinsics, neighbour_filter, pointers  # noqa: F401  registers its functions

for_each_operation(register_operation)

# Functions that allocate arrays need reference counts. All others do without: counting each array in and out of a call
# takes 10 ns, because threads share the counters.
_ALLOCATING = {"empty", "zeros"}


class Scalar(LoopDispatcher):
    """A compiled scalar function; Python calls it through a second one that is made on demand.

    Loops may call it with strict lanes, several particles at once, see `compiler.if_conversion`.
    """

    def __call__(self, *arguments: Any) -> Any:
        """Call it from Python."""
        return _entry(self)(*arguments)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return the call template for arguments of these types."""
        wide = _wide(args)
        if wide:
            return _in_lanes(self, wide).get_call_template(args, kws)
        return super().get_call_template(args, kws)

    def get_overload(self, sig: Any) -> Any:
        """Return the compiled form for a signature."""
        wide = _wide(normalize_signature(sig)[0])
        return _in_lanes(self, wide).get_overload(sig) if wide else super().get_overload(sig)


def _wide(kinds: Any) -> tuple[int, ...]:
    """Return the indices of the types that contain strict lanes."""
    return tuple(k for k, kind in enumerate(kinds) if _holds_lanes(kind))


def _holds_lanes(kind: Any) -> bool:
    if isinstance(kind, numba.types.BaseTuple):
        return any(map(_holds_lanes, kind))
    return kind in (strict, mask) or isinstance(kind, Many)


def make_scalar(one: CompiledFunction) -> Any:
    """Return the numba function of a scalar function."""
    making = any(kind == ATTRIBUTE and name in _ALLOCATING for kind, name in read_names(one.py_func.__code__))
    options = {"forceinline": True} if one.inlined else {}
    return Scalar(one.py_func, targetoptions=LEAN | options | {"_nrt": making})


@cache
def _in_lanes(function: Scalar, wide: tuple[int, ...]) -> Any:
    """Return the function that applies `function` to each lane of the arguments `wide`."""
    if function.targetoptions.get("forceinline"):
        try:
            text = if_conversion.convert(function.py_func, wide)
            return LoopDispatcher(text, targetoptions=LEAN | {"forceinline": True})
        except if_conversion.UnsuitableError:
            function = make_scalar(CompiledFunction(function.py_func, False, make_scalar))
    return LoopDispatcher(if_conversion.apply_per_lane(function), targetoptions=LEAN)


@cache
def _entry(function: Scalar) -> Any:
    return LoopDispatcher(lambda *arguments: function(*arguments), targetoptions=OPTIONS)
