"""Text of others - titles, names in files, paths - made harmless for a terminal."""

from __future__ import annotations

import unicodedata

# Line ends and tabs lay out our own text. Everything else that is control or invisible formatting is spelled out:
# escape codes, which move the cursor, rename the window or answer in the user's name, and marks that turn the
# direction of writing.
_KEPT = "\n\t"
_SPELLED = ("Cc", "Cf", "Cs", "Zl", "Zp")


def harmless(text: object) -> str:
    r"""Return text that steers no terminal: control characters are spelled out, as in ``\x1b[31m``."""
    plain = str(text)
    if plain.isascii() and plain.isprintable():
        return plain
    return "".join(_escape_character(c) if unicodedata.category(c) in _SPELLED and c not in _KEPT else c for c in plain)


def _escape_character(character: str) -> str:
    number = ord(character)
    return f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}" if number < 0x10000 else f"\\U{number:08x}"
