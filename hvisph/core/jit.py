"""The one place with numba's options: compiled scalar functions and specialised loops.

`compiled` marks a scalar function; it costs nothing until a compiled loop calls it.

`specialise` makes a loop out of a template, as C++ does with template parameters:
the template's free names (a pair law, the number of dimensions, an option) are bound
to constants and functions, so the compiler sees one straight loop. The result is
cached on disk under the fingerprint of all that it is made of.
"""

from __future__ import annotations

import hashlib
import os
import types
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from typing import Any

# Types that do not fit are told by errors that nobody reads: to colour each takes a while.
_coloured = "NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING"
os.environ.setdefault(_coloured, "1")
import numba  # noqa: E402
from numba.core import event  # noqa: E402
from numba.core.dispatcher import Dispatcher  # noqa: E402
from numba.core.registry import CPUDispatcher  # noqa: E402
from numba.core.sigutils import normalize_signature  # noqa: E402

from . import branches, loop_cache, on_demand  # noqa: E402
from .fingerprint import ATTRIBUTE, GLOBAL, names_read  # noqa: E402
from .lanes import strict  # noqa: E402
from .loop_cache import LoopCache, MadeElsewhereError, cache_folder  # noqa: E402
from .many import Many  # noqa: E402
from .masks import mask  # noqa: E402

# Threads wait for each other asleep, unless the user says otherwise. Awake they hold a core that another process needs,
# or the very thread that they wait for: a small case on a busy machine then takes ten times as long. Read when the
# first parallel loop loads OpenMP: GNU's has the first name, LLVM's the second.
if "OMP_WAIT_POLICY" not in os.environ:
    os.environ.setdefault("GOMP_SPINCOUNT", "0")
    os.environ.setdefault("KMP_BLOCKTIME", "0")

on_demand.install()

# No fastmath here: with it the same loop, compiled in this process or taken from the cache, may round
# differently. The vectors of `core.lanes`, where the time goes, carry flags of their own.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "boundscheck": False}

# Scalar functions are called by loops: what would let Python call them takes half of their compilation.
_LEAN = _OPTIONS | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
# What makes an array counts who holds it. What is only handed arrays need not: to count them in and out of every call
# takes 10 ns each, for threads share the counters.
_MAKING = {"empty", "zeros"}


def _lean(function: Any) -> dict[str, Any]:
    """Return numba's options for a function that loops call."""
    making = any(kind == ATTRIBUTE and name in _MAKING for kind, name in names_read(function.__code__))
    return _LEAN | {"_nrt": making}


class _Loop(CPUDispatcher):
    """A compiled loop that Python calls."""

    def compile(self, sig: Any) -> Any:
        """Return the loop's entry for these types, from the cache or compiled."""
        try:
            return super().compile(sig)
        finally:
            if isinstance(self._cache, LoopCache):
                self._cache.end_turn()


class _Scalar(CPUDispatcher):
    """A compiled scalar function that Python calls through another one, made when it does.

    Loops may call it with strict lanes, many particles at once: see `core.branches`.
    """

    def __call__(self, *arguments: Any) -> Any:
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


@cache
def _in_lanes(function: _Scalar, wide: tuple[int, ...]) -> Any:
    """Return what does for lanes in the arguments `wide` what `function` does for numbers."""
    if function.targetoptions.get("forceinline"):
        try:
            return numba.njit(forceinline=True, **_LEAN)(branches.in_lanes(function.py_func, wide))
        except branches.UnsuitableError:
            function = called(function.py_func)
    return numba.njit(**_LEAN)(branches.lane_by_lane(function))


@cache
def _entry(function: _Scalar) -> Any:
    return numba.njit(**_OPTIONS)(lambda *arguments: function(*arguments))


def compiled(function: Callable[..., Any]) -> Any:
    """Mark a scalar function, which is compiled into its caller.

    Left to itself the compiler calls larger functions, such as the stress update, at three times the cost.
    """
    made = numba.njit(forceinline=True, **_lean(function))(function)
    made.__class__ = _Scalar
    return made


def called(function: Callable[..., Any]) -> Any:
    """Mark a scalar function that few materials need: it stays one, so that other loops are short and soon compiled."""
    made = numba.njit(**_lean(function))(function)
    made.__class__ = _Scalar
    return made


prange = numba.prange


@cache
def plain(function: Any) -> Any:
    """Return the plain Python twin of a compiled scalar function, those that it calls included: nothing is compiled."""
    source = function.py_func
    twin = types.FunctionType(source.__code__, {}, source.__name__, source.__defaults__)
    twin.__globals__["__builtins__"] = source.__globals__["__builtins__"]
    held, name = None, ""
    for kind, read in names_read(source.__code__):
        if kind == GLOBAL and read in source.__globals__:
            name, held = read, source.__globals__[read]
            if not isinstance(held, types.ModuleType):
                twin.__globals__[name] = plain(held) if isinstance(held, Dispatcher) else held
        elif kind == ATTRIBUTE and isinstance(held, types.ModuleType):
            member = getattr(held, read)
            module = twin.__globals__.setdefault(name, types.SimpleNamespace())
            setattr(module, read, plain(member) if isinstance(member, Dispatcher) else member)
            held = None
    return twin


def _key(value: Any) -> str:
    if isinstance(value, Dispatcher):
        value = value.py_func
    if isinstance(value, types.FunctionType):
        return f"{value.__module__}.{value.__qualname__}"
    return repr(value)


def _bind(template: Callable[..., Any], name: str, bindings: dict[str, Any]) -> types.FunctionType:
    namespace = dict(template.__globals__)
    namespace.update(bindings)
    copy = types.FunctionType(template.__code__, namespace, name, template.__defaults__, None)
    copy.__qualname__, copy.__module__, copy.__doc__ = name, template.__module__, template.__doc__
    return copy


@cache
def _narrowed(function: Any, constants: tuple[tuple[str, Any], ...]) -> Any:
    source, held = function.py_func, dict(constants)
    bindings = {}
    if not any(
        name in held or isinstance(source.__globals__.get(name), Dispatcher) for name in source.__code__.co_names
    ):
        return function
    for name in {name for kind, name in names_read(source.__code__) if kind == GLOBAL}:
        value = source.__globals__.get(name)
        bound = _narrowed(value, constants) if isinstance(value, Dispatcher) else held.get(name, value)
        if bound is not value:
            bindings[name] = bound
    if not bindings:
        return function
    tag = hashlib.sha256(repr(constants).encode()).hexdigest()[:8]
    mark = compiled if function.targetoptions.get("forceinline") else called
    return mark(_bind(source, f"{source.__name__}_{tag}", bindings))


def narrowed(function: Any, **constants: Any) -> Any:
    """Return a compiled scalar function with these constants for its globals, in all that it calls by name.

    The function itself comes back where nothing of it names one of them, or all have that value already.
    """
    return _narrowed(function, tuple(sorted(constants.items())))


class _Rehearsed(_Loop):
    """A loop that is compiled when it is called, and computes nothing."""

    def __call__(self, *arguments: Any) -> None:
        types_of_them = tuple(map(self.typeof_pyval, arguments))
        if types_of_them not in self.overloads:
            with suppress(MadeElsewhereError):
                self.compile(types_of_them)


def loops_there() -> bool:
    """Whether this process has any loop yet: one that may have run."""
    return any(isinstance(made, _Loop) and made.signatures for made in _made.values())


def rehearse() -> None:
    """From now on only compile the loops that are called, but for those that another process is at."""
    global _kind
    _kind, loop_cache.in_passing = _Rehearsed, True
    for made in _made.values():
        if isinstance(made, _Loop):
            made.__class__ = _Rehearsed
            if isinstance(made._cache, LoopCache):
                made._cache.forget_turn()


_kind: type[_Loop] = _Loop
_made: dict[str, Any] = {}


@contextmanager
def heard_compiling(listener: Callable[[str], None]) -> Iterator[None]:
    """Call `listener(name)` when a loop is compiled afresh in this block, not when it comes from the cache.

    Nor when a process that was forked from this one compiles it.
    """
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


def specialise(template: Callable[..., Any], *, parallel: bool | None = None, **bindings: Any) -> Any:
    """Return `template` compiled with its free names bound to `bindings`.

    Parameters
    ----------
    template
        A plain function; the names in `bindings` are free (global) names in it.
    parallel
        True for a loop with `prange` that is called from Python and cached on disk;
        None (default) for a function that other compiled code calls.
    bindings
        Integers, floats and compiled functions.

    Returns
    -------
    A compiled function; the same object for the same arguments.
    """
    spelled = ",".join(f"{k}={_key(v)}" for k, v in sorted(bindings.items()))
    tag = hashlib.sha256(spelled.encode()).hexdigest()[:16]
    name = f"{template.__name__}_{tag}"
    full = f"{template.__module__}.{name}.{parallel}"
    if full in _made:
        return _made[full]
    function = _bind(template, name, bindings)
    if parallel is None:
        made = compiled(function)
    else:
        made = numba.njit(parallel=parallel, nogil=True, no_cfunc_wrapper=True, **_OPTIONS)(function)
        made.__class__ = _kind
        folder = cache_folder()
        if folder is not None:
            made._cache = LoopCache(function, folder)
    _made[full] = made
    return made
