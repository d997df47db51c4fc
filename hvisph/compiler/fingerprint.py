"""What a compiled loop is made of, as a short text: its code, what that calls, and the constants bound into it.

Two functions with the same fingerprint compile to the same loop, so a loop in the cache stays good until
something that it is made of changes: not with another command's text, a comment or a docstring.
"""

from __future__ import annotations

import dis
import hashlib
import sys
import types
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from .lazy_import import Later

# What makes code without being called by name, such as the arithmetic of lanes: taken as whole texts.
_MACHINERY = (
    *("codegen", "component_functions", "dispatch", "fingerprint", "if_conversion", "jit", "lazy_import"),
    *("scalar_functions", "tensors", "tensors3d", "threads.primitives", "unroll", "vector.api"),
    *("vector.contiguous_load", "vector.gather", "vector.intrinsics", "vector.lane_masks", "vector.lanes"),
    *("vector.neighbour_filter", "vector.pointers", "vector.table_access"),
)
_WHOLE = {f"{__package__}.{name}" for name in _MACHINERY}
# Functions of these packages are known by name and version.
_FOREIGN = {"numpy", "numba", "llvmlite", "math", "builtins"}
# What an instruction does with a name, and by how much its argument is shifted to leave room for a flag.
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
def machinery() -> str:
    """Hash of the texts that shape every compiled loop, and of the versions of the compiler below them."""
    import llvmlite
    import numba

    versions = (sys.version_info[:3], numba.__version__, llvmlite.__version__, np.__version__)
    digest = hashlib.sha256(repr(versions).encode())
    for name in _MACHINERY:
        digest.update(Path(__file__).parent.joinpath(f"{name.replace('.', '/')}.py").read_bytes())
    return digest.hexdigest()


def fingerprint(function: Any) -> str:
    """Hash of a function, of all that it calls and of the constants that it reads."""
    digest = hashlib.sha256(machinery().encode())
    for part in _parts(function, set()):
        digest.update(part.encode())
        digest.update(b"\0")
    return digest.hexdigest()[:32]


def _parts(value: Any, seen: set[int]) -> Iterator[str]:
    """Yield texts that together say what `value` is to the compiler."""
    value = _plain(value)
    if isinstance(value, types.FunctionType):
        # Compiled code is filed under the names of its functions: a loop of the same text elsewhere is another.
        yield f"{value.__module__}.{value.__qualname__}"
        if id(value) in seen or value.__module__.split(".")[0] in _FOREIGN:
            return
        seen.add(id(value))
        for cell in value.__closure__ or ():
            yield from _parts(cell.cell_contents, seen)
        if value.__module__ in _WHOLE:
            return
        yield from _code(value.__code__)
        yield repr(value.__defaults__)
        for name, used in _read_by(value):
            yield name
            yield from _parts(used, seen)
    elif isinstance(value, (tuple, list)):
        yield type(value).__name__
        for part in value:
            yield from _parts(part, seen)
    elif isinstance(value, (np.ndarray, np.generic)):
        yield f"{value.dtype}{value.shape}{value.tobytes().hex()}"
    else:
        yield value.__name__ if isinstance(value, (type, types.ModuleType)) else repr(value)
        yield repr(getattr(value, "_fields", ""))  # the order of a named tuple's


def _plain(value: Any) -> Any:
    """Return the Python function behind a compiled one, the name of what is imported later, or the value itself."""
    if isinstance(value, Later):
        return repr(value)
    text = getattr(value, "py_func", None)
    return text if isinstance(text, types.FunctionType) else value


def _code(code: types.CodeType) -> Iterator[str]:
    """Yield what the compiler reads of a code object; not its lines, file or docstring."""
    yield code.co_code.hex()
    yield repr((code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars, code.co_flags))
    first = code.co_consts[:1]  # of a function that is no lambda, the docstring or None
    skipped = int(code.co_name != "<lambda>" and (first == (None,) or isinstance(first[0], str))) if first else 0
    for constant in code.co_consts[skipped:]:
        if isinstance(constant, types.CodeType):
            yield from _code(constant)
        else:
            yield repr(sorted(map(repr, constant)) if isinstance(constant, frozenset) else constant)


def _read_by(function: types.FunctionType) -> Iterator[tuple[str, Any]]:
    """Yield the globals that a function, or one defined inside it, reads; of a module, what is taken from it."""
    for code in _all_code(function.__code__):
        held: Any = None
        for kind, name in names_read(code):
            if kind == GLOBAL:
                held = function.__globals__.get(name)
                if name in function.__globals__:
                    yield name, held
            elif kind == ATTRIBUTE and isinstance(held, types.ModuleType):
                held = getattr(held, name, None)
                if not isinstance(held, types.ModuleType):
                    yield name, held
            else:
                held = None


def names_read(code: types.CodeType) -> Iterator[tuple[int, str]]:
    """Yield GLOBAL or ATTRIBUTE and the name of each instruction that reads one, OTHER and nothing for all others.

    The module `dis` says the same, and all else that there is to know of an instruction, in five times the time.
    """
    names, extended, text = code.co_names, 0, code.co_code
    for operation, argument in zip(text[::2], text[1::2], strict=True):
        if operation == dis.EXTENDED_ARG:
            extended = (extended | argument) << 8
            continue
        if operation in _READS:
            kind, shift = _READS[operation]
            yield kind, names[(extended | argument) >> shift]
        elif operation:  # 0 is room for the interpreter
            yield OTHER, ""
        extended = 0


def _all_code(code: types.CodeType) -> Iterator[types.CodeType]:
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _all_code(constant)
