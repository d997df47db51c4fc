"""Fingerprint of a compiled loop: a hash of its byte code, of all functions that it calls, and of their constants.

Two functions with the same fingerprint compile to the same loop. A loop in the cache stays valid until its code
changes; changes of other functions, comments and docstrings do not matter.
"""

from __future__ import annotations

import dis
import hashlib
import sys
import types
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from .lazy_import import LazyFunction

# Modules that emit code without being called by name, such as the arithmetic of lanes: their whole texts are hashed.
_MACHINERY = (
    *("codegen", "dispatch", "fingerprint", "if_conversion", "jit", "lazy_import", "tensors", "tensors3d"),
    *("thread_primitives", "unroll", "vector.api", "vector.intrinsics", "vector.lane_masks", "vector.lanes"),
    *("vector.memory_access", "vector.neighbour_filter"),
)
_WHOLE = {f"{__package__}.{name}" for name in _MACHINERY}
# Functions of these packages are identified by name and version.
_FOREIGN = {"numpy", "numba", "llvmlite", "math", "builtins"}
# How an instruction uses a name, and the number of flag bits in its argument.
OTHER, GLOBAL, ATTRIBUTE = 0, 1, 2
_READS = {
    dis.opmap[name]: (kind, shift)
    for name, kind, shift in (
        *(("LOAD_GLOBAL", GLOBAL, 1), ("LOAD_NAME", GLOBAL, 0), ("LOAD_METHOD", ATTRIBUTE, 0)),
        ("LOAD_ATTR", ATTRIBUTE, int(sys.version_info >= (3, 12))),
    )
    if name in dis.opmap
}


@cache
def compiler_hash() -> str:
    """Return the hash of this package's code generation and of the versions of Python, numba, LLVM and NumPy."""
    from importlib.metadata import version  # numba itself takes 0.4 s to import

    versions = (sys.version_info[:3], version("numba"), version("llvmlite"), np.__version__)
    digest = hashlib.sha256(repr(versions).encode())
    for name in _MACHINERY:
        digest.update(Path(__file__).parent.joinpath(f"{name.replace('.', '/')}.py").read_bytes())
    return digest.hexdigest()


def fingerprint(function: object) -> str:
    """Return the hash of a function, of all functions that it calls and of the constants that it reads."""
    digest = hashlib.sha256(compiler_hash().encode())
    for part in _parts(function, set()):
        digest.update(part.encode())
        digest.update(b"\0")
    return digest.hexdigest()[:32]


def _parts(value: object, visited: set[int]) -> Iterator[str]:
    """Yield texts that determine the code compiled from `value`."""
    value = _python_function(value)
    if isinstance(value, types.FunctionType):
        # Compiled code contains the names of its functions, so equal texts in two modules differ.
        yield f"{value.__module__}.{value.__qualname__}"
        if id(value) in visited or value.__module__.split(".")[0] in _FOREIGN:
            return
        visited.add(id(value))
        for cell in value.__closure__ or ():
            yield from _parts(cell.cell_contents, visited)
        if value.__module__ in _WHOLE:
            return
        yield from _code(value.__code__)
        yield repr(value.__defaults__)
        for name, member in _read_by(value):
            yield name
            yield from _parts(member, visited)
    elif isinstance(value, (tuple, list)):
        yield type(value).__name__
        for part in value:
            yield from _parts(part, visited)
    elif isinstance(value, (np.ndarray, np.generic)):
        yield f"{value.dtype}{value.shape}{value.tobytes().hex()}"
    else:
        yield value.__name__ if isinstance(value, (type, types.ModuleType)) else repr(value)
        yield repr(getattr(value, "_fields", ""))  # the order of a named tuple's


def _python_function(value: object) -> object:
    """Return the Python function of a compiled one, the name of a lazily imported one, or the value itself."""
    if isinstance(value, LazyFunction):
        return repr(value)
    text = getattr(value, "py_func", None)
    return text if isinstance(text, types.FunctionType) else value


def _code(code: types.CodeType) -> Iterator[str]:
    """Yield the parts of a code object that the compiler reads: not its lines, file or docstring."""
    yield code.co_code.hex()
    yield repr((code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars, code.co_flags))
    first = code.co_consts[:1]  # of a function that is no lambda, the docstring or None
    start = int(code.co_name != "<lambda>" and (first == (None,) or isinstance(first[0], str))) if first else 0
    for constant in code.co_consts[start:]:
        if isinstance(constant, types.CodeType):
            yield from _code(constant)
        else:
            yield repr(sorted(map(repr, constant)) if isinstance(constant, frozenset) else constant)


def _read_by(function: types.FunctionType) -> Iterator[tuple[str, object]]:
    """Yield the globals that a function or a nested function reads; of a module, the members that it reads."""
    for code in _all_code(function.__code__):
        value: object = None
        for kind, name in read_names(code):
            if kind == GLOBAL:
                value = function.__globals__.get(name)
                if name in function.__globals__:
                    yield name, value
            elif kind == ATTRIBUTE and isinstance(value, types.ModuleType):
                value = getattr(value, name, None)
                if not isinstance(value, types.ModuleType):
                    yield name, value
            else:
                value = None


def read_names(code: types.CodeType) -> Iterator[tuple[int, str]]:
    """Yield GLOBAL or ATTRIBUTE and the name for each instruction that reads a name, and OTHER for all others.

    The module `dis` takes five times as long.
    """
    names, high_bits, text = code.co_names, 0, code.co_code
    for operation, argument in zip(text[::2], text[1::2], strict=True):
        if operation == dis.EXTENDED_ARG:
            high_bits = (high_bits | argument) << 8
            continue
        if operation in _READS:
            kind, shift = _READS[operation]
            yield kind, names[(high_bits | argument) >> shift]
        elif operation:  # 0 is an inline cache of the interpreter
            yield OTHER, ""
        high_bits = 0


def _all_code(code: types.CodeType) -> Iterator[types.CodeType]:
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _all_code(constant)
