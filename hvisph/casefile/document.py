"""Documents: plain values with the line of every key, read from YAML or from Python mappings, and their text.

Only what a case needs is read: mappings with text keys, lists, text, numbers, true, false and null, in one document.
Tags are refused, so no code can run from a file. Numbers are those of YAML 1.2: `1e9` is one, `1:30`, `010` as octal
and `yes` as true are not. The text is read event by event, so that depth and size can be bounded.
"""

import os
import pathlib
import re
import stat
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import yaml
from pydantic import BaseModel

from hvisph.case.model import Path
from hvisph.core.errors import FEW, CaseError
from hvisph.core.text import Plain

MOST_DEEP = 32
MOST_NODES = 100_000
_LOADER: type[yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
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
    """Origin of a value: a file and its line, or an override."""

    file: str
    line: int | None = None


@dataclass
class Document:
    """A parsed text."""

    value: Any  # plain values: dict, list, str, int, float, bool, None
    places: dict[Path, Place] = field(default_factory=dict)  # place of every path of keys in `value`


def parse(text: str, name: str) -> Document:
    """Return the one value of a YAML `text`, called `name` in messages.

    Raises `CaseError` for invalid YAML, and for features that a case may not use: tags, several documents, keys twice,
    keys that are not text, recursive anchors, excessive depth or size.
    """
    try:
        text.encode("utf-8")
        return _Reader(name, yaml.parse(text, Loader=_LOADER)).read()
    except UnicodeEncodeError:
        raise CaseError("is not valid Unicode text", file=name) from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        reason = " ".join(filter(None, (error.context, error.problem)))
        line = text.splitlines()[mark.line : mark.line + 1] if mark is not None else []
        if line and "\t" in line[0][: len(line[0]) - len(line[0].lstrip())]:
            reason = "the line is indented by a tab; YAML wants spaces"
        raise CaseError(f"is not valid YAML: {reason}", file=name, line=mark.line + 1 if mark else None) from None
    except yaml.YAMLError as error:
        raise CaseError(f"is not valid YAML: {str(error).splitlines()[0]}", file=name) from None


def dump(value: object, width: int = 100) -> str:
    """Return YAML text of plain values that `parse` reads back to the same, its texts wrapped behind `width`."""
    return yaml.dump(value, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=width)


class _Dumper(yaml.SafeDumper):
    """Quotes text that this module would read otherwise, beyond YAML 1.1."""

    def ignore_aliases(self, data: object) -> bool:
        return True


_Dumper.add_implicit_resolver("tag:yaml.org,2002:float", re.compile(f"^(?:{_FLOAT.pattern})$"), list("-+.0123456789"))


class _Reader:
    """Builds values from the parser's events, to a bounded depth."""

    def __init__(self, name: str, events: Iterator[yaml.Event]):
        self.name, self.events = name, events
        self.places: dict[Path, Place] = {}
        self.anchors: dict[str, object] = {}
        self.nodes = 0

    def read(self) -> Document:
        value, documents = None, 0
        for event in self.events:
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    raise self.error("holds more than one document; only one case per file", event)
            elif isinstance(event, yaml.NodeEvent):
                value = self.node(event, ())
        return Document(value, self.places)

    def node(self, event: Any, path: Path) -> object:
        self.enter(event, path)
        self.places.setdefault(path, Place(self.name, _line(event)))
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in self.anchors:
                raise self.error(f"the alias '*{event.anchor}' refers to itself or to no anchor before it", event)
            return self.copy(self.anchors[event.anchor], path, event)
        if event.tag is not None:
            raise self.error(f"the tag '{event.tag}' is not allowed", event)
        if isinstance(event, yaml.ScalarEvent):
            value: Any = event.value if event.style else _scalar(event.value)
        elif isinstance(event, yaml.SequenceStartEvent):
            value = [self.node(item, (*path, index)) for index, item in enumerate(self.items())]
        else:
            value = {}
            for item in self.items():
                key = self.key(item, value)
                self.places[(*path, key)] = Place(self.name, _line(item))
                value[key] = self.node(next(self.events), (*path, key))
        if event.anchor:
            self.anchors[event.anchor] = value
        return value

    def items(self) -> Iterator[yaml.Event]:
        """Yield the events that begin the items of the list or mapping under way."""
        for event in self.events:
            if isinstance(event, yaml.CollectionEndEvent):
                return
            yield event

    def key(self, event: yaml.Event, mapping: Mapping[str, object]) -> str:
        self.enter(event, ())
        if not isinstance(event, yaml.ScalarEvent) or event.tag is not None:
            raise self.error("a key must be plain text", event)
        if event.value == "<<" and not event.style:
            raise self.error("merge keys (<<) are not supported; use `base: other.yaml`", event)
        if event.value in mapping:
            raise self.error(f"the key '{event.value}' appears twice in one mapping", event)
        return str(event.value)

    def copy(self, value: object, path: Path, event: yaml.Event) -> object:
        """Return an anchor's value at the place of its alias."""
        self.enter(event, path)
        self.places[path] = Place(self.name, _line(event))
        if isinstance(value, dict):
            return {key: self.copy(item, (*path, key), event) for key, item in value.items()}
        if isinstance(value, list):
            return [self.copy(item, (*path, index), event) for index, item in enumerate(value)]
        return value

    def enter(self, event: yaml.Event, path: Path) -> None:
        self.nodes += 1
        if self.nodes > MOST_NODES:
            raise self.error(f"holds more than {MOST_NODES} values", event)
        if len(path) > MOST_DEEP:
            raise self.error(f"is nested more than {MOST_DEEP} levels deep", event)

    def error(self, message: str, event: yaml.Event) -> CaseError:
        return CaseError(message, file=self.name, line=_line(event))


def _line(event: yaml.Event) -> int:
    mark: Any = event.start_mark
    return int(mark.line) + 1


def _scalar(text: str) -> str | float | bool | None:
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if not _FLOAT.fullmatch(text):
        return text
    return float(text.replace(".", "", 1) if text[-1].isalpha() else text)


LARGEST = 1_000_000  # [bytes]; a thousand times a usual case


def read_yaml(path: pathlib.Path) -> Document:
    """Return the content of a YAML file; raises `CaseError` if it is unreadable, too large, or no mapping."""
    name = str(path)
    try:
        status = os.stat(path)
        if stat.S_ISDIR(status.st_mode):
            names = sorted(file.name for file in path.glob("*.yaml"))[:FEW]
            inside = f"; it holds {', '.join(names)}" if names else ""
            raise CaseError(f"is a folder, not a case file{inside}", file=name)
        if not stat.S_ISREG(status.st_mode):
            raise CaseError("is not a regular file", file=name)
        # a file such as /proc/kmsg claims to be regular and blocks: it is not read
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with open(handle, "rb") as stream:
            raw = stream.read(LARGEST + 1)
    except FileNotFoundError:
        raise CaseError("there is no such file", file=name) from None
    except (OSError, ValueError) as error:  # ValueError: a path with a null byte
        raise CaseError(f"cannot be read: {getattr(error, 'strerror', None) or error}", file=name) from None
    if raw is None:
        raise CaseError("cannot be read: it has nothing to give now", file=name)
    if len(raw) > LARGEST:
        raise CaseError(f"is larger than {LARGEST / 1e6:g} MB, too large for a case file", file=name)
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise CaseError("is not UTF-8 text; save it in that encoding", file=name, line=line) from None
    document = parse(text, name)
    if not isinstance(document.value, dict):
        raise CaseError("holds no mapping of keys", file=name)
    return document


_SCALARS = str | int | float | bool | None


def plain_document(source: Mapping[str, object]) -> Document:
    """Return `source` as a document without lines, its models as they are; raises `CaseError` as for a file."""
    return Document(_Copy().plain(source, ()), {(): Place("")})


class _Copy:
    def __init__(self) -> None:
        self.nodes = 0

    def plain(self, value: object, path: tuple[str, ...]) -> object:
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


def _case(text: object) -> Plain:
    if not isinstance(text, str):
        return {}
    try:
        case = parse(text, "case").value
    except CaseError:
        return {}
    return case if isinstance(case, dict) else {}


def formulation(text: object) -> str:
    """Return the name of the formulation; empty where it is unknown."""
    block = _case(text).get("formulation")
    return str(block.get("type", "")) if isinstance(block, dict) else ""


def symmetry_axes(text: object) -> tuple[int, ...]:
    """Return the axes whose coordinate plane is a mirror of the model; none where they are unknown."""
    planes = _case(text).get("symmetry")
    planes = [plane for plane in planes if isinstance(plane, dict)] if isinstance(planes, list) else []
    axes = [plane.get("axis") for plane in planes if not plane.get("at") and not plane.get("velocity")]
    return tuple("xyz".index(axis) for axis in axes if axis in ("x", "y", "z"))
