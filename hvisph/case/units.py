"""Quantities of a case file: "0.1 mm", "3.1 km/s", "27.6 GPa", or plain numbers in SI.

`Quantity` is what the models annotate their floats with. It checks the dimension and
the range, and stores the value in SI (angles in degrees).
"""

import math
import re
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from functools import lru_cache
from typing import Annotated, Any

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from hvisph.core.errors import suggest_nearest


@dataclass(frozen=True)
class Dimension:
    """A kind of quantity."""

    name: str  # its name in messages, with its article: ``a length``
    unit: str  # unit of plain numbers, as pint reads it; empty for pure numbers
    example: str  # example of input
    # usual units and their decimal factors, read without pint, whose import takes 0.3 s; `_` is a blank
    units: str = ""


LENGTH = Dimension("a length", "m", "0.1 mm", "m=1 cm=1e-2 mm=1e-3 um=1e-6 µm=1e-6 nm=1e-9 km=1e3")
TIME = Dimension("a time", "s", "8 us", "s=1 ms=1e-3 us=1e-6 µs=1e-6 ns=1e-9 ps=1e-12")
MASS = Dimension("a mass", "kg", "1 g", "kg=1 g=1e-3 mg=1e-6 ug=1e-9")
INERTIA = Dimension("a moment of inertia", "kg m^2", "0.2 g m^2", "kg_m^2=1 g_m^2=1e-3 kg_mm^2=1e-6 g_mm^2=1e-9")
MOMENTUM = Dimension("a momentum", "N s", "0.5 N s", "N_s=1 mN_s=1e-3 kN_s=1e3 MN_s=1e6")
VELOCITY = Dimension("a velocity", "m/s", "3.1 km/s", "m/s=1 km/s=1e3 mm/us=1e3 mm/µs=1e3 mm/ms=1 cm/us=1e4 mm/s=1e-3")
ACCELERATION = Dimension("an acceleration", "m/s^2", "9.81 m/s^2", "m/s^2=1 m/s**2=1 km/s^2=1e3 mm/s^2=1e-3")
PRESSURE = Dimension("a pressure", "Pa", "27.6 GPa", "Pa=1 kPa=1e3 MPa=1e6 GPa=1e9 TPa=1e12 bar=1e5 kbar=1e8 Mbar=1e11")
DENSITY = Dimension(
    "a density",
    "kg/m^3",
    "2785 kg/m^3",
    "kg/m^3=1 kg/m**3=1 g/cm^3=1e3 g/cm**3=1e3 g/cc=1e3 g/mm^3=1e6 kg/m3=1 g/cm3=1e3",
)
SPECIFIC_ENERGY = Dimension("a specific energy", "J/kg", "1.2 MJ/kg", "J/kg=1 kJ/kg=1e3 MJ/kg=1e6 J/g=1e3 kJ/g=1e6")
HEAT_CAPACITY = Dimension(
    "a specific heat capacity", "J/(kg K)", "875 J/(kg K)", "J/(kg_K)=1 J/(kg*K)=1 J/kg/K=1 kJ/(kg_K)=1e3"
)
TEMPERATURE = Dimension("a temperature", "K", "300 K", "K=1")
RATE = Dimension("a rate", "1/s", "1 1/s", "1/s=1 1/us=1e6 1/ms=1e3")
ANGLE = Dimension("an angle", "deg", "30 deg", "deg=1 degree=1 degrees=1")
TOUGHNESS = Dimension("a fracture toughness", "Pa m^0.5", "29e6 Pa m^0.5", "Pa_m^0.5=1 MPa_m^0.5=1e6")
SURFACE_ENERGY = Dimension("an energy per area", "J/m^2", "10.9 kJ/m^2", "J/m^2=1 J/m**2=1 kJ/m^2=1e3 kJ/m**2=1e3")
INVERSE_PRESSURE = Dimension("an inverse pressure", "1/Pa", "65.2e-12 1/Pa", "1/Pa=1 1/GPa=1e-9 1/Mbar=1e-11")
INVERSE_TEMPERATURE = Dimension("an inverse temperature", "1/K", "0.616e-3 1/K", "1/K=1")
VISCOSITY = Dimension("a viscosity", "Pa s", "0.012 MPa s", "Pa_s=1 MPa_s=1e6")
NUMBER = Dimension("a number", "", "0.3")
DIMENSIONS = tuple(value for value in list(globals().values()) if isinstance(value, Dimension))
# Decimal factors make "27.6 GPa" the float nearest to 27.6e9. A test compares every entry with pint.
COMMON_UNITS = {
    unit.replace("_", " "): (dimension, Decimal(factor))
    for dimension in DIMENSIONS
    for unit, _, factor in (entry.partition("=") for entry in dimension.units.split())
}


def spellings(dimension: Dimension) -> list[str]:
    """Return the usual units of `dimension`, for "did you mean"."""
    return [unit for unit, (kind, _) in COMMON_UNITS.items() if kind is dimension]


def dimension_of(unit: str) -> Dimension:
    """Return the dimension whose plain numbers are in `unit`. Raises `KeyError` if the case file has none."""
    return {dimension.unit: dimension for dimension in DIMENSIONS}[unit]


_NUMBER = re.compile(r"\s*([+-]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][+-]?\d{1,4})?)\s*(.*?)\s*", re.DOTALL)
# Unit names, single-digit powers, products and quotients: all that units need, and nothing
# that an expression evaluator could be kept busy with (no towers of powers, no numbers).
_UNIT = re.compile(
    r"(?:1\s*/\s*)?+(?:(?>[^\W\d_]++(?:_[^\W\d_]++)*+(?:(?:\^|\*\*)-?\d(?!\d)|\d?(?!\d))?)|[*/ ()·]++)++"
)
_LONGEST = 80


def parse_quantity(text: str, dimension: Dimension) -> float:
    """Return the SI value (degrees of angles) of a number with or without unit; `ValueError` for any other text."""
    match = _NUMBER.fullmatch(text) if len(text) <= _LONGEST else None
    if match is None:
        raise ValueError(f"{_quote(text)} is not {dimension.name}{_remedy(dimension)}")
    digits, unit = match.groups()
    try:
        number = Decimal(digits.replace("_", ""))
    except InvalidOperation:
        raise ValueError(f"{_quote(text)} is not {dimension.name}{_remedy(dimension)}") from None
    if not unit:
        return float(number)
    if unit in COMMON_UNITS:
        kind, factor = COMMON_UNITS[unit]
        if kind is dimension:
            return float(number * factor)
        raise ValueError(f"{_quote(text)} is {kind.name}, expected {dimension.name}{_remedy(dimension)}")
    return _parse_with_pint(float(number), unit, text, dimension)


def _parse_with_pint(number: float, unit: str, text: str, dimension: Dimension) -> float:
    """Convert a unit by pint's registry."""
    comma = "; decimals follow a point, not a comma" if unit.startswith(",") else ""
    unknown = f"{_quote(text)}: unknown unit {_quote(unit)}{comma or suggest_nearest(unit, spellings(dimension))}"
    if _UNIT.fullmatch(unit) is None:
        raise ValueError(unknown)
    if dimension is NUMBER:
        raise ValueError(f"{_quote(text)} has a unit, expected a plain number")
    from pint.errors import DimensionalityError

    registry = _registry()
    try:
        return float(registry.Quantity(number, unit).to(dimension.unit).magnitude)
    except DimensionalityError:
        raise ValueError(f"{_quote(text)} is not {dimension.name}{_remedy(dimension)}") from None
    except Exception:  # pint's parser lets tokenizer, attribute, assertion and overflow errors through
        raise ValueError(unknown) from None


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


def _quote(text: str) -> str:
    return repr(text if len(text) <= _LONGEST else text[:_LONGEST] + "...")


def _remedy(dimension: Dimension) -> str:
    if dimension is NUMBER:
        return f" (write it like {dimension.example})"
    return f" (write it like '{dimension.example}', or as a plain number in {dimension.unit})"


LARGEST = 1e30  # products of several numbers stay well inside what a float holds; no quantity of any unit is near it


@dataclass(frozen=True)
class Quantity:
    """Annotation of a float field: dimension and range."""

    dimension: Dimension  # kind of quantity; its unit is that of plain numbers and of the stored value
    # exclusive limits, in that unit
    above: float | None = None
    below: float | None = None
    # inclusive limits, in that unit
    minimum: float | None = None
    maximum: float | None = None

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self.validate)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        number: JsonSchemaValue = {"type": "number"}
        limits = {
            "exclusiveMinimum": self.above,
            "exclusiveMaximum": self.below,
            "minimum": self.minimum,
            "maximum": self.maximum,
        }
        number |= {key: value for key, value in limits.items() if value is not None}
        if self.dimension is NUMBER:
            return number
        return {"anyOf": [number, {"type": "string"}], "examples": [self.dimension.example]}

    def validate(self, value: object, info: ValidationInfo) -> float:
        """Return `value` in SI, or raise ValueError with the expected range."""
        result = self._number(value, info)
        if not math.isfinite(result):
            raise ValueError(f"{value!r} is not a finite number")
        if abs(result) > max(LARGEST, self.maximum or 0.0) or (self.above == 0 and 0.0 < result < 1.0 / LARGEST):
            fault = f"{value} is outside the permitted magnitudes, {1.0 / LARGEST:g} to {LARGEST:g} in"
            raise ValueError(f"{fault} {self.dimension.unit or 'plain numbers'}")
        if not self._is_allowed(result):
            raise ValueError(f"{value} is out of range: must be {self.range_text()}")
        return result

    def _number(self, value: object, info: ValidationInfo) -> float:
        if isinstance(value, str):
            plain = (info.context or {}).get("units") == "none"
            if plain and self.dimension not in (NUMBER, ANGLE):
                try:
                    return parse_quantity(value, NUMBER)
                except ValueError:
                    raise ValueError(
                        f"{_quote(value)}: the case has `units: none`, so only plain numbers are allowed"
                    ) from None
            return parse_quantity(value, self.dimension)
        if isinstance(value, int | float) and not isinstance(value, bool):
            try:
                return float(value)
            except OverflowError:
                raise ValueError("the number is too large") from None
        raise ValueError(f"expected {self.dimension.name}, found {kind_of(value)}{_remedy(self.dimension)}")

    def _is_allowed(self, value: float) -> bool:
        return (
            (self.above is None or value > self.above)
            and (self.below is None or value < self.below)
            and (self.minimum is None or value >= self.minimum)
            and (self.maximum is None or value <= self.maximum)
        )

    def range_text(self) -> str:
        """Return the allowed range in words, empty if there is none."""
        limits = (("above", self.above), ("at least", self.minimum), ("below", self.below), ("at most", self.maximum))
        unit = f" {self.dimension.unit}" if self.dimension.unit else ""
        return " and ".join(f"{word} {limit:g}{unit if limit else ''}" for word, limit in limits if limit is not None)


def kind_of(value: object) -> str:
    """Return the kind of a value of a case file in words."""
    words = {"a mapping": dict, "a list": list | tuple, "text": str, "true/false": bool, "a number": int | float}
    named = next((word for word, kind in words.items() if isinstance(value, kind)), type(value).__name__)
    return "nothing (null)" if value is None else named


Length = Annotated[float, Quantity(LENGTH)]
PositiveLength = Annotated[float, Quantity(LENGTH, above=0)]
NonNegativeLength = Annotated[float, Quantity(LENGTH, minimum=0)]
NonNegativeTime = Annotated[float, Quantity(TIME, minimum=0)]
PositiveTime = Annotated[float, Quantity(TIME, above=0)]
Velocity = Annotated[float, Quantity(VELOCITY)]
PositiveVelocity = Annotated[float, Quantity(VELOCITY, above=0)]
NonNegativeVelocity = Annotated[float, Quantity(VELOCITY, minimum=0)]
Acceleration = Annotated[float, Quantity(ACCELERATION)]
Pressure = Annotated[float, Quantity(PRESSURE)]
PositivePressure = Annotated[float, Quantity(PRESSURE, above=0)]
NonNegativePressure = Annotated[float, Quantity(PRESSURE, minimum=0)]
NegativePressure = Annotated[float, Quantity(PRESSURE, below=0)]
PositiveDensity = Annotated[float, Quantity(DENSITY, above=0)]
NonNegativeSpecificEnergy = Annotated[float, Quantity(SPECIFIC_ENERGY, minimum=0)]
PositiveSpecificEnergy = Annotated[float, Quantity(SPECIFIC_ENERGY, above=0)]
PositiveHeatCapacity = Annotated[float, Quantity(HEAT_CAPACITY, above=0)]
PositiveTemperature = Annotated[float, Quantity(TEMPERATURE, above=0)]
PositiveRate = Annotated[float, Quantity(RATE, above=0)]
Share = Annotated[float, Quantity(NUMBER, minimum=0, maximum=1)]
PositiveShare = Annotated[float, Quantity(NUMBER, above=0, maximum=1)]
SmoothingRatio = Annotated[float, Quantity(NUMBER, minimum=1.0, maximum=2.5)]
Angle = Annotated[float, Quantity(ANGLE)]
Number = Annotated[float, Quantity(NUMBER)]
PositiveNumber = Annotated[float, Quantity(NUMBER, above=0)]
NonNegativeNumber = Annotated[float, Quantity(NUMBER, minimum=0)]
Count = Annotated[int, Field(strict=True, ge=1, le=10**9)]
