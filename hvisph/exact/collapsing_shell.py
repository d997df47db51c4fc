"""Thick shells that collapse until plastic work has taken their motion (Verney's problem).

Incompressible and perfectly plastic, so that geometry alone gives the strain: r0 is where matter was, r where it is,

    cylinder, plane strain:  r^2 = r0^2 - (a0^2 - a^2),   eps_p = 2/sqrt(3) |ln(r0/r)|,   u = V a0 / r
    sphere:                  r^3 = r0^3 - (a0^3 - a^3),   eps_p = 2 |ln(r0/r)|,           u = V (a0 / r)^2

and a is the radius of the inner face. D. Verney 1968, in *Behaviour of Dense Media under High Dynamic Pressures*.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi, sqrt

import numpy as np


@dataclass(frozen=True)
class Shell:
    """A shell and how far it collapses.

    Parameters
    ----------
    dimensions
        2 for a cylinder, 3 for a sphere.
    inner, outer
        Radii of its faces at the start [m].
    stop
        Radius at which the inner face comes to rest [m].
    density
        [kg/m^3].
    yield_stress
        [Pa].
    """

    dimensions: int
    inner: float
    outer: float
    stop: float
    density: float
    yield_stress: float

    def radius(self, start: np.ndarray, face: float) -> np.ndarray:
        """Return where matter that began at `start` is when the inner face is at `face` [m]."""
        d = self.dimensions
        return np.asarray((np.asarray(start) ** d - self.inner**d + face**d) ** (1.0 / d))

    def strain(self, start: np.ndarray, now: np.ndarray) -> np.ndarray:
        """Return the equivalent plastic strain of matter that went from `start` to `now` [m]."""
        factor = 2.0 / sqrt(3.0) if self.dimensions == 2 else 2.0
        return factor * np.abs(np.log(np.asarray(start) / np.asarray(now)))

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
