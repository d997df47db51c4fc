"""Time and output of a run: steps, late stages, limits; regions, gauges, symmetry planes, clamps; files."""

from collections.abc import Collection, Iterator
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from hvisph.case import units
from hvisph.case.bodies import Axis, Position, VelocityVector
from hvisph.case.model import BY_TYPE, SCALAR_AS_LIST, AnyCase, Problem, Shorthand, StrictModel, is_scalar, key
from hvisph.core.errors import suggest_nearest
from hvisph.core.fields import WRITTEN, component_names, recordable
from hvisph.core.text import Plain

Corner = Annotated[tuple[units.Length | None, ...], SCALAR_AS_LIST, Field(max_length=3)]


class SymmetryPlane(StrictModel):
    """Symmetry plane normal to an axis; one side is computed."""

    axis: Axis = key("Axis normal to the plane")
    at: units.Length = key("Coordinate of the plane on that axis [m]", 0.0)
    keep: Literal["above", "below"] = key("Side that is computed: coordinates above or below `at`", "above")
    velocity: Annotated[
        tuple[tuple[units.NonNegativeTime, units.Velocity], ...],
        Shorthand(lambda value, _: [[0.0, value]] if is_scalar(value) else value),
        Field(max_length=10_000),
    ] = key(
        "Velocity along the axis, as that of a rigid wall that moves: a number [m/s], or rows of time [s] "
        "and velocity [m/s], linear between rows and constant beyond them; its work is `external_work` in the history; "
        "at rest unless given; with every formulation but projection",
        (),
    )


class BoxRegion(StrictModel):
    """Box between two corners; a null component is unbounded."""

    min: Corner = key("Lower corner [m], a component per dimension, null if unbounded", ())
    max: Corner = key("Upper corner [m], a component per dimension, null if unbounded", ())


class Region(StrictModel):
    """Particles of some or all bodies within a box."""

    box: BoxRegion = key("Region in the initial configuration whose particles are selected")
    bodies: tuple[str, ...] = key("Bodies to which the particles belong; all unless given", ())


class Clamp(Region):
    """Particles at rest, or at a prescribed velocity, for the whole run."""

    box: BoxRegion = key("Region in the initial configuration whose particles are held")
    bodies: tuple[str, ...] = key("Bodies that are held; all unless given", ())
    velocity: VelocityVector = key(
        "Velocity at which they move, as a driven piston does, one component per dimension [m/s], or the "
        "rows of `velocity_table`; its work is `external_work` in the history; at rest unless given",
        (),
    )
    velocity_table: tuple[tuple[units.NonNegativeTime, units.Velocity], ...] = key(
        "Velocity over time in place of `velocity`, rows of time [s] and velocity [m/s] `along` an axis: "
        "linear between rows, constant beyond them, a jump where two rows have one time",
        (),
        max_length=10_000,
    )
    along: Axis = key("Axis along which `velocity_table` moves them", "x")

    @model_validator(mode="before")
    @classmethod
    def _take_table(cls, data: Any) -> Any:
        """Treat rows given as `velocity` as the table."""
        given = data.get("velocity") if isinstance(data, dict) else None
        if isinstance(given, list | tuple) and given and isinstance(given[0], list | tuple):
            data = {"velocity_table": given} | {key: value for key, value in data.items() if key != "velocity"}
        return data

    @property
    def moves(self) -> bool:
        """Whether the clamp has a velocity."""
        return any(self.velocity) or any(value for _, value in self.velocity_table)

    def motion(self, dim: int) -> tuple[list[float], list[list[float]]]:
        """Return times (k,) [s] and velocities (k, dim) [m/s]."""
        if not self.velocity_table:
            return [0.0], [list(self.velocity) or [0.0] * dim]
        axis = "xyz".index(self.along)
        rows = [[value if k == axis else 0.0 for k in range(dim)] for _, value in self.velocity_table]
        return [time for time, _ in self.velocity_table], rows


class InitialLoad(Region):
    """Impulse: pressure added to that of the material during the first step."""

    box: BoxRegion = key("Region in the initial configuration whose particles are loaded")
    pressure: units.Pressure = key("Pressure added [Pa]; negative is tension")


class EulerianRegion(Region):
    """Particles that are Eulerian from the start of the run."""

    box: BoxRegion = key("Region in the initial configuration whose particles are Eulerian")


def region_problems(region: Region, path: str, dim: int, bodies: Collection[str]) -> Iterator[Problem]:
    """Yield the errors of a region in `dim` dimensions of a case with these `bodies`."""
    for number, name in enumerate(region.bodies):
        if name not in bodies:
            yield f"{path}.bodies.{number}", f"unknown body '{name[:64]}'{suggest_nearest(name, list(bodies))}"
    yield from box_problems(region.box, f"{path}.box", dim)


def box_problems(box: BoxRegion, path: str, dim: int) -> Iterator[Problem]:
    """Yield the errors of a box in `dim` dimensions."""
    axes = "xyz"[:dim]
    for side, corner in (("min", box.min), ("max", box.max)):
        if corner and len(corner) != dim:
            yield f"{path}.{side}", f"has {len(corner)} components, needs {dim} in {dim}D: [{', '.join(axes)}]"
    for axis, low, high in zip(axes, box.min, box.max, strict=False):
        if low is not None and high is not None and not low < high:
            yield path, f"min {low:g} must be below max {high:g} along {axis}"


Fields = Annotated[tuple[Annotated[str, Field(max_length=64)], ...], SCALAR_AS_LIST, Field(min_length=1, max_length=64)]


class GaugeOptions(StrictModel):
    """Options of every gauge."""

    at: Position = key("Place of the gauge at the start [m], a coordinate per dimension")
    fields: Fields = key(
        "What it records: names of fields, such as `pressure`, `velocity` (all components), "
        "`velocity_x`, `stress_xx`, `density`, `plastic_strain`",
        ("velocity", "pressure"),
    )
    every: units.Count | None = key("Steps between its records; that of history.csv unless given", None)


class MaterialGauge(GaugeOptions):
    """Gauge on the particle initially nearest to `at`; empty after it has left the `domain`."""

    type: Literal["material"] = "material"


class FixedGauge(GaugeOptions):
    """Gauge at the fixed point `at`: kernel average over the particles there; empty without any."""

    type: Literal["fixed"] = "fixed"


class FreeSurfaceGauge(GaugeOptions):
    """Gauge on the outermost particle of the body at `at` along `direction`."""

    type: Literal["free_surface"] = "free_surface"
    direction: Literal["+x", "-x", "+y", "-y", "+z", "-z"] = key("Direction of the surface from `at`", "+x")


Gauge = Annotated[MaterialGauge | FixedGauge | FreeSurfaceGauge, BY_TYPE]


def gauge_problems(case: AnyCase) -> Iterator[Problem]:
    """Yield the errors of the gauges of a case beyond their single fields."""
    dim = case.dim
    for name, gauge in case.gauges.items():
        path = f"gauges.{name}"
        if len(gauge.at) != dim:
            axes = ", ".join("xyz"[:dim])
            yield f"{path}.at", f"has {len(gauge.at)} coordinates, needs {dim} in {dim}D: [{axes}]"
        if isinstance(gauge, FreeSurfaceGauge) and gauge.direction[1] not in "xyz"[:dim]:
            yield f"{path}.direction", f"there is no axis {gauge.direction[1]} in {dim}D"
        allowed = recordable(dim)
        for number, field in enumerate(gauge.fields):
            if field not in allowed:
                yield f"{path}.fields.{number}", f"unknown field '{field}'{suggest_nearest(field, allowed)}"
        columns = [c for field in gauge.fields if field in allowed for c in component_names(field, dim)]
        if len(set(columns)) < len(columns):
            yield f"{path}.fields", "names a field twice"


ALWAYS = ("position", "mass", "density")  # fields that snapshots always hold: places, and volumes as mass over density


class OutputRegion(Region):
    """Subset of the particles that is written separately: a box, a body or every n-th particle."""

    box: BoxRegion = key("Region whose particles are written, by current position; all unless given", BoxRegion())
    bodies: tuple[str, ...] = key("Bodies to which the particles belong; all unless given", ())
    stride: units.Count = key("Every how many-th particle, by its number, is written, at least 1", 1)


class Output(StrictModel):
    """Intervals and formats of the files of a run."""

    every: units.PositiveTime | None = key("Time between snapshots [s]; a twentieth of the run unless given", None)
    formats: tuple[Literal["hdf5", "vtu"], ...] = key("Formats of snapshots", ("hdf5",), min_length=1, max_length=2)
    history_every: units.Count = key("Steps between lines of history.csv, at least 1", 1)
    checkpoint_every: units.PositiveTime | None = key(
        "Wall time between checkpoints [s], from which `hvisph resume` continues; at most "
        "2 % of the run is spent on them; null for one at the end only",
        60.0,
    )
    full_every: units.Count = key(
        "Output times between snapshots of all particles, at least 1; regions are written at every output "
        "time, the first and the last state in full",
        1,
    )
    regions: dict[Annotated[str, Field(pattern=r"^[A-Za-z0-9_]{1,64}$")], OutputRegion] = key(
        "Parts of the model by name, written as `regions/NAME.NNNNNN.vtkhdf`", {}, max_length=100
    )
    fields: Annotated[tuple[Literal[WRITTEN], ...], SCALAR_AS_LIST] | None = key(  # type: ignore[valid-type]
        f"Fields of snapshots beside {', '.join(ALWAYS)}; all unless given. Fields left out cannot be "
        "measured or shown later",
        None,
    )
    precision: Literal["double", "single"] = key(
        "Of the fields in snapshots: double, or single, of seven digits in half of the space, for all but "
        "positions. The run itself and its checkpoints are double",
        "double",
    )
    compress: Literal["none", "gzip"] = key("Compression of HDF5 snapshots: gzip halves their size, slowly", "none")
    report: bool = key("Whether to write the page `report.html` when the run ends", False)
    static_fields: Literal["each", "once"] = key(
        "Whether `each` HDF5 snapshot holds mass, body and material, or only the first one (`once`), "
        "without which later ones cannot be read",
        "each",
    )


# Courant number unless given, by formulation and for those without an entry. Where there is a viscosity the criterion
# holds its signal, 1.2 alpha c, already, and it damps what grows at less: below DAMPED steps are as long at half of
# the number. Contact SPH allows for its dissipation in disordered lattices (docs/theory/integration.md); where
# it keeps no slopes of sound matter, in the printed form and without reconstruction, that takes more: FIRM.
# Measured in docs/performance.md.
COURANT_OF, COURANT = {"eulerian": 0.6, "total_lagrangian": 0.5, "adaptive": 0.5, "riemann": 0.42}, 0.3
DAMPED, FIRM = 1.0, 0.35
# Spacings across a body below which contact SPH has COURANT, too: the vibration of three layers is a linear field
# without dissipation, which predicted stresses amplify (docs/theory/integration.md).
FEWEST_ACROSS = 3.5


def default_courant(data: Plain) -> float | None:
    """Return the Courant number of a raw case that leaves it to its formulation, None for any other case."""
    formulation, time = data.get("formulation", {"type": "riemann"}), data.get("time")
    if not isinstance(formulation, dict) or not isinstance(time, dict):
        return None
    if time.get("cfl") is not None or time.get("step") is not None:
        return None
    if data.get("kinematics") == "axisymmetric":  # oscillations beyond 0.35: negative energies in a ball and a bar
        return None
    viscosity = formulation.get("viscosity")
    if isinstance(viscosity, dict):
        alpha = 0.0 if viscosity.get("type") == "none" else viscosity.get("alpha", DAMPED)
        if isinstance(alpha, int | float) and alpha < DAMPED:
            return None
    kind = str(formulation.get("type", "riemann"))
    if kind == "riemann" and (formulation.get("variant") == "original" or formulation.get("reconstruction") == "none"):
        return FIRM
    return COURANT_OF.get(kind)


class Time(StrictModel):
    """Duration and time stepping."""

    end: units.PositiveTime = key("Time at which the run ends [s]; contact is at 0 unless there is a gap")
    cfl: units.PositiveShare = key(
        "Courant number of the adaptive step [-]: 0.6 with `eulerian`, "
        "0.5 with `total_lagrangian` and `adaptive`, 0.42 with `riemann` (0.35 with variant `original` and without "
        "reconstruction), 0.3 with others, in axisymmetric cases, with `riemann` where "
        "a body is three spacings thick, and where alpha of the viscosity is below 1",
        COURANT,
    )
    step: units.PositiveTime | None = key("Fixed time step [s]; adaptive unless given, in projection 1e-6 s/m dx", None)
    integrator: Literal["leapfrog", "predictor_corrector", "staggered"] = key(
        "Time integrator, one evaluation of the forces a step; `staggered` is Zisis 2013's", "leapfrog"
    )
    max_steps: Annotated[int, Field(strict=True, ge=1, le=10**12)] | None = key(
        "Number of steps at which the run stops", None
    )


class LateStage(StrictModel):
    """Stage at a low sound speed: a bulk modulus in place of equations of state, for craters that open slowly."""

    at: units.PositiveTime | Literal["auto"] = key(
        "Time from which on it holds [s]; `auto`: once the default modulus has fallen to `bulk_modulus`, and no "
        "neighbours close faster than a tenth of the new sound speed"
    )
    bulk_modulus: units.PositivePressure | None = key(
        "K_new [Pa], at least ten times the largest pressure p at that time; unless given the largest of 30 p, "
        "100 rho u^2 and 100 q, with the largest von Mises stress q and the speed u below which particles under stress "
        "have 99 % of their kinetic energy, but at most the modulus of any material and of the previous stage; with "
        "`at: auto` a tenth of the previous modulus",
        None,
    )
    nu: Annotated[float, units.Quantity(units.NUMBER, minimum=0, below=0.5)] = key(
        "Poisson's ratio, which with K_new gives the shear modulus [-]", 0.25
    )


LateStages = Annotated[
    tuple[LateStage, ...],
    Shorthand(
        lambda value, _: [value] if isinstance(value, dict) else value, (), ({"type": "object", "required": ["at"]},)
    ),
]


class Witness(StrictModel):
    """Plane across the shot line, for the extrapolation of the debris cloud in free flight."""

    x: Annotated[float, units.Quantity(units.LENGTH)] = key("Where it is, along the shot line [m]")


class RunLimits(StrictModel):
    """Limits beyond which a run stops with a snapshot; non-finite values always stop it."""

    energy_drift: Annotated[float, units.Quantity(units.NUMBER, above=0)] | None = key(
        "Change of total energy over that at the start [-]; null for no limit", 0.01
    )
    negative_energy: Annotated[float, units.Quantity(units.NUMBER, above=0)] | None = key(
        "Negative internal energy of the whole model over the total energy at the start [-], at which a run stops; "
        "null for no limit",
        0.01,
    )
    speed_over_initial: Annotated[float, units.Quantity(units.NUMBER, above=1)] | None = key(
        "Speed of a particle over the fastest at the start, or over the sound speed where all "
        "particles start at rest [-]; null for no limit",
        10.0,
    )
    step_over_initial: Annotated[float, units.Quantity(units.NUMBER, minimum=0, below=1)] = key(
        "Smallest time step over the first [-]", 1e-6
    )
    density: bool = key("Whether densities outside the range of the equation of state stop the run", True)
