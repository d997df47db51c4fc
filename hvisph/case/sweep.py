"""Parameter sweep: varied settings and the evaluation of the results."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, create_model, model_validator

from hvisph.core.text import Plain

from .model import Problem, StrictModel, refuse
from .units import NUMBER, PositiveTime, Quantity

Count = Annotated[int, Field(strict=True, ge=1, le=1_000_000)]
Value = str | int | float | bool | None | list[Any] | Plain
Settings = dict[Annotated[str, Field(pattern=r"^[A-Za-z_][\w.-]*$", max_length=200)], Value]
Text = Annotated[str, Field(min_length=1, max_length=80)]
File = Annotated[str, Field(min_length=1, max_length=4096)]  # as long as paths may be
Bound = str | int | float

MOST_CASES = 100_000


Span = create_model(  # `from` is a word of Python's
    "Span",
    __base__=StrictModel,
    __doc__="Equally spaced values.",
    **{  # type: ignore[call-overload]
        "from": (Bound, Field(description="First value, with its unit")),
        "to": (Bound, Field(description="Last value, in the same unit")),
        "count": (Annotated[int, Field(strict=True, ge=2, le=10_000)], Field(description="How many, at least 2")),
    },
)


Values = Annotated[
    Annotated[Span, Tag("span")] | Annotated[list[Value], Tag("list")],  # type: ignore[valid-type]
    Discriminator(lambda value: "span" if isinstance(value, dict | Span) else "list"),
]


class Grid(StrictModel):
    """Every combination of the values."""

    type: Literal["grid"] = "grid"
    values: dict[str, Values] = Field(
        description="By path of a setting: a list of values, or {from, to, count}", min_length=1
    )


class Listed(StrictModel):
    """Cases listed here or in a table."""

    type: Literal["list"] = "list"
    cases: list[Settings] | None = Field(default=None, description="Settings of each case, by path", min_length=1)
    file: File | None = Field(
        default=None,
        description="A CSV file beside this one: heads are paths of settings, or `experiment.NAME` for a column that "
        "is carried along beside the computed values",
    )

    @model_validator(mode="after")
    def _one_source(self) -> Listed:
        if (self.cases is None) == (self.file is None):
            refuse([Problem(("cases",), "a list needs either `cases` or `file`")])
        return self


class Uniform(StrictModel):
    """Uniform distribution."""

    uniform: tuple[Bound, Bound] = Field(description="Least and greatest value")


class NormalShape(StrictModel):
    """Mean and deviation of a normal distribution."""

    mean: Bound = Field(description="Mean")
    sd: Bound = Field(description="Standard deviation, in the same unit")


class Normal(StrictModel):
    """Normal distribution."""

    normal: NormalShape = Field(description="Mean and standard deviation")


class Choice(StrictModel):
    """Uniform choice among values."""

    choice: list[Value] = Field(description="The values", min_length=1)


DISTRIBUTIONS = {"uniform": Uniform, "normal": Normal, "choice": Choice}


def _distribution(value: object) -> object:
    """Refuse a value that names no distribution or several."""
    if isinstance(value, dict) and len(DISTRIBUTIONS.keys() & value.keys()) != 1:
        found = ", ".join(map(str, value)) or "nothing"
        raise ValueError(f"expected one of {', '.join(DISTRIBUTIONS)}, found {found}")
    if not isinstance(value, dict | StrictModel):
        raise ValueError("expected a distribution, such as {uniform: [a, b]} or {normal: {mean: a, sd: b}}")
    return value


Distribution = Annotated[
    Annotated[Uniform, Tag("uniform")] | Annotated[Normal, Tag("normal")] | Annotated[Choice, Tag("choice")],
    Discriminator(
        lambda value: next(name for name, kind in DISTRIBUTIONS.items() if isinstance(value, kind) or name in value)
    ),
    BeforeValidator(_distribution),
]


class Sample(StrictModel):
    """Random samples of settings."""

    type: Literal["sample"] = "sample"
    method: Literal["latin_hypercube", "sobol", "random"] = Field(
        default="latin_hypercube", description="How points are spread over the space of values"
    )
    count: Count = Field(description="Number of cases; with sobol best a power of 2")
    seed: Annotated[int, Field(strict=True, ge=0)] = Field(default=0, description="Same seed, same cases")
    values: dict[str, Distribution] = Field(
        description="By path of a setting: {uniform: [a, b]}, {normal: {mean, sd}} or {choice: [...]}", min_length=1
    )


FitResult = Annotated[
    File | Plain | None,
    Field(
        default=None,
        description="Folder of a fit whose material the case is made of: its covariance is the material's share of the "
        "uncertainty",
    ),
]


class Converge(StrictModel):
    """Convergence study: resolutions for the observed order and the extrapolated value."""

    type: Literal["converge"] = "converge"
    path: Text = Field(default="resolution", description="The setting that is refined")
    values: list[Bound] = Field(description="Its values, at least two and best three", min_length=2)
    fit: FitResult


class Event(StrictModel):
    """Event that occurs on one side of a limit."""

    measure: Text = Field(default="perforated", description="A measure of the summary; true counts as 1")
    threshold: Annotated[float, Quantity(NUMBER)] = Field(
        default=0.5, description="The event has occurred where the measure is above this value [SI]"
    )
    absent: Literal["below", "above", "undecided"] = Field(
        default="undecided", description="What a measure without a value counts as; undecided ends the search"
    )


class Bisect(StrictModel):
    """Bisection for the value of a setting at which an event begins to occur, such as the ballistic limit."""

    type: Literal["bisect"] = "bisect"
    path: Text = Field(description="The setting, such as bodies.projectile.velocity.0")
    bracket: tuple[Bound, Bound] = Field(description="A value where the event does not occur and one where it does")
    tolerance: Bound = Field(description="Width of the bracket at which to stop, in the same unit")
    points: Annotated[int, Field(strict=True, ge=1, le=64)] | None = Field(
        default=None, description="Shots a round; as many as workers unless given"
    )
    event: Event = Field(default=Event(), description="What happens beyond the limit")
    residual: Text = Field(
        default="residual_velocity", description="Measure of the residual velocity, for the fit beyond the limit"
    )
    parameters: dict[str, list[Value]] = Field(
        default={}, description="By path of a setting: values for each of which the limit is determined"
    )
    longest: PositiveTime | None = Field(
        default=None,
        description="Time [s] up to which a shot that is not decided goes on; four times that of the case unless given",
    )
    resolutions: list[Bound] = Field(
        default=[], description="Spacings for each of which the limit is looked for, for its uncertainty", min_length=2
    )
    fit: FitResult


class Parameter(StrictModel):
    """A setting that a fit varies."""

    start: Bound = Field(description="First value")
    bounds: tuple[Bound, Bound] = Field(description="Least and greatest value")


class FittedMaterial(StrictModel):
    """The material that a fit writes."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z][\w-]*$", max_length=64)] = Field(description="Name of the material")
    base: Text = Field(description="Material of the library that it differs from in the fitted parameters")
    bodies: list[Text] | None = Field(default=None, description="Bodies made of it; all unless given")


class Fit(StrictModel):
    """Parameters whose results agree best with measured values, by least squares or by a response surface."""

    type: Literal["fit"] = "fit"
    shots: File | list[Settings] = Field(
        description="A CSV file: `shot` is the name, the other heads are paths of settings"
    )
    measured: File | list[Settings] = Field(
        description="A CSV file with the heads shot, quantity, at, value, unit, scatter, source"
    )
    only: list[Text] | None = Field(default=None, description="Names of the shots that count, with * and ?")
    quantities: list[Text] | None = Field(default=None, description="Quantities that count; all unless given")
    parameters: dict[str, Parameter] = Field(
        description="By path of a setting, where `material.` stands for the material of each of the bodies",
        min_length=1,
    )
    material: FittedMaterial | None = Field(default=None, description="The material file to write")
    method: Literal["least_squares", "surrogate"] = Field(
        default="least_squares", description="`surrogate` for expensive runs: `count` points, then a response surface"
    )
    count: Count = Field(default=40, description="Points of a surrogate")
    iterations: Annotated[int, Field(ge=1, le=200)] = Field(default=20, description="Most iterations of least squares")
    step: Annotated[float, Field(gt=0.0, le=0.2)] = Field(
        default=0.03, description="Step of the central differences, as a share of the bounds' distance"
    )


Vary = Annotated[Grid | Listed | Sample | Converge | Bisect | Fit, Field(discriminator="type")]


class Sweep(StrictModel):
    """Parameter sweep and the table of its results."""

    title: Annotated[str, Field(max_length=200)] = Field(default="", description="What it is about, one line")
    case: File = Field(description="The case that all are made of: a file, relative to this one, or a bundled name")
    set: Settings = Field(default={}, description="Settings for every case, by path, as of `--set`")
    vary: Vary = Field(description="What differs: grid, list, sample, converge or bisect")
    record: list[Text] | None = Field(
        default=None, description="Measures that become columns of the table; all unless given", min_length=1
    )
    keep: Literal["all", "last", "summary"] = Field(
        default="all",
        description="What stays of a run that is done: all its files, the last snapshot only, or none of them; case, "
        "history, log and summary always stay, and so does all of a run that failed",
    )
    time_limit: PositiveTime | None = Field(
        default=None, description="Wall time of one case [s] after which it is interrupted, with a checkpoint"
    )
    stop_after_failures: Count | None = Field(
        default=None, description="Number of failed cases after which no more are begun; none unless given"
    )
