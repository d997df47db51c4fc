"""Conditions of a run: open edges and loads on faces, gravity and overburden, a start from another run."""

from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path as Folder
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, create_model

from .bodies import Axis, Position
from .model import BY_TYPE, SCALAR_AS_LIST, AnyCase, Problem, Shorthand, StrictModel, expand_switch, is_scalar, key
from .output import BoxRegion, Region, SymmetryPlane
from .units import MASS, Acceleration, Length, NonNegativeTime, PositiveLength, Pressure, Quantity, Share

# Formulations with an ambient layer, and with a viscous edge.
LAYERED, VISCOUS = ("riemann",), ("eulerian", "total_lagrangian", "adaptive")

# Shapes whose sides are free or supported along gravity, so that columns have one height.
STANDING = ("interval", "box", "cylinder", "tube", "particles")


class OpenEdge(StrictModel):
    """Plane normal to an axis through which waves leave; bodies that reach it extend beyond it."""

    axis: Axis = key("Axis normal to the edge")
    at: Length = key("Coordinate of the edge on that axis [m], between two rows of particles")
    keep: Literal["above", "below"] = key("Side that is computed: coordinates above or below `at`")

    @property
    def sign(self) -> float:
        """1.0 where the matter lies below the edge, -1.0 above."""
        return 1.0 if self.keep == "below" else -1.0


class PressureLoad(Region):
    """Pressure over time on a face: the outermost row of a region along a direction."""

    box: BoxRegion = key("Region in the initial configuration in which the face lies")
    bodies: tuple[str, ...] = key("Bodies to which the particles belong; all unless given", ())
    pressure: tuple[tuple[NonNegativeTime, Pressure], ...] = key(
        "Rows of time [s] and pressure [Pa]: linear between rows, constant beyond them, a jump where two "
        "rows have one time; its work is `external_work` in the history",
        min_length=1,
        max_length=10_000,
    )
    normal: Literal["+x", "-x", "+y", "-y", "+z", "-z"] = key("Outward normal of the face")


def table_problems(times: list[float], path: str) -> Iterator[Problem]:
    """Yield the errors of the times of a table."""
    falls = any(later < earlier for earlier, later in pairwise(times))
    if falls or any(times[k] == times[k + 2] for k in range(len(times) - 2)):
        yield path, "its times must rise; two rows at one time are a jump, three none"


def edge_problems(case: AnyCase) -> Iterator[Problem]:
    """Yield the errors of open edges and pressure loads that the case alone shows."""
    axes, kind = "xyz"[: case.dim], case.formulation.type
    for name, given in (("edges", case.edges), ("loads", case.loads)):
        if not given:
            continue
        if kind not in (*LAYERED, *VISCOUS):
            yield name, f"{kind} has none; use riemann, eulerian or total_lagrangian"
        if case.time.integrator == "predictor_corrector":
            yield name, "need one force a step for their work; use `time.integrator: leapfrog`"
        if case.start is not None:
            yield name, "refer to the start of the bodies, which `start` takes from another run; leave it out"
    if case.edges and kind in LAYERED and case.kinematics == "plane_stress":
        yield "edges", "contact SPH has no plate impedance in plane stress; use eulerian"
    for index, edge in enumerate(case.edges):
        path = f"edges.{index}"
        if edge.axis not in axes:
            yield f"{path}.axis", f"there is no axis {edge.axis} in {case.dim}D; allowed: {', '.join(axes)}"
            continue
        across = [plane for plane in case.symmetry if plane.axis == edge.axis]
        if any(plane.keep == edge.keep or edge.sign * (edge.at - plane.at) <= 0.0 for plane in across):
            message = "is cut off by the symmetry plane across the same axis; put it on the side that is kept"
            yield f"{path}.at", message
        if case.kinematics == "axisymmetric" and edge.axis == "y" and edge.at <= 0.0:
            yield f"{path}.at", "is not beside the axis; give the radius of the edge, above 0"
        twins = [one for one in case.edges[:index] if one.axis == edge.axis]
        if len(twins) > 1 or any(
            one.keep == edge.keep or (edge.at - one.at) * (edge.sign - one.sign) <= 0.0 for one in twins
        ):
            message = "two edges across an axis keep what lies between them: the lower one `above`, the upper `below`"
            yield f"{path}.keep", message
    for index, plane in enumerate(case.symmetry):
        if plane.velocity:
            yield from _moving_plane(case, plane, f"symmetry.{index}.velocity")
    for index, load in enumerate(case.loads):
        if load.normal[1] not in axes:
            yield f"loads.{index}.normal", f"there is no axis {load.normal[1]} in {case.dim}D"
        yield from table_problems([time for time, _ in load.pressure], f"loads.{index}.pressure")


def _moving_plane(case: AnyCase, plane: SymmetryPlane, path: str) -> Iterator[Problem]:
    yield from table_problems([time for time, _ in plane.velocity], path)
    if case.formulation.type == "projection":
        yield path, "projection has no planes that move; use another formulation, or leave the velocity out"
    if getattr(case.formulation, "reference_update_strain", None) is not None:
        message = "a reference that is renewed has no plane that moves; leave out `formulation.reference_update_strain`"
        yield path, message
    if [one.axis for one in case.symmetry].count(plane.axis) > 1:
        yield path, "needs one plane across its axis for its work; leave the other one out"
    if any(body.rigid is not None for body in case.bodies.values()):
        yield path, "does not go with rigid bodies; leave one of them out"
    if case.time.integrator == "predictor_corrector":
        yield path, "needs one force a step for its work; use `time.integrator: leapfrog`"
    if case.kinematics == "axisymmetric" and plane.axis != "x":
        yield path, "axisymmetric planes move along the axis x alone"


Components = Annotated[tuple[Acceleration, ...], SCALAR_AS_LIST, Field(min_length=1, max_length=3)]


class UniformGravity(StrictModel):
    """Uniform field of gravity."""

    type: Literal["uniform"] = "uniform"
    acceleration: Components = key("Acceleration, one component per dimension [m/s^2]")

    def words(self, number: Callable[[float, str], str]) -> str:
        """Return the field in words, with quantities by `number`."""
        return ", ".join(number(value, "m/s^2") for value in self.acceleration)


class SphereGravity(StrictModel):
    """Field of a homogeneous sphere: G M/r^2 outside, proportional to r inside."""

    type: Literal["sphere"] = "sphere"
    mass: Annotated[float, Quantity(MASS, above=0)] = key("Mass of the sphere [kg]")
    radius: PositiveLength = key("Radius of the sphere [m]")
    centre: Position = key("Centre of the sphere [m]; the origin unless given", ())

    def words(self, number: Callable[[float, str], str]) -> str:
        """Return the field in words, with quantities by `number`."""
        return f"of a sphere of {number(self.mass, 'kg')}, radius {number(self.radius, 'm')}"


class Overburden(StrictModel):
    """Initial stress of bodies under their own weight and that of what lies on all of their top."""

    lateral: Share = key("Horizontal over vertical stress", 1.0)


Gravity = Annotated[
    Annotated[UniformGravity | SphereGravity, BY_TYPE],
    Shorthand(
        lambda value, _: (
            {"type": "uniform", "acceleration": value} if isinstance(value, list | tuple) or is_scalar(value) else value
        ),
        ("array", "number", "string"),
    ),
]
OptionalOverburden = Annotated[Overburden | None, Shorthand(expand_switch, ("boolean",))]


def gravity_problems(case: AnyCase) -> Iterator[Problem]:
    """Yield the errors of gravity, overburden and settling."""
    gravity, dim = case.gravity, case.dim
    if gravity is None:
        for asked in ("overburden", "settle"):
            if getattr(case, asked) is not None:
                yield asked, "needs `gravity`"
        return
    if case.formulation.type == "projection":
        yield "gravity", "projection has `formulation.body_force` in its place"
    vector = gravity.acceleration if gravity.type == "uniform" else gravity.centre
    path = "gravity.acceleration" if gravity.type == "uniform" else "gravity.centre"
    if vector and len(vector) != dim:
        yield path, f"has {len(vector)} components, needs {dim} in {dim}D"
        return
    if case.kinematics == "axisymmetric" and any(vector[1:]):
        yield path, "axisymmetric cases have gravity along the axis x alone; set the other component to 0"
    if case.overburden is not None and case.formulation.type in ("total_lagrangian", "adaptive"):
        remedy = "use riemann or eulerian, or `settle` alone"
        yield "overburden", f"a Total Lagrangian reference is free of stress; {remedy}"
    for name, body in case.bodies.items() if case.overburden is not None else ():
        if body.material.eos.type in ("ideal_gas", "jwl"):
            yield (
                f"bodies.{name}.material",
                "a gas has a pressure at its face; leave `overburden` out, and give `settle`",
            )
    if case.settle is not None and case.start is not None:
        yield "settle", "the bodies have the state of the other run; leave it out"
    if case.settle is not None and any(body.material.eos.type == "jwl" for body in case.bodies.values()):
        yield "settle", "explosives burn by a clock that begins at the start; leave it out"
    if gravity.type == "uniform" and not case.clamped:
        for asked, axis in ((k, a) for k in ("overburden", "settle") for a in _unsupported(case, vector)):
            if getattr(case, asked) is not None:
                name, side = "xyz"[axis], "above" if vector[axis] < 0.0 else "below"
                fault = f"nothing supports the bodies along {name}: give `symmetry` a plane {{axis: {name}, at: ...,"
                yield asked, f"{fault} keep: {side}}} under them, or clamp their lowest rows"


def _unsupported(case: AnyCase, acceleration: tuple[float, ...]) -> list[int]:
    """Return the axes along which gravity points, and at whose end no symmetry plane lies."""
    held = {("xyz".index(plane.axis), 1.0 if plane.keep == "above" else -1.0) for plane in case.symmetry}
    return [axis for axis, g in enumerate(acceleration) if g and (axis, 1.0 if g < 0.0 else -1.0) not in held]


def gravity_warnings(case: AnyCase) -> Iterator[str]:
    """Yield warnings about an overburden that flows, and about bodies whose sides nothing holds."""
    overburden, gravity = case.overburden, case.gravity
    dissipation = getattr(case.formulation, "density_dissipation", None)
    fluids = [name for name, body in case.bodies.items() if body.material.strength.type == "none"]
    rests = gravity is not None and (overburden is not None or case.settle is not None)
    if rests and fluids and dissipation is not None and dissipation.type == "none":
        yield (
            f"formulation: the pressure of '{fluids[0]}' at rest will alternate from row to row, unseen by its sums; "
            "give `density_dissipation: {type: zisis}`"
        )
    if overburden is None or gravity is None:
        return
    straight = STANDING if gravity.type == "uniform" else ("sphere", "hollow_sphere", "disc", "annulus")
    for name, body in case.bodies.items() if case.settle is None else ():
        if not any(body.velocity) and (body.shape.type not in straight or body.rotation is not None):
            what = f"overburden: '{name}', a {body.shape.type}, has the stress of a column below its highest point"
            yield f"{what} everywhere, at its free sides, too; give `settle`"
    yield from _flowing(case, overburden.lateral)
    if overburden.lateral == 0.0 or gravity.type != "uniform" or case.clamped:
        return
    ends: dict[str, set[str]] = {}
    for one in (*case.symmetry, *case.edges):
        ends.setdefault(one.axis, set()).add(one.keep)
    if case.kinematics == "axisymmetric":
        ends.setdefault("y", set()).add("above")
    for axis, g in zip("xyz", gravity.acceleration, strict=False):
        if not g and ends.get(axis, set()) != {"above", "below"}:
            yield (
                f"overburden: nothing holds the sides along {axis} against a horizontal stress of "
                f"{overburden.lateral:g} of the vertical one, so that the bodies spread; give planes, clamps or open "
                "edges at both sides, or `overburden: {lateral: 0}`"
            )


def _flowing(case: AnyCase, lateral: float) -> Iterator[str]:
    """Yield warnings about matter without cohesion that a ratio of horizontal to vertical stress makes flow."""
    for name, body in case.bodies.items():
        strength = body.material.strength
        if strength.type == "rock" and strength.cohesion == 0.0 and not any(body.velocity):
            least = (1.0 - strength.friction / 3.0) / (1.0 + 2.0 * strength.friction / 3.0)
            if lateral < least:
                fault = f"overburden.lateral: {lateral:g} is below {least:.3g}, the least ratio that the friction of"
                yield f"{fault} '{name}' bears: it flows at the start; give {least:.3g} to 1"


def _resolve_folder(value: object, info: ValidationInfo) -> object:
    """Return the path of a folder beside the files of the case, else of the working folder, where there is one."""
    if isinstance(value, str) and len(value) <= 4096 and "\0" not in value:
        for folder in (*(info.context or {}).get("folders", ()), "."):
            if (Folder(folder) / value).is_dir():
                return str((Folder(folder) / value).resolve())
    return value


class _Start(StrictModel):
    run: Annotated[str, Shorthand(_resolve_folder, ()), Field(min_length=1, max_length=4096)] = key(
        "Folder of the other run, relative to the case file or to the working folder"
    )
    at: NonNegativeTime = key("Time of one of its snapshots [s], at which this run starts; it ends at `time.end`")
    width: PositiveLength | None = key("Width along z [m] of the extruded run; only with `as: extruded`", None)

    @property
    def mapping(self) -> str:
        """Transformation of the state: `same`, `revolved` or `extruded`."""
        return str(getattr(self, "as"))

    def words(self, number: Callable[[float, str], str]) -> str:
        """Return the start in words, with quantities by `number`."""
        extruded = f", extruded along z to {number(self.width or 0.0, 'm')}"
        how = {"same": "", "revolved": ", revolved about x", "extruded": extruded}[self.mapping]
        return f"from {self.run} at {number(self.at, 's')}{how}"


# `as` is a keyword of Python, so that no class statement can contain it.
Start: Any = create_model(
    "Start",
    __base__=_Start,
    __doc__="State of another run that this one starts from.",
    **{
        "as": (
            Literal["same", "revolved", "extruded"],
            key(
                "`same`: particles as they are, in the same kinematics; `revolved`: those of an axisymmetric run "
                "become particles about x in 3D; `extruded`: those of a plane strain run become rows along z in 3D",
                "same",
            ),
        )
    },
)  # type: ignore[call-overload]


def start_problems(case: AnyCase) -> Iterator[Problem]:
    """Yield the errors of a start from another run that the case alone shows."""
    start = case.start
    if start is None:
        return
    if not case.time.end > start.at:
        yield "time.end", f"{case.time.end:g} is not after the start, start.at = {start.at:g}"
    if start.mapping != "same" and case.kinematics != "three_d":
        yield "start.as", f"{start.mapping} needs kinematics three_d, not {case.kinematics}"
    if (start.mapping == "extruded") != (start.width is not None):
        yield "start.width", "`as: extruded` needs it, and nothing else has it"
    least = case.formulation.support_over_h * case.smoothing_length
    if start.width is not None and start.width < least * (1.0 - 1e-9):
        yield "start.width", f"{start.width:g} is below the kernel's support, {least:g}; make it wider"
    if case.formulation.type == "projection":
        yield "start", "projection does not start from another run; use another formulation"
    if case.time.step is not None:
        yield "time.step", "a run with a start has steps by criteria; leave it out"
    if case.overburden is not None:
        yield "overburden", "the bodies have the stress of the other run; leave it out"


def condition_words(case: AnyCase) -> list[tuple[str, str]]:
    """Return kind and description of clamps, planes, open edges, loads and late stages of a case."""
    si = case.units == "si"
    metre, speed, pressure = (unit if si else "" for unit in (" m", " m/s", " Pa"))

    words = []
    for number, clamp in enumerate(case.clamped):
        if clamp.moves:
            given = ", ".join(f"{one:g}" for one in clamp.velocity) + speed
            over_time = f"{len(clamp.velocity_table)} velocities over time along {clamp.along}"
            words.append(("moving clamp", f"clamped.{number}: {over_time if clamp.velocity_table else given}"))
        else:
            words.append(("clamp", f"clamped.{number}, in {', '.join(clamp.bodies) or 'all bodies'}"))
    words += [("open edge", f"{edge.axis} = {edge.at:g}{metre}, matter {edge.keep} it") for edge in case.edges]
    for number, load in enumerate(case.loads):
        peak = max((value for _, value in load.pressure), key=abs)
        words.append(("load", f"{number}: up to {peak:g}{pressure} on faces {load.normal}"))
    for stage in case.late:
        begins = "begins by itself" if stage.at == "auto" else f"from {stage.at:g}{' s' if si else ''}"
        words.append(("late stage", begins + (f", {stage.bulk_modulus:g}{pressure}" if stage.bulk_modulus else "")))
    for plane in case.symmetry:
        if plane.velocity:
            steady = f"{plane.velocity[0][1]:g}{speed}"
            motion = steady if len(plane.velocity) == 1 else f"{len(plane.velocity)} rows over time"
            words.append(("moving plane", f"{plane.axis} = {plane.at:g}{metre}: {motion}"))
        else:
            words.append(("symmetry plane", f"{plane.axis} = {plane.at:g}{metre}, matter {plane.keep} it"))
    return words
