"""Sets of experiments: folders with `set.yaml`, `shots.csv` and `measured.csv`, and their acceptance criteria."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from hvisph.case.model import StrictModel, refuse
from hvisph.case.sweep import Bound, Settings, Text
from hvisph.case.units import NonNegativeNumber, PositiveNumber
from hvisph.casefile.document import read_yaml
from hvisph.casefile.errors import validate_values
from hvisph.casefile.paths import SET, data_folder

Words = Annotated[str, Field(min_length=1, max_length=4000)]
EvaluatorName = Literal["taylor", "shield", "cloud", "limit", "melt", "crater", "spall", "fragments", "planetary"]


class Across(StrictModel):
    """Particles across the characteristic length at full, second and coarse resolution."""

    of: Text = Field(
        description="Path of the length that they lie across, such as bodies.bar.shape.diameter; a shot with "
        "another length names that as experiment.across"
    )
    full: PositiveNumber = Field(description="In the runs that verdicts count")
    second: PositiveNumber = Field(description="In the runs that show the error of the full resolution")
    coarse: PositiveNumber = Field(description="In quick checks of a few seconds")


class Criteria(StrictModel):
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

    title: Text = Field(description="Heading")
    shows: Words = Field(description="What the set tests")
    set_up: Words = Field(description="Formulation, materials and resolution, and why: chosen before any comparison")
    substitutes: str = Field(default="", max_length=4000, description="Substitutes of materials without constants")
    found: str = Field(default="", max_length=4000, description="What agrees, what does not and why")
    why: dict[Text, Words] = Field(default={}, description="By quantity: in a sentence, why it misses its criteria")
    evaluator: EvaluatorName = Field(description="Module that computes the measured quantities from the runs")
    particles_across: Across = Field(description="Particles across")
    required: dict[Text, Criteria] = Field(default={}, description="By quantity; others have no criteria")
    limits: dict[Text, Limit] = Field(default={}, description="Shots whose limit is found, in place of shots.csv")

    @model_validator(mode="after")
    def _bisections(self) -> Self:
        if (self.evaluator == "limit") != bool(self.limits):
            refuse([("limits", "belong to the evaluator `limit`, and to no other")])
        return self


def bundled_sets() -> dict[str, Path]:
    """Return the folders of the bundled sets of experiments by name."""
    return {path.parent.name: path.parent for path in sorted((data_folder("cases") / "validation").glob(f"*/{SET}"))}


def load_set(folder: Path) -> ExperimentSet:
    """Load a set of experiments; raises `CaseError` for invalid input."""
    document = read_yaml(folder / SET)
    return validate_values(ExperimentSet, document.value, document.places)
