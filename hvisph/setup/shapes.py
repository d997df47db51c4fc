"""Shapes of a case as geometry objects, and initial velocities of a body: a uniform velocity and velocity fields."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from hvisph.case.bodies import Body, RadialField, SpinField, TableField
from hvisph.core.errors import CaseError, locate
from hvisph.geometry import shapes
from hvisph.geometry.placement import rotation_matrix
from hvisph.geometry.shapes import Shape
from hvisph.geometry.shapes.axial_bodies import Profile

# Classes of simple shapes and of profiles, with the keys of the case that are their arguments.
SIMPLE = {
    "interval": (shapes.Interval, "length"),
    "disc": (shapes.Disc, "diameter"),
    "annulus": (shapes.Annulus, "outer_diameter inner_diameter"),
    "polygon": (shapes.Polygon, "points"),
    "sphere": (shapes.Sphere, "diameter"),
    "hollow_sphere": (shapes.HollowSphere, "outer_diameter inner_diameter"),
    "box": (shapes.Box, "size"),
    "cylinder": (shapes.Cylinder, "diameter length axis"),
    "tube": (shapes.Tube, "outer_diameter inner_diameter length axis"),
}
PROFILES = {
    "frustum": (shapes.Frustum, "back_diameter front_diameter length"),
    "ogive": (shapes.Ogive, "diameter nose_length shank_length"),
    "rounded_cylinder": (shapes.RoundedCylinder, "diameter length edge_radius ends"),
}


def shape_of(model: Any, dim: int) -> Shape:
    """Return a shape's geometry in `dim` dimensions; raises `CaseError` for sizes or files that do not fit."""
    if model.type in SIMPLE:
        return _of_keys(SIMPLE[model.type], model)
    match model.type:
        case "cone" | "frustum" | "ogive" | "dome" | "rounded_cylinder":
            return shapes.Nosed(_profile(model), dim, model.axis)
        case "prism":
            return shapes.Prism(shape_of(model.section, 2), model.length, model.axis)
        case "ring":
            return shapes.Ring(shape_of(model.section, 2), model.radius, model.axis)
        case "honeycomb":
            return shapes.Honeycomb(model.cell, model.foil * model.thickened, model.size)
        case "mesh":
            return _mesh(model.file, model.unit)
        case "union":
            return shapes.Union(tuple(_part(part, dim) for part in model.parts))
        case "intersection":
            return shapes.Intersection(tuple(_part(part, dim) for part in model.parts))
        case "difference":
            return shapes.Difference(shape_of(model.whole, dim), tuple(_part(part, dim) for part in model.removed))
        case "repeat":
            return shapes.Repeat(shape_of(model.shape, dim), model.vectors, model.counts)
    raise ValueError(model.type)


def _of_keys(shape_type: tuple[Any, str], model: object) -> Any:
    shape, keys = shape_type
    return shape(*(getattr(model, key) for key in keys.split()))


def _profile(model: Any) -> Profile:
    if model.type == "cone":
        return shapes.Frustum(model.diameter, 0.0, model.length)
    if model.type == "dome":
        return shapes.Dome(model.diameter, model.height or model.diameter / 2)
    return _of_keys(PROFILES[model.type], model)


def _part(part: Any, dim: int) -> Shape:
    shape = shape_of(part.shape, dim)
    if part.position is None and part.rotation is None:
        return shape
    turn = None if part.rotation is None else rotation_matrix(dim, part.rotation.radians, part.rotation.axis)
    return shapes.Placed(shape, np.array(part.position or (0.0,) * dim), turn)


@lru_cache(maxsize=8)
def _mesh(file: str, unit: float) -> Shape:
    from hvisph.geometry.shapes.mesh import load_mesh

    with locate("shape"):
        return load_mesh(file, unit)


FIELD_TOLERANCE = 1e-6  # a field may differ by so much of its largest velocity from its mirror image


def initial_velocity(model: Body, positions: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Return the initial velocity of particles (n, dim) [m/s]; fields are centred at `middle` [m] by default."""
    velocity = np.tile(np.asarray(model.velocity, dtype=float), (len(positions), 1))
    for number, field in enumerate(model.initial_velocity):
        centre = getattr(field, "centre", None)
        about = middle if centre is None else np.asarray(centre)
        with locate(f"initial_velocity.{number}"):
            velocity += _FIELDS[field.type](field, positions, positions - about)
    return velocity


def refuse_unlike_halves(model: Body, positions: np.ndarray, middle: np.ndarray, axis: int, at: float) -> None:
    """Raise `CaseError` for a field that is not symmetric about a plane; tables of one half are not tried."""
    mirrored = positions.copy()
    mirrored[:, axis] = 2.0 * at - mirrored[:, axis]
    for number, field in enumerate(model.initial_velocity):
        if field.type in ("uniform", "table"):
            continue
        single = model.model_copy(update={"velocity": (0.0,) * positions.shape[1], "initial_velocity": (field,)})
        u, u_mirrored = initial_velocity(single, positions, middle), initial_velocity(single, mirrored, middle)
        u_mirrored[:, axis] *= -1.0
        if np.abs(u - u_mirrored).max() > FIELD_TOLERANCE * np.abs(u).max():
            plane = f"{'xyz'[axis]} = {at:g}"
            raise CaseError(
                f"the symmetry plane {plane} cuts this body, and a {field.type} of one half is no mirror image of that "
                "of the other; leave out the plane, or give a field that is symmetric about it",
                where=f"initial_velocity.{number}",
            )


def _spin(field: SpinField, positions: np.ndarray, offset: np.ndarray) -> np.ndarray:
    if offset.shape[1] == 2:
        return field.rate * np.stack([-offset[:, 1], offset[:, 0]], axis=1)
    return np.cross(field.rate * _unit(field.axis), offset)


def _radial(field: RadialField, positions: np.ndarray, offset: np.ndarray) -> np.ndarray:
    if field.axis is not None and offset.shape[1] == 3:
        axis = _unit(field.axis)
        offset = offset - np.outer(offset @ axis, axis)
    r = np.sqrt((offset**2).sum(axis=1))
    distance = np.maximum(r, 1e-12 * field.radius)
    speed = np.where(r > 1e-12 * field.radius, field.speed * (distance / field.radius) ** field.power, 0.0)
    return offset * (speed / distance)[:, None]


def _table(field: TableField, positions: np.ndarray, offset: np.ndarray) -> np.ndarray:
    from hvisph.geometry.particle_file import read_columns

    dim = positions.shape[1]
    columns = read_columns(field.file, (*"xyz"[:dim], *"uvw"[:dim]))
    points, values = np.stack(columns[:dim], axis=1), np.stack(columns[dim:], axis=1)
    if dim == 1:
        order = np.argsort(points[:, 0])
        return np.interp(positions[:, 0], points[order, 0], values[order, 0])[:, None]
    from hvisph.geometry.particle_file import interpolate

    return interpolate(points, values, positions)


_FIELDS: dict[str, Callable[..., np.ndarray]] = {
    "uniform": lambda field, positions, _: np.tile(np.array(field.velocity, float), (len(positions), 1)),
    "spin": _spin,
    "radial": _radial,
    "linear": lambda field, _, offset: offset @ np.asarray(field.gradient).T,
    "table": _table,
}


def _unit(direction: object) -> np.ndarray:
    vector = np.asarray(direction, dtype=float)
    length = float(np.sqrt(vector @ vector))
    if not length > 0:
        raise CaseError("the axis of a velocity field must not be all zero", where="axis")
    return vector / length
