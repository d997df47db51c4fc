"""Placement of bodies: rotated about their centres, then in a row along x, in contact or at a gap.

A body's faces along x lie dx / 2 outside its outermost particles, those of a graded one where its layers end, so that
two touching bodies have their particles dx apart. The row's second body has its first face at x = 0, the struck face,
whatever the gap before it; a body alone in the row has its own first face there.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.geometry.lattices import Filling

from .contact_point import Solid, touch
from .shapes import Annulus, Cylinder, Disc, HollowSphere, Nosed, Ring, Shape, Sphere, Tube

ALL_ROUND = (Disc, Annulus, Sphere, HollowSphere)
ROUND = (Cylinder, Tube, Nosed, Ring)  # about their `axis`


def rotation_matrix(dim: int, angle: float, axis: Sequence[float] = (0.0, 0.0, 1.0)) -> np.ndarray:
    """Return the matrix (dim, dim) that turns points by `angle` [rad], counter-clockwise.

    `dim`: 2 (about the centre) or 3 (about `axis`, by Rodrigues' formula).
    `angle`: angle [rad].
    `axis`: direction of the axis, of any length but zero; of no meaning in 2D.

    Raises `CaseError` in 1D, or for an axis without a direction.
    """
    c, s = math.cos(angle), math.sin(angle)
    if dim == 2:
        return np.array([[c, -s], [s, c]])
    if dim != 3:
        raise CaseError("a body in 1D cannot be rotated", where="rotation")
    direction = np.asarray(axis, dtype=float)
    length = np.linalg.norm(direction)
    if direction.shape != (3,) or not (np.isfinite(length) and length > 0):
        raise CaseError("the axis of a rotation needs 3 components, not all zero", where="rotation.axis")
    x, y, z = direction / length
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + s * cross + (1 - c) * (cross @ cross)


def needed_turn(shape: Shape, matrix: np.ndarray) -> np.ndarray | None:
    """Return the part of a rotation that changes a round shape, (dim, dim); None without any.

    A ball or a disc is the same however it is turned, a solid of revolution as long as its axis points as it does. Its
    particles, which are not round, then stay mirror images across planes that are planes of symmetry of the shape.
    """
    if isinstance(shape, ALL_ROUND):
        return None
    if shape.dim != 3 or not isinstance(shape, ROUND):
        return matrix
    own = np.eye(3)["xyz".index(shape.axis)]
    now = matrix @ own
    across, along = np.cross(own, now), float(own @ now)
    size = float(np.linalg.norm(across))
    if size > 1e-12:
        return rotation_matrix(3, math.atan2(size, along), tuple(across))
    return None if along > 0.0 else rotation_matrix(3, math.pi, tuple(np.roll(own, 1)))


def rotate(filling: Filling, matrix: np.ndarray) -> Filling:
    """Return `filling` turned about its centre by `matrix` (dim, dim); its `size` stays that of the shape."""
    return replace(filling, positions=np.ascontiguousarray(filling.positions @ matrix.T))


def row(
    fillings: Sequence[Filling],
    gaps: Sequence[float],
    positions: Sequence[Sequence[float] | None],
    surfaces: Sequence[Shape | None],
    faced: Sequence[bool],
) -> np.ndarray:
    """Return the places of bodies standing in a row along x, shape (bodies, dim) [m].

    `fillings`: the bodies' particles, in the order of the row, already rotated.
    `gaps`: distance [m] from each body to the one before it in the row; of no effect for the first.
    `positions`: stated place of each body's origin [m], or None for a place in the row. A body with a stated place
        takes no place in the row.
    `surfaces`: their surfaces, turned like the particles; None for particles without a known one.
    `faced`: which bodies touch their neighbours at their outermost particles along x, because they are flat there or
        round about the row. Of two neighbours that are not both so the surfaces touch.

    Raises `CaseError` when a stated position has the wrong number of components.
    """
    dim = fillings[0].positions.shape[1] if fillings else 0
    centres = np.zeros((len(fillings), dim))
    in_row = []
    for body, position in enumerate(positions):
        if position is None:
            in_row.append(body)
        elif len(position) != dim:
            raise CaseError(f"a position has {dim} components in {dim}D, not {len(position)}", where="position")
        else:
            centres[body] = position
    if not in_row:
        return centres
    faces = [_faces(filling, surface) for filling, surface in zip(fillings, surfaces, strict=True)]
    first = in_row[0]
    if len(in_row) == 1:
        centres[first, 0] = -faces[first][0]
        return centres
    struck = in_row[1]
    inner, face = _meeting(fillings, surfaces, faced, first, struck)
    centres[struck, 0] = -face
    centres[first, 0] = -gaps[struck] - inner
    behind = faces[struck][1] - face
    for before, body in pairwise(in_row[1:]):
        inner, face = _meeting(fillings, surfaces, faced, before, body)
        # the same but for round-off where they touch at the outermost particles
        at_faces = inner == faces[before][1]
        front = (behind if at_faces else centres[before, 0] + inner) + gaps[body]
        centres[body, 0] = front - face
        behind = front + faces[body][1] - face
    return centres


def _meeting(
    fillings: Sequence[Filling], surfaces: Sequence[Shape | None], faced: Sequence[bool], one: int, other: int
) -> tuple[float, float]:
    """Return where two bodies touch, as x about the origin of the one and of the other [m]."""
    pair = [(surfaces[body], fillings[body]) for body in (one, other)]
    solids = [Solid(shape, f.positions, f.finest) for shape, f in pair if shape is not None]
    touching = touch(*solids) if len(solids) == 2 and not (faced[one] and faced[other]) else None
    if touching is not None:
        return touching
    return _faces(fillings[one], surfaces[one])[1], _faces(fillings[other], surfaces[other])[0]


def _faces(filling: Filling, surface: Shape | None) -> tuple[float, float]:
    """Return the x of a body's two faces about its origin [m]."""
    if np.ndim(filling.spacing) and surface is not None:  # graded: the last layer may be a coarse one
        low, high = surface.bounds()
        return float(low[0]), float(high[0])
    x = filling.positions[:, 0]
    return float(x.min()) - filling.finest / 2, float(x.max()) + filling.finest / 2
