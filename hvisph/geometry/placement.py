"""Placement of bodies in a row or at given places, their contact points, and random spheres within a body."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import pairwise

import numpy as np
import scipy

from hvisph.core.errors import CaseError
from hvisph.geometry.lattices import Filling
from hvisph.geometry.shapes import Annulus, Cylinder, Disc, HollowSphere, Nosed, Placed, Ring, Shape, Sphere, Tube

TRACES = 300
ROUNDS, POINTS = 30, 48
SHRINK = 0.7  # of the neighbourhood, from round to round
MOST_SEEDS = 20_000
NEAREST = 0.9  # [mean spacings] of particles of touching bodies


@dataclass(frozen=True)
class Solid:
    """Surface and particles of a body in the same coordinates."""

    shape: Shape  # its surface
    positions: np.ndarray  # particle centres in the same coordinates, (n, dim) [m]
    spacing: float  # their spacing [m]


def touch(first: Solid, second: Solid) -> tuple[float, float] | None:
    """Return x of the contact of bodies that approach along x, about either origin [m]; None if they pass."""
    start = max(float(first.positions[:, 0].max()), float(first.shape.bounds()[1][0])) - min(
        float(second.positions[:, 0].min()), float(second.shape.bounds()[0][0])
    )
    start += (first.spacing + second.spacing) / 2
    move = np.zeros(first.shape.dim)
    move[0] = -start
    shifted = Solid(Placed(first.shape, move), first.positions + move, first.spacing)
    distance, x = min(_shortest(shifted, second, 1.0), _shortest(second, shifted, -1.0))
    if not np.isfinite(distance):
        return None
    return x + start - min(distance, _between_particles(shifted, second)), x


def _shortest(origin: Solid, aim: Solid, sign: float) -> tuple[float, float]:
    """Return the shortest ray from the surface of `origin` to that of `aim`, and the x of its end on the right."""
    skin = origin.positions[origin.shape.distance(origin.positions) > -1.5 * origin.spacing]
    seeds = on_surface(origin.shape, skin[:: max(1, len(skin) // MOST_SEEDS)])
    if len(seeds) == 0:
        return np.inf, 0.0
    lengths = _trace(aim.shape, seeds, sign)
    best, length = seeds[np.argmin(lengths)], float(lengths.min())
    if not np.isfinite(length):
        return np.inf, 0.0
    random, reach = np.random.default_rng(0), 2 * origin.spacing
    for _ in range(ROUNDS):
        points = on_surface(origin.shape, best + reach * random.uniform(-1, 1, (POINTS, len(best))))
        if len(points):
            lengths = _trace(aim.shape, points, sign)
            if lengths.min() < length:
                best, length = points[np.argmin(lengths)], float(lengths.min())
        reach *= SHRINK
    return length, float(best[0]) + (length if sign > 0 else 0.0)


def _trace(shape: Shape, points: np.ndarray, sign: float) -> np.ndarray:
    """Return how far each of `points` is from `shape` along x, infinite where it passes by."""
    low, high = shape.bounds()
    scale = max(shape.extent())
    end = np.abs((high if sign > 0 else low)[0] - points[:, 0]) + scale
    length = np.zeros(len(points))
    running = np.arange(len(points))
    for _ in range(TRACES):
        at = points[running].copy()
        at[:, 0] += sign * length[running]
        d = shape.distance(at)
        running, d = running[d > 1e-9 * scale], d[d > 1e-9 * scale]
        length[running] += d
        running = running[length[running] <= end[running]]
        if len(running) == 0:
            break
    at = points.copy()
    at[:, 0] += sign * length
    return np.where(shape.distance(at) < 1e-5 * scale, length, np.inf)


def _between_particles(first: Solid, second: Solid) -> float:
    """Return how far the particles of `first` may move until two are `NEAREST` each other."""
    reach = NEAREST * (first.spacing + second.spacing) / 2
    skins = [solid.positions[solid.shape.distance(solid.positions) > -1.5 * solid.spacing] for solid in (first, second)]
    if len(skins[0]) == 0 or len(skins[1]) == 0:
        return np.inf
    trees = [scipy.spatial.cKDTree(skin[:, 1:]) for skin in skins]
    pairs = trees[0].query_ball_tree(trees[1], reach)
    left = np.repeat(np.arange(len(pairs)), [len(p) for p in pairs])
    if len(left) == 0:
        return np.inf
    right = np.concatenate([np.asarray(p, dtype=int) for p in pairs])
    offset = skins[1][right] - skins[0][left]
    lateral = np.minimum((offset[:, 1:] ** 2).sum(axis=1), reach**2)
    return float((offset[:, 0] - np.sqrt(reach**2 - lateral)).min())


def on_surface(shape: Shape, points: np.ndarray) -> np.ndarray:
    """Return `points` (n, dim) moved to the surface, without those that do not reach it."""
    scale = max(shape.extent())
    points = points.copy()
    for _ in range(8):
        d = shape.distance(points)
        points -= d[:, None] * shape.outward(points, 1e-7 * scale)
    return points[np.abs(shape.distance(points)) < 1e-6 * scale]


ALL_ROUND = (Disc, Annulus, Sphere, HollowSphere)
ROUND = (Cylinder, Tube, Nosed, Ring)  # about their `axis`


def rotation_matrix(dim: int, angle: float, axis: Sequence[float] = (0.0, 0.0, 1.0)) -> np.ndarray:
    """Return the matrix (dim, dim) that turns counter-clockwise by `angle` [rad] about `axis` (in 3D)."""
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
    axis = np.eye(3)["xyz".index(shape.axis)]
    rotated = matrix @ axis
    normal, cosine = np.cross(axis, rotated), float(axis @ rotated)
    size = float(np.linalg.norm(normal))
    if size > 1e-12:
        return rotation_matrix(3, math.atan2(size, cosine), tuple(normal))
    return None if cosine > 0.0 else rotation_matrix(3, math.pi, tuple(np.roll(axis, 1)))


def rotate(filling: Filling, matrix: np.ndarray) -> Filling:
    """Return `filling` rotated about its centre by `matrix` (dim, dim); its `size` remains that of the shape."""
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
    """
    dim = fillings[0].positions.shape[1] if fillings else 0
    centres = np.zeros((len(fillings), dim))
    in_row = []
    for body, position in enumerate(positions):
        if position is None:
            in_row.append(body)
        else:
            centres[body] = position
    if not in_row:
        return centres
    faces = [_faces(filling, surface) for filling, surface in zip(fillings, surfaces, strict=True)]
    first = in_row[0]
    if len(in_row) == 1:
        centres[first, 0] = -faces[first][0]
        return centres
    second = in_row[1]
    inner, face = _meeting(fillings, surfaces, faced, first, second)
    centres[second, 0] = -face
    centres[first, 0] = -gaps[second] - inner
    rear = faces[second][1] - face
    for before, body in pairwise(in_row[1:]):
        inner, face = _meeting(fillings, surfaces, faced, before, body)
        # the same but for round-off where they touch at the outermost particles
        at_faces = inner == faces[before][1]
        front = (rear if at_faces else centres[before, 0] + inner) + gaps[body]
        centres[body, 0] = front - face
        rear = front + faces[body][1] - face
    return centres


def _meeting(
    fillings: Sequence[Filling], surfaces: Sequence[Shape | None], faced: Sequence[bool], left: int, right: int
) -> tuple[float, float]:
    """Return where two bodies touch, as x about the origin of the one and of the other [m]."""
    pair = [(surfaces[body], fillings[body]) for body in (left, right)]
    solids = [Solid(shape, f.positions, f.finest) for shape, f in pair if shape is not None]
    touching = touch(*solids) if len(solids) == 2 and not (faced[left] and faced[right]) else None
    if touching is not None:
        return touching
    return _faces(fillings[left], surfaces[left])[1], _faces(fillings[right], surfaces[right])[0]


def _faces(filling: Filling, surface: Shape | None) -> tuple[float, float]:
    """Return the x of a body's two faces about its origin [m]."""
    if np.ndim(filling.spacing) and surface is not None:  # graded: the last layer may be a coarse one
        low, high = surface.bounds()
        return float(low[0]), float(high[0])
    x = filling.positions[:, 0]
    return float(x.min()) - filling.finest / 2, float(x.max()) + filling.finest / 2


TRIES = 4000  # places that are drawn for a sphere before it is said not to fit
AT_ONCE = 200


def draw_diameters(
    limits: tuple[float, float], exponent: float, dim: int, total: float, generator: np.random.Generator
) -> np.ndarray:
    """Return diameters [m], falling, whose spheres (discs in 2D) have at most the volume `total` [m^dim]."""
    low, high = limits
    diameters: list[float] = []
    filled = 0.0
    while True:
        u = generator.random()
        d = low * (1.0 - u * (1.0 - (high / low) ** exponent)) ** (1.0 / exponent) if exponent else high
        volume = ball_volume(d, dim)
        if filled + volume > total:
            return np.sort(np.array(diameters))[::-1]
        filled += volume
        diameters.append(d)


def ball_volume(diameter: float, dim: int) -> float:
    """Return the volume of a sphere, or the area of a disc [m^dim]."""
    return float(np.pi * diameter**dim / (6.0 if dim == 3 else 4.0))


def place_spheres(
    shape: Shape, limits: tuple[float, float], exponent: float, share: float, seed: int, name: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return centres (k, dim) and diameters (k,) [m] of spheres in a shape; `CaseError` where they do not fit."""
    words = np.frombuffer(sha256(name.encode()).digest()[:16], np.uint32)
    generator = np.random.Generator(np.random.PCG64([seed, *map(int, words)]))
    diameters = draw_diameters(limits, exponent, shape.dim, share * shape.volume, generator)
    if not len(diameters):
        raise CaseError(
            f"a volume of {share:g} holds no sphere of the diameters drawn; enlarge it or give smaller ones"
        )
    low, high = shape.bounds()
    centres = np.zeros((0, shape.dim))
    for number, d in enumerate(diameters):
        for _ in range(TRIES // AT_ONCE):
            places = low + generator.random((AT_ONCE, shape.dim)) * (high - low)
            free = shape.distance(places) <= -0.5 * d
            distance = np.sqrt(((places[:, None] - centres[None]) ** 2).sum(axis=2))
            free &= (distance >= 0.5 * (d + diameters[:number])).all(axis=1)
            if free.any():
                centres = np.vstack([centres, places[np.argmax(free)]])
                break
        else:
            filled = sum(ball_volume(diameter, shape.dim) for diameter in diameters[:number]) / shape.volume
            raise CaseError(
                f"there is no free place for a sphere of {d:.3g} after {number} of {len(diameters)}, which "
                f"fill {filled:.3g}; give a smaller volume or smaller diameters"
            )
    return centres, diameters


def owner_of(positions: np.ndarray, centres: np.ndarray, diameters: np.ndarray) -> np.ndarray:
    """Return which sphere holds each point (n,); -1 for none."""
    owner = np.full(len(positions), -1)
    for number, (centre, d) in enumerate(zip(centres, diameters, strict=True)):
        owner[((positions - centre) ** 2).sum(axis=1) < 0.25 * d * d] = number
    return owner
