"""Base class of the models of the case file, and errors with their path."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path as Path_
from typing import Annotated, Any, ClassVar, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationInfo,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

PROBLEMS = "problems"
Path = tuple[str | int, ...]  # keys and places in lists, from the outermost in
Problem = tuple[str, str]  # dotted path of the key to blame, from the checked block on; fault, allowed values, remedy
AnyCase = Any  # a case in the checks of its parts, which its class imports


class StrictModel(BaseModel):
    """Frozen, no unknown keys, no non-finite numbers."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, validate_default=False)

    # Keys that its siblings have and it has not, with the reason, for the message when a user writes one.
    meaningless: ClassVar[dict[str, str]] = {}

    def _faults(self) -> Iterator[Problem]:
        """Yield the errors that involve several keys."""
        yield from ()

    @model_validator(mode="after")
    def _refuse_faults(self) -> Self:
        refuse(self._faults())
        return self


BY_TYPE = Field(discriminator="type")  # in an annotation: the key `type` selects one of several blocks


def key(description: str, default: Any = ..., **limits: Any) -> Any:
    """Return a field of a block: description, default (required unless given), limits of `pydantic.Field`."""
    return Field(default, description=description, **limits)


def refuse(problems: Iterable[Problem]) -> None:
    """Raise, inside a validator, all `problems` at once; do nothing if there are none."""
    if problems := tuple(problems):
        text = "; ".join(f"{path}: {message}" for path, message in problems)
        raise PydanticCustomError(PROBLEMS, "{text}", {"text": text, PROBLEMS: problems})


@dataclass(frozen=True)
class Shorthand:
    """Annotation of a short form of a value, expanded before validation."""

    expand: Callable[[Any, ValidationInfo], object]  # returns the long form of a short one, and anything else unchanged
    forms: tuple[str, ...] = ("number", "string")  # kinds of JSON values of the short forms
    schemas: tuple[JsonSchemaValue, ...] = ()  # JSON schemas of further forms

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_before_validator_function(self.expand, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {"anyOf": [handler(schema), *({"type": form} for form in self.forms), *self.schemas]}


def is_scalar(value: object) -> bool:
    """Whether a raw value is a number or text."""
    return isinstance(value, int | float | str) and not isinstance(value, bool)


SCALAR_AS_LIST = Shorthand(lambda value, _: [value] if is_scalar(value) else value)


def expand_switch(value: object, info: ValidationInfo) -> object:
    """Return an empty block for true, None for false, anything else unchanged."""
    return {} if value is True else None if value is False else value


def _resolve_path(value: object, info: ValidationInfo) -> object:
    """Resolve the path of a file, relative to the files of the case where it exists there."""
    if not isinstance(value, str) or Path_(value).is_absolute():
        return value
    for folder in (info.context or {}).get("folders", ()):
        if (Path_(folder) / value).is_file():
            return str((Path_(folder) / value).resolve())
    return value


# Path of a data file, relative to the case file that names it.
DataFile = Annotated[str, Shorthand(_resolve_path, ()), Field(min_length=1, max_length=4096)]
