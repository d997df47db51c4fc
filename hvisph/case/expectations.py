"""Requested measures and expected values of a case, and sets of experiments with their acceptance criteria."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, create_model, model_validator

from hvisph.core.measure_catalogue import CATALOGUE
from hvisph.core.text import Plain

from .model import Problem, StrictModel, refuse
from .sweep import Bound, Settings, Text
from .units import Dimension, NonNegativeNumber, PositiveNumber, Quantity, dimension_of


class Expectation(StrictModel):
    """Expected value [SI unit of the measure], its tolerance and its source."""

    value: float = Field(description="Expected value")
    tolerance: float = Field(description="Largest deviation that passes; a percentage such as '12 %' is of the value")
    source: str = Field(default="", description="Where the value comes from")


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
        for name in CATALOGUE:
            expectation = getattr(self, name)
            if expectation is not None:
                yield name, expectation


_BY_UNIT = {unit: _expectation(dimension_of(unit)) for unit in dict.fromkeys(m.unit for m in CATALOGUE.values())}
_FIELDS: Plain = {
    name: (_BY_UNIT[measure.unit] | None, Field(default=None, description=measure.meaning))
    for name, measure in CATALOGUE.items()
}
if TYPE_CHECKING:  # what is made from the catalogue cannot be read by a type checker
    Expectations = _Expectations
    MeasureName = str
else:
    Expectations = create_model("Expectations", __base__=_Expectations, __doc__=_Expectations.__doc__, **_FIELDS)
    MeasureName = Literal[tuple(CATALOGUE)]


Words = Annotated[str, Field(min_length=1, max_length=4000)]
JudgeName = Literal["taylor", "shield", "cloud", "limit", "melt", "crater", "spall", "fragments"]


class Across(StrictModel):
    """Particles across the characteristic length at full, second and coarse resolution."""

    of: Text = Field(
        description="Path of the length that they lie across, such as bodies.bar.shape.diameter; a shot with "
        "another length names that as experiment.across"
    )
    full: PositiveNumber = Field(description="In the runs that are judged")
    second: PositiveNumber = Field(description="In the runs that tell the error of the first")
    coarse: PositiveNumber = Field(description="In the runs that only show that all works: seconds")


class Asked(StrictModel):
    """Acceptance criteria of a quantity over all evaluated experiments."""

    mean: NonNegativeNumber | None = Field(default=None, description="Largest mean of the differences, as a share")
    worst: NonNegativeNumber | None = Field(default=None, description="Largest difference of a shot, as a share")
    within: NonNegativeNumber | None = Field(default=None, description="Largest difference of a shot, in its unit")
    between: tuple[float, float] | None = Field(default=None, description="Where every value must lie, in its unit")
    right: NonNegativeNumber | None = Field(default=None, description="Least share of shots on the right side")
    wrong_within: NonNegativeNumber | None = Field(
        default=None, description="How far from the limit curve in diameter a shot on the wrong side may be, as a share"
    )


class Limit(StrictModel):
    """Limit value of a setting, found by bisection."""

    set: Settings = Field(default={}, description="Settings of this shot, by path")
    path: Text = Field(default="bodies.projectile.velocity.0", description="The setting that is varied")
    bracket: tuple[Bound, Bound] = Field(description="A value below the limit and one above it")
    tolerance: Bound = Field(description="Width of the bracket at which to stop")


class ExperimentSet(StrictModel):
    """Experiments of one kind, computed with one formulation at one resolution."""

    title: Text = Field(description="What it is, for a heading")
    shows: Words = Field(description="What it tells of a code")
    set_up: Words = Field(description="Formulation, materials and resolution, and why: chosen before any comparison")
    stands_in: str = Field(default="", max_length=4000, description="What stands for a material whose numbers lack")
    found: str = Field(default="", max_length=4000, description="What agrees, what does not and why")
    why: dict[Text, Words] = Field(default={}, description="By quantity: in a sentence, why it misses what is asked")
    remarks: dict[Text, Text] = Field(default={}, description="By group of shots: why one is beyond the worst asked")
    judge: JudgeName = Field(description="What draws the measured quantities from the runs")
    across: Across = Field(description="Particles across")
    asked: dict[Text, Asked] = Field(default={}, description="By quantity; those not named are shown, not judged")
    limits: dict[Text, Limit] = Field(default={}, description="Shots whose limit is looked for, in place of shots.csv")

    @model_validator(mode="after")
    def _bisections(self) -> ExperimentSet:
        if (self.judge == "limit") != bool(self.limits):
            refuse([Problem(("limits",), "belong to the judge `limit`, and to no other")])
        return self
