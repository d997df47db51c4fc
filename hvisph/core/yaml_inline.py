"""Plain values as a case file writes them, in one line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

_WORDS = {None: "null", True: "true", False: "false"}


def format_value(value: Any) -> str:
    """Return a value as a case file has it: ``{type: disc, diameter: 10 mm}``, ``[1, 2]``, ``true``."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {format_value(item)}' for key, item in value.items())}}}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"[{', '.join(map(format_value, value))}]"
    return _WORDS[value] if value is None or isinstance(value, bool) else str(value)


def format_differences(values: Sequence[Any]) -> list[str]:
    """Return values as a case file has them, of mappings only the keys in which they are not all the same."""
    if len(values) < 2 or not all(isinstance(value, Mapping) for value in values):
        return ["" if value is None else format_value(value) for value in values]
    keys = dict.fromkeys(key for value in values for key in value)
    unlike = [key for key in keys if any(value.get(key) != values[0].get(key) for value in values[1:])]
    return [format_value({key: value[key] for key in unlike if key in value}) for value in values]
