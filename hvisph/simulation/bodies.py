"""From the case's bodies to particle positions: shapes, fillings and places. Compiles nothing."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.geometry.fill import fill
from hvisph.geometry.filling import Filling
from hvisph.geometry.overlap import overlaps
from hvisph.geometry.place import rotated, rotation_matrix, row
from hvisph.geometry.shapes import Box, Cylinder, Disc, Interval, Shape, Sphere

if TYPE_CHECKING:
    from hvisph.case.bodies import Body
    from hvisph.case.case import Case


@dataclass(frozen=True)
class PlacedBody:
    """A body's particles where they start.

    Parameters
    ----------
    name
        Name in the case.
    model
        Its `hvisph.case.bodies.Body`.
    filling
        Particles about the centre.
    positions
        Particles at their place (n, dim) [m], those kept by symmetry planes.
    volumes
        Their volumes (n,) [m^dim].
    """

    name: str
    model: Body
    filling: Filling
    positions: np.ndarray
    volumes: np.ndarray


def shape_of(model: Any) -> Shape:
    """Return the geometry of a case's shape."""
    match model.type:
        case "interval":
            return Interval(model.length)
        case "disc":
            return Disc(model.diameter)
        case "sphere":
            return Sphere(model.diameter)
        case "box":
            return Box(tuple(model.size))
        case "cylinder":
            return Cylinder(model.diameter, model.length, model.axis)
    raise ValueError(model.type)


def placed_bodies(case: Case) -> list[PlacedBody]:
    """Fill all bodies of a case and put them in their places.

    Raises
    ------
    CaseError
        Where a shape cannot be filled, bodies overlap or a symmetry plane leaves nothing of a body.
    """
    dx, dim = case.resolution, case.dim
    fillings = []
    for name, model in case.bodies.items():
        try:
            filling = fill(shape_of(model.shape), model.arrangement, dx)
        except CaseError as error:
            raise CaseError(error.message, where=f"bodies.{name}.{error.where or 'shape'}") from error
        if model.rotation is not None:
            filling = rotated(filling, rotation_matrix(dim, model.rotation.radians, model.rotation.axis))
        fillings.append(filling)
    models = list(case.bodies.values())
    centres = row(fillings, [m.gap for m in models], [m.position for m in models], dx)
    bodies = []
    for (name, model), filling, centre in zip(case.bodies.items(), fillings, centres, strict=True):
        positions = filling.positions + centre
        kept = np.ones(len(positions), bool)
        for plane in case.symmetry:
            along = positions[:, "xyz".index(plane.axis)] - plane.at
            kept &= along > 0 if plane.keep == "above" else along < 0
        if not kept.any():
            raise CaseError("the symmetry planes leave no particle of this body", where=f"bodies.{name}")
        bodies.append(PlacedBody(name, model, filling, positions[kept], filling.volumes[kept]))
    _refuse_overlaps(bodies, dx, case.units)
    if dim == 1:
        _refuse_disorder(bodies)
    return bodies


def _refuse_disorder(bodies: list[PlacedBody]) -> None:
    """Refuse layers that do not stand from left to right: projectile and target are told by their order."""
    for before, body in pairwise(bodies):
        if body.positions.min() < before.positions.min():
            raise CaseError(
                f"stands left of '{before.name}', which is listed before it; list the layers from left to "
                "right, or change their positions",
                where=f"bodies.{body.name}.position",
            )


def _refuse_overlaps(bodies: list[PlacedBody], dx: float, units: str) -> None:
    positions = np.concatenate([body.positions for body in bodies])
    owner = np.concatenate([np.full(len(body.positions), i) for i, body in enumerate(bodies)])
    for overlap in overlaps(positions, owner, dx):
        first, second = (bodies[i].name for i in overlap.bodies)
        scale, unit = (1e3, " mm") if units == "si" else (1.0, "")
        place = ", ".join(f"{scale * float(c):.4g}" for c in positions[overlap.particles[0]])
        raise CaseError(
            f"overlaps '{second}': {overlap.count} pairs of particles are closer than particles of touching "
            f"bodies, the first at ({place}){unit}; move one (position, gap) or shrink it",
            where=f"bodies.{first}",
        )
