"""Output: quantities, formats and intervals."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hvisph.core.fields import WRITTEN

from .model import SCALAR_AS_LIST, StrictModel
from .regions import BoxRegion, Region
from .units import PositiveTime

# Fields that snapshots always hold: places, and volumes as mass over density.
ALWAYS = ("position", "mass", "density")


class OutputRegion(Region):
    """Subset of the particles that is written separately: a box, a body or every n-th particle."""

    box: BoxRegion = Field(
        default=BoxRegion(),
        description="Region whose particles are meant, as they stand at the moment; all unless given",
    )
    bodies: tuple[str, ...] = Field(default=(), description="Bodies of which they are; all unless given")
    stride: Annotated[int, Field(strict=True, ge=1, le=10**9)] = Field(
        default=1, description="Every how many-th particle, by its number, is written, at least 1"
    )


class Output(StrictModel):
    """Intervals and formats of the files of a run."""

    every: PositiveTime | None = Field(
        default=None,
        description="Time between snapshots [s], a twentieth of the run unless given; beyond it first and last alone",
    )
    formats: tuple[Literal["hdf5", "vtu"], ...] = Field(
        default=("hdf5",),
        description="Formats of snapshots; `hvisph measure` reads either",
        min_length=1,
        max_length=2,
    )
    history_every: Annotated[int, Field(strict=True, ge=1, le=10**9)] = Field(
        default=1, description="Steps between lines of history.csv, at least 1"
    )
    checkpoint_every: PositiveTime | None = Field(
        default=60.0,
        description="Wall time between checkpoints [s], from which `hvisph resume` goes on; at most "
        "2 % of the run is spent on them; null for one at the end only",
    )
    full_every: Annotated[int, Field(strict=True, ge=1, le=10**9)] = Field(
        default=1,
        description="Output times between snapshots of all particles, at least 1; regions are written at every output "
        "time, the first and the last state in full",
    )
    regions: dict[Annotated[str, Field(pattern=r"^[A-Za-z0-9_]{1,64}$")], OutputRegion] = Field(
        default={}, description="Parts of the model by name, written as `regions/NAME.NNNNNN.vtkhdf`", max_length=100
    )
    fields: Annotated[tuple[Literal[WRITTEN], ...], SCALAR_AS_LIST] | None = Field(  # type: ignore[valid-type]
        default=None,
        description=f"Fields of snapshots beside {', '.join(ALWAYS)}; all unless given. What is not there cannot be "
        "measured or shown later",
    )
    precision: Literal["double", "single"] = Field(
        default="double",
        description="Of the fields in snapshots: double, or single, of seven digits in half of the room, for all but "
        "positions. The run itself and its checkpoints are double",
    )
    compress: Literal["none", "gzip"] = Field(
        default="none", description="Compression of HDF5 snapshots: gzip takes about half of the room, and time"
    )
    report: bool = Field(default=False, description="Whether to write the page `report.html` when the run ends")
    static_fields: Literal["each", "once"] = Field(
        default="each",
        description="Whether `each` HDF5 snapshot holds mass, body and material, or only the first one (`once`), "
        "without which later ones cannot be read",
    )
