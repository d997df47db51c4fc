"""Open edges: bodies cut at a plane, their continuation beyond it, and the faces of bodies.

A body that reaches an edge is cut there. Its outermost rows, mirrored at the plane, continue it by an ambient layer.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hvisph.core.errors import CaseError

BETWEEN = 0.2  # [spacings]: nearer than this to the edge no row may lie
ROW = 0.6  # [spacings]: so far behind the outermost particle of a face its row ends


@dataclass(frozen=True)
class Edge:
    """An edge normal to an axis."""

    axis: int  # 0, 1 or 2
    at: float  # its coordinate [m]
    sign: float = 1.0  # 1.0 where the matter lies below it, -1.0 above

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
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a body cut at open edges and continued beyond those that it reaches.

    `positions`, `volumes`, `spacing`: particles of the body, (n, dim) [m], (n,) and (n,) [m].
    `depth`: depth of the continuation in spacings; 0 for none.
    `axisymmetric`: whether particles are axisymmetric about the axis x, whose volumes grow with their radius.

    Returns positions, volumes and spacings. Raises `CaseError` when a row lies in the edge, or nothing of the body
    within it.
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

    `positions`, `volumes`, `spacing`: particles of the body (n, dim) [m] and (n,), and their spacing [m].
    `normal`: axis across which the face lies, and 1.0 or -1.0 for its direction.
    `shares`: shares of the rows from the face inwards (rows,).
    `axisymmetric`: whether particles are axisymmetric about the axis x.

    Returns indices (k,), areas (k,) [m^2, m in 2D, 1 in 1D], whose sum is the area of the face, and the depth of the
    row [m].
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
    """Return the shares of a face that the pair sums of the rows behind it lack, from the face inwards (rows,).

    Row k lacks the layers farther than k spacings, each with the sum of |dW/dr| n . (x_a - x_b)/r. With these shares a
    uniform stress and the traction of the face cancel at every row.

    `layers`, `aside`: distances of the layers of a lattice, and places within a layer, see `sph.kernels.Kernel.layers`
        [m].
    `slope`: |dW/dr| of distances, but for a factor.
    """
    r = np.sqrt(layers[1:, None] ** 2 + aside**2)
    lacks = np.cumsum((slope(r) * layers[1:, None] / r).sum(axis=1)[::-1])[::-1]
    return np.asarray(lacks / lacks.sum())


def _with_images(
    positions: np.ndarray, planes: Sequence[tuple[int, float]], reach: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
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


def follow(
    layer: np.ndarray, matter: np.ndarray, edges: Sequence[Edge], planes: Sequence[tuple[int, float]], reach: float
) -> MigratingRows:
    """Return what each place of an ambient layer follows: the mean of the matter beside the edge.

    The weight is (1 - r^2/R^2)^2 at the distance r from the point of the edge before the place, within R = `reach`.

    `layer`, `matter`: positions of the layer (k, dim) and of the matter of the same body (n, dim) [m].
    `edges`, `planes`: the edges, and the planes of symmetry as axis and coordinate [m].
    `reach`: R [m].
    """
    from scipy.spatial import cKDTree

    feet = layer.copy()
    for edge in edges:
        over = edge.distance_beyond(feet) > 0.0
        feet[over, edge.axis] = edge.at
    places, source, signs = _with_images(matter, planes, reach)
    tree, counts = cKDTree(places), []
    chosen: list[np.ndarray] = []
    weights: list[np.ndarray] = []
    for foot, beside in zip(feet, tree.query_ball_point(feet, reach), strict=True):
        near = np.sort(np.array(beside or [tree.query(foot)[1]], np.int64))
        weight = (1.0 - ((places[near] - foot) ** 2).sum(axis=1) / reach**2) ** 2
        counts.append(len(near))
        chosen.append(near)
        weights.append(weight / weight.sum())
    every = np.concatenate(chosen)
    return MigratingRows(np.cumsum([0, *counts[:-1]]), source[every], np.concatenate(weights), signs[every])
