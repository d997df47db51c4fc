"""Requested measures and expected values of a case."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BeforeValidator, ValidationInfo, create_model

from hvisph.core.measure_catalogue import CATALOGUE
from hvisph.core.text import Plain

from .model import StrictModel, key
from .units import Dimension, Quantity, dimension_of


class Expectation(StrictModel):
    """Expected value [SI unit of the measure], its tolerance and its source."""

    value: float = key("Expected value")
    tolerance: float = key("Largest deviation that passes; a percentage such as '12 %' is of the value")
    source: str = key("Where the value comes from", "")


def _percentage(value: object, info: ValidationInfo) -> object:
    """Convert a tolerance such as '12 %' to the unit of the measure."""
    if isinstance(value, str) and value.rstrip().endswith("%"):
        try:
            share = float(value.rstrip()[:-1]) / 100.0
        except ValueError:
            raise ValueError(f"{value[:80]!r} is not a percentage (write it like '12 %')") from None
        return share * abs(info.data.get("value", 0.0))
    return value


def _expectation(dimension: Dimension) -> type[Expectation]:
    name = dimension.name.split()[-1].capitalize() + "Expectation"
    value = Annotated[float, Quantity(dimension)]
    tolerance = Annotated[float, Quantity(dimension, minimum=0), BeforeValidator(_percentage)]
    unit = f" [{dimension.unit or '-'}]"
    fields = Expectation.model_fields
    return create_model(
        name,
        __base__=Expectation,
        __doc__=f"An expected value that is {dimension.name}.",
        value=(value, key(f"{fields['value'].description}{unit}")),
        tolerance=(tolerance, key(f"{fields['tolerance'].description}{unit}, at least 0")),
    )


class _Expectations(StrictModel):
    """Expected values, by the name of the measure."""

    def items(self) -> Iterator[tuple[str, Expectation]]:
        """Yield the name and the expectation of every measure that has one."""
        for name in CATALOGUE:
            expectation = getattr(self, name)
            if expectation is not None:
                yield name, expectation


_BY_UNIT = {unit: _expectation(dimension_of(unit)) for unit in dict.fromkeys(m.unit for m in CATALOGUE.values())}
_FIELDS: Plain = {
    name: (_BY_UNIT[measure.unit] | None, key(measure.meaning, None)) for name, measure in CATALOGUE.items()
}
if TYPE_CHECKING:  # a type checker cannot read types made from the catalogue
    Expectations = _Expectations
    MeasureName = str
else:
    Expectations = create_model("Expectations", __base__=_Expectations, __doc__=_Expectations.__doc__, **_FIELDS)
    MeasureName = Literal[tuple(CATALOGUE)]
