"""What the parts of a case must fulfil together. Each check says where, what is wrong and the remedy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol

from hvisph.case.body_checks import body_problems
from hvisph.case.expected import Expectations
from hvisph.case.formulations.options import KernelOptions
from hvisph.case.gauges import Gauge, gauge_problems
from hvisph.case.model import Path, Problem
from hvisph.case.output import Output
from hvisph.case.regions import Clamp, SymmetryPlane, box_problems, region_problems
from hvisph.case.surroundings import Surroundings
from hvisph.core.measures import CATALOGUE, measures_of

AXES = ("x", "y", "z")


class Case(Surroundings, Protocol):
    """A whole case: what its parts see of it, and the rest."""

    @property
    def smoothing_length(self) -> float:
        """Initial smoothing length h [m]."""

    @property
    def symmetry(self) -> Sequence[SymmetryPlane]:
        """Symmetry planes."""

    @property
    def clamped(self) -> Sequence[Clamp]:
        """Regions that are held."""

    @property
    def formulation(self) -> KernelOptions:
        """Scheme that computes the run."""

    @property
    def gauges(self) -> Mapping[str, Gauge]:
        """Gauges by name."""

    @property
    def output(self) -> Output:
        """What is written, and how often."""

    @property
    def measures(self) -> Sequence[str] | None:
        """What to measure."""

    @property
    def expected(self) -> Expectations:
        """Expected values."""


def problems_of(case: Case) -> list[Problem]:
    """Return all that is wrong with `case` beyond its single fields."""
    return [
        *body_problems(case),
        *_symmetry(case),
        *_regions(case),
        *gauge_problems(case.gauges, case.dim),
        *case.formulation.problems(case),
        *_schedule(case),
        *_measures(case),
    ]


def warnings_of(case: Case) -> list[str]:
    """Return what a user should know about a valid `case` before it runs."""
    return [*case.formulation.warnings(case)]


def _symmetry(case: Case) -> Iterator[Problem]:
    seen: dict[str, SymmetryPlane] = {}
    for index, plane in enumerate(case.symmetry):
        path = ("symmetry", index)
        if plane.axis not in AXES[: case.dim]:
            yield Problem(
                (*path, "axis"), f"there is no axis {plane.axis} in {case.dim}D; allowed: {', '.join(AXES[: case.dim])}"
            )
        other = seen.setdefault(plane.axis, plane)
        if other is plane:
            continue
        low, high = sorted((other, plane), key=lambda one: one.at)
        support = case.formulation.support_over_h * case.smoothing_length
        if (low.keep, high.keep) != ("above", "below"):
            yield Problem(
                (*path, "keep"),
                f"two planes across {plane.axis} keep what lies between them: the lower one `above`, the upper `below`",
            )
        elif high.at - low.at < 2 * support:
            yield Problem(
                (*path, "at"),
                f"the two planes across {plane.axis} are closer than twice the kernel's support, {2 * support:g}: "
                "images of images would be missed; move them apart or make the resolution finer",
            )
        if [p.axis for p in case.symmetry].count(plane.axis) > 2:
            yield Problem((*path, "axis"), f"a third plane across {plane.axis}; two are allowed")


def _regions(case: Case) -> Iterator[Problem]:
    for index, clamp in enumerate(case.clamped):
        yield from region_problems(clamp, ("clamped", index), case.dim, case.bodies)
    for index, load in enumerate(case.initial_loads):
        yield from region_problems(load, ("initial_loads", index), case.dim, case.bodies)
    if case.domain is not None:
        yield from box_problems(case.domain, ("domain",), case.dim)


def _schedule(case: Case) -> Iterator[Problem]:
    end, unit = case.time.end, " s" if case.units == "si" else ""
    if case.output.every is not None and case.output.every > end:
        yield Problem(
            ("output", "every"),
            f"{case.output.every:g}{unit} is beyond time.end = {end:g}{unit}; make it shorter",
        )
    if case.time.step is not None and case.time.step > end:
        yield Problem(("time", "step"), f"{case.time.step:g}{unit} is beyond time.end = {end:g}{unit}; make it shorter")
    if len(set(case.output.formats)) < len(case.output.formats):
        yield Problem(("output", "formats"), "names a format twice")


def _measures(case: Case) -> Iterator[Problem]:
    wanted: list[tuple[Path, str]] = [(("measures", i), name) for i, name in enumerate(case.measures or ())]
    wanted += [(("expected", name), name) for name, _ in case.expected.items()]
    for path, name in wanted:
        if case.dim not in CATALOGUE[name].dims:
            yield Problem(path, f"has no meaning in {case.dim}D; allowed: {', '.join(measures_of(case.dim))}")


def _metre(case: Case) -> str:
    return " m" if case.units == "si" else ""
