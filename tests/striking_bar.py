"""Impact of an elastic bar on a smooth rigid wall, by explicit finite elements.

Two equal bars that meet are mirror images in the frame of their centre, so that the face between them is such a wall:
the bar that was struck leaves with half the speed and the rebound, and half the speed less the rebound stays.

    m_i a_i = - sum over elements K u,      v += a dt,     u += v dt

K is that of bi- or trilinear elements (Hooke's law, small strains, two Gauss points an axis), masses are lumped. A node
of the face is held from when it reaches the wall until the bar pulls at it. Only the part on one side of the bar's
planes of symmetry is computed.
"""

from __future__ import annotations

from itertools import product

import numpy as np

# Of the time in which a longitudinal wave crosses an element.
COURANT = 0.5


def stiffness(dx: float, dim: int, youngs_modulus: float, poisson_ratio: float) -> np.ndarray:
    """Return the stiffness of a square (plane strain) or cubic element of side `dx` [m], (2^dim dim, same) [N/m]."""
    first = youngs_modulus * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio))
    shear = youngs_modulus / (2 * (1 + poisson_ratio))
    corners = np.array(list(product((0, 1), repeat=dim)))
    total = np.zeros((len(corners), dim, len(corners), dim))
    for point in product((0.5 - 0.5 / np.sqrt(3), 0.5 + 0.5 / np.sqrt(3)), repeat=dim):
        parts = np.where(corners == 1, point, 1 - np.array(point))
        slopes = np.where(corners == 1, 1.0, -1.0) / dx
        for axis in range(dim):
            slopes[:, axis] *= np.delete(parts, axis, axis=1).prod(axis=1)
        total += first * np.einsum("ai,bj->aibj", slopes, slopes) + shear * np.einsum("aj,bi->aibj", slopes, slopes)
        total += shear * np.einsum("ij,ak,bk->aibj", np.eye(dim), slopes, slopes)
    return (total * (dx / 2) ** dim).reshape(len(corners) * dim, -1)


def rebound(
    size: tuple[float, ...], dx: float, material: tuple[float, float, float], speed: float, end: float
) -> tuple[float, float]:
    """Return the mean velocity of the bar away from the wall at the end [m/s], and since when it is free [s].

    Parameters
    ----------
    size
        Length of the bar, and its full width along one or two axes [m].
    dx
        Side of an element [m].
    material
        Young's modulus [Pa], Poisson's ratio, density [kg/m^3].
    speed
        Speed towards the wall [m/s].
    end
        How long it is followed [s].
    """
    youngs_modulus, poisson_ratio, density = material
    dim = len(size)
    counts = [round(size[0] / dx), *(round(width / 2 / dx) for width in size[1:])]
    number = np.arange(np.prod([n + 1 for n in counts])).reshape([n + 1 for n in counts])
    nodes = np.stack([number[tuple(slice(o, o + n) for o, n in zip(corner, counts, strict=True))].ravel()
                      for corner in product((0, 1), repeat=dim)], axis=1)  # fmt: skip
    k, count = stiffness(dx, dim, youngs_modulus, poisson_ratio), number.size
    mass = np.bincount(nodes.ravel(), minlength=count) * density * dx**dim / 2**dim
    place = np.stack(np.unravel_index(np.arange(count), number.shape), axis=1)
    wall, planes = place[:, 0] == 0, [np.flatnonzero(place[:, axis] == 0) for axis in range(1, dim)]
    modulus = youngs_modulus * (1 - poisson_ratio) / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio))
    dt = COURANT * dx / np.sqrt(modulus / density)
    u, v = np.zeros((count, dim)), np.zeros((count, dim))
    v[:, 0] = -speed
    held, last, time = wall.copy(), 0.0, 0.0
    while time < end:
        force = -(u[nodes].reshape(len(nodes), -1) @ k).reshape(len(nodes), -1, dim)
        total = [np.bincount(nodes.ravel(), force[:, :, axis].ravel(), count) for axis in range(dim)]
        held &= total[0] <= 0.0
        v += dt * np.stack(total, axis=1) / mass[:, None]
        for axis, nodes_on in enumerate(planes, 1):
            v[nodes_on, axis] = 0.0
        held |= wall & (u[:, 0] + dt * v[:, 0] < 0.0)
        v[held, 0] = -u[held, 0] / dt  # to the wall, and no farther
        u += dt * v
        time += dt
        last = time if held.any() else last
    return float(mass @ v[:, 0] / mass.sum()), last
