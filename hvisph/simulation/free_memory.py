"""Giving up the arrays of a run that has ended, so that its results are measured in their room."""

from __future__ import annotations

from typing import Any

import numpy as np


def let_go(holder: Any, _seen: set[int] | None = None) -> None:
    """Empty all arrays that an object of hvisph holds, and those of the objects that it holds itself.

    It is no good for anything afterwards. What is constant, as frozen settings are, stays.
    """
    seen = set() if _seen is None else _seen
    if id(holder) in seen or not hasattr(holder, "__dict__") or not type(holder).__module__.startswith("hvisph."):
        return
    seen.add(id(holder))
    frozen = getattr(type(holder), "__dataclass_params__", None)
    if frozen is not None and frozen.frozen:
        return
    for name, value in vars(holder).items():
        if isinstance(value, np.ndarray):
            vars(holder)[name] = np.empty((0, *value.shape[1:]), value.dtype)
        elif isinstance(value, list | tuple):
            for one in value:
                let_go(one, seen)
        else:
            let_go(value, seen)
