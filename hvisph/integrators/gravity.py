"""Gravity: a uniform field, or that of a homogeneous sphere.

Uniform: acceleration g, potential -g . x. Sphere of mass M and radius R about a centre c, with s = x - c:

    g(x) = -G M s / max(|s|, R)^3,      phi(x) = -G M / |s|  outside,  -G M (3 R^2 - |s|^2) / (2 R^3)  inside.

Particles take g at the stage, where the pair forces are evaluated. In a uniform field kinetic energy, internal energy
and m phi then add up to a constant to round-off; in that of a sphere up to the error of leapfrog, which is of second
order and does not grow.
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np

from hvisph.compiler.tensors import dot, multiply, row_vector, subtract

# Constant of gravitation [m^3/(kg s^2)], CODATA 2018.
GRAVITATIONAL_CONSTANT = 6.67430e-11
# Kinds of fields, as the particle update has them.
NONE, UNIFORM, SPHERE = 0, 1, 2


@dataclass(frozen=True)
class Gravity:
    """Field of gravity."""

    kind: int  # UNIFORM or SPHERE
    vector: tuple[float, ...]  # acceleration [m/s^2] of a uniform field, or the centre of the sphere [m], (dim,)
    # G M [m^3/s^2] and radius [m] of the sphere
    strength: float = 0.0
    radius: float = 0.0

    def numbers(self) -> np.ndarray:
        """Return what `gravity_at` reads (1, dim + 2): the vector, G M and the radius."""
        return np.array([[*self.vector, self.strength, self.radius]])

    def acceleration(self, x: np.ndarray) -> np.ndarray:
        """Return the acceleration (n, dim) [m/s^2] at the positions `x` (n, dim) [m]."""
        if self.kind == UNIFORM:
            return np.broadcast_to(np.array(self.vector), x.shape)
        s = x - np.array(self.vector)
        distance = np.maximum(np.sqrt((s * s).sum(axis=1)), self.radius)
        return np.asarray(-self.strength * s / distance[:, None] ** 3)

    def potential(self, x: np.ndarray) -> np.ndarray:
        """Return the potential (n,) [J/kg] at the positions `x` (n, dim) [m]."""
        if self.kind == UNIFORM:
            return np.asarray(-(x @ np.array(self.vector)))
        s = x - np.array(self.vector)
        square = (s * s).sum(axis=1)
        inside = (3.0 * self.radius**2 - square) / (2.0 * self.radius**3)
        outside = 1.0 / np.sqrt(np.maximum(square, self.radius**2))
        return np.asarray(-self.strength * np.where(square < self.radius**2, inside, outside))


def gravity_at(x, gravity):
    """Return the acceleration (DIM) [m/s^2] at `x` in the field with the `numbers` (1, DIM + 2) (template)."""
    zero = np.uint64(0)
    vector = row_vector(gravity, zero, 0, DIM)
    if GRAVITY == UNIFORM:
        return vector
    s = subtract(x, vector)
    distance = max(sqrt(dot(s, s)), gravity[zero, DIM + 1])
    return multiply(-gravity[zero, DIM] / (distance * distance * distance), s)
