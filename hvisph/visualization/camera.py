"""Projection of particles as shaded discs: visibility and mirror images.

The camera looks along z at the shot from the side (x to the right, y up), from the front along the shot, or turned
by two angles. Each disc is as wide as its particle's share of the lattice; the nearest wins, pixel by pixel, so that
nothing is covered by what lies behind it.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

VIEWS = {"side": (0.0, 0.0), "front": (-90.0, 0.0), "3d": (-30.0, 20.0)}  # yaw, pitch [degrees]
RADIUS = 0.75  # of a disc, in spacings: on a lattice they close the squares between four of them
SHADES = (0.55, 1.0)  # of a disc's rim and middle in 3D
# Of a plate: what still stands is slower than a tenth of the fastest, its thickness less than 0.7 of its width, and it
# is oblique where its normal is more than 5 degrees off the shot.
STANDS, FLAT, OBLIQUE = 0.1, 0.7, np.cos(np.radians(5.0))


@dataclass(frozen=True)
class Picture:
    """Visible particles of a picture."""

    index: np.ndarray  # particle at each pixel, -1 for none, shape (height, width)
    shade: np.ndarray  # brightness of each pixel, 0 to 1
    extent: tuple[float, float, float, float]  # left, right, bottom, top in the plane of the picture [m]


def rotate_view(position: np.ndarray, yaw: float, pitch: float) -> np.ndarray:
    """Return right, up and towards the eye for positions (n, dim) and two angles [degrees], shape (n, 3)."""
    x = np.zeros((len(position), 3))
    x[:, : position.shape[1]] = position
    cy, sy, cp, sp = (f(np.radians(a)) for a in (yaw, pitch) for f in (np.cos, np.sin))
    axes = np.array([[cy, 0.0, sy], [sp * sy, cp, -sp * cy], [-cp * sy, sp, cp * cy]])
    return x @ axes.T


def facing_the_struck_side(
    position: np.ndarray, velocity: np.ndarray, mass: np.ndarray, planes: Sequence[int]
) -> tuple[float, float] | None:
    """Return yaw and pitch [degrees] that show an oblique plate's struck face; None for others. Arrays (n, 3), (n,)."""
    free_axes = [axis for axis in range(3) if axis not in planes]
    shot = np.zeros(3)
    shot[free_axes] = (mass[:, None] * velocity).sum(axis=0)[free_axes]
    speed = np.sqrt((velocity**2).sum(axis=1))
    standing = position[speed <= STANDS * speed.max()]
    if not shot.any() or len(standing) < 4:
        return None
    offset = standing - standing.mean(axis=0) * np.isin(range(3), free_axes)
    widths, axes = np.linalg.eigh(offset.T @ offset)
    normal = axes[:, 0] * -np.sign(axes[:, 0] @ shot)
    if widths[0] > FLAT**2 * widths[1] or -(normal @ shot) > OBLIQUE * np.linalg.norm(shot):
        return None
    yaw, pitch = VIEWS["3d"]
    return max(
        ((sy * yaw, sp * pitch) for sy in (1.0, -1.0) for sp in (1.0, -1.0)),
        key=lambda angles: float(rotate_view(normal[None], *angles)[0, 2]) + 1e-9 * angles[1],
    )


def copies(position: np.ndarray, planes: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return positions with their images at coordinate planes, and the particle that each is of."""
    parts = []
    for signs in itertools.product((1.0, -1.0), repeat=len(planes)):
        factor = np.ones(position.shape[1])
        factor[list(planes)] = signs
        parts.append(position * factor)
    return np.concatenate(parts), np.tile(np.arange(len(position)), len(parts))


def revolve(position: np.ndarray, spacing: float, angle: float = 360.0) -> tuple[np.ndarray, np.ndarray]:
    """Revolve particles (x, r) by `angle` [degrees] into those of the solid, with the index of each origin.

    `spacing` is the distance around the axis [m]; less than 360 degrees show the inside.
    """
    radius = np.abs(position[:, 1])
    number = np.maximum((np.radians(angle) * radius / spacing).astype(int), 1)
    ring = np.repeat(np.arange(len(position)), number)
    first = np.repeat(np.cumsum(number) - number, number)
    # the turn opens towards the eye
    share = (np.arange(len(ring)) - first + 0.5) / number[ring]
    phi = np.radians(90.0 + (360.0 - angle) / 2.0 + share * angle)
    return np.column_stack([position[ring, 0], radius[ring] * np.sin(phi), radius[ring] * np.cos(phi)]), ring


def visible_discs(place: np.ndarray, radius: float, extent: tuple[float, float, float, float], width: int) -> Picture:
    """Return the visible discs.

    `place`: right, up, towards the eye, shape (n, 3) [m].
    `extent`: left, right, bottom, top of the picture [m].
    `width`: pixels across.
    """
    left, right, bottom, top = extent
    scale = width / (right - left)
    height = max(round((top - bottom) * scale), 1)
    column = np.rint((place[:, 0] - left) * scale - 0.5).astype(np.int64)
    row = np.rint((place[:, 1] - bottom) * scale - 0.5).astype(np.int64)
    order = np.argsort(place[:, 2], kind="stable")  # of those on one pixel the last written, the nearest, stays
    column, row, heights = column[order], row[order], place[order, 2] * scale
    index = np.full((height, width), -1, np.int64)
    shade, depth = np.zeros((height, width)), np.full((height, width), -np.inf)
    reach = max(radius * scale, 0.5)
    span = np.arange(-int(reach), int(reach) + 1)
    for dy, dx in itertools.product(span, span):
        if dx * dx + dy * dy > reach * reach:
            continue
        rise = float(np.sqrt(reach * reach - dx * dx - dy * dy))
        r, c = row + dy, column + dx
        inside = np.flatnonzero((r >= 0) & (r < height) & (c >= 0) & (c < width))
        r, c, height_of_disc = r[inside], c[inside], heights[inside] + rise
        front = height_of_disc >= depth[r, c]
        r, c, height_of_disc, inside = r[front], c[front], height_of_disc[front], inside[front]
        depth[r, c], index[r, c] = height_of_disc, order[inside]
        light = (0.7 * rise + 0.4 * dy - 0.4 * dx) / (0.9 * reach) if reach >= 1.5 else 1.0
        shade[r, c] = min(max(light, 0.0), 1.0)
    return Picture(index, shade, extent)
