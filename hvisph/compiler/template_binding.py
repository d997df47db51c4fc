"""Binding of the free names of templates."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from typing import Any

from .jit import specialise


def bind(template: Callable[..., object], options: Mapping[str, object], offered: Mapping[str, Any] | None = None,
         parallel: bool | None = None, parts: Iterable[Callable[..., Any]] = ()) -> Any:  # fmt: skip
    """Return `template` compiled with `options` and with those names of `offered` that it uses.

    Parameters
    ----------
    template, parallel
        See `specialise`.
    parts
        Templates that it, or a later one of them, calls by name; they are bound to the same values.
    options
        Constants and functions of this template; it or one of its parts must use each of them.
    offered
        Constants and functions that several templates share, such as the slots of a row.

    Raises
    ------
    TypeError
        For an option that the template does not use, for example a misspelt one.
    """
    every = {name for one in (template, *parts) for name in one.__code__.co_names}
    for option in options:
        if option not in every:
            near = get_close_matches(option, every, 1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise TypeError(f"{template.__module__}.{template.__name__} has no option {option!r}{hint}")
    given = dict(offered or {}) | dict(options)
    for one in parts:
        given[one.__name__] = specialise(one, **_named_by(one, given))
    return specialise(template, parallel=parallel, **_named_by(template, given))


def _named_by(template: Callable[..., object], given: Mapping[str, object]) -> dict[str, Any]:
    return {name: given[name] for name in template.__code__.co_names if name in given}
