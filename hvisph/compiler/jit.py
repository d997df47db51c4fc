"""Compiled scalar functions and specialised loops.

`compiled` marks a scalar function; it costs nothing until a compiled loop calls it.

`specialise` makes a loop out of a template, as C++ does with template parameters:
the template's free names (a pair law, the number of dimensions, an option) are bound
to constants and functions, so the compiler sees one straight loop. The result is
cached on disk under the fingerprint of all that it is made of.

numba is loaded when the first loop is called, see `compiler.lazy_import` and `compiler.dispatch`.
"""

from __future__ import annotations

import hashlib
import os
import types
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from .fingerprint import ATTRIBUTE, GLOBAL, names_read
from .lazy_import import Compiled, prange

__all__ = ["called", "compiled", "narrowed", "plain", "prange", "specialise"]

# numba reads these when it is loaded. Types that do not fit are told by errors that nobody reads: to colour each takes
# a while.
os.environ.setdefault("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")
# Threads wait for each other asleep, unless the user says otherwise. Awake they hold a core that another process needs,
# or the very thread that they wait for: a small case on a busy machine then takes ten times as long. Read when the
# first parallel loop loads OpenMP: GNU's has the first name, LLVM's the second.
if "OMP_WAIT_POLICY" not in os.environ:
    os.environ.setdefault("GOMP_SPINCOUNT", "0")
    os.environ.setdefault("KMP_BLOCKTIME", "0")


def _scalar(one: Compiled) -> Any:
    from . import scalar_functions

    return scalar_functions.made_scalar(one)


def compiled(function: Callable[..., Any]) -> Any:
    """Mark a scalar function, which is compiled into its caller.

    Left to itself the compiler calls larger functions, such as the stress update, at three times the cost.
    """
    return Compiled(function, True, _scalar)


def called(function: Callable[..., Any]) -> Any:
    """Mark a scalar function that few materials need: it stays one, so that other loops are short and soon compiled."""
    return Compiled(function, False, _scalar)


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
                twin.__globals__[name] = plain(held) if isinstance(held, Compiled) else held
        elif kind == ATTRIBUTE and isinstance(held, types.ModuleType):
            member = getattr(held, read)
            module = twin.__globals__.setdefault(name, types.SimpleNamespace())
            setattr(module, read, plain(member) if isinstance(member, Compiled) else member)
            held = None
    return twin


def _key(value: Any) -> str:
    if isinstance(value, Compiled):
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
    if not any(name in held or isinstance(source.__globals__.get(name), Compiled) for name in source.__code__.co_names):
        return function
    for name in {name for kind, name in names_read(source.__code__) if kind == GLOBAL}:
        value = source.__globals__.get(name)
        bound = _narrowed(value, constants) if isinstance(value, Compiled) else held.get(name, value)
        if bound is not value:
            bindings[name] = bound
    if not bindings:
        return function
    tag = hashlib.sha256(repr(constants).encode()).hexdigest()[:8]
    mark = compiled if function.inlined else called
    return mark(_bind(source, f"{source.__name__}_{tag}", bindings))


def narrowed(function: Any, **constants: Any) -> Any:
    """Return a compiled scalar function with these constants for its globals, in all that it calls by name.

    The function itself comes back where nothing of it names one of them, or all have that value already.
    """
    return _narrowed(function, tuple(sorted(constants.items())))


def _loops() -> list[Any]:
    """Return the loops that numba has made."""
    return [one.made for one in _made.values() if one.inlined is None and one.is_made]


def loops_there() -> bool:
    """Whether this process has any loop yet: one that may have run."""
    return any(made.signatures for made in _loops())


_made: dict[str, Compiled] = {}


@contextmanager
def heard_compiling(listener: Callable[[str], None]) -> Iterator[None]:
    """Call `listener(name)` in this block when a loop is compiled, not when it comes from the cache."""
    from . import dispatch

    with dispatch.heard_compiling(listener):
        yield


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
    _made[full] = compiled(function) if parallel is None else Compiled(function, None, _loop(parallel))
    return _made[full]


def _register_operations() -> None:
    from . import scalar_functions  # noqa: F401  takes 0.03 s


def _loop(parallel: bool) -> Callable[[Compiled], Any]:
    """Return the function that makes the numba function of a loop."""

    def make(one: Compiled) -> Any:
        from . import dispatch

        return dispatch.made_loop(one, parallel, _register_operations)

    return make
