"""Open edges, which let waves out, and pressures on faces."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, Literal

from pydantic import Field

from .bodies import Axis
from .model import Path, Problem, StrictModel
from .output import BoxRegion, Region, SymmetryPlane
from .units import Length, NonNegativeTime, Pressure

# Formulations with an ambient layer, and with a viscous edge.
LAYERED, VISCOUS = ("riemann",), ("eulerian", "total_lagrangian", "adaptive")


class OpenEdge(StrictModel):
    """Plane normal to an axis through which waves leave; bodies that reach it go on beyond it."""

    axis: Axis = Field(description="Axis normal to the edge")
    at: Length = Field(description="Coordinate of the edge on that axis [m], between two rows of particles")
    keep: Literal["above", "below"] = Field(description="Side that is computed: coordinates above or below `at`")

    @property
    def sign(self) -> float:
        """1.0 where the matter lies below the edge, -1.0 above."""
        return 1.0 if self.keep == "below" else -1.0


class PressureLoad(Region):
    """Pressure over time on a face: the outermost row of a region along a direction."""

    box: BoxRegion = Field(description="Region in the initial configuration in which the face lies")
    bodies: tuple[str, ...] = Field(default=(), description="Bodies of which they are; all unless given")
    pressure: tuple[tuple[NonNegativeTime, Pressure], ...] = Field(
        description="Rows of time [s] and pressure [Pa]: linear between rows, constant beyond them, a jump where two "
        "rows have one time; its work is `external_work` in the history",
        min_length=1,
        max_length=10_000,
    )
    normal: Literal["+x", "-x", "+y", "-y", "+z", "-z"] = Field(
        description="Outward normal of the face; the pressure pushes the other way"
    )


def edge_words(case: Any) -> list[str]:
    """Return the open edges of a case in words."""
    unit = " m" if case.units == "si" else ""
    return [f"{edge.axis} = {edge.at:g}{unit}, matter {edge.keep} it" for edge in case.edges]


def load_words(case: Any) -> list[str]:
    """Return the pressure loads of a case in words."""
    unit = " Pa" if case.units == "si" else ""
    return [
        f"{number}: up to {max((value for _, value in load.pressure), key=abs):g}{unit} on faces {load.normal}"
        for number, load in enumerate(case.loads)
    ]


def table_problems(times: list[float], path: Path) -> Iterator[Problem]:
    """Yield the errors of the times of a table."""
    falls = any(later < earlier for earlier, later in pairwise(times))
    if falls or any(times[k] == times[k + 2] for k in range(len(times) - 2)):
        yield Problem(path, "its times must rise; two rows at one time are a jump, three none")


def edge_problems(case: Any) -> Iterator[Problem]:
    """Yield the errors of open edges and pressure loads that the case alone shows."""
    axes, kind = "xyz"[: case.dim], case.formulation.type
    for key, given in (("edges", case.edges), ("loads", case.loads)):
        if not given:
            continue
        if kind not in (*LAYERED, *VISCOUS):
            yield Problem((key,), f"{kind} has none; use riemann, eulerian or total_lagrangian")
        if case.time.integrator == "predictor_corrector":
            yield Problem((key,), "need one force a step for their work; use `time.integrator: leapfrog`")
        if case.start is not None:
            yield Problem(
                (key,), "refer to the start of the bodies, which `start` takes from another run; leave it out"
            )
    if case.edges and kind in LAYERED and case.kinematics == "plane_stress":
        yield Problem(("edges",), "contact SPH has no plate impedance in plane stress; use eulerian")
    for index, edge in enumerate(case.edges):
        path: Path = ("edges", index)
        if edge.axis not in axes:
            yield Problem((*path, "axis"), f"there is no axis {edge.axis} in {case.dim}D; allowed: {', '.join(axes)}")
            continue
        across = [plane for plane in case.symmetry if plane.axis == edge.axis]
        if any(plane.keep == edge.keep or edge.sign * (edge.at - plane.at) <= 0.0 for plane in across):
            message = "is cut off by the symmetry plane across the same axis; put it on the side that is kept"
            yield Problem((*path, "at"), message)
        if case.kinematics == "axisymmetric" and edge.axis == "y" and edge.at <= 0.0:
            yield Problem((*path, "at"), "is not beside the axis; give the radius of the edge, above 0")
        twins = [one for one in case.edges[:index] if one.axis == edge.axis]
        if len(twins) > 1 or any(
            one.keep == edge.keep or (edge.at - one.at) * (edge.sign - one.sign) <= 0.0 for one in twins
        ):
            message = "two edges across an axis keep what lies between them: the lower one `above`, the upper `below`"
            yield Problem((*path, "keep"), message)
    for index, plane in enumerate(case.symmetry):
        if plane.velocity:
            yield from _moving_plane(case, plane, ("symmetry", index, "velocity"))
    for index, load in enumerate(case.loads):
        if load.normal[1] not in axes:
            yield Problem(("loads", index, "normal"), f"there is no axis {load.normal[1]} in {case.dim}D")
        yield from table_problems([time for time, _ in load.pressure], ("loads", index, "pressure"))


def _moving_plane(case: Any, plane: SymmetryPlane, path: Path) -> Iterator[Problem]:
    """Yield the errors of a plane of symmetry that moves."""
    yield from table_problems([time for time, _ in plane.velocity], path)
    if case.formulation.type not in ("riemann", "eulerian") or getattr(case.formulation, "contact_algorithm", False):
        yield Problem(path, "only planes of riemann and eulerian move; use one of them, or leave the velocity out")
    if [one.axis for one in case.symmetry].count(plane.axis) > 1:
        yield Problem(path, "needs one plane across its axis for its work; leave the other one out")
    if case.edges or any(body.rigid is not None for body in case.bodies.values()):
        yield Problem(path, "does not go with open edges or rigid bodies; leave one of them out")
    if case.time.integrator == "predictor_corrector":
        yield Problem(path, "needs one force a step for its work; use `time.integrator: leapfrog`")
    if case.kinematics == "axisymmetric" and plane.axis != "x":
        yield Problem(path, "axisymmetric planes move along the axis x alone")


def plane_words(case: Any) -> list[str]:
    """Return the moving planes of symmetry of a case in words."""
    unit = " m/s" if case.units == "si" else ""
    return [
        f"{plane.axis} = {plane.at:g}{' m' if unit else ''}: "
        + (f"{plane.velocity[0][1]:g}{unit}" if len(plane.velocity) == 1 else f"{len(plane.velocity)} rows over time")
        for plane in case.symmetry
        if plane.velocity
    ]
