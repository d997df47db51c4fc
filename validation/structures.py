"""Exact solutions of structures: pulsating ball and ring, cantilever, collapsing shell, disc in rotation.

Ball (Lamb, Proc. London Math. Soc. 13 (1882) 189): the slowest purely radial mode, u ~ j1(k r) with k R = x the first
root above 0 of

    tan x = x / (1 - (c_l/c_t)^2 x^2/4),     omega = x c_l / R

Ring of radius R, its section small beside R: hoop stress E u/R alone, omega = sqrt(E/rho) / R.

    Q = kappa G A (w' - phi),   M = E' I phi',   Q' = -rho A omega^2 w,   M' = -Q - rho I omega^2 phi

E' = E/(1 - nu^2), kappa = 5/6. Euler and Bernoulli's beam is the limit of slenderness.
Timoshenko, Phil. Mag. 41 (1921) 744.

Incompressible and perfectly plastic, so that geometry alone gives the strain: r0 is where matter was, r where it is,

    cylinder, plane strain:  r^2 = r0^2 - (a0^2 - a^2),   eps_p = 2/sqrt(3) |ln(r0/r)|,   u = V a0 / r
    sphere:                  r^3 = r0^3 - (a0^3 - a^3),   eps_p = 2 |ln(r0/r)|,           u = V (a0 / r)^2

and a is the radius of the inner face. D. Verney 1968, in *Behaviour of Dense Media under High Dynamic Pressures*.

Orthotropic disc in plane stress: potential of the body force -rho w^2 r^2/2, stress function rho w^2 a^2 r^2/4 +
A (r^2 - a^2)^2, derived here; isotropic, the centre has (3 + nu)/8 rho w^2 a^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, log, pi, sin, sqrt

import numpy as np

from hvisph.exact.wave_curves import bracketed_root


@dataclass(frozen=True)
class Ball:
    """A free elastic ball."""

    radius: float  # its radius [m]
    density: float  # its density [kg/m^3]
    # E [Pa] and nu [-]
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


FIRST = 1.8751040687119611  # k L of Euler and Bernoulli's first mode: cos(kL) cosh(kL) = -1
KAPPA = 5.0 / 6.0


@dataclass(frozen=True)
class Cantilever:
    """A beam of rectangular section held at one end, bent in plane strain."""

    # [m]
    length: float
    height: float
    # [kg/m^3], [Pa], [-]
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


@dataclass(frozen=True)
class Shell:
    """A shell and how far it collapses."""

    dimensions: int  # 2 for a cylinder, 3 for a sphere
    # radii of its faces at the start [m]
    inner: float
    outer: float
    stop: float  # radius at which the inner face comes to rest [m]
    density: float  # [kg/m^3]
    yield_stress: float  # [Pa]

    def radius(self, start: np.ndarray, face: float) -> np.ndarray:
        """Return where matter that began at `start` is when the inner face is at `face` [m]."""
        d = self.dimensions
        return np.asarray((np.asarray(start) ** d - self.inner**d + face**d) ** (1.0 / d))

    def strain(self, start: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Return the equivalent plastic strain of matter that went from `start` to `after` [m]."""
        factor = 2.0 / sqrt(3.0) if self.dimensions == 2 else 2.0
        return factor * np.abs(np.log(np.asarray(start) / np.asarray(after)))

    @property
    def speed(self) -> float:
        """Speed of the inner face at the start, inwards, so that all of the energy is gone at `stop` [m/s]."""
        d, a, b = self.dimensions, self.inner, self.outer
        area = 2.0 * pi if d == 2 else 4.0 * pi
        edges = np.linspace(a, b, 20_001)
        middle, step = 0.5 * (edges[1:] + edges[:-1]), edges[1] - edges[0]
        strain = self.strain(middle, self.radius(middle, self.stop))
        work = area * self.yield_stress * float((middle ** (d - 1) * strain).sum()) * step
        inertia = area * self.density * (a * a * log(b / a) if d == 2 else a**4 * (1.0 / a - 1.0 / b))
        return sqrt(2.0 * work / inertia)


@dataclass(frozen=True)
class SpinningDisc:
    """A free orthotropic disc that spins in plane stress, its axes 1 and 2 along x and y."""

    radius: float  # a [m]
    density: float  # [kg/m^3]
    spin: float  # w [rad/s]
    compliance: np.ndarray  # S (6, 6) [1/Pa], components as 11 22 33 12 13 23, engineering shear strains

    def state(self, x: np.ndarray | float, y: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """Return stress xx, yy, xy [Pa] and displacement x, y [m] in the disc's frame."""
        s, load = self.compliance, self.density * self.spin**2
        a = load * (s[0, 0] + 2 * s[0, 1] + s[1, 1]) / (8 * (3 * s[0, 0] + 3 * s[1, 1] + 2 * s[0, 1] + s[3, 3]))
        k = 0.5 * load - 4 * a
        c, shared = k * self.radius**2, k * (self.radius**2 - x * x - y * y)
        u = x * ((s[0, 0] + s[0, 1]) * (c - k * (x * x / 3 + y * y)) + 8 * a * (s[0, 0] * y * y + s[0, 1] * x * x / 3))
        v = y * ((s[1, 1] + s[0, 1]) * (c - k * (y * y / 3 + x * x)) + 8 * a * (s[1, 1] * x * x + s[0, 1] * y * y / 3))
        return np.array([shared + 8 * a * y * y, shared + 8 * a * x * x, -8 * a * x * y]), np.array([u, v])
