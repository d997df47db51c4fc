"""YAML to plain values, with the line of every key, and back.

Only what a case needs is read: mappings with text keys, lists, text, numbers, true,
false and null, in one document. Tags are refused, so no code can run from a file. Numbers
are those of YAML 1.2: `1e9` is one, `1:30`, `010` as octal and `yes` as true are not.
The text is read event by event, never by recursion, so that depth and size can be bounded.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import yaml

from hvisph.case.model import Path
from hvisph.core.errors import CaseError

MOST_DEEP = 32
MOST_NODES = 100_000

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_INTEGER = re.compile(r"[-+]?[0-9]{1,18}")
_FLOAT = re.compile(
    r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)"
)
_WORDS = {"": None, "~": None} | {
    form: value
    for word, value in (("null", None), ("true", True), ("false", False))
    for form in (word, word.capitalize(), word.upper())
}


class Place(NamedTuple):
    """Where a value comes from: a file and its line, or an override."""

    file: str
    line: int | None = None


@dataclass
class Document:
    """A parsed text.

    Parameters
    ----------
    value
        Plain values: dict, list, str, int, float, bool, None.
    places
        Place of every path of keys in `value`.
    """

    value: Any
    places: dict[Path, Place] = field(default_factory=dict)


def parse(text: str, name: str) -> Document:
    """Return the one value that `text` holds.

    Parameters
    ----------
    text
        YAML.
    name
        What messages call the text: the file's name, or the override.

    Raises
    ------
    CaseError
        For what is no YAML, or uses what a case may not: tags, several documents, keys twice,
        keys that are not text, recursive anchors, excessive depth or size.
    """
    try:
        text.encode("utf-8")
        return _Reader(name).read(yaml.parse(text, Loader=_LOADER))
    except UnicodeEncodeError:
        raise CaseError("is not valid Unicode text", file=name) from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        reason = " ".join(filter(None, (error.context, error.problem)))
        if mark is not None and "\t" in _indent(text, mark.line):
            reason = "the line is indented by a tab; YAML wants spaces"
        raise CaseError(f"is no YAML: {reason}", file=name, line=mark.line + 1 if mark else None) from None
    except yaml.YAMLError as error:
        raise CaseError(f"is no YAML: {str(error).splitlines()[0]}", file=name) from None


def _indent(text: str, line: int) -> str:
    """Return what a line begins with before its first word."""
    lines = text.splitlines()
    whole = lines[line] if line < len(lines) else ""
    return whole[: len(whole) - len(whole.lstrip())]


def dump(value: Any, width: int = 100) -> str:
    """Return YAML text of plain values that `parse` reads back to the same, its texts wrapped behind `width`."""
    return yaml.dump(value, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=width)


class _Dumper(yaml.SafeDumper):
    """Quotes what this module would not read as text, beyond what YAML 1.1 has quoted."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


_Dumper.add_implicit_resolver("tag:yaml.org,2002:float", re.compile(f"^(?:{_FLOAT.pattern})$"), list("-+.0123456789"))


class _Frame:
    """A mapping or list that is being filled."""

    def __init__(self, value: Any, path: Path, anchor: str | None):
        self.value, self.path, self.anchor = value, path, anchor
        self.key: str | None = None

    def next_path(self) -> Path:
        return (*self.path, self.key if isinstance(self.value, dict) else len(self.value))  # type: ignore[arg-type]

    def add(self, item: Any) -> None:
        if isinstance(self.value, dict):
            self.value[self.key] = item
            self.key = None
        else:
            self.value.append(item)


class _Reader:
    """Builds values from the parser's events."""

    def __init__(self, name: str):
        self.name = name
        self.document = Document(None)
        self.stack: list[_Frame] = []
        self.anchors: dict[str, Any] = {}
        self.nodes = 0
        self.documents = 0

    def fail(self, message: str, event: yaml.Event) -> CaseError:
        return CaseError(message, file=self.name, line=_line(event))

    def read(self, events: Iterator[yaml.Event]) -> Document:
        for event in events:
            if isinstance(event, yaml.DocumentStartEvent):
                self.documents += 1
                if self.documents > 1:
                    raise self.fail("holds more than one document; only one case per file", event)
            elif isinstance(event, yaml.NodeEvent):
                self.node(event)
            elif isinstance(event, yaml.CollectionEndEvent):
                frame = self.stack.pop()
                if frame.anchor:
                    self.anchors[frame.anchor] = frame.value
        return self.document

    def node(self, event: yaml.NodeEvent) -> None:
        self.count(1, event)
        frame = self.stack[-1] if self.stack else None
        if frame is not None and isinstance(frame.value, dict) and frame.key is None:
            frame.key = self.mapping_key(event, frame)
            self.document.places[frame.next_path()] = self.place(event)
            return
        path = frame.next_path() if frame else ()
        self.document.places.setdefault(path, self.place(event))
        value = self.value(event, path)
        if frame is None:
            self.document.value = value
        else:
            frame.add(value)

    def value(self, event: yaml.NodeEvent, path: Path) -> Any:
        if isinstance(event, yaml.AliasEvent):
            return self.aliased(event, path)
        if getattr(event, "tag", None) is not None:
            raise self.fail(f"the tag '{event.tag}' is not allowed", event)  # type: ignore[attr-defined]
        if isinstance(event, yaml.ScalarEvent):
            plain = event.value if event.style else _scalar(event.value)
            if event.anchor:
                self.anchors[event.anchor] = plain
            return plain
        value: Any = {} if isinstance(event, yaml.MappingStartEvent) else []
        self.stack.append(_Frame(value, path, event.anchor))
        if len(self.stack) > MOST_DEEP:
            raise self.fail(f"is nested more than {MOST_DEEP} levels deep", event)
        return value

    def aliased(self, event: yaml.AliasEvent, path: Path) -> Any:
        if event.anchor not in self.anchors:
            raise self.fail(f"the alias '*{event.anchor}' refers to itself or to no anchor before it", event)
        return self.copy(self.anchors[event.anchor], path, event)

    def copy(self, value: Any, path: Path, event: yaml.Event) -> Any:
        self.count(1, event)
        self.document.places[path] = self.place(event)
        if len(path) > MOST_DEEP:
            raise self.fail(f"is nested more than {MOST_DEEP} levels deep", event)
        if isinstance(value, dict):
            return {key: self.copy(item, (*path, key), event) for key, item in value.items()}
        if isinstance(value, list):
            return [self.copy(item, (*path, index), event) for index, item in enumerate(value)]
        return value

    def mapping_key(self, event: yaml.NodeEvent, frame: _Frame) -> str:
        if not isinstance(event, yaml.ScalarEvent) or event.tag is not None:
            raise self.fail("a key must be plain text", event)
        if event.value == "<<" and not event.style:
            raise self.fail("merge keys (<<) are not supported; use `base: other.yaml`", event)
        if event.value in frame.value:
            raise self.fail(f"the key '{event.value}' appears twice in one mapping", event)
        return event.value

    def place(self, event: yaml.Event) -> Place:
        return Place(self.name, _line(event))

    def count(self, number: int, event: yaml.Event) -> None:
        self.nodes += number
        if self.nodes > MOST_NODES:
            raise self.fail(f"holds more than {MOST_NODES} values", event)


def _line(event: yaml.Event) -> int:
    mark: Any = event.start_mark
    return int(mark.line) + 1


def _scalar(text: str) -> Any:
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if not _FLOAT.fullmatch(text):
        return text
    return float(text.replace(".", "", 1) if text[-1].isalpha() else text)
