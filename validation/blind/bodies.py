"""Blind problems of bodies that collide: a thin shell, brittle bodies, an oblique impact at 15 km/s, half of a disc."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from hvisph_validation.structures import Shell
from scipy.spatial import cKDTree

from hvisph.verification.problem import Figure, Options, Ran, Start, Trial, limit, vectors

from ..problems.implosion import collapse
from ..problems.random_collisions import collisions, least_energy

SHELL = Shell(2, 60e-3, 66e-3, 45e-3, 2700.0, 0.25e9)  # three particles thick
SEEDS = range(100, 105)
OBLIQUE, ODD = 15e3, 1500.0  # speeds [m/s]
ALONE, HIGH = 2.0, 5e9  # nearest neighbour over the spacing, pressure [Pa]: a particle alone bears none


def colliding_bodies(options: Options) -> Iterator[Trial]:
    """Yield the trials."""
    yield collapse("shell of three particles", SHELL, options.dx(2e-3, 3e-3))
    yield collisions("seeds 100 to 104", SEEDS, options.dx(1e-3, 1e-3))
    yield _oblique(options.dx(0.5e-3, 1e-3))
    yield _half(options.dx(0.5e-3, 0.5e-3))


def _case(dx: float, disc: float, metal: str, plate: list[float], velocity: list[float], end: float) -> dict[str, Any]:
    return {
        "title": "disc on a plate",
        "kinematics": "plane_strain",
        "resolution": dx,
        "bodies": {
            "projectile": {"material": metal, "shape": {"type": "disc", "diameter": disc}, "velocity": velocity},
            "target": {"material": "aluminium-howell-ball", "shape": {"type": "box", "size": plate}},
        },
        "time": {"end": end},
    }


def _oblique(dx: float) -> Trial:
    case = _case(dx, 10e-3, "tungsten", [5e-3, 60e-3], [OBLIQUE * np.sqrt(0.5), OBLIQUE * np.sqrt(0.5)], 5e-6)

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        x, mass, pressure = vectors(ran.last, "position"), ran.last.fields["mass"], ran.last.fields["pressure"]
        nearest = cKDTree(x).query(x, k=2)[0][:, 1]
        lone = mass[(nearest > ALONE * dx) & (pressure > HIGH)].sum() / mass.sum()
        yield limit("mass alone under more than 5 GPa", float(lone), 5e-4, why="nothing presses a particle alone")
        lowest = -least_energy(ran, ran.kinetic_energy(ran.first))
        yield limit("lowest internal energy over mean kinetic energy", lowest, 1e-3, why="a body cannot hold less")
        drift = abs(float(ran.summary["conservation"]["energy_drift"]))
        yield limit("drift of energy", drift, 1e-9, why="exact in the step; sums of a thousand steps")
        yield limit("drift of momentum", ran.drift, 1e-12, why="round-off")

    return Trial("tungsten on aluminium at 15 km/s and 45 degrees", [Start(case)], figures)


def _half(dx: float) -> Trial:
    """Return a disc of nine particles across, whole and cut by the plane through its middle row."""
    model = _case(dx, 9.0 * dx, "aluminium-howell-ball", [2e-3, 12e-3], [ODD, 0.0], 6e-6)

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        v_full, half = (float(ran.mean_velocity(0)[0]) for ran in runs)
        yield Figure("velocity of half a disc", half, v_full, 0.02, "m/s", ODD, "a lattice moved by half a spacing")

    return Trial(
        "half of a disc of nine particles", [Start(model), Start(model | {"symmetry": [{"axis": "y"}]})], figures
    )
