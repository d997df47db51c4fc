"""Other spellings, for error messages: former names of keys, values, fields and commands, and words of other codes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from hvisph.core.text import Plain

if TYPE_CHECKING:
    from hvisph.case.model import Path as Keys


@cache
def spellings(table: str) -> Plain:
    """Return a table of `spellings.yaml` by its name."""
    import yaml  # not before it is used: the help needs none

    return dict(yaml.safe_load(Path(__file__).with_suffix(".yaml").read_text(encoding="utf-8"))[table])


def renamed_key(path: Keys, allowed: Sequence[str]) -> str:
    """Return the present name of the unknown key at the end of `path`, if it is one of the `allowed`; else empty."""
    blocks = [str(part) for part in path[-3:-1]] or [""]
    names = [spellings("keys").get(block, {}).get(str(path[-1]), "") for block in blocks]
    return next((f"is now `{name}`" for name in names if name.partition(":")[0] in allowed), "")


def renamed_value(key: str | int, value: object) -> str:
    """Return the present name of the unknown `value` of `key`; empty without one."""
    successor = spellings("values").get(str(key), {}).get(str(value))
    return f"'{value}' is now `{successor}`" if successor else ""


def present_name(table: str, name: object) -> str:
    """Return the present name of a state field or a measure (`table`); empty without one."""
    present = spellings(table).get(str(name))
    return f"'{name}' is now `{present}`" if present else ""
