"""Stopping limits of a run, and the witness plane."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from .dimensions import LENGTH, NUMBER
from .model import StrictModel
from .units import Quantity


class Witness(StrictModel):
    """Plane across the shot line, for the extrapolation of the debris cloud in free flight."""

    x: Annotated[float, Quantity(LENGTH)] = Field(description="Where it is, along the shot line [m]")


class RunLimits(StrictModel):
    """Limits beyond which a run stops with a snapshot; non-finite values always stop it."""

    energy_drift: Annotated[float, Quantity(NUMBER, above=0)] | None = Field(
        default=0.01,
        description="Change of total energy over that at the start [-], above 0; null for no limit",
    )
    negative_energy: Annotated[float, Quantity(NUMBER, above=0)] | None = Field(
        default=0.01,
        description="Internal energy of the whole below that at the start and below zero, over the energy at the start "
        "[-], above 0: more stops a run; null for no limit",
    )
    speed_over_initial: Annotated[float, Quantity(NUMBER, above=1)] | None = Field(
        default=10.0,
        description="Speed of a particle over the fastest at the start, or over the speed of signals where "
        "all start at rest [-], above 1; null for no limit",
    )
    step_over_initial: Annotated[float, Quantity(NUMBER, minimum=0, below=1)] = Field(
        default=1e-6, description="Smallest time step over the first [-], at least 0 and below 1"
    )
    density: bool = Field(
        default=True, description="Whether densities outside the range of the equation of state stop the run"
    )
