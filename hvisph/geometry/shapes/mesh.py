"""Closed triangle surfaces: STL, OBJ and other formats of `trimesh` (`pip install hvisph[mesh]`).

A point is inside where a ray towards +x crosses the surface an odd number of times. Triangles are sorted into bins
of the y-z plane. A ray that hits an edge or a corner is moved aside by an infinitesimal amount, first along
y, then along z, by the signs alone: two triangles with an edge in common are never both hit nor both missed.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from hvisph.core.errors import CaseError

from .shape import Shape, grid

AT_ONCE = 1_000_000  # pairs of ray and triangle at once, 200 bytes each
MOST_SAMPLES = 100_000  # points on the surface from which distances are taken, at most
# Rays each way that look for what lies within a surface twice, and how close faces of its size touch.
RAYS, TOUCHING = 150, 1e-7
# How much farther than the nearest of them one may be that is taken for it: a search deep inside would look at all.
SLACK = 0.1


@dataclass(frozen=True, eq=False)
class Mesh(Shape):
    """A solid within a closed surface of triangles (3D), in the coordinates of its file."""

    corners: np.ndarray  # corners of the triangles, (n, 3, 3) [m]
    volume_within: float  # enclosed volume [m^3]
    name: str = "mesh"  # name in messages

    dim = 3

    @property
    def kind(self) -> str:
        return "mesh"

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))

    @property
    def volume(self) -> float:
        return self.volume_within

    @property
    def thickness(self) -> float:
        """Mean thickness of walls [m]: twice the volume over the surface; of a compact body a third of its size."""
        first, second = self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0]
        return 4.0 * self.volume_within / float(np.linalg.norm(np.cross(first, second), axis=1).sum())

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Tell which `points` (n, 3) [m] lie inside: booleans of shape (n,)."""
        points = np.asarray(points, dtype=float)
        inside = np.zeros(len(points), bool)
        for batch, ray, x, _ in self._crossings(points[:, 1:]):
            crossed = ray[x > points[batch[ray], 0]]
            inside[batch] = np.bincount(crossed, minlength=len(batch)) % 2 == 1
        return inside

    def contains_grid(self, axes: list[np.ndarray]) -> np.ndarray:
        """Tell which nodes of a lattice lie inside, from one ray for each of its rows along x: (nodes,)."""
        rows = grid(axes[1:])
        crossings = np.zeros((len(axes[0]) + 1, len(rows)), np.int32)
        for batch, ray, x, _ in self._crossings(rows):
            np.add.at(crossings, (np.searchsorted(axes[0], x), batch[ray]), 1)
        # a node is inside where an odd number of crossings lies ahead of it
        count = np.cumsum(crossings[::-1], axis=0)[::-1][1:]
        return np.asarray(count % 2 == 1).ravel()

    def inconsistent_point(self) -> np.ndarray | None:
        """Return a point (3,) [m] that the surface encloses twice or with inverted normals; None if there is none."""
        low, high = self.bounds()
        size = float((high - low).max())
        steps = (np.arange(RAYS) + 0.4142) / RAYS
        rows = grid([low[k] + steps * (high[k] - low[k]) for k in (1, 2)])
        for batch, ray, x, enters in self._crossings(rows):
            # faces that touch are left before they are entered
            order = np.lexsort((x + np.where(enters, TOUCHING, -TOUCHING) * size, ray))
            ray, x, enters = ray[order], x[order], enters[order]
            depth = np.cumsum(np.where(enters, 1, -1))  # each ray begins and ends outside
            wrong = np.flatnonzero((depth < 0) | (depth > 1))
            if len(wrong):
                k = wrong[0]
                return np.array([0.5 * (x[k] + x[min(k + 1, len(x) - 1)]), *rows[batch[ray[k]]]])
        return None

    def _crossings(self, rays: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
        """Yield, for batches of rays along x through (y, z), ray numbers, crossings, their x, whether they enter."""
        bins = self._bins
        cell = bins.bin_of(rays)
        candidates = np.flatnonzero(bins.counts[cell] > 0)
        ends = np.cumsum(bins.counts[cell[candidates]])
        start = 0
        while start < len(candidates):
            total = ends[start - 1] if start else 0
            stop = max(start + 1, int(np.searchsorted(ends, total + AT_ONCE, "right")))
            batch = candidates[start:stop]
            yield batch, *self._intersect(rays[batch], cell[batch])
            start = stop

    def _intersect(self, rays: np.ndarray, cell: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the ray of each crossing with a triangle, its x, and whether the ray enters there."""
        bins = self._bins
        counts = bins.counts[cell]
        ray = np.repeat(np.arange(len(rays)), counts)
        rank = np.arange(len(ray)) - np.repeat(np.cumsum(counts) - counts, counts)
        t = self.corners[bins.members[bins.first[cell][ray] + rank]]
        p = rays[ray]
        sides = np.stack([_side(t[:, k], t[:, (k + 1) % 3], p) for k in range(3)])
        hit = (sides[0] == sides[1]) & (sides[1] == sides[2])
        p, t = p[hit], t[hit]
        normal = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
        x = t[:, 0, 0] - ((p - t[:, 0, 1:]) * normal[:, 1:]).sum(axis=1) / normal[:, 0]
        return ray[hit], x, normal[:, 0] < 0

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return signed distances (n,) [m], exact in sign, in size to half the spacing of points of the surface."""
        distance, _, height = self._nearest_sample(points)
        # beside a sample of a flat face the distance to the face, farther away that to the sample
        size = np.where(self._is_near_face(distance), np.abs(height), distance / (1 + SLACK) - self._sample_spacing / 2)
        return np.where(self.contains(points), -size, size)

    def outward(self, points: np.ndarray, step: float) -> np.ndarray:
        """Return unit vectors (n, 3) along which the distance to the surface grows; of a mesh without a `step`."""
        distance, (offset, normals), height = self._nearest_sample(points)
        ways = np.where(
            self._is_near_face(distance)[:, None],
            np.sign(height)[:, None] * normals,
            offset / np.maximum(distance, 1e-300)[:, None],
        )
        return np.where(self.contains(points)[:, None], -ways, ways)

    def _nearest_sample(self, points: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray], np.ndarray]:
        """Return distance (n,) and vector from the nearest sample, its normal, (n, 3) each, and their product (n,)."""
        samples, normals, tree = self._surface
        distance, nearest = tree.query(points, eps=SLACK)
        offset, facing = points - samples[nearest], normals[nearest]
        return distance, (offset, facing), (offset * facing).sum(axis=1)

    def _is_near_face(self, distance: np.ndarray) -> np.ndarray:
        """Return which distances to a sample belong to points next to its face."""
        return np.asarray(distance < self._sample_spacing * 2)

    @cached_property
    def _bins(self) -> "_Bins":
        return _Bins(self.corners[:, :, 1:])

    @cached_property
    def _sample_spacing(self) -> float:
        edges = np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])
        area = np.sqrt((edges**2).sum(axis=1)).sum() / 2
        return float(max(np.sqrt(area / MOST_SAMPLES), max(self.extent()) / 1000))

    @cached_property
    def _surface(self) -> tuple[np.ndarray, np.ndarray, Any]:
        edges = self.corners[:, 1:] - self.corners[:, :1]
        normals = np.cross(edges[:, 0], edges[:, 1])
        area = np.sqrt((normals**2).sum(axis=1)) / 2
        counts = np.maximum(1, np.rint(area / self._sample_spacing**2)).astype(int)
        owner = np.repeat(np.arange(len(counts)), counts)
        rank = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
        # a sequence of low discrepancy, folded into the triangle
        u = (0.5 + (rank + 1) * 0.7548776662466927) % 1.0
        v = (0.5 + (rank + 1) * 0.5698402909980532) % 1.0
        fold = u + v > 1
        u, v = np.where(fold, 1 - u, u), np.where(fold, 1 - v, v)
        samples = self.corners[owner, 0] + u[:, None] * edges[owner, 0] + v[:, None] * edges[owner, 1]
        unit = normals / np.maximum(2 * area, 1e-300)[:, None]
        return samples, unit[owner], scipy.spatial.cKDTree(samples)


class _Bins:
    """Triangles by the bins of the y-z plane that their boxes touch."""

    def __init__(self, corners: np.ndarray):
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        self.side = int(np.clip(np.sqrt(len(corners)), 1, 2048))
        self.low, self.step = low, (high - low) / self.side
        begin = self._index(corners.min(axis=1))
        span = self._index(corners.max(axis=1)) - begin + 1
        counts = span.prod(axis=1)
        triangle = np.repeat(np.arange(len(corners)), counts)
        rank = np.arange(len(triangle)) - np.repeat(np.cumsum(counts) - counts, counts)
        at = begin[triangle] + np.stack([rank // span[triangle, 1], rank % span[triangle, 1]], axis=1)
        flat = at[:, 0] * self.side + at[:, 1]
        order = np.argsort(flat, kind="stable")
        self.members = triangle[order]
        self.counts = np.append(np.bincount(flat, minlength=self.side**2), 0)  # the last: outside of all
        self.first = np.cumsum(self.counts) - self.counts

    def _index(self, points: np.ndarray) -> np.ndarray:
        return np.clip(np.floor((points - self.low) / self.step), 0, self.side - 1).astype(int)

    def bin_of(self, points: np.ndarray) -> np.ndarray:
        """Return the bin of each of `points` (n, 2)."""
        out = ((points < self.low) | (points > self.low + self.step * self.side)).any(axis=1)
        at = self._index(points)
        return np.where(out, self.side**2, at[:, 0] * self.side + at[:, 1])


def _side(a: np.ndarray, b: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Tell on which side of the edge a -> b the ray through `p` (n, 2) passes, the same for b -> a but for the sign."""
    swapped = (a[:, 1] > b[:, 1]) | ((a[:, 1] == b[:, 1]) & (a[:, 2] > b[:, 2]))
    start, end = np.where(swapped[:, None], b, a), np.where(swapped[:, None], a, b)
    dy, dz = end[:, 1] - start[:, 1], end[:, 2] - start[:, 2]
    value = dy * (p[:, 1] - start[:, 2]) - dz * (p[:, 0] - start[:, 1])
    value = np.where(value == 0, np.where(dz == 0, dy, -dz), value)
    return (value > 0) != swapped


def load_mesh(path: str | Path, scale: float = 1.0) -> Mesh:
    """Return the solid in a file, `scale` in m; `CaseError` says where it is open, or why it is unreadable."""
    if not Path(path).is_file():
        raise CaseError(f"there is no file '{path}'", where="file")
    try:
        import trimesh
    except ImportError:
        raise CaseError("meshes need trimesh: pip install 'hvisph[mesh]'", where="type") from None
    try:
        loaded: Any = trimesh.load(path, force="mesh")
    except Exception as error:  # trimesh lets whatever its readers meet through
        raise CaseError(f"'{path}' cannot be read as a mesh: {error}", where="file") from None
    if len(loaded.faces) == 0:
        raise CaseError(f"'{path}' holds no triangles", where="file")
    loaded.merge_vertices()
    if not loaded.is_watertight:
        raise CaseError(_open(path, loaded), where="file")
    if loaded.volume < 0:
        loaded.invert()
    solid = Mesh(np.asarray(loaded.triangles, float) * scale, float(loaded.volume) * scale**3, Path(path).name)
    point = solid.inconsistent_point()
    if point is not None:
        at = ", ".join(f"{c:.4g}" for c in point / scale)
        raise CaseError(
            f"parts of the surface in '{path}' overlap, or one of them is inside out, as near ({at}): neither volume "
            "nor inside is certain; unite them in the CAD program, or give each as a mesh of its own in a `union`",
            where="file",
        )
    return solid


def _open(path: str | Path, mesh: Any) -> str:
    """Return where a surface is open."""
    edges = np.sort(np.asarray(mesh.edges_sorted), axis=1)
    unique, counts = np.unique(edges, axis=0, return_counts=True)
    open_edges = unique[counts != 2]
    at = np.asarray(mesh.vertices)[open_edges].mean(axis=1)
    if len(at) == 0:
        return f"the surface in '{path}' is not closed: its triangles face different ways; repair it in the CAD program"
    low, high = at.min(axis=0), at.max(axis=0)
    first = ", ".join(f"{c:.4g}" for c in at[0])
    box = " to ".join("(" + ", ".join(f"{c:.4g}" for c in corner) + ")" for corner in (low, high))
    return (
        f"the surface in '{path}' is not closed: {len(at)} edges do not join two triangles, the first near ({first}), "
        f"all within {box}; close it in the CAD program"
    )
