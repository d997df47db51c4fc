"""Elastic bodies of revolution that breathe: a ball, and a thin ring.

Ball (Lamb, Proc. London Math. Soc. 13 (1882) 189): the slowest purely radial mode, u ~ j1(k r) with k R = x the first
root above 0 of

    tan x = x / (1 - (c_l/c_t)^2 x^2/4),     omega = x c_l / R

Ring of radius R, its section small beside R: hoop stress E u/R alone, omega = sqrt(E/rho) / R.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin, sqrt

import numpy as np

from .roots import bracketed_root


@dataclass(frozen=True)
class Ball:
    """A free elastic ball.

    Parameters
    ----------
    radius
        Its radius [m].
    density
        Its density [kg/m^3].
    youngs_modulus, poisson_ratio
        E [Pa] and nu [-].
    """

    radius: float
    density: float
    youngs_modulus: float
    poisson_ratio: float

    @property
    def longitudinal_speed(self) -> float:
        """Speed of pressure waves [m/s]."""
        e, nu = self.youngs_modulus, self.poisson_ratio
        return sqrt(e * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu) * self.density))

    @property
    def root(self) -> float:
        """The wave number of the slowest mode times the radius [-]."""
        nu = self.poisson_ratio
        squared = 2.0 * (1.0 - nu) / (1.0 - 2.0 * nu)  # of the ratio of both wave speeds

        def missing(x: float) -> float:
            return sin(x) * (1.0 - 0.25 * squared * x * x) - x * cos(x)

        return bracketed_root(missing, 1.0, pi)

    @property
    def period(self) -> float:
        """Period of the slowest mode [s]."""
        return 2.0 * pi * self.radius / (self.root * self.longitudinal_speed)

    def shape(self, r: np.ndarray) -> np.ndarray:
        """Return the mode's radial displacement at the radii `r` [m], 1 at the surface."""
        z = self.root * np.asarray(r) / self.radius
        at_surface = sin(self.root) / self.root**2 - cos(self.root) / self.root
        return np.asarray((np.sin(z) / z**2 - np.cos(z) / z) / at_surface)


@dataclass(frozen=True)
class ThinRing:
    """A free elastic ring of radius [m], density [kg/m^3] and Young's modulus [Pa]."""

    radius: float
    density: float
    youngs_modulus: float

    @property
    def period(self) -> float:
        """Period of its breathing [s]."""
        return 2.0 * pi * self.radius * sqrt(self.density / self.youngs_modulus)
