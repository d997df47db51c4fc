"""Solids held in tension: 4 GPa in a bar and in a plane patch whose particles are 3 % off their lattice.

In the exact solution nothing changes. Particles that attract each other tend to clump, and the lattice tears without a
flaw of the material; 3 us is the time of an impact.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hvisph.casefile.material_library import load_material
from hvisph.core.particles import Particles
from hvisph.setup.bodies import PlacedBody
from hvisph.setup.materials import material_of
from hvisph.verification.problem import EULERIAN, Figure, Options, Problem, Ran, Start, Trial, limit, vectors
from hvisph.visualization.curves import Curve

TENSION, END = 4e9, 3e-6  # [Pa], [s]
NOISE = 0.03  # standard deviation of the positions, over dx
CELLS = {1: 100, 2: 36}
HELD, EDGE = 4, 8  # particles at the ends that are held, and that are left out of the figures


def _trials(options: Options) -> Iterator[Trial]:
    dx = options.dx(0.1e-3, 0.1e-3)
    for name, dim in (("bar, 1D", 1), ("patch, plane strain", 2)):
        yield _trial(name, dim, dx, 0.5 * END if options.quick else END)


def _trial(name: str, dim: int, dx: float, end: float) -> Trial:
    half = 0.5 * CELLS[dim] * dx
    inner = half - HELD * dx
    clamps = []
    for axis in range(dim):
        low, high = [None] * dim, [None] * dim
        low[axis], high[axis] = inner, -inner  # type: ignore[call-overload]
        clamps += [{"box": {"min": low}}, {"box": {"max": high}}]
    shape = {"type": "interval", "length": 2 * half} if dim == 1 else {"type": "box", "size": [2 * half] * dim}
    case: dict[str, Any] = {
        "title": f"4 GPa of tension, {name}",
        "kinematics": "uniaxial_strain" if dim == 1 else "plane_strain",
        "resolution": dx,
        "bodies": {"solid": {"material": "aluminium-howell-ball", "shape": shape, "position": [0.0] * dim}},
        "clamped": clamps,
        "time": {"end": end},
        "output": {"every": end / 6.0},
    }

    def disordered(placed: list[PlacedBody]) -> list[PlacedBody]:
        (body,) = placed
        noise = NOISE * dx * np.random.default_rng(1).normal(size=body.positions.shape)
        return [replace(body, positions=body.positions + noise)]

    def stretched(particles: Particles) -> None:
        solid = material_of(load_material("aluminium-howell-ball"))
        density = solid.density - TENSION / solid.bulk_sound_speed**2  # stiffened gas without energy
        particles["mass"] = particles["mass"] * (density / solid.density)
        particles["density"] = density

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        x = vectors(ran.last, "position")
        inside = (np.abs(vectors(ran.first, "position")) < half - EDGE * dx).all(axis=1)
        computed = -float(ran.last.fields["pressure"][inside].mean())
        yield Figure("tension left", computed, TENSION, 0.05, "Pa", why="what is asked of a sound body in 3 us")
        gap = largest_gap(x, half - EDGE * dx)
        yield limit("largest gap over dx", gap / dx, 1.5, why="the emptiest circle of a square lattice is 1.41 across")
        yield Figure("nearest neighbour over dx", nearest(x) / dx, 1.0, 0.3, why="3 % of noise leave 0.9")

    def curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
        (ran,) = runs
        inside = (np.abs(vectors(ran.first, "position")) < half - EDGE * dx).all(axis=1)
        time = np.array([snapshot.time for snapshot in ran.snapshots])
        mean = np.array([float(snapshot.fields["pressure"][inside].mean()) for snapshot in ran.snapshots])
        return {"pressure": [Curve("mean", time, mean, marked=True),
                             Curve("exact", time, np.full_like(time, -TENSION), exact=True)]}  # fmt: skip

    return Trial(name, [Start(case, disordered, stretched)], figures, curves, across="time")


def largest_gap(x: np.ndarray, reach: float) -> float:
    """Return the diameter of the largest empty circle whose centre is within `reach` of the middle [m]."""
    if x.shape[1] == 1:
        places = np.sort(x[:, 0])
        middle = 0.5 * (places[1:] + places[:-1])
        return float(np.diff(places)[np.abs(middle) < reach].max())
    from scipy.spatial import Voronoi, cKDTree

    corners = Voronoi(x).vertices
    corners = corners[(np.abs(corners) < reach).all(axis=1)]
    return 2.0 * float(cKDTree(x).query(corners)[0].max())


def nearest(x: np.ndarray) -> float:
    """Return the distance of the nearest pair [m]."""
    from scipy.spatial import cKDTree

    return float(cKDTree(x).query(x, k=2)[0][:, 1].min())


PROBLEM = Problem(
    "tension", "4 GPa of tension for 3 us in a disordered lattice: remaining tension, gaps", _trials, EULERIAN,
    "a Total Lagrangian reference is free of stress, and projection has no equation of state",
)  # fmt: skip
