"""What the parts of a case must fulfil together. Each check says where, what is wrong and the remedy."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol

from hvisph.case.bodies import ARRANGEMENTS, SHAPES, Body
from hvisph.case.expected import Expectations
from hvisph.case.formulations.options import KernelOptions
from hvisph.case.gauges import Gauge, gauge_problems
from hvisph.case.model import Path, Problem
from hvisph.case.output import Output
from hvisph.case.regions import Clamp, SymmetryPlane, box_problems, region_problems
from hvisph.case.surroundings import Surroundings
from hvisph.core.measures import CATALOGUE, measures_of

FASTEST = 1e5  # [m/s]; ten times any impact in the solar system's inner part is a slip of units
MOST_PARTICLES = 2**31 - 1  # indices in compiled loops are 32 bits wide
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
        *_bodies(case),
        *_count(case),
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


def _bodies(case: Case) -> Iterator[Problem]:
    for index, (name, body) in enumerate(case.bodies.items()):
        path = ("bodies", name)
        shape_fits = body.shape.type in SHAPES[case.dim]
        if not shape_fits:
            yield Problem(
                (*path, "shape", "type"),
                f"a {body.shape.type} has no meaning in {case.dim}D (kinematics {case.kinematics}); "
                f"allowed: {', '.join(SHAPES[case.dim])}",
            )
        elif len(body.shape.extent()) != case.dim:
            yield _length((*path, "shape", "size"), case.dim, len(body.shape.extent()), "sizes")
        else:
            yield from _arrangement(case, body, path)
            yield from _thickness(case, body, path)
        if len(body.velocity) != case.dim:
            yield _length((*path, "velocity"), case.dim, len(body.velocity), "components")
        elif case.units == "si" and math.hypot(*body.velocity) > FASTEST:
            speed = math.hypot(*body.velocity)
            yield Problem((*path, "velocity"), f"{speed:g} m/s is above {FASTEST / 1e3:g} km/s; check its unit")
        yield from _place(case, body, path, first=index == 0)


def _length(path: Path, dim: int, found: int, what: str) -> Problem:
    axes = ", ".join(AXES[:dim])
    return Problem(path, f"has {found} {what}, needs {dim} in {dim}D: [{axes}]")


def _arrangement(case: Case, body: Body, path: tuple[str, ...]) -> Iterator[Problem]:
    allowed = ARRANGEMENTS[case.dim, body.shape.type]
    if body.arrangement not in allowed:
        yield Problem(
            (*path, "arrangement"),
            f"'{body.arrangement}' has no meaning for a {body.shape.type} in {case.dim}D; "
            f"allowed: {', '.join(allowed)}",
        )


def _thickness(case: Case, body: Body, path: tuple[str, ...]) -> Iterator[Problem]:
    h = case.smoothing_length
    support = case.formulation.support_over_h * h
    thickness = min(body.shape.extent())
    # a thickness written as a decimal multiple of dx must not fail by round-off
    if thickness < support * (1.0 - 1e-9):
        finest = thickness / (case.formulation.support_over_h * case.formulation.h_over_dx)
        unit = _metre(case)
        yield Problem(
            (*path, "shape"),
            f"the body is {thickness:g}{unit} thick, thinner than the kernel's support "
            f"{case.formulation.support_over_h:g}h = {support:g}{unit} (h = {h:g}{unit}); "
            f"make it thicker or the resolution {finest:.3g}{unit} or finer",
        )


def _place(case: Case, body: Body, path: tuple[str, ...], first: bool) -> Iterator[Problem]:
    if body.position is not None:
        if len(body.position) != case.dim:
            yield _length((*path, "position"), case.dim, len(body.position), "components")
        if body.gap:
            yield Problem((*path, "gap"), "given beside `position`, which fixes the place already; leave one out")
    elif first and body.gap:
        yield Problem((*path, "gap"), "there is no body before the first; give the gap to the second")
    if body.rotation is None:
        return
    if case.dim == 1:
        yield Problem((*path, "rotation"), "a body in 1D cannot be rotated; leave it out")
    elif case.dim == 2 and body.rotation.axis != (0.0, 0.0, 1.0):
        yield Problem((*path, "rotation", "axis"), "the axis is always z in 2D; leave it out")
    elif not math.hypot(*body.rotation.axis) > 0.0:
        yield Problem((*path, "rotation", "axis"), "must not be all zero")


def _count(case: Case) -> Iterator[Problem]:
    spacings = [math.prod(size / case.resolution for size in b.shape.extent()) for b in case.bodies.values()]
    count = sum(spacings)
    if not count <= MOST_PARTICLES:
        yield Problem(
            ("resolution",),
            f"{case.resolution:g}{_metre(case)} asks for about {count:.1e} particles, more than the "
            f"{MOST_PARTICLES:.1e} that can be numbered; make it coarser",
        )


def _symmetry(case: Case) -> Iterator[Problem]:
    seen: set[str] = set()
    for index, plane in enumerate(case.symmetry):
        path = ("symmetry", index, "axis")
        if plane.axis not in AXES[: case.dim]:
            yield Problem(path, f"there is no axis {plane.axis} in {case.dim}D; allowed: {', '.join(AXES[: case.dim])}")
        if plane.axis in seen:
            yield Problem(path, f"a second plane across {plane.axis}; one per axis is allowed")
        seen.add(plane.axis)


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
