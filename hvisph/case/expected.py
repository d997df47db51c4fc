"""Measures that a case can ask for, and the values it expects of them.

A new measure is one line in `MEASURES`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

from pydantic import BeforeValidator, Field, ValidationInfo, create_model

from hvisph.case.dimensions import LENGTH, NUMBER, PRESSURE, VELOCITY, Dimension
from hvisph.case.model import StrictModel
from hvisph.case.units import Quantity


class Measure(NamedTuple):
    """A number that `hvisph measure` reports: its kind, its meaning, and where it has one."""

    dimension: Dimension
    meaning: str
    dims: tuple[int, ...]


MEASURES: dict[str, Measure] = {
    "crater_diameter": Measure(LENGTH, "Mean diameter of the hole in the target [m]", (2, 3)),
    "crater_diameter_minimum": Measure(LENGTH, "Smallest diameter of the hole in the target [m]", (2, 3)),
    "crater_lip_to_lip": Measure(LENGTH, "Diameter of the crater between its lips [m]", (2, 3)),
    "extension": Measure(LENGTH, "Extent of the projectile's main body along the shot line [m]", (2, 3)),
    "penetration": Measure(LENGTH, "Depth of the projectile's tip behind the struck face [m]", (2, 3)),
    "centre_pressure_peak": Measure(PRESSURE, "Highest mean pressure at the projectile's centre [Pa]", (1, 2, 3)),
    "centre_tension_peak": Measure(PRESSURE, "Highest tension on the shot line [Pa], positive", (1, 2, 3)),
    "residual_velocity": Measure(VELOCITY, "Axial velocity of the projectile's main body [m/s]", (1, 2, 3)),
    "momentum_transfer": Measure(NUMBER, "Momentum of the target over that of the shot [-]", (1, 2, 3)),
    "plug_velocity": Measure(VELOCITY, "Axial velocity of the plug, the largest piece punched out [m/s]", (2, 3)),
    "plug_width": Measure(LENGTH, "Extent of the plug across the shot line, between particles [m]", (2, 3)),
    "plug_thickness": Measure(LENGTH, "Extent of the plug along the shot line, between particles [m]", (2, 3)),
    "impact_diameter": Measure(LENGTH, "Twice the mean radius of the hole's lip [m]", (2, 3)),
    "lip_height": Measure(LENGTH, "Mean height of the lip over the plate's rear face [m]", (2, 3)),
    "lip_height_maximum": Measure(LENGTH, "Largest height of the lip over the plate's rear face [m]", (2, 3)),
    "target_fragments": Measure(NUMBER, "Number of the target's detached pieces of 5 particles or more [-]", (2, 3)),
    "void_fraction": Measure(NUMBER, "Share of voids within the projectile's main body [-]", (2,)),
    "plateau_stress": Measure(PRESSURE, "Axial stress behind the shocks of a plate impact [Pa]", (1,)),
    "interface_velocity": Measure(VELOCITY, "Velocity of the interface of a plate impact [m/s]", (1,)),
}


def measures_of(dim: int) -> tuple[str, ...]:
    """Return the names of the measures that have a meaning in `dim` dimensions."""
    return tuple(name for name, measure in MEASURES.items() if dim in measure.dims)


class Expectation(StrictModel):
    """An expected value [SI unit of the measure], how far from it still passes, and who says so."""

    value: float = Field(description="Expected value")
    tolerance: float = Field(description="Largest deviation that passes; a percentage such as '12 %' is of the value")
    source: str = Field(default="", description="Where the value comes from")


def _percentage(value: Any, info: ValidationInfo) -> Any:
    """Turn a tolerance such as '12 %' into the measure's unit."""
    if isinstance(value, str) and value.rstrip().endswith("%"):
        try:
            share = float(value.rstrip()[:-1]) / 100.0
        except ValueError:
            raise ValueError(f"{value[:80]!r} is not a percentage (write it like '12 %')") from None
        return share * abs(info.data.get("value", 0.0))
    return value


def _expectation(dimension: Dimension) -> type[Expectation]:
    """Return the model of an expected value of one dimension."""
    name = dimension.name.split()[-1].capitalize() + "Expectation"
    value = Annotated[float, Quantity(dimension)]
    tolerance = Annotated[float, Quantity(dimension, minimum=0), BeforeValidator(_percentage)]
    unit = f" [{dimension.unit or '-'}]"
    fields = Expectation.model_fields
    return create_model(
        name,
        __base__=Expectation,
        __doc__=f"An expected value that is {dimension.name}.",
        value=(value, Field(description=f"{fields['value'].description}{unit}")),
        tolerance=(tolerance, Field(description=f"{fields['tolerance'].description}{unit}, at least 0")),
    )


class _Expectations(StrictModel):
    """Expected values, by the name of the measure."""

    def items(self) -> Iterator[tuple[str, Expectation]]:
        """Yield the name and the expectation of every measure that has one."""
        for name in MEASURES:
            expectation = getattr(self, name)
            if expectation is not None:
                yield name, expectation


_BY_DIMENSION = {measure.dimension: _expectation(measure.dimension) for measure in MEASURES.values()}
_FIELDS: dict[str, Any] = {
    name: (_BY_DIMENSION[measure.dimension] | None, Field(default=None, description=measure.meaning))
    for name, measure in MEASURES.items()
}
if TYPE_CHECKING:  # what is made from the table below cannot be read by a type checker
    Expectations = _Expectations
    MeasureName = str
else:
    Expectations = create_model("Expectations", __base__=_Expectations, __doc__=_Expectations.__doc__, **_FIELDS)
    MeasureName = Literal[tuple(MEASURES)]
