"""Swinging beams: Timoshenko's cantilever in plane strain.

    Q = kappa G A (w' - phi),   M = E' I phi',   Q' = -rho A omega^2 w,   M' = -Q - rho I omega^2 phi

E' = E/(1 - nu^2), kappa = 5/6. Euler and Bernoulli's beam is the limit of slenderness.
Timoshenko, Phil. Mag. 41 (1921) 744.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from .roots import bracketed_root

FIRST = 1.8751040687119611  # k L of Euler and Bernoulli's first mode: cos(kL) cosh(kL) = -1
KAPPA = 5.0 / 6.0


@dataclass(frozen=True)
class Cantilever:
    """A beam of rectangular section held at one end, bent in plane strain.

    Parameters
    ----------
    length, height
        [m].
    density, youngs_modulus, poisson_ratio
        [kg/m^3], [Pa], [-].
    """

    length: float
    height: float
    density: float
    youngs_modulus: float
    poisson_ratio: float

    @property
    def slender_period(self) -> float:
        """Period of the first mode by Euler and Bernoulli [s]."""
        modulus = self.youngs_modulus / (1.0 - self.poisson_ratio**2)
        return 2.0 * pi / ((FIRST / self.length) ** 2 * self.height * sqrt(modulus / (12.0 * self.density)))

    @property
    def period(self) -> float:
        """Period of the first mode by Timoshenko, with shear and the inertia of rotation [s]."""
        slender = 2.0 * pi / self.slender_period
        return 2.0 * pi / bracketed_root(self._free_end, 0.2 * slender, 1.2 * slender)

    def _free_end(self, omega: float) -> float:
        """Return the determinant of moment and shear at the free end for unit ones at the held end: 0 is a mode."""
        modulus = self.youngs_modulus / (1.0 - self.poisson_ratio**2)
        shear = KAPPA * self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio)) * self.height
        stiffness = modulus * self.height**3 / 12.0
        mass, inertia = self.density * self.height, self.density * self.height**3 / 12.0
        # of (w, phi L, M L / stiffness, Q L^2 / stiffness) along x / L, so that all entries are of one size
        n, s = self.length, stiffness / (shear * self.length**2)
        matrix = np.zeros((4, 4))
        matrix[0, 1], matrix[0, 3] = 1.0, s
        matrix[1, 2] = 1.0
        matrix[2, 3], matrix[2, 1] = -1.0, -inertia * omega**2 * n**2 / stiffness
        matrix[3, 0] = -mass * omega**2 * n**4 / stiffness
        values, vectors = np.linalg.eig(matrix)
        along = (vectors @ np.diag(np.exp(values)) @ np.linalg.inv(vectors)).real
        return float(np.linalg.det(along[2:, 2:]))

    def shape(self, x: np.ndarray) -> np.ndarray:
        """Return Euler and Bernoulli's first mode at `x` [m] from the held end, 1 at the free end."""
        z = FIRST * np.clip(np.asarray(x) / self.length, 0.0, 1.0)
        ratio = (np.cosh(FIRST) + np.cos(FIRST)) / (np.sinh(FIRST) + np.sin(FIRST))
        return 0.5 * (np.cosh(z) - np.cos(z) - ratio * (np.sinh(z) - np.sin(z)))
