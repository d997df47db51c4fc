"""Planes of symmetry: mirror images of particles as additional rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvisph.core.fields import CATALOGUE, SYMMETRIC_COMPONENTS
from hvisph.core.particles import Particles

from .particle_layout import RowLayout


@dataclass(frozen=True)
class Plane:
    """A plane of symmetry.

    Parameters
    ----------
    axis
        0, 1 or 2: the plane is normal to x, y or z.
    at
        Its coordinate [m].
    side
        1 or -1: the material lies above or below it.
    """

    axis: int
    at: float
    side: float = 1.0

    def distance_beyond(self, x: np.ndarray) -> np.ndarray:
        """Return the signed distance of positions (n, dim) [m] beyond the plane [m]."""
        return self.side * (self.at - x[:, self.axis])


# The axis of solids of revolution, in the half-plane (x, r).
AXIS = Plane(1, 0.0)


@dataclass(frozen=True)
class Images:
    """The images that one plane makes.

    Parameters
    ----------
    plane
        The plane.
    source
        Rows that are mirrored, images of earlier planes included.
    first
        Row of the first image.
    """

    plane: Plane
    source: np.ndarray
    first: int


def mirror(rows: np.ndarray, plane: Plane, layout: RowLayout) -> np.ndarray:
    """Return the mirror images of packed `rows`, of any length up to the layout's width."""
    made = rows * layout.mirror_signs(plane.axis)[: rows.shape[1]]
    made[:, plane.axis] += 2.0 * plane.at
    return made


def with_images(
    rows: np.ndarray, planes: tuple[Plane, ...], layout: RowLayout, reach: float
) -> tuple[np.ndarray, list[Images]]:
    """Return `rows` (n, width) followed by the images of all that can meet one, `reach` [m] being that of the kernel.

    A particle that a step has carried beyond the plane meets images of what is farther from it by as much: their own
    images meet it, too, and every pair has its counterpart.
    """
    made = []
    for plane in planes:
        depth = plane.distance_beyond(rows)
        deepest = float(depth[depth < reach].max(initial=0.0))
        source = np.flatnonzero(np.abs(depth) < reach + deepest)
        made.append(Images(plane, source, len(rows)))
        rows = np.concatenate([rows, mirror(rows[source], plane, layout)])
    return rows, made


# The number of an image is that of its source with the bit of its plane: so it is unlike any other, and in a cell
# images come behind particles.
FIRST_PLANE_BIT = 32


def image_numbers(numbers: np.ndarray, made: list[Images]) -> np.ndarray:
    """Return `numbers` (n,) uint64 of rows followed by those of the images `made` of them."""
    for k, images in enumerate(made):
        own = numbers[images.source] | np.uint64(1 << (FIRST_PLANE_BIT + k))
        numbers = np.concatenate([numbers, own])
    return numbers


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


def turn_back(particles: Particles, rows: np.ndarray, layout: RowLayout, rates: np.ndarray, place: np.ndarray,
              planes: tuple[Plane, ...]) -> None:  # fmt: skip
    """Put the images of the particles that have passed a plane into their place.

    Particle and image are one to all others, so that nothing else changes.

    Parameters
    ----------
    particles, rows, layout
        The state, and packed rows of it in the same order.
    rates, place
        Rows of rates, and the row of each particle.
    planes
        Planes of symmetry.
    """
    dim = particles.dim
    for plane in planes:
        passed = np.flatnonzero((plane.distance_beyond(particles["position"]) > 0.0) & (particles["mass"] > 0.0))
        if not len(passed):
            continue
        for name in particles.names:
            values = particles[name]
            if values.ndim == 2:
                signs = field_signs(CATALOGUE[name].rank, plane.axis, dim)
                values[passed] *= signs[: values.shape[1]]
        particles["position"][passed, plane.axis] += 2.0 * plane.at
        rows[passed] = mirror(rows[passed], plane, layout)
        ring = layout.slots().get("RING")
        if ring is not None:  # they are rings again, no images
            rows[passed, ring] = np.abs(rows[passed, ring])
        vector, gradient = (field_signs(rank, plane.axis, dim) for rank in ("vector", "gradient"))
        of_rates = np.concatenate([vector, np.ones(2), gradient])
        rates[place[passed], : len(of_rates)] *= of_rates
