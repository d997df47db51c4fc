"""Gauges: quantities recorded at points over time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import Field

from hvisph.core.errors import suggest_nearest
from hvisph.core.fields import component_names, recordable

from .bodies import Position
from .model import SCALAR_AS_LIST, Path, Problem, StrictModel

Fields = Annotated[tuple[Annotated[str, Field(max_length=64)], ...], SCALAR_AS_LIST, Field(min_length=1, max_length=64)]


class GaugeOptions(StrictModel):
    """Options of every gauge."""

    at: Position = Field(description="Place of the gauge at the start [m], a coordinate per dimension")
    fields: Fields = Field(
        default=("velocity", "pressure"),
        description="What it records: names of fields, such as `pressure`, `velocity` (all components), "
        "`velocity_x`, `stress_xx`, `density`, `plastic_strain`",
    )
    every: Annotated[int, Field(strict=True, ge=1, le=10**9)] | None = Field(
        default=None,
        description="Steps between its records, at least 1; with every line of history.csv unless given",
    )


class MaterialGauge(GaugeOptions):
    """Gauge on the particle initially nearest to `at`; empty after it has left the `domain`."""

    type: Literal["material"] = "material"


class FixedGauge(GaugeOptions):
    """Gauge at the fixed point `at`: kernel average over the particles there; empty without any."""

    type: Literal["fixed"] = "fixed"


class FreeSurfaceGauge(GaugeOptions):
    """Gauge on the outermost particle of the body at `at` along `direction`."""

    type: Literal["free_surface"] = "free_surface"
    direction: Literal["+x", "-x", "+y", "-y", "+z", "-z"] = Field(
        default="+x", description="Direction in which the surface lies, seen from `at`"
    )


Gauge = Annotated[MaterialGauge | FixedGauge | FreeSurfaceGauge, Field(discriminator="type")]


def gauge_problems(gauges: Mapping[str, Gauge], dim: int) -> Iterator[Problem]:
    """Yield the errors of the gauges of a case in `dim` dimensions beyond their single fields."""
    for name, gauge in gauges.items():
        path: Path = ("gauges", name)
        if len(gauge.at) != dim:
            axes = ", ".join("xyz"[:dim])
            yield Problem((*path, "at"), f"has {len(gauge.at)} coordinates, needs {dim} in {dim}D: [{axes}]")
        if isinstance(gauge, FreeSurfaceGauge) and gauge.direction[1] not in "xyz"[:dim]:
            yield Problem((*path, "direction"), f"there is no axis {gauge.direction[1]} in {dim}D")
        allowed = recordable(dim)
        for number, field in enumerate(gauge.fields):
            if field not in allowed:
                yield Problem((*path, "fields", number), f"unknown field '{field}'{suggest_nearest(field, allowed)}")
        columns = [c for field in gauge.fields if field in allowed for c in component_names(field, dim)]
        if len(set(columns)) < len(columns):
            yield Problem((*path, "fields"), "names a field twice")
