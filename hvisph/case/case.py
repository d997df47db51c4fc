"""Case: bodies, formulation, time, output; requested measures and their expected values."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, create_model, field_serializer, model_validator

from hvisph.case.consistency import problems_of
from hvisph.case.formulations.projection import default_step
from hvisph.case.formulations.riemann import formulation_by_materials, is_gas
from hvisph.case.output import COURANT, FEWEST_ACROSS, LateStages, RunLimits, Time, Witness, default_courant
from hvisph.core.catalogues import KINEMATICS, SHAPES, Kinematics, arrangements_of
from hvisph.core.errors import CaseError
from hvisph.core.measure_catalogue import CATALOGUE, measures_of
from hvisph.core.text import Plain

from .bodies import Body
from .conditions import Gravity, OpenEdge, OptionalOverburden, PressureLoad, Start
from .formulations import Formulation, RiemannFormulation
from .model import Problem, StrictModel, key
from .output import BoxRegion, Clamp, Gauge, InitialLoad, Output, SymmetryPlane
from .units import Dimension, PositiveLength, PositiveTime, PositiveVelocity, Quantity, dimension_of


class Expectation(StrictModel):
    """Expected value [SI unit of the measure], its tolerance and its source."""

    value: float = key("Expected value")
    tolerance: float = key("Largest deviation that passes; a percentage such as '12 %' is of the value")
    source: str = key("Where the value comes from", "")


def _percentage(value: object, info: ValidationInfo) -> object:
    """Convert a tolerance such as '12 %' to the unit of the measure."""
    if isinstance(value, str) and value.rstrip().endswith("%"):
        try:
            share = float(value.rstrip()[:-1]) / 100.0
        except ValueError:
            raise ValueError(f"{value[:80]!r} is not a percentage (write it like '12 %')") from None
        return share * abs(info.data.get("value", 0.0))
    return value


def _expectation(dimension: Dimension) -> type[Expectation]:
    name = dimension.name.split()[-1].capitalize() + "Expectation"
    value = Annotated[float, Quantity(dimension)]
    tolerance = Annotated[float, Quantity(dimension, minimum=0), BeforeValidator(_percentage)]
    unit = f" [{dimension.unit or '-'}]"
    fields = Expectation.model_fields
    return create_model(
        name,
        __base__=Expectation,
        __doc__=f"An expected value that is {dimension.name}.",
        value=(value, key(f"{fields['value'].description}{unit}")),
        tolerance=(tolerance, key(f"{fields['tolerance'].description}{unit}, at least 0")),
    )


class _Expectations(StrictModel):
    """Expected values, by the name of the measure."""

    def items(self) -> Iterator[tuple[str, Expectation]]:
        """Yield the name and the expectation of every measure that has one."""
        for name in CATALOGUE:
            expectation = getattr(self, name)
            if expectation is not None:
                yield name, expectation


_BY_UNIT = {unit: _expectation(dimension_of(unit)) for unit in dict.fromkeys(m.unit for m in CATALOGUE.values())}
_FIELDS: Plain = {name: (_BY_UNIT[one.unit] | None, key(one.meaning, None)) for name, one in CATALOGUE.items()}
if TYPE_CHECKING:  # a type checker cannot read types made from the catalogue
    Expectations = _Expectations
    MeasureName = str
else:
    Expectations = create_model("Expectations", __base__=_Expectations, __doc__=_Expectations.__doc__, **_FIELDS)
    MeasureName = Literal[tuple(CATALOGUE)]


if TYPE_CHECKING:  # a type checker cannot read types made from the catalogue
    KinematicsName = str
else:
    KinematicsName = Literal[tuple(KINEMATICS)]

# What solids leave out about the axis unless set otherwise: pairs push in the plane alone, and no hoop balances that.
DEFAULTS: dict[str, Plain] = {
    "eulerian": {"viscosity_in_shear": "reduced"},
    "adaptive": {"artificial_stress": {"type": "none"}},
}
_VECTORS = ("velocity", "position")
SNAPSHOTS = 20  # of a run after its start, unless a case says how often
BodyName = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_-]{0,63}$")]


class Case(StrictModel):
    """Complete description of a run. Plain numbers are in SI."""

    title: str = key("One line that says what this is", "")
    source: str = key("Where the set-up comes from", "")
    units: Literal["si", "none"] = key("`si`: plain numbers are SI, units are allowed; `none`: no dimensions", "si")
    kinematics: KinematicsName = key(
        "Dimensions and stress state: `uniaxial_strain` is 1D, `plane_strain` and "
        "`plane_stress` are 2D, `axisymmetric` is 2D about the x axis, with y the radius, and bodies are the solids of "
        "revolution that they are in 3D; `three_d` is 3D"
    )
    resolution: PositiveLength = key("Initial particle spacing dx [m]")
    materials: tuple[str, ...] = key(
        "Files of your own materials by name, or folders of such files, relative to the case file",
        (),
        exclude=True,
        max_length=100,
    )
    bodies: dict[BodyName, Body] = key("Bodies by name, the projectile first", min_length=1, max_length=1000)
    symmetry: tuple[SymmetryPlane, ...] = key(
        "Symmetry planes, also used as rigid walls without friction; at most two per axis, the part between "
        "them being computed",
        (),
        max_length=6,
    )
    clamped: tuple[Clamp, ...] = key("Regions that are held fixed", (), max_length=100)
    initial_loads: tuple[InitialLoad, ...] = key("Pressures that act during the first step", (), max_length=100)
    edges: tuple[OpenEdge, ...] = key("Planes through which waves leave; at most two per axis", (), max_length=6)
    loads: tuple[PressureLoad, ...] = key("Pressures over time on faces of bodies", (), max_length=100)
    start: Start | None = key(
        "Another run whose state this one starts from; bodies may be added. Unless given, bodies start as "
        "they are described",
        None,
    )
    gravity: Gravity | None = key(
        "Acceleration of gravity, one component per dimension [m/s^2], or `{type: sphere, ...}`, the field "
        "of a homogeneous sphere",
        None,
    )
    overburden: OptionalOverburden = key(
        "`true`: bodies start with the pressure of their own weight, `{lateral: K0}`: with that ratio of "
        "horizontal to vertical stress; they start without stress unless given",
        None,
    )
    settle: PositiveTime | None = key(
        "Time before the start in which bodies come to rest under `gravity`, with damped velocities [s]; "
        "bodies and planes with a velocity do not move meanwhile, and time does not advance",
        None,
    )
    formulation: Formulation = key("Scheme that computes the run", RiemannFormulation())
    time: Time = key("Duration and time stepping")
    late: LateStages = key(
        "Stages at a low sound speed, one or a list, with falling bulk moduli: the step grows by the root "
        "of their ratio, and pressure and deviator are continuous",
        (),
        max_length=10,
    )
    gauges: dict[BodyName, Gauge] = key("Gauges by name: their records go to history.csv", {}, max_length=1000)
    domain: BoxRegion | None = key(
        "Box outside of which particles are retired: they leave the computation, and their mass, "
        "momentum and energy stay in the balance",
        None,
    )
    limits: RunLimits = key("Limits beyond which a run is stopped", RunLimits())
    output: Output = key("What is written, and how often", Output())
    witness: Witness | None = key(
        "Witness plane behind the layers, in 2D and 3D: mass, momentum, energy and areal momentum of the "
        "debris cloud over the radius there go to summary.json (`cloud.witness`)",
        None,
    )
    escape: PositiveVelocity | None = key(
        "Least launch speed of ejecta that escape, for `beta.escaping` [m/s]; that of the `gravity` of a "
        "sphere unless given, and 0 without gravity",
        None,
    )
    measures: tuple[MeasureName, ...] | None = key("Measures; all of these dimensions unless given", None)
    expected: Expectations = key("Expected values, by name of the measure", Expectations())

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return KINEMATICS[self.kinematics].dim

    @property
    def drawing_dimensions(self) -> int:
        """Number of dimensions in which bodies are drawn."""
        return KINEMATICS[self.kinematics].drawing_dimensions

    @property
    def begins(self) -> float:
        """Time at the start [s]: 0, or that of the other run."""
        return 0.0 if self.start is None else float(self.start.at)

    @property
    def duration(self) -> float:
        """Time from start to end [s]."""
        return self.time.end - self.begins

    @property
    def snapshot_interval(self) -> float:
        """Time between snapshots [s]."""
        return self.output.every or self.duration / SNAPSHOTS

    @property
    def smoothing_length(self) -> float:
        """Initial smoothing length h [m]."""
        return self.formulation.h_over_dx * self.resolution

    @model_validator(mode="before")
    @classmethod
    def _fill_what_depends_on_dimensions(cls, data: Any, info: ValidationInfo) -> object:
        """Fill in the arrangements, velocities and measures whose defaults depend on the kinematics."""
        name = data.get("kinematics") if isinstance(data, dict) else None
        if not isinstance(name, str) or name not in KINEMATICS:
            return data
        kinematics = KINEMATICS[name]
        dim = kinematics.dim
        if isinstance(info.context, dict):
            info.context["dim"] = dim  # a speed and an angle become as many components
        filled = about_axis(data) if kinematics.axisymmetric else dict(data)
        if isinstance(filled.get("bodies"), dict):
            filled["bodies"] = {name: _fill_body(body, kinematics) for name, body in filled["bodies"].items()}
        if filled.get("measures") is None:
            filled["measures"] = measures_of(dim)
        formulation = formulation_by_materials(filled | {"bodies": _with_materials(filled.get("bodies"), info.context)})
        if formulation is not None:
            filled["formulation"] = formulation
        step = default_step(filled)
        if step is not None:
            filled["time"] = {**filled["time"], "step": step}
        courant = default_courant(filled)
        if courant is not None:
            filled["time"] = {**filled["time"], "cfl": courant}
        return filled

    @model_validator(mode="wrap")
    @classmethod
    def _shorten_steps_of_thin_bodies(cls, data: Any, handler: Any) -> "Case":
        """Set the Courant number of a case that leaves it open and has bodies of three layers of particles."""
        case: Case = handler(data)
        time = data.get("time") if isinstance(data, dict) else None
        if isinstance(time, dict) and time.get("cfl") is None and has_thin_body(case):
            return case.model_copy(update={"time": case.time.model_copy(update={"cfl": COURANT})})
        return case

    def _faults(self) -> Iterator[Problem]:
        return problems_of(self)

    @field_serializer("expected")
    def _expected_values(self, expected: Any) -> Plain:
        return {name: expectation.model_dump() for name, expectation in expected.items()}


def has_thin_body(case: Case) -> bool:
    """Return whether a body of a case of corrected contact SPH is fewer than four layers of particles thick."""
    if case.formulation.type != "riemann" or case.formulation.variant == "original":
        return False
    bodies = (body for body in case.bodies.values() if not body.rigid)
    return any(body.shape.thickness() < FEWEST_ACROSS * body.spacing(case) for body in bodies)


def _fill_body(body: object, kinematics: Kinematics) -> object:
    if isinstance(body, Body):
        defaults = _body_defaults(body.shape.type, kinematics)
        missing = {name: value for name, value in defaults.items() if not getattr(body, name)}
        return body.model_copy(update=missing)
    if not isinstance(body, dict):
        return body
    shape = body.get("shape")
    kind = shape.get("type") if isinstance(shape, dict) else getattr(shape, "type", None)
    defaults = _body_defaults(kind, kinematics)
    return body | {name: value for name, value in defaults.items() if body.get(name) is None}


def _with_materials(bodies: object, context: object) -> object:
    """Replace material names in raw bodies by the materials; unknown names are refused later."""
    fetch = context.get("library") if isinstance(context, dict) else None
    if fetch is None or not isinstance(bodies, dict):
        return bodies
    resolved: Plain = {}
    for name, body in bodies.items():
        named = body.get("material") if isinstance(body, dict) else None
        try:
            resolved[name] = body | {"material": fetch(named)} if isinstance(named, str) else body
        except CaseError:
            resolved[name] = body
    return resolved


def _body_defaults(shape: object, kinematics: Kinematics) -> Plain:
    defaults: Plain = {"velocity": (0.0,) * kinematics.dim}
    if isinstance(shape, str) and shape in SHAPES[kinematics.drawing_dimensions]:
        defaults["arrangement"] = arrangements_of(kinematics.dim, shape)[0]
    return defaults


def about_axis(data: Plain) -> Plain:
    """Convert the plain form of an axisymmetric case from 3D to the half-plane (x, r).

    Formulations have the `DEFAULTS` of axisymmetric cases. A third component that is zero and planes of symmetry
    through the axis are removed.
    """
    filled = dict(data)
    if isinstance(filled.get("bodies"), dict):
        filled["bodies"] = {name: _flatten(body) for name, body in filled["bodies"].items()}
    planes = filled.get("symmetry")
    if isinstance(planes, list | tuple):
        filled["symmetry"] = [plane for plane in planes if not _through_axis(plane)]
    scheme = filled.get("formulation")
    if isinstance(scheme, dict):
        gas = isinstance(filled.get("bodies"), dict) and any(map(is_gas, filled["bodies"].values()))
        filled["formulation"] = ({} if gas else DEFAULTS.get(str(scheme.get("type")), {})) | scheme
    return filled


def _flatten(body: object) -> object:
    if not isinstance(body, dict):
        return body
    short = dict(body)
    for name in _VECTORS:
        value = short.get(name)
        if isinstance(value, list | tuple) and len(value) == 3 and value[2] == 0:
            short[name] = list(value[:2])
    grading = short.get("grading")
    if isinstance(grading, dict):
        fine = grading.get("fine")
        if isinstance(fine, list | tuple) and len(fine) == 3 and fine[1] == fine[2]:
            short["grading"] = grading | {"fine": list(fine[:2])}
    if short.get("arrangement") == "cubic":
        short["arrangement"] = "square"
    if "shape" in short:
        short["shape"] = _in_space(short["shape"])
    return short


def _in_space(shape: object) -> object:
    """Return a raw shape in 3D whose parts may stand at places of the half-plane, (x, y) for (x, y, 0)."""
    if not isinstance(shape, dict):
        return shape
    whole = dict(shape)
    for name in ("whole", "shape"):
        if name in whole:
            whole[name] = _in_space(whole[name])
    for name in ("parts", "removed"):
        if isinstance(whole.get(name), list | tuple):
            whole[name] = [_in_space(part) for part in whole[name]]
    if isinstance(whole.get("vectors"), list | tuple):
        whole["vectors"] = [_extend_vector(vector) for vector in whole["vectors"]]
    if "position" in whole:
        whole["position"] = _extend_vector(whole["position"])
    return whole


def _extend_vector(vector: object) -> object:
    return [*vector, 0] if isinstance(vector, list | tuple) and len(vector) == 2 else vector


def _through_axis(plane: object) -> bool:
    if isinstance(plane, SymmetryPlane):
        return plane.axis != "x" and plane.at == 0.0
    return isinstance(plane, dict) and plane.get("axis") in ("y", "z") and plane.get("at", 0) == 0
