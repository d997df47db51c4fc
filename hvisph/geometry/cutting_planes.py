"""Bodies cut at planes of symmetry and at open edges, their faces, and half-plane sections of solids of revolution.

A particle at (x, r) of a section is a torus of the volume 2 pi r A, where A is its share of the section. Rows are
at r = dx/2, 3 dx/2, ... from the axis, and their volumes add up to that of the solid.

A plane of symmetry through a body must be one of its particles, too. Particles on the far side are left out; a row in
the plane itself is split: half its mass stays, a quarter of a spacing from the plane, and the other half is in its
image. So a half, a quarter and an eighth have exactly this share of the mass.

A body that reaches an open edge is cut there. Its outermost rows, mirrored at the plane, continue it by a layer.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from hvisph.core.errors import CaseError
from hvisph.geometry.filling import fill
from hvisph.geometry.lattices import Filling, Grading, fill_graded
from hvisph.geometry.shapes import Cylinder, Ring, Shape, Tube
from hvisph.geometry.shapes.combinations import Measured

IN_PLANE = 0.05  # [spacings]: nearer than this a particle lies in the plane
SPLIT = 0.25  # [spacings]: from the plane to what stays of a row in it
OFF = 0.02  # [spacings]: how far a particle's image may be from a particle
MOST_COMPARED = 20_000
Arrays = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Plane:
    """A plane normal to an axis: of symmetry, or an open edge."""

    axis: int  # 0, 1 or 2: the plane is normal to x, y or z
    at: float  # its coordinate [m]
    sign: float = 1.0


@dataclass(frozen=True)
class Mirror(Plane):
    """A plane of symmetry; `sign` is 1.0 where coordinates above it are kept, -1.0 below."""


def crosses(low: np.ndarray, high: np.ndarray, mirror: Mirror, spacing: float) -> bool:
    """Whether the plane passes through the box from `low` to `high` rather than along its face."""
    margin = IN_PLANE * spacing
    return bool(low[mirror.axis] + margin < mirror.at < high[mirror.axis] - margin)


def cut(positions: np.ndarray, volumes: np.ndarray, spacing: np.ndarray, mirrors: Sequence[Mirror]) -> Arrays:
    """Return positions (n, dim), volumes (n,) and numbers of the particles that planes of symmetry keep.

    `spacing` is (n,) [m]. Raises `CaseError` when a plane passes through a body that is not symmetric about it.
    """
    kept = np.arange(len(positions))
    for mirror in mirrors:
        along = mirror.sign * (positions[:, mirror.axis] - mirror.at)
        near = spacing[kept]
        if (along < 0).any() and (along > 0).any():
            _require_symmetry(positions, mirror, float(near.max()))
        inside = np.abs(along) <= IN_PLANE * near
        stays = (along > 0) | inside
        positions, volumes = positions.copy(), volumes.copy()
        positions[inside, mirror.axis] = mirror.at + mirror.sign * SPLIT * near[inside]
        volumes[inside] *= 0.5
        positions, volumes, kept = positions[stays], volumes[stays], kept[stays]
    return np.ascontiguousarray(positions), volumes, kept


def _require_symmetry(positions: np.ndarray, mirror: Mirror, spacing: float) -> None:
    images = positions[:: max(1, len(positions) // MOST_COMPARED)].copy()
    images[:, mirror.axis] = 2 * mirror.at - images[:, mirror.axis]
    distance, _ = scipy.spatial.cKDTree(positions, balanced_tree=False, compact_nodes=False).query(images)
    if distance.max() > OFF * spacing:
        axis = "xyz"[mirror.axis]
        raise CaseError(
            f"the symmetry plane {axis} = {mirror.at:g} passes through this body, whose particles are not mirror "
            "images across it: put the body's middle on the plane or all of it on one side, turn it by right "
            "angles only, and use an arrangement that is symmetric (square, cubic, relaxed); or leave the plane out",
            where="symmetry",
        )


ROUND = 1e-6  # [size]: how much the distance to a solid of revolution may change round the axis


@dataclass(frozen=True)
class Section(Measured):
    """Half-plane section (x, r >= 0) of a solid; raises `CaseError` unless it is one of revolution about x."""

    solid: Shape

    def __post_init__(self) -> None:
        require_revolved(self.solid)

    @property
    def dim(self) -> int:
        return 2

    @property
    def kind(self) -> str:
        return self.solid.kind

    @property
    def flat_axes(self) -> tuple[int, ...]:
        solid = self.solid
        round_wall = isinstance(solid, Cylinder | Tube) or (isinstance(solid, Ring) and 1 in solid.section.flat_axes)
        return (*(axis for axis in solid.flat_axes if axis == 0), *((1,) if round_wall else ()))

    @property
    def wall_axes(self) -> tuple[int, ...]:
        """The radius, where the solid reaches to the axis."""
        return (1,) if self.bounds()[0][1] == 0.0 else ()

    @property
    def radial_axes(self) -> tuple[int, ...]:
        """The radius."""
        return (1,)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        low, high = self.solid.bounds()
        inner = 0.0
        if isinstance(self.solid, Tube):
            inner = self.solid.inner_diameter / 2
        elif isinstance(self.solid, Ring):
            inner = max(0.0, float(self.solid.section.bounds()[0][1]) + self.solid.radius)
        return np.array([low[0], inner]), np.array([high[0], high[1]])

    def distance(self, points: np.ndarray) -> np.ndarray:
        in_space = np.concatenate([points, np.zeros((len(points), 1))], axis=1)
        return np.maximum(self.solid.distance(in_space), -points[:, 1])


def require_revolved(solid: Shape) -> None:
    """Raise `CaseError` unless `solid` is a solid of revolution about x."""
    low, high = solid.bounds()
    size = float((high - low).max())
    random = np.random.default_rng(0)
    x = random.uniform(low[0], high[0], 400)
    r = random.uniform(0.0, max(high[1], high[2]), 400)
    start = solid.distance(np.stack([x, r, np.zeros(400)], axis=1))
    for angle in (0.7, 1.9, 3.4, 5.1):
        turned = solid.distance(np.stack([x, r * math.cos(angle), r * math.sin(angle)], axis=1))
        if np.abs(turned - start).max() > ROUND * size:
            raise CaseError(
                f"the {solid.kind} is no solid of revolution about the x axis; take a cylinder for a plate, a tube or "
                "ring off the axis, and leave out what turns or moves it off the axis",
                where="shape",
            )


def fill_section(
    solid: Shape,
    arrangement: str | None,
    dx: float,
    *,
    exact: bool = True,
    even: tuple[int, ...] = (),
    grading: Grading | None = None,
) -> Filling:
    """Fill the half-plane section of a solid of revolution about x; see `hvisph.geometry.filling.fill`.

    With `grading` the spacing grows in a section that flat faces bound. Returns positions (x, r) (n, 2) [m] and volumes
    of the tori [m^3]. Raises `CaseError` for a solid that changes round the axis or cannot be filled.
    """
    section = Section(solid)
    if grading is not None:
        filling = fill_graded(section, dx, grading, even)
    else:
        filling = fill(section, arrangement, dx, exact=exact, even=even)
    rings = 2 * math.pi * filling.positions[:, 1] * filling.volumes
    return replace(filling, volumes=rings * (solid.volume / rings.sum()) if exact else rings)


BETWEEN = 0.2  # [spacings]: nearer than this to the edge no row may lie
ROW = 0.6  # [spacings]: so far behind the outermost particle of a face its row ends


@dataclass(frozen=True)
class Edge(Plane):
    """An open edge; `sign` is 1.0 where the matter lies below it, -1.0 above."""

    def distance_beyond(self, positions: np.ndarray) -> np.ndarray:
        """Return the signed distance of positions (n, dim) [m] beyond the edge [m]."""
        return np.asarray(self.sign * (positions[:, self.axis] - self.at))


def is_beyond(edges: Sequence[Edge], positions: np.ndarray) -> np.ndarray:
    """Return which positions (n, dim) [m] lie beyond any of the edges (n,)."""
    beyond = np.zeros(len(positions), bool)
    for edge in edges:
        beyond |= edge.distance_beyond(positions) > 0.0
    return beyond


def cut_open(
    positions: np.ndarray,
    volumes: np.ndarray,
    spacing: np.ndarray,
    edges: Sequence[Edge],
    depth: float,
    axisymmetric: bool,
) -> Arrays:
    """Return positions, volumes and spacings of a body cut at open edges and continued by `depth` spacings beyond.

    Volumes of axisymmetric particles grow with their radius. Raises `CaseError` when a row lies in the edge, or nothing
    of the body within it.
    """
    for edge in edges:
        beyond = edge.distance_beyond(positions)
        if (beyond + 1.5 * spacing < 0.0).all():
            continue
        if (np.abs(beyond) < BETWEEN * spacing).any():
            raise CaseError(
                f"a row of particles lies in the edge {'xyz'[edge.axis]} = {edge.at:g}; move the edge by half a "
                f"spacing, {0.5 * float(spacing.min()):.3g}"
            )
        inside = beyond < 0.0
        if not inside.any():
            raise CaseError(f"lies beyond the edge {'xyz'[edge.axis]} = {edge.at:g}; move one of them, or turn `keep`")
        positions, volumes, spacing, beyond = positions[inside], volumes[inside], spacing[inside], beyond[inside]
        near = -beyond < depth * spacing
        made = positions[near].copy()
        made[:, edge.axis] = 2.0 * edge.at - made[:, edge.axis]
        grown = volumes[near]
        if axisymmetric and edge.axis == 1:
            if (made[:, 1] <= 0.0).any():
                raise CaseError(f"the layer beyond the edge y = {edge.at:g} would reach the axis; move the edge out")
            grown = grown * made[:, 1] / positions[near, 1]
        positions, volumes = np.concatenate([positions, made]), np.concatenate([volumes, grown])
        spacing = np.concatenate([spacing, spacing[near]])
    return np.ascontiguousarray(positions), volumes, spacing


def face_areas(
    positions: np.ndarray,
    volumes: np.ndarray,
    spacing: float,
    normal: tuple[int, float],
    shares: np.ndarray,
    axisymmetric: bool,
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the outermost rows of a body behind its face, and the share of the face of each particle.

    `normal` is the axis across which the face lies with its sign, `shares` (rows,) are those of the rows from the face
    inwards. Returns indices (k,), areas (k,) [m^2, m in 2D, 1 in 1D], whose sum is that of the face, and the row's
    depth [m].
    """
    axis, sign = normal
    along = sign * positions[:, axis]
    outer, depth = along > along.max() - ROW * spacing, spacing
    if not outer.all():
        behind = along[~outer]
        depth = float(along[outer].mean() - behind[behind > behind.max() - ROW * spacing].mean())
    row = np.rint((along[outer].mean() - along) / depth).astype(np.int64)
    some = np.flatnonzero(row < len(shares))
    areas = volumes[some] / depth
    if axisymmetric and axis == 1:
        areas *= (along[outer].mean() + 0.5 * depth) * sign / positions[some, 1]
    face = areas[row[some] == 0].sum()
    areas *= shares[np.maximum(row[some], 0)]
    return some, areas * (face / areas.sum()), depth


def row_shares(layers: np.ndarray, aside: np.ndarray, slope: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Return the shares (rows,) of a face that the pair sums of the rows behind it lack, from the face inwards.

    Row k lacks the layers (distances `layers`, places `aside`, see `sph.kernels.Kernel.layers`) farther than k
    spacings, each with the sum of |dW/dr| n . (x_a - x_b)/r, `slope` but for a factor. So a uniform stress and the
    traction of the face cancel at every row.
    """
    r = np.sqrt(layers[1:, None] ** 2 + aside**2)
    lacks = np.cumsum((slope(r) * layers[1:, None] / r).sum(axis=1)[::-1])[::-1]
    return np.asarray(lacks / lacks.sum())


def _with_images(positions: np.ndarray, planes: Sequence[tuple[int, float]], reach: float) -> Arrays:
    """Return positions and those of images within `reach` of planes, the particle of each, and signs (n, dim)."""
    found = [(positions, np.arange(len(positions)), np.ones(positions.shape))]
    for axis, at in planes:
        for places, source, signs in list(found):
            near = np.abs(places[:, axis] - at) < reach
            image, turned = places[near].copy(), signs[near].copy()
            image[:, axis] = 2.0 * at - image[:, axis]
            turned[:, axis] *= -1.0
            found.append((image, source[near], turned))
    places, source, signs = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return places, source, signs


@dataclass(frozen=True)
class MigratingRows:
    """Particles that the places of a layer follow, as terms of means."""

    starts: np.ndarray  # first term of each place (k,)
    source: np.ndarray  # particle of each term (n,)
    weight: np.ndarray  # its weight (n,)
    signs: np.ndarray  # its signs (n, dim), negative along the normal of the plane of symmetry whose image it is
    normals: np.ndarray  # outward unit vector of each place from the point of the edge before it (k, dim)


def follow(
    layer: np.ndarray, matter: np.ndarray, edges: Sequence[Edge], planes: Sequence[tuple[int, float]], reach: float
) -> MigratingRows:
    """Return what each place (k, dim) of an ambient layer follows: the mean of the matter (n, dim) beside the edge.

    The weight is (1 - r^2/R^2)^2 at the distance r from the point of the edge before the place, within R = `reach`;
    `planes` are those of symmetry, axis and coordinate [m].
    """
    feet = layer.copy()
    for edge in edges:
        over = edge.distance_beyond(feet) > 0.0
        feet[over, edge.axis] = edge.at
    places, source, signs = _with_images(matter, planes, reach)
    tree, counts = scipy.spatial.cKDTree(places), []
    chosen: list[np.ndarray] = []
    weights: list[np.ndarray] = []
    for foot, beside in zip(feet, tree.query_ball_point(feet, reach), strict=True):
        near = np.sort(np.array(beside or [tree.query(foot)[1]], np.int64))
        weight = (1.0 - ((places[near] - foot) ** 2).sum(axis=1) / reach**2) ** 2
        counts.append(len(near))
        chosen.append(near)
        weights.append(weight / weight.sum())
    every = np.concatenate(chosen)
    first, away = np.cumsum([0, *counts[:-1]]), layer - feet
    normals = away / np.linalg.norm(away, axis=1)[:, None]
    return MigratingRows(first, source[every], np.concatenate(weights), signs[every], normals)
