"""Elastic bodies that vibrate and rebound: a breathing ring, and a disc that strikes a plate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from hvisph_validation.structures import ThinRing

from hvisph.core.particles import Particles
from hvisph.output.snapshot import Snapshot
from hvisph.verification.problem import (
    ELASTIC,
    POISSON_RATIO,
    RHO,
    SOLIDS,
    YOUNGS_MODULUS,
    Figure,
    Options,
    Problem,
    Ran,
    Start,
    Trial,
    limit,
    vectors,
)
from hvisph.visualization.curves import Curve

from .cantilever import swing

MEAN_RADIUS, WALL = 10.64e-3, 2e-3  # [m]
SPEED = 5.0  # radial, at the start [m/s]
PERIODS = 2.0
RING = ThinRing(MEAN_RADIUS, RHO, YOUNGS_MODULUS / (1.0 - POISSON_RATIO**2))  # in plane strain
DISC, STRIKING = 10e-3, 30.0  # [m], [m/s]
PLATE = [5e-3, 30e-3]  # [m]
# Of the same disc by Total Lagrangian SPH, 0.951 at 20 and 0.961 at 40 particles across: the rest is vibration.
RESTITUTION = 0.96


def _ring(options: Options) -> Iterator[Trial]:
    dx = options.dx(0.25e-3, 0.5e-3)
    periods = 1.0 if options.quick else PERIODS
    case = {
        "title": "elastic ring",
        "kinematics": "plane_strain",
        "resolution": dx,
        "bodies": {"ring": {"material": ELASTIC, "position": [0.0, 0.0], "shape": {
            "type": "annulus", "outer_diameter": 2.0 * MEAN_RADIUS + WALL,
            "inner_diameter": 2.0 * MEAN_RADIUS - WALL}}},
        "time": {"end": (periods + 0.05) * RING.period},
        "output": {"every": 0.05 * RING.period},
    }  # fmt: skip

    def breathing(particles: Particles) -> None:
        x = particles["position"]
        particles["velocity"] = SPEED * x / np.linalg.norm(x, axis=1)[:, None]

    def record(run: Ran) -> tuple[np.ndarray, np.ndarray]:
        time = np.array([snapshot.time for snapshot in run.snapshots])
        return time, np.array([_radial_speed(snapshot) for snapshot in run.snapshots])

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        period, amplitude = swing(*record(runs[0]), RING.period, periods)
        ratio = amplitude ** (2.0 / periods)
        last = runs[0].last
        mean = runs[0].kinetic_energy(runs[0].first) / last.fields["mass"].sum()
        yield Figure("period", period, RING.period, 0.05, "s", why="4 or 8 particles across")
        yield limit("loss of energy per period", 1.0 - ratio, 0.15, why="4 or 8 particles across")
        lowest = float(last.fields["internal_energy"].min())
        yield limit("least particle energy below zero", -lowest / mean, 0.01,
                    why="share of the kinetic energy; elastic energy is not negative")  # fmt: skip

    def curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
        time, speed = record(runs[0])
        exact = SPEED * np.cos(2.0 * np.pi * time / RING.period)
        return {"radial velocity": [Curve("computed", time, speed), Curve("thin ring", time, exact, exact=True)]}

    yield Trial(f"dx {1e3 * dx:g} mm", [Start(case, state=breathing)], figures, curves, across="time",
                units={"radial velocity": "m/s"})  # fmt: skip


def _radial_speed(snapshot: Snapshot) -> float:
    """Return the mean radial velocity [m/s]."""
    x, u = vectors(snapshot, "position"), vectors(snapshot, "velocity")
    return float(((x * u).sum(axis=1) / np.linalg.norm(x, axis=1)).mean())


def _rebound(options: Options) -> Iterator[Trial]:
    dx = options.dx(0.25e-3, 0.5e-3)
    case = {
        "title": "elastic rebound",
        "kinematics": "plane_strain",
        "resolution": dx,
        "bodies": {
            "disc": {"material": ELASTIC, "shape": {"type": "disc", "diameter": DISC}, "velocity": [STRIKING, 0.0],
                     "position": [-0.5 * DISC - 0.5 * dx, 0.0]},
            "plate": {"material": ELASTIC, "shape": {"type": "box", "size": PLATE}, "position": [0.5 * PLATE[0], 0.0]},
        },
        "clamped": [{"box": {"min": [PLATE[0] - 4.0 * dx, None]}}],
        "time": {"end": 15e-6},
        "output": {"every": 1e-6},
    }  # fmt: skip

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        rebound = -float(runs[0].mean_velocity(0)[0]) / STRIKING
        yield Figure("restitution", rebound, RESTITUTION, 0.1, scale=0.0, why="Total Lagrangian SPH, 40 across")

    def curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
        time = np.array([snapshot.time for snapshot in runs[0].snapshots])
        speed = np.array([runs[0].mean_velocity(0, snapshot)[0] for snapshot in runs[0].snapshots])
        return {"velocity_x": [Curve("disc", time, speed)]}

    yield Trial(f"dx {1e3 * dx:g} mm", [Start(case)], figures, curves, across="time")


PROBLEM = Problem("elastic_ring", "a free elastic ring breathes: period and energy", _ring, SOLIDS, slow=True)
REBOUND = Problem("rebound", "an elastic disc strikes a clamped plate: restitution", _rebound, SOLIDS, slow=True)
