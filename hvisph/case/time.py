"""Time: how long a run lasts and how it steps."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hvisph.case.dimensions import NUMBER
from hvisph.case.model import StrictModel
from hvisph.case.units import PositiveTime, Quantity


class Time(StrictModel):
    """Duration and time stepping."""

    end: PositiveTime = Field(
        description="Time at which the run ends [s], above 0; contact is at 0 unless there is a gap"
    )
    cfl: Annotated[float, Quantity(NUMBER, above=0, maximum=1)] = Field(
        default=0.3, description="Courant number of the adaptive step [-], above 0 and at most 1"
    )
    step: PositiveTime | None = Field(
        default=None,
        description="Fixed time step [s]; unless given adaptive or, with projection, 0.1 ns per 0.1 mm of resolution",
    )
    integrator: Literal["leapfrog", "predictor_corrector", "staggered"] = Field(
        default="leapfrog",
        description="Time integrator, one evaluation of the forces a step; `staggered` is Zisis 2013's",
    )
    max_steps: Annotated[int, Field(strict=True, ge=1, le=10**12)] | None = Field(
        default=None, description="Number of steps at which to stop early, at least 1; none unless given"
    )
