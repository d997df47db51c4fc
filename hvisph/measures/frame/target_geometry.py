"""A layer's geometry before it was struck: its normal, its faces, where the shot line enters, its edges."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

PLATE_LIKE = 0.5  # a body is a plate where its least extent is below this share of the next
ALIGNED = 1e-7  # directions that differ by less are one
RIM = 0.9  # of the way from the shot line to the layer's edges: what is further out the impact leaves alone
DIRECTIONS = np.round([[np.cos(a), np.sin(a)] for a in np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)], 15)


@dataclass(frozen=True)
class Plate:
    """A layer before it was struck, in the axes of the shot: x along the shot line.

    Parameters
    ----------
    body
        Index of the body.
    basis
        Orthonormal rows (dim, dim): the normal, on the side that the shot flies to, and directions in the plane.
    front
        Coordinate along the normal of the struck face, half a spacing before its particles [m].
    thickness
        Along the normal, at the shot line [m].
    entry
        Intersection of the shot line with the struck face, coordinates in the plane (dim - 1) [m].
    low, high
        Outermost particles from there, in the plane, (dim - 1) [m].
    edges
        In 3D: how far its particles reach from the entry in each of `DIRECTIONS` in the plane [m], which a disc or a
        turned box fills less than the box of `low` and `high`; empty in 1D and 2D.
    open
        Whether a way led through it before it was struck: a mesh, a honeycomb, a plate with holes or of several parts.
    clear
        Whether none of it was in the projectile's way along the shot line.
    pieces
        Of how many connected groups it was.
    """

    body: int
    basis: tuple[tuple[float, ...], ...]
    front: float
    thickness: float
    entry: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    edges: tuple[float, ...] = ()
    open: bool = False
    clear: bool = False
    pieces: int = 1

    @property
    def obliquity(self) -> float:
        """Angle between the shot line and the normal [rad]."""
        return float(np.arccos(np.clip(self.basis[0][0], -1.0, 1.0)))

    def depth(self, position: np.ndarray) -> np.ndarray:
        """Return how far behind the struck face, along the normal, points (n, dim) are [m]."""
        return np.asarray(position @ np.array(self.basis[0]) - self.front)

    def in_plane(self, position: np.ndarray) -> np.ndarray:
        """Return coordinates in the plane (n, dim - 1) from where the shot line enters [m]."""
        return np.asarray(position @ np.array(self.basis[1:]).reshape(-1, position.shape[1]).T - np.array(self.entry))

    def outward(self, across: np.ndarray) -> np.ndarray:
        """Return how far (n,) of the way from the shot line to the edges points in the plane are; 1 is on an edge."""
        if across.shape[1] == 0:
            return np.zeros(len(across))
        if self.edges:
            share = np.zeros(len(across))
            for direction, distance in zip(DIRECTIONS, self.edges, strict=True):
                if distance > 0.0:
                    np.maximum(share, across @ direction / distance, out=share)
            return share
        reach = np.where(across > 0.0, self.high, -np.array(self.low))
        share = np.divide(np.abs(across), reach, out=np.zeros_like(across), where=reach > 0.0)
        return np.asarray(share.max(axis=1))

    def is_beyond(self, across: np.ndarray, share: float) -> np.ndarray:
        """Return whether points in the plane are a `share` of the way to the edges or further out, shape (n,)."""
        out = np.ones(len(across), dtype=bool)
        if self.edges and min(self.edges) > 0.0:  # what is nearer than the nearest edge is not
            out = (across**2).sum(axis=1) >= (share * min(self.edges) * (1.0 - 1e-9)) ** 2
        out[out] = self.outward(across[out]) >= share
        return np.asarray(out)

    def as_dict(self) -> dict[str, Any]:
        """Return the plain form for the metadata of snapshots."""
        return asdict(self)

    @classmethod
    def from_dict(cls, plain: dict[str, Any]) -> Plate:
        """Return what `as_dict` was made from."""
        rows = tuple(tuple(map(float, row)) for row in plain["basis"])
        entry, low, high, edges = (tuple(map(float, plain.get(key, ()))) for key in ("entry", "low", "high", "edges"))
        return cls(int(plain["body"]), rows, float(plain["front"]), float(plain["thickness"]), entry, low, high, edges,
                   bool(plain.get("open")), bool(plain.get("clear")), int(plain.get("pieces", 1)))  # fmt: skip


def plate_of(body: int, position: np.ndarray, axis: np.ndarray, spacing: float) -> Plate:
    """Return the geometry of a layer from its initial positions (n, dim) in the axes of the shot [m].

    `axis` are the lateral coordinates of the shot line (dim - 1), `spacing` is dx [m].
    """
    basis = _basis(_normal(position, spacing))
    normal = basis[0]
    depth, flat = position @ normal, position @ basis[1:].T
    middle = 0.5 * (depth.min() + depth.max())
    off = np.sqrt(((flat - _crossing(basis, axis, middle)) ** 2).sum(axis=1))
    # as thick as it is along the shot line; one that the line misses, as a whole
    near = depth[off <= off.min() + 1.5 * spacing]
    front = float(near.min() - 0.5 * spacing)
    entry = _crossing(basis, axis, front)
    return Plate(body, _rows(basis), front, float(np.ptp(near) + spacing), tuple(entry.tolist()),
                 tuple((flat - entry).min(axis=0).tolist()), tuple((flat - entry).max(axis=0).tolist()),
                 outline(flat - entry))  # fmt: skip


def outline(flat: np.ndarray) -> tuple[float, ...]:
    """Return how far points in a plane (n, 2) reach in each of `DIRECTIONS` [m]; nothing on a line."""
    if flat.shape[1] != 2:
        return ()
    return tuple(float((flat @ direction).max()) for direction in DIRECTIONS)


def _crossing(basis: np.ndarray, axis: np.ndarray, depth: float) -> np.ndarray:
    """Return where in the plane at `depth` the shot line crosses it."""
    x = (depth - basis[0, 1:] @ axis) / basis[0, 0]
    return np.asarray(basis[1:] @ np.concatenate([[x], axis]))


def _normal(position: np.ndarray, spacing: float) -> np.ndarray:
    """Return a plate's normal on the side that the shot flies to; x for what is no plate, or is grazed."""
    dim = position.shape[1]
    along = np.eye(dim)[0]
    if dim == 1 or len(position) <= dim:
        return along
    centred = position - position.mean(axis=0)
    vectors = np.linalg.eigh(centred.T @ centred)[1]
    extents = np.ptp(centred @ vectors, axis=0) + spacing
    normal = vectors[:, 0]
    if extents[0] > PLATE_LIKE * extents[1:].min() or abs(normal[0]) < 0.02:
        return along
    normal = normal * np.sign(normal[0])
    return along if np.abs(normal - along).max() < ALIGNED else normal


def _basis(normal: np.ndarray) -> np.ndarray:
    """Return the normal and directions in the plane, the first in the plane of incidence; y and z for a square hit."""
    dim = len(normal)
    if dim == 1:
        return np.ones((1, 1))
    if dim == 2:
        return np.array([normal, [-normal[1], normal[0]]])
    along = np.eye(3)[0]
    if np.abs(normal - along).max() < ALIGNED:
        return np.eye(3)
    first = along - normal[0] * normal
    first /= np.sqrt((first**2).sum())
    return np.array([normal, first, np.cross(normal, first)])


def _rows(basis: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in basis.tolist())
