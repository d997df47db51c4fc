"""Ghost rows behind a process's own: mirror images at planes of symmetry, and rows of other processes.

Copies are appended before rows are sorted, and updated after a pass that wrote into rows. They have no rates: these
belong to the particle itself, or to the process that owns it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol

import numpy as np

from hvisph.compiler.jit import specialise
from hvisph.core.fields import CATALOGUE, SYMMETRIC_COMPONENTS
from hvisph.core.particles import Particles

from .particle_layout import RowLayout, slots


@dataclass
class Plane:
    """A plane of symmetry."""

    axis: int  # 0, 1 or 2: the plane is normal to x, y or z
    at: float  # its coordinate at the stage [m]
    side: float = 1.0  # 1 or -1: the material lies above or below it
    velocity: float = 0.0  # along its normal [m/s]
    ahead: float = 0.0  # how far it goes from the time of the state to the stage [m]

    def distance_beyond(self, x: np.ndarray) -> np.ndarray:
        """Return the signed distance of positions (n, dim) [m] beyond the plane [m]."""
        return self.side * (self.at - x[:, self.axis])


# The axis of solids of revolution, in the half-plane (x, r).
AXIS = Plane(1, 0.0)


@dataclass(frozen=True)
class Images:
    """The images that one plane makes."""

    plane: Plane  # the plane
    source: np.ndarray  # rows that are mirrored, images of earlier planes included
    first: int  # row of the first image


def mirror(rows: np.ndarray, plane: Plane, layout: RowLayout) -> np.ndarray:
    """Return the mirror images of packed `rows`, of any length up to the layout's width."""
    images = rows * layout.mirror_signs(plane.axis)[: rows.shape[1]]
    images[:, plane.axis] += 2.0 * plane.at
    if plane.velocity:
        first = layout.slots().get("U")
        if first is not None and first < rows.shape[1]:  # else the rows have places alone
            images[:, first + plane.axis] += 2.0 * plane.velocity
    return images


def find_beside(rows, axis, coordinate, side, reach, indices):
    """Write the numbers of the rows that have an image which can meet a particle into `indices` (n,); return how many.

    A particle that a step has moved beyond the plane interacts with images of more distant particles: their own
    images meet it, too, and every pair has its counterpart.
    """
    depth_max, count = 0.0, 0
    for i in range(len(rows)):
        depth = side * (coordinate - rows[i, axis])
        if depth < reach:
            depth_max = max(depth_max, depth)
    for i in range(len(rows)):
        if abs(side * (coordinate - rows[i, axis])) < reach + depth_max:
            indices[count] = i
            count += 1
    return count


def append_images(rows, numbers, count, source, signs, axis, offset, first, velocity, bit):
    """Write the mirror images of the rows `source` (n,), with `signs` (width,), behind the first `count` of `rows`.

    `offset`, `velocity`: twice the coordinate of the plane and twice its velocity, for the slot `first`
    `bit`: bit of the plane in the `numbers` of images
    """
    for k in range(len(source)):
        for f in range(len(signs)):
            rows[count + k, f] = rows[source[k], f] * signs[f]
        rows[count + k, axis] += offset
        if velocity != 0.0:
            rows[count + k, first] += velocity
        numbers[count + k] = numbers[source[k]] | bit


def find_passed(state, axis, mass, coordinate, side, ahead, indices):
    """Write the numbers of the particles with `mass` beyond a plane into `indices` (n,); return how many.

    `axis`, `mass`: columns of the state
    """
    count = 0
    for i in range(len(state)):
        if side * (coordinate - state[i, axis]) - side * ahead > 0.0 and state[i, mass] > 0.0:
            indices[count] = i
            count += 1
    return count


def mirror_slots(rows, target, source, first, signs):
    """Make the slots of the sorted rows `target` (n,) from `first` on those of `source`, times `signs`."""
    for k in range(len(target)):
        for f in range(len(signs)):
            rows[target[k], first + f] = rows[source[k], first + f] * signs[f]


@cache
def _loops() -> tuple[Any, ...]:
    return tuple(specialise(loop, parallel=False) for loop in (find_beside, append_images, find_passed, mirror_slots))


# The number of an image is that of its source with the bit of its plane: so it is unlike any other, and in a cell
# images come behind particles.
FIRST_PLANE_BIT = 32


def make_images(
    rows: np.ndarray, numbers: np.ndarray, planes: tuple[Plane, ...], layout: RowLayout, reach: float
) -> tuple[np.ndarray, np.ndarray, list[Images]]:
    """Return the images of `rows` (n, width) that can meet one, and `numbers` (n,) followed by those of the images.

    The last value is the source of the images of each plane. `reach`: that of the kernel [m]
    """
    find, append, count, width = *_loops()[:2], len(rows), rows.shape[1]
    indices = np.empty(count, np.int64)
    lists = [indices[: find(rows, plane.axis, plane.at, plane.side, reach, indices)].copy() for plane in planes]
    indices = lists[0] if len(lists) == 1 else np.unique(np.concatenate([indices[:0], *lists]))
    n_near = end = len(indices)
    capacity = n_near << len(planes)  # each plane at most doubles the rows
    copies, copy_numbers = np.empty((capacity, width), rows.dtype), np.empty(capacity, np.uint64)
    sources = np.empty(capacity, np.int64)
    copies[:n_near], copy_numbers[:n_near], sources[:n_near] = rows[indices], numbers[indices], indices
    sources[n_near:] = np.arange(count, count + capacity - n_near)
    images, first = [], layout.slots().get("U") or width
    for k, plane in enumerate(planes):
        source = np.empty(end, np.int64)
        source = source[: find(copies[:end], plane.axis, plane.at, plane.side, reach, source)]
        velocity = 2.0 * plane.velocity if first < width else 0.0  # else the rows have places alone
        append(copies, copy_numbers, end, source, layout.mirror_signs(plane.axis)[:width], plane.axis,
               2.0 * plane.at, first + plane.axis, velocity, np.uint64(1 << (FIRST_PLANE_BIT + k)))  # fmt: skip
        images.append(Images(plane, sources[source], count + end - n_near))
        end += len(source)
    return copies[n_near:end], np.concatenate([numbers, copy_numbers[n_near:end]]), images


def field_signs(rank: str, axis: int, dim: int) -> np.ndarray:
    """Return the sign of each component of a field of a state under reflection along `axis`."""
    vector = "xyz"[:dim]
    names = {
        "scalar": ("",),
        "vector": tuple(vector),
        "axial": ("xy",) if dim == 2 else ("yz", "zx", "xy"),
        "symmetric": SYMMETRIC_COMPONENTS,
        "gradient": tuple(a + b for a in vector for b in vector),
        "quaternion": ("", "yz", "zx", "xy"),  # the material is the same in a mirror along any of its axes
    }[rank]
    return np.array([(-1.0) ** name.count("xyz"[axis]) for name in names])


def turn_back(
    particles: Particles,
    rows: np.ndarray,
    layout: RowLayout,
    rates: np.ndarray,
    place: np.ndarray,
    planes: tuple[Plane, ...],
) -> None:
    """Put the images of the particles that have passed a plane into their place.

    Particle and image are one to all others, so that nothing else changes.

    `particles`, `rows`, `layout`: the state, and packed rows of it in the same order
    `rates`, `place`: rows of rates, and the row of each particle
    `planes`: planes of symmetry
    """
    dim, buffer, offsets = particles.dim, np.empty(particles.count, np.int64), particles.offsets
    for plane in planes:
        columns = offsets["position"] + plane.axis, offsets["mass"]
        indices = buffer[: _loops()[2](particles.data, *columns, plane.at, plane.side, plane.ahead, buffer)]
        if not len(indices):
            continue
        for name in particles.names:
            values = particles[name]
            if values.ndim == 2:
                signs = field_signs(CATALOGUE[name].rank, plane.axis, dim)
                values[indices] *= signs[: values.shape[1]]
        particles["position"][indices, plane.axis] += 2.0 * (plane.at - plane.ahead)
        particles["velocity"][indices, plane.axis] += 2.0 * plane.velocity
        rows[indices] = mirror(rows[indices], plane, layout)
        ring = layout.slots().get("RING")
        if ring is not None:  # these are particles again, no images
            rows[indices, ring] = np.abs(rows[indices, ring])
        vector, gradient = (field_signs(rank, plane.axis, dim) for rank in ("vector", "gradient"))
        rate_signs = np.concatenate([vector, np.ones(2), gradient])
        rates[place[indices], : len(rate_signs)] *= rate_signs
        if "GU_BEFORE" in layout.slots():
            first = slots(dim)["R_GRADIENT_BEFORE"]
            rates[place[indices], first : first + dim * dim] *= gradient


class Copies(Protocol):
    """Ghost rows of particles elsewhere."""

    def refresh(self, sorted_rows: np.ndarray, place: np.ndarray) -> None:
        """Bring the copies among sorted rows up to date; `place` is the sorted place of each row."""


class Halo(Copies, Protocol):
    """Rows of other processes."""

    def append(self, rows: np.ndarray, numbers: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Return rows (n, width) and numbers (n,) with those of all ghost rows within `reach` [m]."""

    def any_process(self, condition: bool) -> bool:
        """Return whether a condition holds on any process."""

    def total(self, counts: np.ndarray) -> np.ndarray:
        """Return the sums of integers over all processes."""

    def get_maxima(self, values: np.ndarray) -> np.ndarray:
        """Return the maximum of each float over all processes."""

    def select_appended(self, indices: np.ndarray) -> None:
        """Declare the rows given to `append` as those with these `indices` of more rows, for `exchange_again`."""

    def exchange_again(self, values: np.ndarray) -> np.ndarray:
        """Return `values` (n, ...) of the rows received by the last `append`."""


class ImageCopies:
    """Images of rows at planes of symmetry, including rows of other processes."""

    def __init__(self, planes: tuple[Plane, ...], layout: RowLayout):
        self._planes, self._layout = planes, layout
        self._image_list: list[Images] = []
        slots = layout.slots()
        first = slots["U"] + layout.dim if "U" in slots else layout.dim
        self._first = layout.packed_width if "U_REST" in slots else first
        self._signs = [layout.mirror_signs(axis)[self._first : layout.used_width] for axis in range(layout.dim)]

    def find(self, rows: np.ndarray, numbers: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the images of rows (n, width) within `reach` [m], and the numbers (n,) of rows with theirs behind."""
        images, numbers, self._image_list = make_images(rows, numbers, self._planes, self._layout, reach)
        return images, numbers

    def refresh(self, sorted_rows: np.ndarray, place: np.ndarray) -> None:
        """Mirror what passes have written: any field but position and velocity; in single precision none packed."""
        for images in self._image_list:
            target = place[images.first : images.first + len(images.source)]
            _loops()[3](sorted_rows, target, place[images.source], self._first, self._signs[images.plane.axis])


class FixedCopies:
    """Ghost rows of a reference configuration, found once: rows of other processes, then images of all."""

    def __init__(self, planes: tuple[Plane, ...], dim: int):
        self._planes = planes
        self.layout = RowLayout(dim, (("x", "vector"), ("number", "scalar")))
        self.halo: Halo | None = None

    def find(
        self, position: np.ndarray, numbers: np.ndarray, reach: float, isolated: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return ghosts of reference positions, (m, dim) [m] and numbers (m,); `isolated` (n,) have no neighbours."""
        dim, count = self.layout.dim, len(position)
        if self.halo is not None:
            indices = np.flatnonzero(~isolated)
            rows = np.zeros((len(indices), self.layout.width))
            rows[:, :dim] = position[indices]
            rows, all_numbers = self.halo.append(rows, numbers[indices], reach)
            self.halo.select_appended(indices)
            position = np.concatenate([position, rows[len(indices) :, :dim]])
            numbers = np.concatenate([numbers, all_numbers[len(indices) :]])
        self._halo_rows = slice(count, len(position))
        table = np.column_stack([position, np.arange(len(position))])
        images, numbers, self._images = make_images(table, numbers, self._planes, self.layout, reach)
        self._coordinates = [plane.at for plane in self._planes]  # of the reference: planes may move
        self._origin = images[:, dim].astype(np.int64)
        return np.concatenate([position, images[:, :dim]]), numbers

    def extend_rows(self, values: np.ndarray) -> np.ndarray:
        """Return the `values` (n, ...) of the own rows followed by those of all ghost rows, not mirrored."""
        if self.halo is not None:
            values = np.concatenate([values, self.halo.exchange_again(values)])
        return np.concatenate([values, values[self._origin]]) if len(self._origin) else values

    def refresh(self, rows: np.ndarray, layout: RowLayout, slots: slice) -> None:
        """Bring copies among `rows` up to date: of others the `slots`, images as a whole with the place X0."""
        if self.halo is not None:
            rows[self._halo_rows, slots] = self.halo.exchange_again(rows[: self._halo_rows.start, slots])
        first = layout.slots()["X0"]
        for images, coordinate in zip(self._images, self._coordinates, strict=True):
            copies = mirror(rows[images.source], images.plane, layout)
            copies[:, first + images.plane.axis] += 2.0 * coordinate
            rows[images.first : images.first + len(images.source)] = copies
