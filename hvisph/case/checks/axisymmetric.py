"""Axisymmetric cases: conversion from 3D input and consistency checks."""

from collections.abc import Iterator

from hvisph.case.bodies import Body
from hvisph.case.formulations.riemann import is_gas
from hvisph.case.model import AnyCase, Problem
from hvisph.case.output import SymmetryPlane
from hvisph.core.catalogues import KINEMATICS
from hvisph.core.text import Plain, recommend

# Fields of velocity that have a meaning about the axis.
FIELDS = ("uniform", "radial", "linear", "table")
# What solids leave out about the axis unless set otherwise: pairs push in the plane alone, and no hoop balances that.
DEFAULTS: dict[str, Plain] = {
    "eulerian": {"viscosity_in_shear": "reduced"},
    "adaptive": {"artificial_stress": {"type": "none"}},
}
_VECTORS = ("velocity", "position")


def about_axis(data: Plain) -> Plain:
    """Convert the plain form of an axisymmetric case from 3D to the half-plane (x, r).

    Formulations have the `DEFAULTS` of rings. A third component that is zero and planes of symmetry through the axis
    say nothing about a solid of revolution.
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
    for key in _VECTORS:
        value = short.get(key)
        if isinstance(value, list | tuple) and len(value) == 3 and value[2] == 0:
            short[key] = list(value[:2])
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
    for key in ("whole", "shape"):
        if key in whole:
            whole[key] = _in_space(whole[key])
    for key in ("parts", "removed"):
        if isinstance(whole.get(key), list | tuple):
            whole[key] = [_in_space(part) for part in whole[key]]
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


def axisymmetric_problems(case: AnyCase) -> Iterator[Problem]:
    """Yield the settings of an axisymmetric `case` that are undefined or not available about the axis."""
    if not KINEMATICS[case.kinematics].axisymmetric:
        return
    formulation = case.formulation
    if formulation.type == "projection":
        why = "its Poisson equation is that of the plane"
        yield Problem(("kinematics",), f"'projection' has no axisymmetric form: {why}; use another formulation")
    elif formulation.contact.type == "penalty":
        yield Problem(("formulation", "contact", "type"), "'penalty' has no axisymmetric form; use frictional")
    if formulation.type == "eulerian":
        yield from _require_none(formulation, "correction", "type", "none", "gradients are renormalised as it is")
        yield from _require_none(formulation, "density_dissipation", "type", "none", "its exchange is one of the plane")
    if formulation.mixes_kernels:
        yield from _require_none(
            formulation, "spatial_correction", "type", "none", "gradients are renormalised as it is"
        )
    for index, plane in enumerate(case.symmetry):
        if plane.axis != "x":
            yield Problem(("symmetry", index), "a plane along the axis, but not through it; only planes across x")
    for name, body in case.bodies.items():
        yield from _body(name, body)


def _require_none(formulation: object, key: str, part: str, allowed: str, why: str) -> Iterator[Problem]:
    model = getattr(formulation, key)
    given = getattr(model, part) if part else model
    if given != allowed:
        path = ("formulation", key, part) if part else ("formulation", key)
        yield Problem(path, f"'{given}' has no axisymmetric form: {why}; use {allowed}")


def _body(name: str, body: Body) -> Iterator[Problem]:
    if len(body.velocity) == 2 and body.velocity[1] != 0.0:
        yield Problem(
            ("bodies", name, "velocity"),
            f"{body.velocity[1]:g} is a radial velocity of the whole ring, towards or away from the axis everywhere; "
            "for an oblique impact use three_d, for an implosion a `radial` field in `initial_velocity`",
        )
    if body.position is not None and len(body.position) == 2 and body.position[1] != 0.0:
        yield Problem(("bodies", name, "position"), "bodies are solids about the axis: y must be 0; off it use a ring")
    if body.rotation is not None:
        yield Problem(("bodies", name, "rotation"), "a turned solid is no solid about the axis; leave it out")
    if body.shape.type == "particles":
        yield Problem(("bodies", name, "shape", "type"), "particles from a file have no axisymmetric form")
    for number, field in enumerate(body.initial_velocity):
        if field.type not in FIELDS:
            yield Problem(("bodies", name, "initial_velocity", number), "no ring turns about another axis than x")


def axisymmetric_warnings(case: AnyCase) -> Iterator[str]:
    """Yield warnings about an axisymmetric `case`."""
    if not KINEMATICS[case.kinematics].axisymmetric:
        return
    formulation = case.formulation
    if hasattr(formulation, "artificial_stress") and formulation.artificial_stress.type != "none":
        yield recommend(
            "formulation.artificial_stress: pushes rings apart in the plane, which no hoop balances: bodies in tension "
            "run away; leave it out",
            "formulation.artificial_stress={type: none}",
        )
