"""Bodies: material, shape, particle arrangement, position and initial velocity."""

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, ValidationInfo

from hvisph.case import units
from hvisph.case.materials.material import NamedMaterial
from hvisph.core.catalogues import ARRANGEMENTS

from .model import BY_TYPE, SCALAR_AS_LIST, AnyCase, DataFile, Problem, Shorthand, StrictModel, expand_switch, key
from .shapes import UNIT_VECTORS, Axis, Direction, OptionalRotation, Position, Rotation, Shape

Rate = Annotated[float, units.Quantity(units.RATE)]


def _vector(value: object, info: ValidationInfo) -> object:
    """Return the components of {speed, angle}, and a single number as a list."""
    if isinstance(value, Mapping):
        if set(value) - {"speed", "angle"} or "speed" not in value:
            raise ValueError("expected components, or a speed and an angle: {speed: 3.1 km/s, angle: 30 deg}")
        speed = units.Quantity(units.VELOCITY).validate(value["speed"], info)
        angle = math.radians(units.Quantity(units.ANGLE).validate(value.get("angle", 0.0), info))
        dim = (info.context or {}).get("dim", 2)
        if dim == 1 and angle != 0.0:
            raise ValueError("there is no angle in 1D; give the speed alone")
        return [speed * math.cos(angle), speed * math.sin(angle), 0.0][:dim]
    return SCALAR_AS_LIST.expand(value, info)


VelocityVector = Annotated[
    tuple[units.Velocity, ...], Shorthand(_vector, ("number", "string", "object")), Field(max_length=3)
]


class AboutPoint(StrictModel):
    """Options of velocity fields about a point."""

    centre: Position | None = key("Point where the field is zero [m]; the middle of the body's mass unless given", None)


class UniformField(StrictModel):
    """Uniform velocity."""

    type: Literal["uniform"] = "uniform"
    velocity: VelocityVector = key("Velocity [m/s]")


class SpinField(AboutPoint):
    """Rigid rotation, u = omega x (x - centre) (2D, 3D)."""

    type: Literal["spin"] = "spin"
    rate: Rate = key("Angular velocity [rad/s], counter-clockwise about the axis")
    axis: Direction = key("Direction of the axis [-], or x, y or z; in 2D always z", (0.0, 0.0, 1.0))


class RadialField(AboutPoint):
    """u = speed (r/radius)^power along the radius: outwards where the speed is positive."""

    type: Literal["radial"] = "radial"
    speed: units.Velocity = key("Speed at the radius [m/s], negative inwards")
    radius: units.PositiveLength = key("Radius where it has that speed [m]")
    power: units.Number = key("Power of the radius [-]: -1 (2D) and -2 (3D) keep the volume", 0.0)
    axis: Direction | None = key("Axis from which the radius is measured in 3D [-]; the centre unless given", None)


class LinearField(AboutPoint):
    """u = G (x - centre)."""

    type: Literal["linear"] = "linear"
    gradient: tuple[tuple[Rate, ...], ...] = key("Velocity gradient G, row by row [1/s]", min_length=1, max_length=3)


class TableField(StrictModel):
    """Velocities interpolated linearly in a table, constant outside."""

    type: Literal["table"] = "table"
    file: DataFile = key("CSV in SI with the columns x, y, z and u, v, w, one a dimension")


_Rigid = UniformField | SpinField
VelocityField = Annotated[_Rigid | RadialField | LinearField | TableField, BY_TYPE]
__all__ = ["Axis", "Body", "Position", "Rotation", "Shape"]

if TYPE_CHECKING:  # a type checker cannot read types made from the catalogue
    Arrangement = str
else:
    Arrangement = Literal[tuple(ARRANGEMENTS)]


def _expand_move(value: object, info: ValidationInfo) -> object:
    if not isinstance(value, str):
        return value
    if value not in ("free", "fixed", "x", "y", "z"):
        raise ValueError(f"'{value}' is none of free, fixed, x, y, z, {{along: [1, 0, 0]}}, {{about: [0, 0, 1]}}")
    return {} if value == "free" else {"fixed": True} if value == "fixed" else {"along": value}


class RigidMove(StrictModel):
    """Freedom of a rigid body: all of it unless one of these is given."""

    fixed: bool = key("Whether the body is at rest; `fixed` for short", False)
    along: Direction | None = key("Direction of the only motion, without rotation [-]; `x`, `y` or `z` for short", None)
    about: Direction | None = key("Axis of the only rotation [-], through the centre of mass, which is at rest", None)


class Rigid(StrictModel):
    """Mass and motion of a rigid body."""

    move: Annotated[RigidMove, Shorthand(_expand_move, ("string",))] = key(
        "`free`, `fixed`, `{along: [1, 0, 0]}` without rotation, or `{about: [0, 0, 1]}` alone", RigidMove()
    )
    mass: Annotated[float, units.Quantity(units.MASS, above=0)] | None = key(
        "Mass of the whole body [kg; per metre in 2D, per square metre in 1D]; that of shape and material unless given",
        None,
    )
    inertia: tuple[Annotated[float, units.Quantity(units.INERTIA, above=0)], ...] = key(
        "Moments of inertia of the whole body about the axes x, y, z through its centre of mass [kg m^2], "
        "about z alone in 2D [kg m], each at most the sum of the others; those of shape and mass unless given",
        (),
        max_length=3,
    )
    velocity: tuple[tuple[units.NonNegativeTime, units.Velocity], ...] = key(
        "Prescribed motion: rows of time [s] and velocity [m/s] `along` an axis, linear between rows, "
        "constant beyond them, a jump where two rows have one time; its work is `external_work` in the history",
        (),
        max_length=10_000,
    )
    along: Axis = key("Axis along which `velocity` moves the body", "x")

    @property
    def words(self) -> str:
        """Description of its motion."""
        if self.velocity:
            return f"{len(self.velocity)} velocities over time along {self.along}"
        names = {"moves along": self.move.along, "turns about": self.move.about}
        given = [f"{verb} {direction_name(axis)}" for verb, axis in names.items() if axis is not None]
        return "fixed" if self.move.fixed else given[0] if given else "free"


def direction_name(axis: tuple[float, ...]) -> str:
    """Return the letter of an axis, or the components of a direction."""
    letters = [letter for letter, unit in UNIT_VECTORS.items() if unit == tuple(axis)]
    return letters[0] if letters else ", ".join(f"{one:g}" for one in axis)


OptionalRigid = Annotated[
    Rigid | None,
    Shorthand(
        lambda value, info: {"move": value} if isinstance(value, str) else expand_switch(value, info),
        ("boolean", "string"),
    ),
]


class Grading(StrictModel):
    """Spacing that is fine at the struck face and grows with the distance from it."""

    fine: tuple[units.PositiveLength | None, ...] = key(
        "Full width of the fine part along each axis [m], null along an axis that is not graded; in axisymmetric "
        "cases along x, and as a diameter about the axis",
        min_length=1,
        max_length=3,
    )
    coarsest: units.PositiveLength = key("Largest spacing [m], above the resolution")
    ratio: Annotated[float, units.Quantity(units.NUMBER, above=1, maximum=1.1)] = key(
        "Largest ratio of the thicknesses of successive layers [-]", 1.1
    )
    face: Literal["middle", "front", "rear"] = key(
        "Where along x the fine part lies: in the middle, at the `front` (the face at lower x), as in a "
        "thick target, or at the `rear`",
        "middle",
    )


class MaterialAxes(StrictModel):
    """Directions of a body's material; the third is normal to both."""

    one: Direction = key("Axis 1, such as that of the fibres [-], or x, y, z")
    two: Direction = key("Axis 2 [-], at right angles to it")

    def _faults(self) -> Iterator[Problem]:
        first, second = math.hypot(*self.one), math.hypot(*self.two)
        if not (first > 0.0 and second > 0.0):
            yield "", "a direction must not be all zero"
            return
        across = math.fsum(a * b for a, b in zip(self.one, self.two, strict=True)) / (first * second)
        if abs(across) > 1e-6:
            angle = math.degrees(math.acos(max(-1.0, min(1.0, across))))
            yield "", f"one and two must be at right angles, but lie at {angle:.4g} degrees"


class Inclusions(StrictModel):
    """Spheres of another material in a body, in 2D discs, at random positions: boulders."""

    material: NamedMaterial = key("Material of the spheres, as that of a body")
    diameters: tuple[units.PositiveLength, units.PositiveLength] = key("Smallest and largest [m]; at least three dx")
    exponent: Annotated[float, units.Quantity(units.NUMBER, maximum=0)] = key(
        "Exponent of the number of spheres above a diameter, N(>D) ~ D^exponent [-]", -3.0
    )
    volume: Annotated[float, units.Quantity(units.NUMBER, above=0, maximum=0.55)] = key(
        "Their volume over that of the body [-], at most 0.55: more does not fit at random"
    )
    seed: Annotated[int, Field(strict=True, ge=0)] = key("Seed of the generator, at least 0", 0)


class Body(StrictModel):
    """Body of one material and one shape with an initial velocity."""

    material: NamedMaterial = key("Name in the library, `{base: NAME, ...}` with changes, or a material written out")
    inclusions: Inclusions | None = key("Spheres of another material, which are part of the body", None)
    shape: Shape = key("Shape, about the body's centre")
    arrangement: Arrangement | None = key("Lattice; `uniform` (1D), `square` (2D), `cubic` (3D) unless given", None)
    mass: Literal["exact", "nominal"] = key(
        "`exact`: the spacing is stretched and the masses are scaled so that size and mass are those of "
        "the shape; `nominal`: every particle has the volume dx^dim",
        "exact",
    )
    resolution: units.PositiveLength | None = key(
        "Particle spacing of this body [m]; that of the case unless given. Equal masses of neighbours "
        "serve best: next to a denser body the finer spacing belongs to the denser one",
        None,
    )
    grading: Grading | None = key(
        "Spacing that grows towards the rim, of a `box` or `interval`, axisymmetric also of a `cylinder`, "
        "`tube` or `ring` of a box; uniform unless given",
        None,
    )
    velocity: VelocityVector = key(
        "Initial velocity, one component per dimension [m/s], or {speed, angle}: the angle [deg] from x "
        "towards y; at rest unless given",
        (),
    )
    initial_velocity: tuple[VelocityField, ...] = key("Initial fields, added to `velocity`", (), max_length=100)
    position: Position | None = key(
        "Centre of the body, or the origin of a shape's own coordinates [m]; unless given, bodies stand in "
        "a row along x in the order of the file, and the first and the second touch at x = 0",
        None,
    )
    gap: units.NonNegativeLength = key("Distance to the body before it in the row [m]; 0 touches", 0.0)
    rotation: OptionalRotation = key("Turn about the centre before placing: an angle [deg], or angle and axis", None)
    axes: MaterialAxes | None = key(
        "Axes of an `orthotropic` or `fabric` material, which turn with `rotation`; required for one in "
        "3D; in 1D and `axisymmetric` axis 3 lies along x unless given",
        None,
    )
    role: Literal["projectile", "layer", "other"] | None = key(
        "Role in measures: `projectile`, `layer` of the target, or `other`. By default the first body that "
        "moves and all with its velocity are the projectile, all others layers, except for bodies behind it and gases "
        "at rest; where no body moves, explosives are `other`",
        None,
    )
    formulation: Literal["eulerian", "total_lagrangian", "adaptive"] | None = key(
        "Kernels of this body, where the case's formulation is `total_lagrangian` or `adaptive`; that of "
        "the case unless given",
        None,
    )
    rigid: OptionalRigid = key(
        "Rigid body, without stress and strain: `true` moves and turns by the forces on it, `x`, `y` or "
        "`z` moves along that axis without rotation, `fixed` is at rest; deformable unless given",
        None,
    )
    internal_energy: units.NonNegativeSpecificEnergy = key("Initial specific internal energy [J/kg]", 0.0)
    temperature: units.PositiveTemperature | None = key("Initial temperature, at zero pressure [K]", None)

    def spacing(self, case: AnyCase) -> float:
        """Return the particle spacing of the body [m]: its own, or that of the case."""
        return self.resolution or float(case.resolution)
