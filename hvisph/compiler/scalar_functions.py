"""Scalar functions under compilation, and all that numba must know of to compile what names them."""

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
from .component_functions import each_operation
from .dispatch import LEAN, OPTIONS
from .fingerprint import ATTRIBUTE, names_read
from .lazy_import import Compiled
from .threads import primitives as sharing  # noqa: F401  numba learns of what they have
from .unroll import unrolled
from .vector import contiguous_load, intrinsics, neighbour_filter, pointers  # noqa: F401  numba learns of what they have

each_operation(unrolled)

# What makes an array counts who holds it. What is only handed arrays need not: to count them in and out of every call
# takes 10 ns each, for threads share the counters.
_MAKING = {"empty", "zeros"}


class Scalar(LoopDispatcher):
    """A compiled scalar function that Python calls through another one, made when it does.

    Loops may call it with strict lanes, many particles at once: see `compiler.if_conversion`.
    """

    def __call__(self, *arguments: Any) -> Any:
        """Call it from Python."""
        return _entry(self)(*arguments)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return how the function is called with arguments of these types."""
        wide = _wide(args)
        if wide:
            return _in_lanes(self, wide).get_call_template(args, kws)
        return super().get_call_template(args, kws)

    def get_overload(self, sig: Any) -> Any:
        """Return the compiled form for a signature."""
        wide = _wide(normalize_signature(sig)[0])
        return _in_lanes(self, wide).get_overload(sig) if wide else super().get_overload(sig)


def _wide(kinds: Any) -> tuple[int, ...]:
    """Return which of some types hold strict lanes."""
    return tuple(k for k, kind in enumerate(kinds) if _holds_lanes(kind))


def _holds_lanes(kind: Any) -> bool:
    if isinstance(kind, numba.types.BaseTuple):
        return any(map(_holds_lanes, kind))
    return kind in (strict, mask) or isinstance(kind, Many)


def made_scalar(one: Compiled) -> Any:
    """Return what numba makes of a scalar function."""
    making = any(kind == ATTRIBUTE and name in _MAKING for kind, name in names_read(one.py_func.__code__))
    options = {"forceinline": True} if one.inlined else {}
    return Scalar(one.py_func, targetoptions=LEAN | options | {"_nrt": making})


@cache
def _in_lanes(function: Scalar, wide: tuple[int, ...]) -> Any:
    """Return what does for lanes in the arguments `wide` what `function` does for numbers."""
    if function.targetoptions.get("forceinline"):
        try:
            text = if_conversion.in_lanes(function.py_func, wide)
            return LoopDispatcher(text, targetoptions=LEAN | {"forceinline": True})
        except if_conversion.UnsuitableError:
            function = made_scalar(Compiled(function.py_func, False, made_scalar))
    return LoopDispatcher(if_conversion.lane_by_lane(function), targetoptions=LEAN)


@cache
def _entry(function: Scalar) -> Any:
    return LoopDispatcher(lambda *arguments: function(*arguments), targetoptions=OPTIONS)
