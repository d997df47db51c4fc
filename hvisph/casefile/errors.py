"""Error messages of validation: path, fault, allowed values and nearest name."""

from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from functools import cache
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from hvisph.case.model import PROBLEMS, Path
from hvisph.case.units import kind_of
from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.core.text import format_value, shorten

from .document import Place
from .model_fields import Spot, keys_of, places, walk
from .spellings import present_name, renamed_key, renamed_value, spellings

M = TypeVar("M", bound=BaseModel)
MOST_SHOWN = 20
# How like an allowed key a key is that is a slip of it, and in how many places one may stand that is reported.
SLIP, MOST_PLACES = 0.75, 3


class CaseErrors(CaseError):  # noqa: N818 - a collection, not a kind
    """Several errors of one case."""

    def __init__(self, errors: Sequence[CaseError]):
        self.errors = tuple(errors)
        lines = [str(error) for error in errors[:MOST_SHOWN]]
        if len(errors) > MOST_SHOWN:
            lines.append(f"and {len(errors) - MOST_SHOWN} more")
        super().__init__("\n".join([f"{len(errors)} errors in the case:", *(f"  {line}" for line in lines)]))


def translate(error: ValidationError, root: type[M], data: object, places: Mapping[Path, Place]) -> list[CaseError]:
    """Translate the validation errors of `data` against `root`, each with its file and line."""
    errors: dict[tuple[Path, str], CaseError] = {}
    for detail in error.errors(include_url=False):
        path, kind = user_path(root, detail["loc"], data), detail["type"]
        if kind == "too_short" and detail["ctx"]["actual_length"] < len(detail["input"]):
            continue  # entries are missing because they are at fault themselves
        if kind == PROBLEMS:
            value = value_at(data, path)
            problems = [((*path, *_keys_of_text(value, text)), reason) for text, reason in detail["ctx"][PROBLEMS]]
        else:
            problems = [_explain(root, path, detail, data)]
        for where, message in problems:
            if where[-2:-1] == ("fields",):
                message = present_name("fields", value_at(data, where)) or message
            errors.setdefault((where, message), locate_error(where, message, places))
    return list(errors.values())


def validate_values(model: type[M], value: object, places: Mapping[Path, Place], context: Any = None) -> M:
    """Validate plain data against a model; raises all errors, each with its file and line."""
    try:
        return model.model_validate(value, context=context)
    except ValidationError as error:
        errors = translate(error, model, value, places)
        raise errors[0] if len(errors) == 1 else CaseErrors(errors) if errors else error from None


def locate_error(path: Path, message: str, places: Mapping[Path, Place]) -> CaseError:
    """Return the error at `path`, with the place of the nearest key above that has one."""
    place = next((places[path[:n]] for n in range(len(path), -1, -1) if path[:n] in places), Place(""))
    where = ".".join(shorten(str(part)) for part in path)
    return CaseError(message, where=where, file=place.file, line=place.line)


def _keys_of_text(data: object, text: str) -> Iterator[str | int]:
    """Yield the keys of a dotted path below `data`; numbers are places in lists unless a mapping has such a key."""
    for key in text.split(".") if text else ():
        yield key if isinstance(data, dict) or not key.isdecimal() else int(key)
        data = value_at(data, (int(key),) if key.isdecimal() and not isinstance(data, dict) else (key,))


def user_path(root: type[BaseModel], loc: Sequence[str | int], data: object) -> Path:
    """Return pydantic's location without the tags of alternatives."""
    path: Path = ()
    tag_due = False
    for part in loc:
        # pydantic marks a bad name of a body by '[key]' after the name
        block = walk(root, path[:-1], data) if part == "[key]" and path else None
        if tag_due or (block is not None and block.named):
            tag_due = False
            continue
        path = (*path, part)
        spot = walk(root, path, data)
        tag_due = spot is not None and spot.tagged
    return path


UNLIKE = ("model_type", "model_attributes_type", "dict_type", "tuple_type", "list_type")


def _explain(root: type[BaseModel], path: Path, detail: ErrorDetails, data: object) -> tuple[Path, str]:
    kind, value = detail["type"], detail["input"]
    if path[-2:-1] in (("measures",), ("expected",)) and kind in ("extra_forbidden", "literal_error"):
        name = path[-1] if kind == "extra_forbidden" else value
        if renamed := present_name("measures", name):
            return path, renamed
    if kind == "extra_forbidden":
        parent = walk(root, path[:-1], data)
        if parent is not None and (reason := _meaningless(parent, value_at(data, path[:-1]), str(path[-1]))):
            return path, reason
        if ":" in str(path[-1]):
            spaced = shorten(str(path[-1])).replace(":", ": ", 1)
            return path, f"unknown key; YAML wants a space after a colon: '{spaced}'"
        allowed = keys_of(parent, value_at(data, path[:-1])) if parent else []
        if now := renamed_key(path, allowed):
            return path, now
        key, remark = spellings("other_keys").get(str(path[-1]), ("", ""))
        if key in allowed:
            return path, f"unknown key; give '{key}'{remark}"
        where = _models_with_key(parent, value_at(data, path[:-1]), str(path[-1]), allowed) if parent else ""
        where = where or _places_of_key(root, path, allowed) or suggest_nearest(str(path[-1]), allowed)
        return path, f"unknown key{where}"
    spot = walk(root, path, data)
    if kind == "missing":
        about = spot.info.description if spot and spot.info and spot.info.description else ""
        has_name = "name" in (value if isinstance(value, dict) else {}) and path[-1] in ("density", "eos")
        library = "; a material of the library is its name alone, or {base: NAME}" if has_name else ""
        return path, f"missing{': ' + about if about else ''}{library}"
    if kind == "union_tag_not_found":
        return path, _missing_type(spot, value)
    if kind == "union_tag_invalid":
        tag = str(detail["ctx"]["tag"])
        if renamed := renamed_value("type", tag):
            return (*path, "type"), renamed
        word = spellings("types").get(tag.lower().replace("-", "_"), "")
        if spot and word in spot.models:
            return (*path, "type"), f"unknown '{shorten(tag)}'; here it is '{word}'"
        return (*path, "type"), f"unknown '{shorten(tag)}'{suggest_nearest(tag, list(spot.models) if spot else [])}"
    if kind == "literal_error":
        choice = spellings("kinematics").get(str(value).lower()) if path[-1] == "kinematics" else None
        remedy = f"; write {choice}" if choice else suggest_nearest(str(value), spot.choices if spot else ())
        return path, renamed_value(path[-1], value) or f"unknown {_format_short(value)}{remedy}"
    if kind == "value_error":
        return path, str(detail["ctx"]["error"])
    if kind == "model_attributes_type" and spot and spot.tagged:
        return path, _missing_type(spot, value)
    example = next((spellings("written_out").get(part) for part in reversed(path) if isinstance(part, str)), None)
    return path, _plain(kind, detail, value) + (f"; write it like {example}" if example and kind in UNLIKE else "")


def _models_with_key(parent: Spot, value: object, key: str, allowed: Sequence[str]) -> str:
    """Return the other models at `parent` that have the key; empty for none."""
    tags = [tag for tag, model in parent.models.items() if key in model.model_fields]
    tag = value.get("type") if isinstance(value, dict) else None
    if not parent.tagged or tag not in parent.models or not tags:
        return ""
    keys = ", ".join(k for k in allowed if k != "type") or "no other"
    return f" of {tag}, which has {keys}; it is one of {', '.join(tags)}"


def _places_of_key(root: type[BaseModel], path: Path, allowed: Sequence[str]) -> str:
    """Return the places below `root` of a key that is unknown at `path`; empty for slips and common keys."""
    key = str(path[-1])
    if get_close_matches(key, allowed, n=1, cutoff=SLIP):
        return ""
    paths = _paths_by_key(root).get(key, set())
    paths = {p for p in paths if p.split(".")[0] == path[0]} or paths
    text = " or ".join(sorted(paths, key=lambda p: (p.count("."), p)))
    return f" here; it stands at {text}" if 0 < len(paths) <= MOST_PLACES else ""


@cache
def _paths_by_key(root: type[BaseModel]) -> dict[str, set[str]]:
    paths: dict[str, set[str]] = {}
    for path, *_ in places(root):
        paths.setdefault(path.rpartition(".")[2], set()).add(path)
    return paths


def _meaningless(spot: Spot, value: object, key: str) -> str:
    """Return why `key` has no meaning in the mapping `value`, empty where it is simply unknown."""
    tag = value.get("type") if isinstance(value, dict) else None
    reason = getattr(spot.models.get(str(tag)), "meaningless", {}).get(key)
    return f"has no meaning with {tag}: {reason}; leave it out" if reason else ""


def _plain(error_type: str, detail: ErrorDetails, value: object) -> str:
    """Reword the remaining messages of pydantic."""
    expected = {
        "a mapping of keys": ("model_type", "model_attributes_type", "dict_type"),
        "a list": ("tuple_type", "list_type"),
        "text": ("string_type",),
    }
    for noun, kinds in expected.items():
        if error_type in kinds:
            return f"expected {noun}, found {kind_of(value)}"
    if error_type in ("int_type", "int_parsing", "int_from_float"):
        return f"expected a whole number, found {_format_short(value)}"
    if error_type == "string_pattern_mismatch":
        return "a name starts with a letter or _ and holds up to 64 letters, digits, _ and -"
    if error_type == "too_short":
        return f"needs at least {detail['ctx']['min_length']} entries, has {detail['ctx']['actual_length']}"
    if error_type == "too_long":
        return f"has more than the {detail['ctx']['max_length']} entries that are allowed"
    message = str(detail["msg"])
    return f"{message[:1].lower()}{message[1:]}, found {_format_short(value)}"


def _missing_type(spot: Spot | None, value: object) -> str:
    allowed = list(spot.models) if spot else []
    if isinstance(value, dict):
        return f"`type` is missing; allowed: {', '.join(allowed)}"
    if isinstance(value, str) and value in allowed:
        return f"expected a mapping; write {{type: {value}}}"
    return f"expected a mapping with `type`, found {kind_of(value)}; allowed types: {', '.join(allowed)}"


def value_at(data: object, path: Path) -> Any:
    """Return the value at `path` in plain `data`, None where there is none."""
    for key in path:
        if isinstance(data, dict):
            data = data.get(key)
        elif isinstance(data, list | tuple) and isinstance(key, int) and 0 <= key < len(data):
            data = data[key]
        else:
            return None
    return data


def _format_short(value: object) -> str:
    return f"'{shorten(value)}'" if isinstance(value, str) else f"{shorten(format_value(value))}"
