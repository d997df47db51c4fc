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
    numbers = np.arange(len(positions))
    for mirror in mirrors:
        height = mirror.sign * (positions[:, mirror.axis] - mirror.at)
        dx = spacing[numbers]
        if (height < 0).any() and (height > 0).any():
            _require_symmetry(positions, mirror, float(dx.max()))
        inside = np.abs(height) <= IN_PLANE * dx
        stays = (height > 0) | inside
        positions, volumes = positions.copy(), volumes.copy()
        positions[inside, mirror.axis] = mirror.at + mirror.sign * SPLIT * dx[inside]
        volumes[inside] *= 0.5
        positions, volumes, numbers = positions[stays], volumes[stays], numbers[stays]
    return np.ascontiguousarray(positions), volumes, numbers


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
        rotated = solid.distance(np.stack([x, r * math.cos(angle), r * math.sin(angle)], axis=1))
        if np.abs(rotated - start).max() > ROUND * size:
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
    outside = np.zeros(len(positions), bool)
    for edge in edges:
        outside |= edge.distance_beyond(positions) > 0.0
    return outside


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
        excess = edge.distance_beyond(positions)
        if (excess + 1.5 * spacing < 0.0).all():
            continue
        if (np.abs(excess) < BETWEEN * spacing).any():
            raise CaseError(
                f"a row of particles lies in the edge {'xyz'[edge.axis]} = {edge.at:g}; move the edge by half a "
                f"spacing, {0.5 * float(spacing.min()):.3g}"
            )
        inside = excess < 0.0
        if not inside.any():
            raise CaseError(f"lies beyond the edge {'xyz'[edge.axis]} = {edge.at:g}; move one of them, or turn `keep`")
        positions, volumes, spacing, excess = positions[inside], volumes[inside], spacing[inside], excess[inside]
        adjacent = -excess < depth * spacing
        images = positions[adjacent].copy()
        images[:, edge.axis] = 2.0 * edge.at - images[:, edge.axis]
        grown = volumes[adjacent]
        if axisymmetric and edge.axis == 1:
            if (images[:, 1] <= 0.0).any():
                raise CaseError(f"the layer beyond the edge y = {edge.at:g} would reach the axis; move the edge out")
            grown = grown * images[:, 1] / positions[adjacent, 1]
        positions, volumes = np.concatenate([positions, images]), np.concatenate([volumes, grown])
        spacing = np.concatenate([spacing, spacing[adjacent]])
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
    height = sign * positions[:, axis]
    outer, depth = height > height.max() - ROW * spacing, spacing
    if not outer.all():
        inner = height[~outer]
        depth = float(height[outer].mean() - inner[inner > inner.max() - ROW * spacing].mean())
    row = np.rint((height[outer].mean() - height) / depth).astype(np.int64)
    outer_rows = np.flatnonzero(row < len(shares))
    areas = volumes[outer_rows] / depth
    if axisymmetric and axis == 1:
        areas *= (height[outer].mean() + 0.5 * depth) * sign / positions[outer_rows, 1]
    face = areas[row[outer_rows] == 0].sum()
    areas *= shares[np.maximum(row[outer_rows], 0)]
    return outer_rows, areas * (face / areas.sum()), depth


def row_shares(layers: np.ndarray, lateral: np.ndarray, slope: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Return the shares (rows,) of a face that the pair sums of the rows behind it lack, from the face inwards.

    Row k lacks the layers (distances `layers`, places `lateral`, see `sph.kernels.Kernel.layers`) farther than k
    spacings, each with the sum of |dW/dr| n . (x_a - x_b)/r, `slope` but for a factor. So a uniform stress and the
    traction of the face cancel at every row.
    """
    r = np.sqrt(layers[1:, None] ** 2 + lateral**2)
    lacks = np.cumsum((slope(r) * layers[1:, None] / r).sum(axis=1)[::-1])[::-1]
    return np.asarray(lacks / lacks.sum())


def _with_images(positions: np.ndarray, planes: Sequence[tuple[int, float]], reach: float) -> Arrays:
    """Return positions and those of images within `reach` of planes, the particle of each, and signs (n, dim)."""
    images = [(positions, np.arange(len(positions)), np.ones(positions.shape))]
    for axis, at in planes:
        for places, source, signs in list(images):
            adjacent = np.abs(places[:, axis] - at) < reach
            image, mirrored = places[adjacent].copy(), signs[adjacent].copy()
            image[:, axis] = 2.0 * at - image[:, axis]
            mirrored[:, axis] *= -1.0
            images.append((image, source[adjacent], mirrored))
    places, source, signs = (np.concatenate(parts) for parts in zip(*images, strict=True))
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
        outside = edge.distance_beyond(feet) > 0.0
        feet[outside, edge.axis] = edge.at
    places, source, signs = _with_images(matter, planes, reach)
    tree, counts = scipy.spatial.cKDTree(places), []
    sources: list[np.ndarray] = []
    weights: list[np.ndarray] = []
    for foot, candidates in zip(feet, tree.query_ball_point(feet, reach), strict=True):
        neighbours = np.sort(np.array(candidates or [tree.query(foot)[1]], np.int64))
        weight = (1.0 - ((places[neighbours] - foot) ** 2).sum(axis=1) / reach**2) ** 2
        counts.append(len(neighbours))
        sources.append(neighbours)
        weights.append(weight / weight.sum())
    rows = np.concatenate(sources)
    first, offset = np.cumsum([0, *counts[:-1]]), layer - feet
    normals = offset / np.linalg.norm(offset, axis=1)[:, None]
    return MigratingRows(first, source[rows], np.concatenate(weights), signs[rows], normals)
