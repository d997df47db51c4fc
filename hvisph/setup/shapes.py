"""From a case's shapes to the geometry's. Compiles nothing."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.geometry.placement import rotation_matrix
from hvisph.geometry.shapes import (
    Annulus,
    Box,
    Cylinder,
    Difference,
    Disc,
    Dome,
    Frustum,
    HollowSphere,
    Intersection,
    Interval,
    Nosed,
    Ogive,
    Placed,
    Polygon,
    Prism,
    Repeat,
    Ring,
    RoundedCylinder,
    Shape,
    Sphere,
    Tube,
    Union,
)
from hvisph.geometry.shapes.nosed import Profile


def shape_of(model: Any, dim: int) -> Shape:
    """Return the geometry of a case's shape in `dim` dimensions.

    Raises
    ------
    CaseError
        When sizes do not go together, or a file cannot be read.
    """
    match model.type:
        case "interval":
            return Interval(model.length)
        case "disc":
            return Disc(model.diameter)
        case "annulus":
            return Annulus(model.outer_diameter, model.inner_diameter)
        case "polygon":
            return Polygon(model.points)
        case "sphere":
            return Sphere(model.diameter)
        case "hollow_sphere":
            return HollowSphere(model.outer_diameter, model.inner_diameter)
        case "box":
            return Box(tuple(model.size))
        case "cylinder":
            return Cylinder(model.diameter, model.length, model.axis)
        case "tube":
            return Tube(model.outer_diameter, model.inner_diameter, model.length, model.axis)
        case "cone" | "frustum" | "ogive" | "dome" | "rounded_cylinder":
            return Nosed(_profile(model), dim, model.axis)
        case "prism":
            return Prism(shape_of(model.section, 2), model.length, model.axis)
        case "ring":
            return Ring(shape_of(model.section, 2), model.radius, model.axis)
        case "mesh":
            return _mesh(model.file, model.unit)
    return _combine(model, dim)


def _profile(model: Any) -> Profile:
    match model.type:
        case "cone":
            return Frustum(model.diameter, 0.0, model.length)
        case "frustum":
            return Frustum(model.back_diameter, model.front_diameter, model.length)
        case "ogive":
            return Ogive(model.diameter, model.nose_length, model.shank_length)
        case "dome":
            return Dome(model.diameter, model.height or model.diameter / 2)
    return RoundedCylinder(model.diameter, model.length, model.edge_radius, model.ends)


def _combine(model: Any, dim: int) -> Shape:
    match model.type:
        case "union":
            return Union(tuple(_part(part, dim) for part in model.parts))
        case "intersection":
            return Intersection(tuple(_part(part, dim) for part in model.parts))
        case "difference":
            return Difference(shape_of(model.whole, dim), tuple(_part(part, dim) for part in model.removed))
        case "repeat":
            return Repeat(shape_of(model.shape, dim), model.vectors, model.counts)
    raise ValueError(model.type)


def _part(part: Any, dim: int) -> Shape:
    shape = shape_of(part.shape, dim)
    if part.position is None and part.rotation is None:
        return shape
    turn = None if part.rotation is None else rotation_matrix(dim, part.rotation.radians, part.rotation.axis)
    return Placed(shape, np.array(part.position or (0.0,) * dim), turn)


@lru_cache(maxsize=8)
def _mesh(file: str, unit: float) -> Shape:
    from hvisph.geometry.shapes.mesh import load_mesh

    try:
        return load_mesh(file, unit)
    except CaseError as error:
        raise CaseError(error.message, where=f"shape.{error.where}") from error
