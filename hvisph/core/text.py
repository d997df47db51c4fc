"""Text of values and of foreign strings."""

import unicodedata
from collections.abc import Mapping, Sequence
from typing import Any

# Line ends and tabs lay out our own text. Everything else that is control or invisible formatting is spelled out:
# escape codes, which move the cursor, rename the window or answer in the user's name, and marks that turn the
# direction of writing.
_KEPT = "\n\t"
_SPELLED = ("Cc", "Cf", "Cs", "Zl", "Zp")


def sanitize(text: object) -> str:
    r"""Replace control characters by escape sequences, as in ``\x1b[31m``."""
    plain = str(text)
    if plain.isascii() and plain.isprintable():
        return plain
    return "".join(_escape_character(c) if unicodedata.category(c) in _SPELLED and c not in _KEPT else c for c in plain)


def _escape_character(character: str) -> str:
    number = ord(character)
    return f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}" if number < 0x10000 else f"\\U{number:08x}"


def recommend(text: str, *settings: str) -> str:
    """Return a warning that ends with a line of options `--set` which follow its recommendation."""
    return "\n  ".join([text, " ".join(f"--set '{setting}'" for setting in settings)]) if settings else text


# The plain form of an object, as JSON knows it: numbers, text, None, lists, and mappings by name.
Plain = dict[str, Any]
PlainMapping = Mapping[str, Any]
_WORDS = {None: "null", True: "true", False: "false"}


def format_value(value: object) -> str:
    """Return a value as a case file has it: ``{type: disc, diameter: 10 mm}``, ``[1, 2]``, ``true``."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {format_value(item)}' for key, item in value.items())}}}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"[{', '.join(map(format_value, value))}]"
    return _WORDS[value] if value is None or isinstance(value, bool) else str(value)


def format_differences(values: Sequence[object]) -> list[str]:
    """Return values as a case file has them, of mappings only the keys in which they are not all the same."""
    mappings = [value for value in values if isinstance(value, Mapping)]
    if len(values) < 2 or len(mappings) < len(values):
        return ["" if value is None else format_value(value) for value in values]
    keys = dict.fromkeys(key for value in mappings for key in value)
    unequal = [key for key in keys if any(value.get(key) != mappings[0].get(key) for value in mappings[1:])]
    return [format_value({key: value[key] for key in unequal if key in value}) for value in mappings]


def is_number(value: object) -> bool:
    """Return whether a plain value is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < float("inf")


def shorten(text: str, length: int = 64) -> str:
    """Return `text`, cut off behind `length` characters."""
    return text if len(text) <= length else f"{text[:length]}..."


def last_name(path: str) -> str:
    """Return the last name of a dotted path, a number with the key that it belongs to."""
    *_, above, last = ("", *path.split("."))
    return f"{above}.{last}" if last.isdigit() else last
