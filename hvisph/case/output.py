"""Output: what is written, and how often."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hvisph.case.model import StrictModel
from hvisph.case.units import PositiveTime


class Output(StrictModel):
    """Schedules and formats of the files in the run's folder."""

    every: PositiveTime | None = Field(
        default=None,
        description="Time between snapshots [s]; unless given, or beyond the end, only first and last state",
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
