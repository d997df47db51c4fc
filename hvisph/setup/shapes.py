"""Shapes of a case as geometry objects."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from hvisph.core.errors import CaseError
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
    """Return the geometry of a case's shape in `dim` dimensions.

    Raises `CaseError` when sizes do not go together, or a file cannot be read.
    """
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


def _of_keys(kind: tuple[Any, str], model: object) -> Any:
    shape, keys = kind
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

    try:
        return load_mesh(file, unit)
    except CaseError as error:
        raise CaseError(error.message, where=f"shape.{error.where}") from error
