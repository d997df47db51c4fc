"""Consistency checks of a case. Each error names the path, the fault and the remedy."""

from collections.abc import Iterator
from itertools import pairwise

from hvisph.case.bodies import Body
from hvisph.case.conditions import edge_problems, gravity_problems, gravity_warnings, start_problems, table_problems
from hvisph.case.model import AnyCase, Problem
from hvisph.case.output import Clamp, SymmetryPlane, box_problems, gauge_problems, region_problems
from hvisph.core.catalogues import KINEMATICS
from hvisph.core.measure_catalogue import CATALOGUE, measures_of
from hvisph.core.text import format_value, recommend

from .body_checks import body_problems, spacing_warnings
from .plausible import implausible

BAROTROPIC = ("linear", "elastic")  # equations of state without energy
MOST_SNAPSHOTS = 1_000_000
AXES = ("x", "y", "z")
FIELDS = ("uniform", "radial", "linear", "table")  # fields of velocity that have a meaning about the axis


def problems_of(case: AnyCase) -> Iterator[Problem]:
    """Yield the errors of `case` beyond its single fields."""
    checks = (body_problems, axisymmetric_problems, _symmetry, _regions, gravity_problems, edge_problems)
    for check in (*checks, start_problems, gauge_problems, case.formulation.problems, _schedule, _late, _measures):
        yield from check(case)


def _late(case: AnyCase) -> Iterator[Problem]:
    if not case.late:
        return
    kind = case.formulation.type
    if kind not in ("riemann", "eulerian") or case.kinematics == "plane_stress":
        yield (
            "late",
            "needs `formulation` riemann or eulerian, and no plane_stress: only these show pairs the new sound speed",
        )
    if case.edges:
        yield "edges", "have the impedance of the start, which a late stage changes; leave one of them out"
    for number, stage in enumerate(case.late):
        if stage.at != "auto" and not case.begins < stage.at < case.time.end:
            yield f"late.{number}.at", f"{stage.at:g} is not within the run, {case.begins:g} to {case.time.end:g}"
    for number, (one, following) in enumerate(pairwise(case.late), 1):
        if one.at == "auto" and following.at != "auto":
            yield f"late.{number}.at", "after a stage that begins by itself give auto"
        elif one.at != "auto" != following.at and not following.at > one.at:
            yield f"late.{number}.at", f"{following.at:g} is not later than that of the stage before it"
        given = one.bulk_modulus, following.bulk_modulus
        if None not in given and not given[1] < given[0]:
            message = f"{following.bulk_modulus:g} is not below that of the stage before it"
            yield f"late.{number}.bulk_modulus", message
    for name, body in case.bodies.items():
        material = body.material
        if material.eos.type in ("ideal_gas", "jwl") or material.strength.type in ("orthotropic", "fabric"):
            message = "gases, explosives and matter with directions have no late stage; leave out `late`"
            yield f"bodies.{name}.material", message


def warnings_of(case: AnyCase) -> list[str]:
    """Return the warnings about a valid `case`."""
    checks = (spacing_warnings, case.formulation.warnings, _unused_settings, _mirror_conflicts, gravity_warnings)
    return [text for check in (*checks, axisymmetric_warnings, implausible) for text in check(case)]


def _unused_settings(case: AnyCase) -> Iterator[str]:
    """Yield warnings about settings without effect."""
    projection = case.formulation.type == "projection"
    for name, body in case.bodies.items():
        eos = body.material.eos.type
        if body.internal_energy != 0.0 and (projection or eos in BAROTROPIC):
            why = "projection has no equation of energy" if projection else f"'{eos}' has none of energy"
            yield f"bodies.{name}.internal_energy: {body.internal_energy:g} has no effect on its pressure: {why}"
    default = type(case.time).model_fields["cfl"].default
    if case.time.step is not None and case.time.cfl != default:
        yield f"time.cfl: {case.time.cfl:g} is not used, because time.step = {case.time.step:g} fixes the step"
    if case.time.step is not None and case.late:
        yield f"late: its longer steps are not taken, because time.step = {case.time.step:g} fixes the step"


def _mirror_conflicts(case: AnyCase) -> Iterator[str]:
    """Yield warnings about bodies that move normal to a plane of symmetry: beside it they meet a rigid wall."""
    for plane in case.symmetry:
        axis = AXES.index(plane.axis)
        for name, body in case.bodies.items():
            if any(body.velocity[axis : axis + 1]) and not _is_on_one_side(case, name, axis, plane.at):
                kept = [one.model_dump(mode="json") for one in case.symmetry if one is not plane]
                yield recommend(
                    f"bodies.{name}.velocity: {body.velocity[axis]:g} along {plane.axis} is across the symmetry plane "
                    f"{plane.axis} = {plane.at:g}, so the body's image moves the other way; for a body that crosses "
                    "the plane leave the plane out",
                    f"symmetry={format_value(kept)}",
                )


def _is_on_one_side(case: AnyCase, name: str, axis: int, at: float) -> bool:
    """Whether a body of known size or in a row, whose first two bodies touch at x = 0, lies on one side of a plane."""
    body, row = case.bodies[name], [other for other, one in case.bodies.items() if one.position is None]
    if axis == 0 and name == next(iter(row), ""):
        return at <= 0.0 if len(row) == 1 else at >= 0.0
    size = body.shape.extent()
    if body.position is None or axis >= len(size) or axis >= len(body.position) or body.rotation is not None:
        return False
    return abs(body.position[axis] - at) >= 0.5 * size[axis] * (1.0 - 1e-9)


def _symmetry(case: AnyCase) -> Iterator[Problem]:
    seen: dict[str, SymmetryPlane] = {}
    for index, plane in enumerate(case.symmetry):
        path = f"symmetry.{index}"
        if plane.axis not in AXES[: case.dim]:
            message = f"there is no axis {plane.axis} in {case.dim}D; allowed: {', '.join(AXES[: case.dim])}"
            yield f"{path}.axis", message
        other = seen.setdefault(plane.axis, plane)
        if other is plane:
            continue
        low, high = sorted((other, plane), key=lambda one: one.at)
        support = case.formulation.support_over_h * case.smoothing_length
        if (low.keep, high.keep) != ("above", "below"):
            yield (
                f"{path}.keep",
                f"two planes across {plane.axis} keep what lies between them: the lower one `above`, the upper `below`",
            )
        elif high.at - low.at < 2 * support:
            yield (
                f"{path}.at",
                f"the two planes across {plane.axis} are closer than twice the kernel's support, {2 * support:g}: "
                "images of images would be missed; move them apart or make the resolution finer",
            )
        if [p.axis for p in case.symmetry].count(plane.axis) > 2:
            yield f"{path}.axis", f"a third plane across {plane.axis}; two are allowed"


def _regions(case: AnyCase) -> Iterator[Problem]:
    for index, clamp in enumerate(case.clamped):
        yield from region_problems(clamp, f"clamped.{index}", case.dim, case.bodies)
        yield from _moving_clamp(case, clamp, f"clamped.{index}")
    for index, load in enumerate(case.initial_loads):
        yield from region_problems(load, f"initial_loads.{index}", case.dim, case.bodies)
    for index, pressed in enumerate(case.loads):
        yield from region_problems(pressed, f"loads.{index}", case.dim, case.bodies)
    for name, region in case.output.regions.items():
        yield from region_problems(region, f"output.regions.{name}", case.dim, case.bodies)
    if case.domain is not None:
        yield from box_problems(case.domain, "domain", case.dim)


def _moving_clamp(case: AnyCase, clamp: Clamp, path: str) -> Iterator[Problem]:
    """Yield the errors of the prescribed velocity of a clamp."""
    yield from table_problems([time for time, _ in clamp.velocity_table], f"{path}.velocity_table")
    if clamp.velocity and clamp.velocity_table:
        yield f"{path}.velocity", "is given beside `velocity_table`; leave one of them out"
    if clamp.along != "x" and not clamp.velocity_table:
        yield f"{path}.along", "needs `velocity_table`; give `velocity` its components"
    if clamp.velocity_table and clamp.along not in AXES[: case.dim]:
        yield f"{path}.along", f"there is no axis {clamp.along} in {case.dim}D"
    if not clamp.moves:
        return
    kind = case.formulation.type
    if clamp.velocity and len(clamp.velocity) != case.dim:
        yield f"{path}.velocity", f"has {len(clamp.velocity)} components, needs {case.dim} in {case.dim}D"
    elif case.kinematics == "axisymmetric" and (any(clamp.velocity[1:]) or clamp.along != "x"):
        yield f"{path}.velocity", "axisymmetric clamps move along the axis x alone"
    if kind == "projection":
        yield f"{path}.velocity", f"{kind} has no moving clamps; use another formulation, or leave the velocity out"
    if case.time.integrator == "predictor_corrector":
        yield f"{path}.velocity", "needs one force a step for its work; use `time.integrator: leapfrog`"
    if case.gravity is not None:
        yield f"{path}.velocity", "the balance has no work of a moving clamp against gravity; leave one of them out"


def _schedule(case: AnyCase) -> Iterator[Problem]:
    end, unit = case.duration, " s" if case.units == "si" else ""
    if case.output.every is not None and not end / case.output.every <= MOST_SNAPSHOTS:
        fault = f"{case.output.every:g}{unit} asks for {end / case.output.every:.2g} snapshots, more than"
        yield "output.every", f"{fault} {MOST_SNAPSHOTS:g}; make it longer, or time.end = {end:g}{unit} shorter"
    if case.time.step is not None and case.time.step > end:
        yield "time.step", f"{case.time.step:g}{unit} is beyond time.end = {end:g}{unit}; make it shorter"
    if len(set(case.output.formats)) < len(case.output.formats):
        yield "output.formats", "names a format twice"


def _measures(case: AnyCase) -> Iterator[Problem]:
    wanted = [(f"measures.{number}", name) for number, name in enumerate(case.measures or ())]
    wanted += [(f"expected.{name}", name) for name, _ in case.expected.items()]
    for path, name in wanted:
        if case.dim not in CATALOGUE[name].dims:
            yield path, f"has no meaning in {case.dim}D; allowed: {', '.join(measures_of(case.dim))}"


def axisymmetric_problems(case: AnyCase) -> Iterator[Problem]:
    """Yield the settings of an axisymmetric `case` that are undefined or not available about the axis."""
    if not KINEMATICS[case.kinematics].axisymmetric:
        return
    formulation = case.formulation
    if formulation.type == "projection":
        why = "its Poisson equation is that of the plane"
        yield "kinematics", f"'projection' has no axisymmetric form: {why}; use another formulation"
    elif formulation.contact.type == "penalty":
        yield "formulation.contact.type", "'penalty' has no axisymmetric form; use frictional"
    wanted = {
        "correction": "gradients are renormalised as it is",
        "density_dissipation": "its exchange is one of the plane",
        "spatial_correction": "gradients are renormalised as it is",
    }
    for name, why in wanted.items():
        given = getattr(getattr(formulation, name, None), "type", "none")
        if given != "none":
            yield f"formulation.{name}.type", f"'{given}' has no axisymmetric form: {why}; use none"
    for index, plane in enumerate(case.symmetry):
        if plane.axis != "x":
            yield f"symmetry.{index}", "a plane along the axis, but not through it; only planes across x"
    for name, body in case.bodies.items():
        yield from _axisymmetric_body(name, body)


def _axisymmetric_body(name: str, body: Body) -> Iterator[Problem]:
    if len(body.velocity) == 2 and body.velocity[1] != 0.0:
        yield (
            f"bodies.{name}.velocity",
            f"{body.velocity[1]:g} is a radial velocity of the whole ring, towards or away from the axis everywhere; "
            "for an oblique impact use three_d, for an implosion a `radial` field in `initial_velocity`",
        )
    if body.position is not None and len(body.position) == 2 and body.position[1] != 0.0:
        yield f"bodies.{name}.position", "bodies are solids about the axis: y must be 0; off it use a ring"
    if body.rotation is not None:
        yield f"bodies.{name}.rotation", "a turned solid is no solid about the axis; leave it out"
    if body.shape.type == "particles":
        yield f"bodies.{name}.shape.type", "particles from a file have no axisymmetric form"
    for number, field in enumerate(body.initial_velocity):
        if field.type not in FIELDS:
            yield f"bodies.{name}.initial_velocity.{number}", "axisymmetric particles rotate about x alone"


def axisymmetric_warnings(case: AnyCase) -> Iterator[str]:
    """Yield warnings about an axisymmetric `case`."""
    if not KINEMATICS[case.kinematics].axisymmetric:
        return
    formulation = case.formulation
    if hasattr(formulation, "artificial_stress") and formulation.artificial_stress.type != "none":
        yield recommend(
            "formulation.artificial_stress: acts in the plane alone, and no hoop force balances it: bodies in tension "
            "run away; leave it out",
            "formulation.artificial_stress={type: none}",
        )
