"""Blind problems of elastic solids: bars, discs, a ring, a spinning box, unlike spacings, rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from hvisph_validation.structures import ThinRing

from hvisph.core.particles import Particles
from hvisph.setup.bodies import PlacedBody
from hvisph.verification.problem import (
    ELASTIC,
    POISSON_RATIO,
    RHO,
    YOUNGS_MODULUS,
    Figure,
    Options,
    Ran,
    Start,
    Trial,
    limit,
    vectors,
)
from hvisph.verification.problems.bars import LEFT, SIZES, SPEED, TOLERANCE, WHY

from ..problems.cantilever import swing
from ..problems.random_collisions import least_energy
from ..problems.spacings import C, unlike_spacings
from ..problems.spinning_disc import angular_momentum

STEEL: dict[str, Any] = {
    "density": 7800.0,
    "eos": {"type": "elastic", "youngs_modulus": 200e9, "poisson_ratio": 0.3},
    "strength": {"type": "elastic"},
}
STEEL_SPEED = float(np.sqrt(200e9 * 0.7 / (1.3 * 0.4) / 7800.0))  # of longitudinal waves [m/s]
ANGLE = np.radians(37.0)
DISC, HEAD_ON = 10e-3, 15.0  # diameter [m]; speed of each disc [m/s]
RING, THICKNESS, BREATHING, PERIODS = 10e-3, 2e-3, 0.5, 3.0  # radius, thickness [m]; speed [m/s]; periods followed
BOX, RIM, TURNS = [10e-3, 6e-3], 50.0, 2.0  # sides [m], speed at the corners [m/s]


def elastic_solids(options: Options) -> Iterator[Trial]:
    """Yield the trials."""
    dx = options.dx(0.5e-3, 1e-3)
    yield _unlike_bars(options.dx(0.1e-3, 0.2e-3))
    yield _turned_bars(dx)
    yield _rebound(dx)
    yield _ring(options.dx(0.5e-3, 0.5e-3))
    yield _spinning_box(dx)
    yield unlike_spacings(1, options.dx(0.1e-3, 0.2e-3), 3)
    yield _rest(dx)


def _case(
    title: str, dx: float, bodies: dict[str, Any], end: float, kinematics: str = "plane_strain"
) -> dict[str, Any]:
    return {"title": title, "kinematics": kinematics, "resolution": dx, "bodies": bodies, "time": {"end": end},
            "output": {"every": end / 60.0}}  # fmt: skip


def _unlike_bars(dx: float) -> Trial:
    """Return bars of aluminium and steel through which waves take the same time, so that they part as one."""
    length = SIZES[1][0]
    za, zb = RHO * C, STEEL["density"] * STEEL_SPEED
    bodies = {
        "striker": {"material": ELASTIC, "shape": {"type": "interval", "length": length}, "velocity": [SPEED]},
        "bar": {"material": STEEL, "shape": {"type": "interval", "length": length * STEEL_SPEED / C}},
    }

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        for body, exact in ((0, SPEED * (za - zb) / (za + zb)), (1, SPEED * 2.0 * za / (za + zb))):
            yield Figure(f"velocity of the {('striker', 'bar')[body]}", float(runs[0].mean_velocity(body)[0]), exact,
                         TOLERANCE[1], "m/s", SPEED, WHY[1])  # fmt: skip

    case = _case("unlike bars", dx, bodies, 6e-6, "uniaxial_strain")
    return Trial("bar of aluminium on bar of steel, 1D", [Start(case)], figures)


def _turned_bars(dx: float) -> Trial:
    shape = {"type": "box", "size": SIZES[2]}
    along = np.array([np.cos(ANGLE), np.sin(ANGLE)])
    turn = np.array([along, [-along[1], along[0]]])
    bodies = {"striker": {"material": ELASTIC, "shape": shape}, "bar": {"material": ELASTIC, "shape": shape}}

    def turned(placed: list[PlacedBody]) -> list[PlacedBody]:
        return [replace(body, positions=body.positions @ turn) for body in placed]

    def moving(particles: Particles) -> None:
        particles["velocity"] = SPEED * along * (particles.body == 0)[:, None]

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        yield Figure("velocity of the striker", float(runs[0].mean_velocity(0) @ along), LEFT[2], TOLERANCE[2], "m/s",
                     SPEED, WHY[2])  # fmt: skip
        lateral = abs(float(runs[0].mean_velocity(0) @ turn[1]))
        yield limit("velocity across the bars", lateral, 1e-9 * SPEED, "m/s", "symmetry; round-off")

    return Trial(
        "bars turned by 37 degrees, 2D", [Start(_case("turned bars", dx, bodies, 12e-6), turned, moving)], figures
    )


def _rebound(dx: float) -> Trial:
    disc = {"material": ELASTIC, "shape": {"type": "disc", "diameter": DISC}}
    bodies = {"left": disc | {"velocity": [HEAD_ON, 0.0]}, "right": disc | {"velocity": [-HEAD_ON, 0.0]}}

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        rebound = float(runs[0].mean_velocity(1)[0] - runs[0].mean_velocity(0)[0]) / (2.0 * HEAD_ON)
        yield Figure("restitution", rebound, 1.0, 0.1,
                     why="at 1/200 of the wave speed contact lasts many transits; little vibrates on")  # fmt: skip

    return Trial("two elastic discs, head on", [Start(_case("rebound", dx, bodies, 40e-6))], figures)


def _ring(dx: float) -> Trial:
    period = ThinRing(RING, RHO, YOUNGS_MODULUS / (1.0 - POISSON_RATIO**2)).period
    shape = {"type": "annulus", "outer_diameter": 2.0 * RING + THICKNESS, "inner_diameter": 2.0 * RING - THICKNESS}
    bodies = {"ring": {"material": ELASTIC, "shape": shape, "position": [0.0, 0.0]}}

    def outward(x: np.ndarray) -> np.ndarray:
        return np.asarray(x / np.linalg.norm(x, axis=1)[:, None])

    def swinging(particles: Particles) -> None:
        particles["velocity"] = BREATHING * outward(particles["position"])

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        shape = outward(vectors(runs[0].first, "position"))
        speeds = [float((shape * vectors(snapshot, "velocity")).sum(axis=1).mean()) for snapshot in runs[0].snapshots]
        value, amplitude = swing(
            np.array([snapshot.time for snapshot in runs[0].snapshots]), np.array(speeds), period, PERIODS
        )
        yield Figure("period", value, period, 0.05, "s", why="4 particles across, as steps at the faces")
        yield limit("amplitude loss per period", 1.0 - amplitude ** (1.0 / PERIODS), 0.05, why="a tenth of the energy")

    return Trial(
        "ring that breathes, 2D", [Start(_case("ring", dx, bodies, PERIODS * period), state=swinging)], figures
    )


def _spinning_box(dx: float) -> Trial:
    rate = RIM / (0.5 * np.hypot(BOX[0], BOX[1]))
    bodies = {"box": {"material": ELASTIC, "shape": {"type": "box", "size": BOX}, "position": [0.0, 0.0]}}

    def spinning(particles: Particles) -> None:
        x = particles["position"]
        particles["velocity"] = rate * np.column_stack([-x[:, 1], x[:, 0]])

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        ratio = angular_momentum(ran.last) / angular_momentum(ran.first)
        yield limit("loss of angular momentum per turn", abs(ratio - 1.0) / TURNS, 1e-6, why="as the spinning disc")
        lowest = -least_energy(ran, ran.kinetic_energy(ran.first))
        yield limit("lowest internal energy over mean kinetic energy", lowest, 0.01,
                    why="elastic energy is positive; linear laws differ from it by the strain")  # fmt: skip

    end = TURNS * 2.0 * np.pi / rate
    return Trial("box that spins, two turns", [Start(_case("spinning box", dx, bodies, end), state=spinning)], figures)


def _rest(dx: float) -> Trial:
    square = {"type": "box", "size": [8e-3, 8e-3]}
    bodies = {"left": {"material": ELASTIC, "shape": square}, "middle": {"material": STEEL, "shape": square,
              "resolution": 2.0 * dx}, "right": {"material": ELASTIC, "shape": square}}  # fmt: skip

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        fastest = np.sqrt(2.0 * np.nanmax(runs[0].history["kinetic_energy"]) / runs[0].first.fields["mass"].sum())
        yield limit("largest mean speed", float(fastest), 1e-9, "m/s", "round-off of stresses of 0")

    return Trial("three unlike bodies at rest", [Start(_case("rest", dx, bodies, 20e-6))], figures)
