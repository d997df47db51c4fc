"""Consistency checks of bodies: shapes, arrangements, sizes, positions, velocities."""

import math
from collections.abc import Iterator
from itertools import pairwise

from hvisph.case import shapes
from hvisph.case.bodies import Body, LinearField, UniformField, direction_name
from hvisph.case.conditions import table_problems
from hvisph.case.model import AnyCase, Problem
from hvisph.core.catalogues import SECTION_ARRANGEMENTS, arrangements_of
from hvisph.core.text import recommend

FASTEST = 1e5  # [m/s]; ten times any impact in the solar system's inner part is a slip of units
MOST_PARTICLES = 2**31 - 1  # indices in compiled loops are 32 bits wide
AXES = ("x", "y", "z")
UNLIKE_SPACINGS = ("eulerian", "riemann")  # whose laws take every particle's own smoothing length
# Ratio of spacings and of masses of particles that cause a warning.
UNLIKE, MOST_UNEQUAL = 1.1, 3.0
FEWEST_LAYERS = 3  # layers of particles that a rigid body should have


def body_problems(case: AnyCase) -> Iterator[Problem]:
    """Yield the errors of the bodies of `case`."""
    for index, (name, body) in enumerate(case.bodies.items()):
        path = f"bodies.{name}"
        wrong = list(shapes.shape_problems(body.shape, case.drawing_dimensions, f"{path}.shape"))
        yield from wrong
        if not wrong:
            yield from _arrangement(case, body, path)
            yield from _thickness(case, body, path)
            yield from _inclusions(case, body, path)
            yield from _spacing(case, body, path)
        if body.temperature is not None and body.internal_energy:
            yield f"{path}.internal_energy", "given beside `temperature`, which sets it; leave one out"
        yield from _velocity(case, body, path)
        yield from _place(case, body, path, first=index == 0)
    yield from _count(case)
    yield from _rigid(case)


def _rigid(case: AnyCase) -> Iterator[Problem]:
    rigid = {name: body for name, body in case.bodies.items() if body.rigid is not None}
    for number, (name, body) in enumerate(rigid.items()):
        path = f"bodies.{name}.rigid"
        yield from _rigid_motion(case, body, path)
        yield from _rigid_mass(case, body, path)
        moving = [other for other in list(rigid)[:number] if not (_is_still(rigid[other]) and _is_still(body))]
        if moving:
            yield path, f"there is no law for two rigid bodies that meet; make it or '{moving[0]}' deformable"
        fields = all(field.type in ("uniform", "spin") for field in body.initial_velocity)
        if not fields or body.internal_energy or body.temperature or body.formulation:
            what = "a rigid body has no internal_energy, temperature, formulation, nor other initial_velocity than spin"
            yield path, f"{what} and uniform; leave them out"
        if case.formulation.type == "projection":
            yield path, "rigid bodies need another formulation than projection"
        elif len(case.bodies) > 1 and case.formulation.contact.type != "frictional":
            yield "formulation.contact", "bodies meet a rigid one in `frictional` contact alone"
        if case.time.integrator == "predictor_corrector":
            yield path, "needs one force a step; use `time.integrator: leapfrog` or `staggered`"


def _is_still(body: Body) -> bool:
    """Return whether a rigid body never moves."""
    return body.rigid is not None and body.rigid.move.fixed and not body.rigid.velocity


def _rigid_motion(case: AnyCase, body: Body, path: str) -> Iterator[Problem]:
    assert body.rigid is not None
    rigid, move, axisymmetric = body.rigid, body.rigid.move, case.kinematics == "axisymmetric"
    axes = AXES[: 1 if axisymmetric else case.dim]
    if sum((move.fixed, move.along is not None, move.about is not None, bool(rigid.velocity))) > 1:
        yield path, "give one of fixed, along, about and velocity, not several"
    for key, axis in (("along", move.along), ("about", move.about)):
        if axis is not None and not any(axis):
            yield f"{path}.move.{key}", "a direction must not be all zero"
    if move.along is not None and any(move.along[len(axes) :]):
        given = direction_name(move.along)
        yield f"{path}.move", f"it cannot move along {given} here; allowed: {', '.join(axes)}"
    if move.about is not None and (axisymmetric or case.dim == 1 or (case.dim == 2 and any(move.about[:2]))):
        yield f"{path}.move", "it cannot turn about this axis here; allowed: z in 2D, any in 3D"
    if rigid.along != "x" and not rigid.velocity:
        yield f"{path}.along", f"needs `velocity`; for a free motion along {rigid.along} give `move: {rigid.along}`"
    if rigid.velocity:
        yield from table_problems([time for time, _ in rigid.velocity], f"{path}.velocity")
        if rigid.along not in axes:
            yield f"{path}.along", f"it cannot move along {rigid.along} here; allowed: {', '.join(axes)}"
        if any(body.velocity) or body.initial_velocity:
            yield path, "its velocity is given twice; leave `velocity` and `initial_velocity` of the body out"
    kept = body.velocity
    if move.along is not None and any(body.velocity) and any(move.along):
        along = [*body.velocity, 0.0, 0.0][:3]
        share = sum(a * b for a, b in zip(along, move.along, strict=True)) / sum(a * a for a in move.along)
        kept = tuple(a - share * b for a, b in zip(body.velocity, move.along, strict=False))
        kept = tuple(one if abs(one) > 1e-9 * max(map(abs, body.velocity)) else 0.0 for one in kept)
    elif axisymmetric and not (move.fixed or move.about):
        kept = (0.0, *body.velocity[1:])
    elif not (move.fixed or move.about):
        kept = ()
    lost = [axis for axis, one in zip(AXES, kept, strict=False) if one != 0.0]
    if lost:
        yield path, f"its velocity has a component along {lost[-1]}, which it cannot keep"


def _rigid_mass(case: AnyCase, body: Body, path: str) -> Iterator[Problem]:
    assert body.rigid is not None
    moments, needed = body.rigid.inertia, {1: 0, 2: 1, 3: 3}[1 if case.kinematics == "axisymmetric" else case.dim]
    if moments and (body.rigid.velocity or body.rigid.move.fixed or body.rigid.move.along is not None):
        yield f"{path}.inertia", "has no effect on a body that does not turn; leave it out"
    elif moments and len(moments) != needed:
        yield f"{path}.inertia", f"has {len(moments)} moments, needs {needed} here"
    elif len(moments) == 3 and 2.0 * max(moments) > sum(moments) * (1.0 + 1e-12):
        what = "no body has a moment of inertia above the sum of the two others"
        yield f"{path}.inertia", f"{what}; correct the largest, {max(moments):g}"


def spacing_warnings(case: AnyCase) -> Iterator[str]:
    """Yield warnings about thin rigid bodies, and adjacent ones with different spacings or particle masses."""
    bodies = list(case.bodies.items())
    for name, body in bodies:
        layers = body.shape.thickness() / body.spacing(case)
        if body.rigid is not None and layers < FEWEST_LAYERS:
            yield recommend(
                f"bodies.{name}: a rigid body of {layers:.2g} layers; kernels see through fewer than {FEWEST_LAYERS}",
                f"bodies.{name}.resolution={body.shape.thickness() / FEWEST_LAYERS:.3g}",
            )
    for (one, first), (other, second) in pairwise(bodies):
        spacings = [body.spacing(case) for body in (first, second)]
        ratio = max(spacings) / min(spacings)
        if ratio > UNLIKE:
            own = [name for name, body in ((one, first), (other, second)) if body.resolution is not None]
            yield recommend(
                f"bodies.{one} and bodies.{other}: particle spacings in the ratio {ratio:.3g}; 2 to 6 % of a wave is "
                "reflected at their interface, and `frictional` contact transmits little until they are compressed; "
                "`grading` within one body reflects 0.2 to 0.5 %",
                *(f"bodies.{name}.resolution=null" for name in own),
            )
        masses = [body.material.density * dx**case.dim for body, dx in zip((first, second), spacings, strict=True)]
        unequal = max(masses) / min(masses)
        if ratio > UNLIKE and unequal > MOST_UNEQUAL:
            equal = spacings[1] * (masses[0] / masses[1]) ** (1 / case.dim)
            fault = f"bodies.{one} and bodies.{other}: particles of one weigh {unequal:.3g} times those of the other;"
            yield recommend(f"{fault} pairs of equal mass serve best", f"bodies.{other}.resolution={equal:.6g}")


def _inclusions(case: AnyCase, body: Body, path: str) -> Iterator[Problem]:
    own = body.inclusions
    if own is None:
        return
    path, unit = f"{path}.inclusions", _metre(case)
    low, high = own.diameters
    least = 3.0 * body.spacing(case)
    if low < least * (1.0 - 1e-9):
        fault = f"a diameter of {low:g}{unit} is below three spacings, {least:g}{unit};"
        yield f"{path}.diameters", f"{fault} give larger ones or a finer resolution"
    if high < low:
        yield f"{path}.diameters", f"fall from {low:g} to {high:g}{unit}; give the smallest first"
    if high > body.shape.thickness():
        message = f"a sphere of {high:g}{unit} does not fit a body {body.shape.thickness():g}{unit} thick"
        yield f"{path}.diameters", message
    if case.dim == 1 or case.drawing_dimensions != case.dim:
        yield path, "spheres need plane 2D or 3D: about an axis they would be tori"
    if case.symmetry:
        yield path, "are random, and not symmetric about a plane; leave out `symmetry`"
    if body.shape.type == "particles" or case.start is not None:
        yield path, "need a shape; leave them out for particles of a file or of another run"
    if body.rigid is not None:
        yield path, "have no meaning in a rigid body; leave them out"
    if own.material.strength.type in ("orthotropic", "fabric") or body.axes is not None:
        yield f"{path}.material", "has directions, which the spheres do not; give an isotropic material"


def _length(path: str, dim: int, given: int, what: str) -> Problem:
    axes = ", ".join(AXES[:dim])
    if what == "components" and given == 1 and path.endswith(".velocity"):
        return (path, f"is a speed alone; write {{speed: ...}} for one along x, or [{axes}]")
    return (path, f"has {given} {what}, needs {dim} in {dim}D: [{axes}]")


def _arrangement(case: AnyCase, body: Body, path: str) -> Iterator[Problem]:
    allowed = arrangements_of(case.dim, body.shape.type)
    if case.drawing_dimensions != case.dim:
        allowed = SECTION_ARRANGEMENTS
    if body.arrangement not in allowed:
        fault = f"'{body.arrangement}' has no meaning for a {body.shape.type} in {case.dim}D;"
        yield f"{path}.arrangement", f"{fault} allowed: {', '.join(allowed)}"


def _thickness(case: AnyCase, body: Body, path: str) -> Iterator[Problem]:
    formulation, thickness = case.formulation, body.shape.thickness()
    h = formulation.h_over_dx * body.spacing(case)
    support = formulation.support_over_h * h
    if isinstance(body.shape, shapes.HoneycombShape):
        yield from _walls(case, body, body.shape, path)
        return
    # a thickness written as a decimal multiple of dx must not fail by round-off
    if thickness < support * (1.0 - 1e-9):
        finest = thickness / (formulation.support_over_h * formulation.h_over_dx)
        unit, reach = _metre(case), f"the kernel's support {formulation.support_over_h:g}h"
        fault = f"the body is {thickness:g}{unit} thick, thinner than {reach} = {support:g}{unit} (h = {h:g}{unit});"
        yield f"{path}.shape", f"{fault} make it thicker or the resolution {finest:.3g}{unit} or finer"


def _walls(case: AnyCase, body: Body, shape: shapes.HoneycombShape, path: str) -> Iterator[Problem]:
    """Yield the errors of foil: walls of less than two particles, pores that do not keep the mass."""
    dx, unit = body.spacing(case), _metre(case)
    if shape.thickness() < 2.0 * dx * (1.0 - 1e-9):
        yield (
            f"{path}.shape.thickened",
            f"walls of {shape.thickness():g}{unit} have less than two particles of {dx:g}{unit} across; give "
            f"{math.ceil(2.0 * dx / shape.foil * (1.0 - 1e-9))} or more, or a finer resolution",
        )
    if shape.thickness() >= 0.25 * shape.cell:
        yield (
            f"{path}.shape.thickened",
            f"walls of {shape.thickness():g}{unit}, twice that where two foils are bonded, are no foil in cells of "
            f"{shape.cell:g}{unit}; give less than {0.25 * shape.cell / shape.foil:.3g}",
        )
    distension = 1.0 if body.material.porosity is None else body.material.porosity.distension
    if not math.isclose(distension, shape.thickened, rel_tol=1e-6):
        yield (
            f"{path}.material.porosity",
            f"a foil drawn {shape.thickened:g} times as thick keeps its mass with pores of distension "
            f"{shape.thickened:g}, but the material has {distension:g}; give both the same, such as porosity: "
            f"{{distension: {shape.thickened:g}, elastic_pressure: 10 MPa, solid_pressure: 1 GPa}}",
        )


def _spacing(case: AnyCase, body: Body, path: str) -> Iterator[Problem]:
    contact = getattr(case.formulation, "contact", None)
    penalty = contact is not None and contact.type == "penalty"
    for key in ("resolution", "grading"):
        if getattr(body, key) is not None and (case.formulation.type not in UNLIKE_SPACINGS or penalty):
            fault = f"spacings of a body's own need the formulation {' or '.join(UNLIKE_SPACINGS)}, with contact"
            yield f"{path}.{key}", f"{fault} frictional or bonded: Total Lagrangian bodies have one smoothing length"
    grading = body.grading
    if grading is None:
        return
    if case.drawing_dimensions != case.dim:
        if not _is_washer(body.shape):
            fault = (
                f"a {body.shape.type} has even spacing; in axisymmetric cases a cylinder, a tube and a ring of a box "
                "are graded"
            )
            yield f"{path}.grading", fault
    elif not isinstance(body.shape, shapes.BoxShape | shapes.IntervalShape):
        yield f"{path}.grading", f"a {body.shape.type} has even spacing; only a box or an interval is graded"
    if len(grading.fine) != case.dim:
        yield _length(f"{path}.grading.fine", case.dim, len(grading.fine), "widths")
    if not grading.coarsest > body.spacing(case):
        yield f"{path}.grading.coarsest", "must be above the spacing of the fine part, the resolution"
    if body.mass == "nominal":
        yield f"{path}.mass", "a graded body always has its exact mass; leave `mass` out"


def _is_washer(shape: shapes.Shape) -> bool:
    """Whether the half-plane section of a solid of revolution about x is a box along x and the radius."""
    if isinstance(shape, shapes.RingShape):
        return shape.axis == "x" and isinstance(shape.section, shapes.BoxShape)
    return isinstance(shape, shapes.CylinderShape | shapes.TubeShape) and shape.axis == "x"


def _velocity(case: AnyCase, body: Body, path: str) -> Iterator[Problem]:
    if len(body.velocity) != case.dim:
        yield _length(f"{path}.velocity", case.dim, len(body.velocity), "components")
    elif case.units == "si" and math.hypot(*body.velocity) > FASTEST:
        speed = math.hypot(*body.velocity)
        yield f"{path}.velocity", f"{speed:g} m/s is above {FASTEST / 1e3:g} km/s; check its unit"
    for number, field in enumerate(body.initial_velocity):
        place = f"{path}.initial_velocity.{number}"
        centre = getattr(field, "centre", None)
        if centre is not None and len(centre) != case.dim:
            yield _length(f"{place}.centre", case.dim, len(centre), "components")
        if isinstance(field, UniformField) and len(field.velocity) != case.dim:
            yield _length(f"{place}.velocity", case.dim, len(field.velocity), "components")
        if isinstance(field, LinearField) and {len(field.gradient), *map(len, field.gradient)} != {case.dim}:
            yield f"{place}.gradient", f"needs {case.dim} rows of {case.dim} in {case.dim}D"
        if field.type == "spin" and case.dim == 1:
            yield place, "nothing spins in 1D; leave it out"


def _place(case: AnyCase, body: Body, path: str, first: bool) -> Iterator[Problem]:
    if body.position is not None:
        if len(body.position) != case.dim:
            yield _length(f"{path}.position", case.dim, len(body.position), "components")
        if body.gap:
            yield f"{path}.gap", "given beside `position`, which fixes the place already; leave one out"
    elif first and body.gap:
        yield f"{path}.gap", "there is no body before the first; give the gap to the second"
    if body.rotation is None:
        return
    if case.dim == 1:
        yield f"{path}.rotation", "a body in 1D cannot be rotated; leave it out"
    elif case.dim == 2 and body.rotation.axis != (0.0, 0.0, 1.0):
        yield f"{path}.rotation.axis", "the axis is always z in 2D; leave it out"
    elif not math.hypot(*body.rotation.axis) > 0.0:
        yield f"{path}.rotation.axis", "must not be all zero"


def _count(case: AnyCase) -> Iterator[Problem]:
    spacings = [
        math.prod(size / b.spacing(case) for size in b.shape.extent()[: case.dim])
        for b in case.bodies.values()
        if b.grading is None and b.shape.extent()
    ]
    if not sum(spacings) <= MOST_PARTICLES:
        fault = f"{case.resolution:g}{_metre(case)} asks for about {sum(spacings):.1e} particles, more than the"
        yield "resolution", f"{fault} {MOST_PARTICLES:.1e} that can be numbered; make it coarser"


def _metre(case: AnyCase) -> str:
    return " m" if case.units == "si" else ""
