"""Compiled scalar functions and specialised loops.

`inline` and `noinline` mark a scalar function. It is compiled when a loop calls it.

`specialise` makes a loop from a template, as C++ does with template parameters: the template's free names (a pair law,
the number of dimensions, an option) are bound to constants and functions, so that the compiler sees one straight loop.
The compiled loop is cached on disk under the fingerprint of its code.

numba is imported when the first loop is called, see `compiler.lazy_import` and `compiler.dispatch`.
"""

from __future__ import annotations

import hashlib
import os
import types
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from difflib import get_close_matches
from functools import cache, partial
from typing import Any

from .fingerprint import ATTRIBUTE, GLOBAL, read_names
from .lazy_import import CompiledFunction, Options, PythonFunction
from .lazy_import import prange as prange

# Waiting threads sleep unless the user says otherwise. Spinning threads occupy a core that another process or the
# awaited thread needs: a small case on a busy machine then takes ten times as long. OpenMP reads these variables when
# the first parallel loop loads it: GNU's the first, LLVM's the second.
if "OMP_WAIT_POLICY" not in os.environ:
    os.environ.setdefault("GOMP_SPINCOUNT", "0")
    os.environ.setdefault("KMP_BLOCKTIME", "0")


def _scalar(function: CompiledFunction) -> object:
    from . import dispatch

    return dispatch.make_scalar(function)


def inline(function: PythonFunction) -> CompiledFunction:
    """Mark a scalar function that is inlined into its callers.

    By default the compiler does not inline larger functions such as the stress update, which costs three times as much.
    """
    return CompiledFunction(function, True, _scalar)


def noinline(function: PythonFunction) -> CompiledFunction:
    """Mark a scalar function that few materials need and that is not inlined: loops stay short to compile."""
    return CompiledFunction(function, False, _scalar)


@cache
def python_twin(function: CompiledFunction) -> PythonFunction:
    """Return a scalar function, and all that it calls, as plain Python functions."""
    source = function.py_func
    twin = types.FunctionType(source.__code__, {}, source.__name__, source.__defaults__)
    twin.__globals__["__builtins__"] = source.__globals__["__builtins__"]
    value, name = None, ""
    for kind, read in read_names(source.__code__):
        if kind == GLOBAL and read in source.__globals__:
            name, value = read, source.__globals__[read]
            if not isinstance(value, types.ModuleType):
                twin.__globals__[name] = python_twin(value) if isinstance(value, CompiledFunction) else value
        elif kind == ATTRIBUTE and isinstance(value, types.ModuleType):
            member = getattr(value, read)
            module = twin.__globals__.setdefault(name, types.SimpleNamespace())
            setattr(module, read, python_twin(member) if isinstance(member, CompiledFunction) else member)
            value = None
    return twin


def _key(value: object) -> str:
    if isinstance(value, CompiledFunction):
        value = value.py_func
    if isinstance(value, types.FunctionType):
        return f"{value.__module__}.{value.__qualname__}"
    return repr(value)


def _bind(template: PythonFunction, name: str, bindings: Mapping[str, object]) -> types.FunctionType:
    namespace = dict(template.__globals__)
    namespace.update(bindings)
    copy = types.FunctionType(template.__code__, namespace, name, template.__defaults__, None)
    copy.__qualname__, copy.__module__, copy.__doc__ = name, template.__module__, template.__doc__
    return copy


@cache
def _narrowed(function: CompiledFunction, constants: tuple[tuple[str, object], ...]) -> CompiledFunction:
    source, table = function.py_func, dict(constants)
    bindings = {}
    if not any(n in table or isinstance(source.__globals__.get(n), CompiledFunction) for n in source.__code__.co_names):
        return function
    for name in {name for kind, name in read_names(source.__code__) if kind == GLOBAL}:
        value = source.__globals__.get(name)
        replacement = _narrowed(value, constants) if isinstance(value, CompiledFunction) else table.get(name, value)
        if replacement is not value:
            bindings[name] = replacement
    if not bindings:
        return function
    tag = hashlib.sha256(repr(constants).encode()).hexdigest()[:8]
    mark = inline if function.inlined else noinline
    return mark(_bind(source, f"{source.__name__}_{tag}", bindings))


def bind_constants(function: CompiledFunction, **constants: object) -> CompiledFunction:
    """Return a scalar function whose globals, and those of all functions that it calls, have these values.

    The function itself is returned if it uses none of these names, or if all have that value already.
    """
    return _narrowed(function, tuple(sorted(constants.items())))


_functions: dict[str, CompiledFunction] = {}
_listeners: list[Callable[[str], None]] = []


@contextmanager
def report_compilation(listener: Callable[[str], None]) -> Iterator[None]:
    """Call `listener(name)` in this block when a loop is compiled, not when it comes from the cache."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


def _report(name: str) -> None:
    for listener in _listeners:
        listener(name)


def _make_loop(parallel: bool, function: CompiledFunction) -> object:
    from . import dispatch

    return dispatch.make_loop(function, parallel, _report)


def specialise(template: PythonFunction, *, parallel: bool | None = None, **bindings: Any) -> CompiledFunction:
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
    key = ",".join(f"{k}={_key(v)}" for k, v in sorted(bindings.items()))
    tag = hashlib.sha256(key.encode()).hexdigest()[:16]
    name = f"{template.__name__}_{tag}"
    path = f"{template.__module__}.{name}.{parallel}"
    if path in _functions:
        return _functions[path]
    function = _bind(template, name, bindings)
    result = inline(function) if parallel is None else CompiledFunction(function, None, partial(_make_loop, parallel))
    return _functions.setdefault(path, result)


def missing_loops() -> list[str]:
    """Return the names of the loops that `specialise` has made in this process and that are not in the cache."""
    from .cache_folder import SUFFIX, cache_folder, file_stem

    folder = cache_folder()
    stored = set() if folder is None else {file.name.rsplit("-", 1)[0] for file in folder.glob(f"*{SUFFIX}")}
    loops = [function.py_func for function in _functions.values() if function.inlined is None]
    return [loop.__name__.rsplit("_", 1)[0] for loop in loops if file_stem(loop) not in stored]


def bind(
    template: PythonFunction,
    options: Mapping[str, object],
    bindings: Mapping[str, object] | None = None,
    parts: Iterable[PythonFunction] = (),
) -> CompiledFunction:
    """Return `template` compiled with `options` and with those names of `bindings` that it uses.

    Parameters
    ----------
    template
        See `specialise`.
    parts
        Templates that it, or a later one of them, calls by name; they are bound to the same values.
    options
        Constants and functions of this template; it or one of its parts must use each of them.
    bindings
        Constants and functions that several templates share, such as the slots of a row.

    Raises
    ------
    TypeError
        For an option that the template does not use, for example a misspelt one.
    """
    names = {name for one in (template, *parts) for name in one.__code__.co_names}
    for option in options:
        if option not in names:
            match = get_close_matches(option, names, 1)
            hint = f"; did you mean {match[0]!r}?" if match else ""
            raise TypeError(f"{template.__module__}.{template.__name__} has no option {option!r}{hint}")
    values = dict(bindings or {}) | dict(options)
    for one in parts:
        values[one.__name__] = specialise(one, **_select_names(one, values))
    return specialise(template, **_select_names(template, values))


def _select_names(template: PythonFunction, values: Mapping[str, object]) -> Options:
    return {name: values[name] for name in template.__code__.co_names if name in values}
