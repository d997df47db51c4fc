"""Introspection of the models: fields and alternatives at a path.

Error messages, overrides, the schema and the manual all ask here, so none keeps a list of keys.
"""

import types
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Union, get_args, get_origin

from pydantic import BaseModel, Discriminator
from pydantic.fields import FieldInfo

from hvisph.case.model import Shorthand
from hvisph.case.units import Quantity


@dataclass(frozen=True)
class Spot:
    """Allowed content at one path of the case file."""

    # the mappings that may stand there, by the value of their `type`; a single one that has no `type` is under the
    # empty string
    models: dict[str, type[BaseModel]]
    item: object = None  # annotation of the items, where it is a list or a mapping with free keys
    quantity: Quantity | None = None  # dimension and range, where it is a number
    choices: tuple[str, ...] = ()  # allowed words
    integer: bool = False  # whether it is a whole number
    info: FieldInfo | None = None  # the field, with its description and default
    tagged: bool = False  # whether `type` chooses among `models`
    short: tuple[str, ...] = ()  # kinds of JSON values that may stand there as a shorthand
    named: bool = False  # whether the items have names (a mapping) rather than places (a list)
    row: tuple[object, ...] = ()  # annotations of the items of a list whose places differ, such as time and velocity


def spot_of(annotation: object, info: FieldInfo | None = None) -> Spot:
    """Return the content that `annotation` allows."""
    metadata = list(info.metadata) if info else []
    tagged = bool(info and info.discriminator)
    while get_origin(annotation) is Annotated:
        annotation, *annotations = get_args(annotation)
        metadata += annotations
    tagged = tagged or any(isinstance(m, Discriminator) or getattr(m, "discriminator", None) for m in metadata)
    options = get_args(annotation) if _is_union(annotation) else (annotation,)
    models: dict[str, type[BaseModel]] = {}
    item, integer, named = None, False, False
    row: tuple[object, ...] = ()
    short = next((m.forms for m in metadata if isinstance(m, Shorthand)), ())
    choices: list[str] = []
    quantity = next((m for m in metadata if isinstance(m, Quantity)), None)
    for option in options:
        if _is_union(option) or get_origin(option) is Annotated:
            inner = spot_of(option)
            models |= inner.models
            item, quantity, tagged = item or inner.item, quantity or inner.quantity, tagged or inner.tagged
            row = row or inner.row
            choices += inner.choices
            integer = integer or inner.integer
        elif isinstance(option, type) and issubclass(option, BaseModel):
            field = option.model_fields.get("type")
            models[str(get_args(field.annotation)[0]) if field else ""] = option
        elif get_origin(option) is tuple:
            places = get_args(option)
            item, row = places[0], places if Ellipsis not in places and len(set(places)) > 1 else row
        elif get_origin(option) is dict:
            item, named = get_args(option)[1], True
        elif str(get_origin(option)) == "typing.Literal":
            choices += map(str, get_args(option))
        elif option is int:
            integer = True
    return Spot(models, item, quantity, tuple(choices), integer, info, tagged, short, named, row)


def walk(root: type[BaseModel], keys: Sequence[str | int], value: object = None) -> Spot | None:
    """Return the expected content at the path `keys` below the model `root`, None where nothing is allowed.

    `keys` are as a user writes them, without tags of alternatives: the `type` entries of the input `value` choose among
    these; without it, the first one that has the key.
    """
    spot = Spot({"": root})
    for key in keys:
        tag = value.get("type") if isinstance(value, dict) else None
        fields = next((m.model_fields for m in _models_of_kind(spot, tag) if key in m.model_fields), None)
        if fields is not None:
            info = fields[str(key)]
            spot = spot_of(info.annotation, info)
        elif spot.item is not None:
            spot = spot_of(spot.item)
        else:
            return None
        value = _item(value, key)
    return spot


def keys_of(spot: Spot, value: object = None) -> list[str]:
    """Return the allowed keys of the mapping at `spot`, given its `type` in `value`."""
    tag = value.get("type") if isinstance(value, dict) else None
    names: list[str] = []
    for model in _models_of_kind(spot, tag):
        names += [name for name in model.model_fields if name not in names]
    return names


def inner_of(spot: Spot) -> Spot:
    """Return the content of each entry of a list or of named blocks, or the spot itself."""
    return spot if spot.item is None else spot_of(spot.item)


def places(
    model: type[BaseModel], above: str = "", parents: tuple[object, ...] = ()
) -> Iterator[tuple[str, str, FieldInfo, Spot]]:
    """Yield every key below `model`: its path, the path of its items, its field and the allowed content."""
    for name, info, spot, alternatives in _spots_of(model):
        path = f"{above}.{name}" if above else name
        below = f"{path}.NAME" if spot.named else path
        yield path, below, info, spot
        for alternative in alternatives:
            if alternative not in parents:
                yield from places(alternative, below, (*parents, alternative))


@cache
def _spots_of(model: type[BaseModel]) -> list[tuple[str, FieldInfo, Spot, list[type[BaseModel]]]]:
    spots = ((name, info, spot_of(info.annotation, info)) for name, info in model.model_fields.items())
    return [(name, info, spot, list(inner_of(spot).models.values())) for name, info, spot in spots]


def _models_of_kind(spot: Spot, tag: object) -> list[type[BaseModel]]:
    if isinstance(tag, str) and tag in spot.models:
        return [spot.models[tag]]
    return list(spot.models.values())


def _item(value: object, key: str | int) -> object:
    if isinstance(value, dict):
        return value.get(key)
    if isinstance(value, list | tuple) and isinstance(key, int) and 0 <= key < len(value):
        return value[key]
    return None


def _is_union(annotation: object) -> bool:
    return get_origin(annotation) in (Union, types.UnionType)
