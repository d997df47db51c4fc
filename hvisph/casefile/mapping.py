"""Cases given as Python mappings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from hvisph.core.errors import CaseError

from .yaml_text import MOST_DEEP, MOST_NODES, Document, Place

_SCALARS = str | int | float | bool | None


def plain_document(source: Mapping[str, object]) -> Document:
    """Return `source` as a document without lines; models within it stay as they are.

    Raises
    ------
    CaseError
        For keys that are not text, values that a case file could not hold, excessive depth or size.
    """
    return Document(_Copy().plain(source, ()), {(): Place("")})


class _Copy:
    def __init__(self) -> None:
        self.nodes = 0

    def plain(self, value: object, path: tuple[str, ...]) -> Any:
        self.nodes += 1
        where = ".".join(path)
        if len(path) > MOST_DEEP:
            raise CaseError(f"is nested more than {MOST_DEEP} levels deep", where=where[:200])
        if self.nodes > MOST_NODES:
            raise CaseError(f"holds more than {MOST_NODES} values")
        if isinstance(value, BaseModel | _SCALARS):
            return value
        if isinstance(value, Mapping):
            for key in value:
                if not isinstance(key, str):
                    raise CaseError(f"a key must be text, not {key!r:.80}", where=where)
            return {key: self.plain(item, (*path, key)) for key, item in value.items()}
        if isinstance(value, list | tuple):
            return [self.plain(item, (*path, str(index))) for index, item in enumerate(value)]
        if hasattr(value, "item") and getattr(value, "ndim", None) == 0:
            return value.item()
        raise CaseError(f"a case cannot hold a {type(value).__name__}", where=where)
