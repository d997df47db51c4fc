"""Plain values as a case file writes them, in one line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

_WORDS = {None: "null", True: "true", False: "false"}


def written(value: Any) -> str:
    """Return a value as a case file has it: ``{type: disc, diameter: 10 mm}``, ``[1, 2]``, ``true``."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {written(item)}' for key, item in value.items())}}}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"[{', '.join(map(written, value))}]"
    return _WORDS[value] if value is None or isinstance(value, bool) else str(value)


def told_apart(values: Sequence[Any]) -> list[str]:
    """Return values as a case file has them, of mappings only the keys in which they are not all the same."""
    if len(values) < 2 or not all(isinstance(value, Mapping) for value in values):
        return ["" if value is None else written(value) for value in values]
    keys = dict.fromkeys(key for value in values for key in value)
    unlike = [key for key in keys if any(value.get(key) != values[0].get(key) for value in values[1:])]
    return [written({key: value[key] for key in unlike if key in value}) for value in values]
