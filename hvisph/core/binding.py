"""Binding of templates: which names a compiled loop takes from what is offered to it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from difflib import get_close_matches
from typing import Any

from .jit import specialise


def bind(template: Callable[..., Any], options: Mapping[str, Any], offered: Mapping[str, Any] | None = None,
         parallel: bool | None = None) -> Any:  # fmt: skip
    """Return `template` compiled with `options`, and with what it names of `offered`.

    Parameters
    ----------
    template, parallel
        See `specialise`.
    options
        Constants and functions that are meant for this template: it must name each of them.
    offered
        Those that several templates share, such as the slots of a row; each takes what it names.

    Raises
    ------
    TypeError
        For an option that the template does not name: misspelt, it would have no effect.
    """
    names = template.__code__.co_names
    for option in options:
        if option not in names:
            near = get_close_matches(option, names, 1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise TypeError(f"{template.__module__}.{template.__name__} has no option {option!r}{hint}")
    taken = {name: value for name, value in (offered or {}).items() if name in names}
    return specialise(template, parallel=parallel, **(taken | dict(options)))
