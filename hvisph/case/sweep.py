"""Parameter sweep: varied settings and the evaluation of the results."""

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, create_model

from hvisph.core.text import Plain

from .case import MeasureName
from .model import BY_TYPE, Problem, StrictModel, key
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
        "from": (Bound, key("First value, with its unit")),
        "to": (Bound, key("Last value, in the same unit")),
        "count": (Annotated[int, Field(strict=True, ge=2, le=10_000)], key("How many, at least 2")),
    },
)
Values = Annotated[
    Annotated[Span, Tag("span")] | Annotated[list[Value], Tag("list")],  # type: ignore[valid-type]
    Discriminator(lambda value: "span" if isinstance(value, dict | Span) else "list"),
]


class Grid(StrictModel):
    """Every combination of the values."""

    type: Literal["grid"] = "grid"
    values: dict[str, Values] = key("By path of a setting: a list of values, or {from, to, count}", min_length=1)


class Listed(StrictModel):
    """Cases listed here or in a table."""

    type: Literal["list"] = "list"
    cases: list[Settings] | None = key("Settings of each case, by path", None, min_length=1)
    file: File | None = key(
        "A CSV file beside this one: heads are paths of settings, or `experiment.NAME` for a column that "
        "is carried along beside the computed values",
        None,
    )

    def _faults(self) -> Iterator[Problem]:
        if (self.cases is None) == (self.file is None):
            yield "cases", "a list needs either `cases` or `file`"


class Uniform(StrictModel):
    """Uniform distribution."""

    uniform: tuple[Bound, Bound] = key("Least and greatest value")


class NormalShape(StrictModel):
    """Mean and deviation of a normal distribution."""

    mean: Bound = key("Mean")
    sd: Bound = key("Standard deviation, in the same unit")


class Normal(StrictModel):
    """Normal distribution."""

    normal: NormalShape = key("Mean and standard deviation")


class Choice(StrictModel):
    """Uniform choice among values."""

    choice: list[Value] = key("The values", min_length=1)


DISTRIBUTIONS = {"uniform": Uniform, "normal": Normal, "choice": Choice}


def _distribution(value: object) -> object:
    """Refuse a value that names no distribution or several."""
    if isinstance(value, dict) and len(DISTRIBUTIONS.keys() & value.keys()) != 1:
        raise ValueError(f"expected one of {', '.join(DISTRIBUTIONS)}, found {', '.join(map(str, value)) or 'nothing'}")
    if not isinstance(value, dict | StrictModel):
        raise ValueError("expected a distribution, such as {uniform: [a, b]} or {normal: {mean: a, sd: b}}")
    return value


Distribution = Annotated[
    Annotated[Uniform, Tag("uniform")] | Annotated[Normal, Tag("normal")] | Annotated[Choice, Tag("choice")],
    Discriminator(lambda value: next(n for n, kind in DISTRIBUTIONS.items() if isinstance(value, kind) or n in value)),
    BeforeValidator(_distribution),
]


class Sample(StrictModel):
    """Random samples of settings."""

    type: Literal["sample"] = "sample"
    method: Literal["latin_hypercube", "sobol", "random"] = key("Distribution of the points", "latin_hypercube")
    count: Count = key("Number of cases; with sobol best a power of 2")
    seed: Annotated[int, Field(strict=True, ge=0)] = key("Same seed, same cases", 0)
    values: dict[str, Distribution] = key("By path of a setting: uniform, normal or choice", min_length=1)


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
    path: Text = key("The setting that is refined", "resolution")
    values: list[Bound] = key("Its values, at least two and best three", min_length=2)
    fit: FitResult


class Event(StrictModel):
    """Event that occurs on one side of a limit."""

    measure: MeasureName = key("A measure of the summary; true counts as 1", "perforated")
    threshold: Annotated[float, Quantity(NUMBER)] = key("The event has occurred if the measure is above it [SI]", 0.5)
    absent: Literal["below", "above", "undecided"] = key("Meaning of no value; undecided ends the search", "undecided")


class Bisect(StrictModel):
    """Bisection for the value of a setting at which an event begins to occur, such as the ballistic limit."""

    type: Literal["bisect"] = "bisect"
    path: Text = key("The setting, such as bodies.projectile.velocity.0")
    bracket: tuple[Bound, Bound] = key("A value where the event does not occur and one where it does")
    tolerance: Bound = key("Width of the bracket at which to stop, in the same unit")
    points: Annotated[int, Field(strict=True, ge=1, le=64)] | None = key("Shots per round; default: the workers", None)
    event: Event = key("What happens beyond the limit", Event())
    residual: MeasureName = key("Measure of the residual velocity, for the fit beyond the limit", "residual_velocity")
    parameters: dict[str, list[Value]] = key("By path of a setting: values, each with a limit of its own", {})
    longest: PositiveTime | None = key("Longest time of an undecided shot [s]; 4 `time.end` unless given", None)
    resolutions: list[Bound] = key("Spacings at which the limit is determined, for its uncertainty", [], min_length=2)
    fit: FitResult


class Parameter(StrictModel):
    """A setting that a fit varies."""

    start: Bound = key("First value")
    bounds: tuple[Bound, Bound] = key("Least and greatest value")


class FittedMaterial(StrictModel):
    """The material that a fit writes."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z][\w-]*$", max_length=64)] = key("Name of the material")
    base: Text = key("Material of the library that it differs from in the fitted parameters")
    bodies: list[Text] | None = key("Bodies made of it; all unless given", None)


class Fit(StrictModel):
    """Parameters whose results agree best with measured values, by least squares or by a response surface."""

    type: Literal["fit"] = "fit"
    shots: File | list[Settings] = key("A CSV file: `shot` is the name, the other heads are paths of settings")
    measured: File | list[Settings] = key("A CSV file with the heads shot, quantity, at, value, unit, scatter, source")
    only: list[Text] | None = key("Names of the shots that count, with * and ?", None)
    quantities: list[Text] | None = key("Quantities that count; all unless given", None)
    parameters: dict[str, Parameter] = key("By path of a setting; `material.` is that of each body", min_length=1)
    material: FittedMaterial | None = key("The material file to write", None)
    method: Literal["least_squares", "surrogate"] = key(
        "`surrogate`: response surface of `count` points", "least_squares"
    )
    count: Count = key("Points of a surrogate", 40)
    iterations: Annotated[int, Field(ge=1, le=200)] = key("Most iterations of least squares", 20)
    step: Annotated[float, Field(gt=0.0, le=0.2)] = key("Step of central differences over the width of bounds", 0.03)


Vary = Annotated[Grid | Listed | Sample | Converge | Bisect | Fit, BY_TYPE]


class Sweep(StrictModel):
    """Parameter sweep and the table of its results."""

    title: Annotated[str, Field(max_length=200)] = key("What it is about, one line", "")
    case: File = key("The case that all are made of: a file, relative to this one, or a bundled name")
    set: Settings = key("Settings for every case, by path, as of `--set`", {})
    vary: Vary = key("What differs: grid, list, sample, converge or bisect")
    record: tuple[MeasureName, ...] | None = key(
        "Measures that become columns of the table; all unless given", None, min_length=1
    )
    keep: Literal["all", "last", "summary"] = key(
        "What stays of a run that is done: all its files, the last snapshot only, or none of them; case, "
        "history, log and summary always stay, and so does all of a run that failed",
        "all",
    )
    time_limit: PositiveTime | None = key("Wall time of a case [s] after which it stops, with a checkpoint", None)
    stop_after_failures: Count | None = key("Number of failed cases after which no more are started", None)
