"""Solids of revolution as rings: bodies that breathe, a bar on a wall, a flat impact, a pressure at rest, other frames.

Cases without exact solution are compared with three-dimensional ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from hvisph_validation.structures import Ball, ThinRing

from hvisph.core.particles import Particles
from hvisph.exact.hugoniot import impedance_match
from hvisph.setup.bodies import PlacedBody
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
    body_material,
    fluid,
    limit,
    stress_xx,
    vectors,
)
from hvisph.visualization.curves import Curve

from .cantilever import swing

BALL = Ball(10e-3, RHO, YOUNGS_MODULUS, POISSON_RATIO)
RING, SECTION = ThinRing(20e-3, RHO, YOUNGS_MODULUS), 4e-3  # 4 across the section of a torus, contact SPH gains energy
SPEED = 0.5  # of what breathes [m/s]: strains of 1e-4, so that nothing but Hooke's law shows
PERIODS = 3.0
METAL = "aluminium-howell-ball-mie-gruneisen"
COPPER: dict[str, Any] = {
    "density": 8930.0,
    "eos": {"type": "stiffened_gas", "sound_speed": 3940.0, "gamma": 3.0},
    "strength": {"type": "linear_hardening", "shear_modulus": 47.7e9, "yield_stress": 0.35e9,
                 "hardening_modulus": 0.1e9},
}  # fmt: skip
BAR = 24e-3, 6e-3  # length and diameter [m]
# Length left in 3D: 16.0 mm by contact SPH at 0.33 mm, 16.8 by standard SPH at 0.3, 16.6 Total Lagrangian at 0.5.
LEFT, SPREAD = 16.4e-3, 0.05
PLATE, IMPACT = (24, 48, 80), 3100.0  # particles along flyer and target, and across half of them; [m/s]
FRAME, STEPS, STEP = 10e3, 60, 8e-9  # [m/s], -, [s]
ROUND_OFF = "round-off of 60 steps, in which impacts let it grow"


def _trials(options: Options) -> Iterator[Trial]:
    dx = options.dx(1e-3, 1.25e-3)
    yield _breathing("sphere", BALL.period, dx, {"type": "sphere", "diameter": 2.0 * BALL.radius}, _ball_mode)
    shape = {"type": "ring", "section": {"type": "box", "size": [SECTION, SECTION]}, "radius": RING.radius}
    yield _breathing("torus", RING.period, options.dx(0.5e-3, SECTION / 6), shape, _ring_mode)
    yield _pressure(options.dx(0.5e-3, 0.5e-3))
    yield _impact(options.dx(0.1e-3, 0.1e-3))
    yield _bar(options.dx(0.25e-3, 0.3e-3))
    yield _in_frame("moving frame, 10 km/s along the axis", FRAME, 1.0)
    yield _in_frame("mirrored along the axis", 0.0, -1.0)


def _ball_mode(x: np.ndarray) -> np.ndarray:
    r = np.linalg.norm(x, axis=1)
    return np.asarray(BALL.shape(r)[:, None] * x / r[:, None])


def _ring_mode(x: np.ndarray) -> np.ndarray:
    return np.column_stack([np.zeros(len(x)), np.ones(len(x))])


def _breathing(name: str, period: float, dx: float, shape: dict[str, Any], mode: Any) -> Trial:
    case = {
        "title": f"breathing {name}",
        "kinematics": "axisymmetric",
        "resolution": dx,
        "bodies": {"body": {"material": ELASTIC, "shape": shape, "position": [0.0, 0.0]}},
        "symmetry": [{"axis": "x"}],
        "time": {"end": PERIODS * period},
        "output": {"every": period / 20.0},
    }

    def swinging(particles: Particles) -> None:
        particles["velocity"] = SPEED * mode(particles["position"])

    def record(ran: Ran) -> tuple[np.ndarray, np.ndarray]:
        """Return times, and the share of the mode in the motion [m/s]."""
        shape, mass = mode(vectors(ran.first, "position")), ran.first.fields["mass"]
        norm = (mass[:, None] * shape * shape).sum()
        velocities = [
            (mass[:, None] * shape * vectors(snapshot, "velocity")).sum() / norm for snapshot in ran.snapshots
        ]
        return np.array([snapshot.time for snapshot in ran.snapshots]), np.array(velocities)

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        velocities, amplitude = swing(*record(runs[0]), period, PERIODS)
        yield Figure(
            "period", velocities, period, 0.025, "s", why="8 particles across the radius, or 6 across the section"
        )
        yield limit("amplitude loss per period", 1.0 - amplitude ** (1.0 / PERIODS), 0.1, why="viscosity")
        yield limit("growth of the amplitude", amplitude - 1.0, 0.005, why="terms that are not dual to the gradient")

    def curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
        time, speed = record(runs[0])
        exact = SPEED * np.cos(2.0 * np.pi * time / period)
        return {"velocity": [Curve("computed", time, speed), Curve("exact", time, exact, exact=True)]}

    return Trial(f"{name}, radial oscillation", [Start(case, state=swinging)], figures, curves, across="time")


def _pressure(dx: float) -> Trial:
    """Return a cylinder between planes, its rim held: nothing moves."""
    height, length = 12.0 * dx, 8.0 * dx
    case = {
        "title": "uniform pressure",
        "kinematics": "axisymmetric",
        "resolution": dx,
        "bodies": {"metal": {"material": METAL, "internal_energy": 1e6, "position": [0.5 * length, 0.0],
                             "shape": {"type": "cylinder", "diameter": 2.0 * height, "length": length}}},
        "symmetry": [{"axis": "x"}, {"axis": "x", "at": length, "keep": "below"}],
        "clamped": [{"box": {"min": [None, height - 5.0 * dx]}}],
        "time": {"end": 1.0, "step": 2e-8, "max_steps": 1000},
        "output": {"every": 0.5},
    }  # fmt: skip

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        natural = np.sqrt(np.abs(ran.first.fields["pressure"]).mean() / ran.first.fields["density"].mean())
        fastest = float(np.abs(vectors(ran.last, "velocity")).max())
        yield Figure("steps", float(ran.summary["steps"]), 1000.0, 0.0)
        yield limit("largest speed over sqrt(p/rho)", fastest / float(natural), 1e-10,
                    why="round-off of 1,000 steps")  # fmt: skip

    return Trial("uniform pressure, 1,000 steps", [Start(case)], figures)


def _impact(dx: float) -> Trial:
    flyer, target, width = (count * dx for count in PLATE)
    discs = [{"type": "cylinder", "diameter": 2.0 * width, "length": length} for length in (flyer, target)]
    metal = fluid(METAL)
    case = {
        "title": "a disc on a disc",
        "kinematics": "axisymmetric",
        "resolution": dx,
        "bodies": {"flyer": {"material": metal, "shape": discs[0], "velocity": [IMPACT, 0.0]},
                   "target": {"material": metal, "shape": discs[1]}},
        "time": {"end": 0.6 * target / 7400.0},
    }  # fmt: skip

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        exact = impedance_match(body_material(ran.case, "flyer"), body_material(ran.case, "target"), IMPACT)
        last, at = ran.last, vectors(ran.first, "position")
        # between what the interface heats and the front; the flyer's release has not come so far
        shock = exact.target_shock_velocity * last.time
        depth = (at[:, 0] > 10.0 * dx) & (at[:, 0] < 0.6 * shock) & (last.body == 1)
        stress = stress_xx(last)
        for name, low, high in (("on the axis", 0, 1), ("in the rows 1 to 4", 1, 5), ("in the rows 5 to 20", 5, 21)):
            rows = depth & (at[:, 1] > low * dx) & (at[:, 1] < high * dx)
            yield Figure(f"stress {name}", float(stress[rows].mean()), exact.pressure, 0.02, "Pa",
                         why="a plane shock's; 1 % of it is that of the scheme in the plane")  # fmt: skip

    return Trial("flat impact of discs", [Start(case)], figures)


def _bar(dx: float) -> Trial:
    length, diameter = BAR
    case = {
        "title": "axisymmetric Taylor bar",
        "kinematics": "axisymmetric",
        "resolution": dx,
        "bodies": {"bar": {"material": COPPER, "position": [0.5 * length, 0.0], "velocity": [-210.0, 0.0],
                           "shape": {"type": "cylinder", "diameter": diameter, "length": length}}},
        "symmetry": [{"axis": "x"}],
        "time": {"end": 60e-6},
    }  # fmt: skip

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        (ran,) = runs
        before, after = vectors(ran.first, "position"), vectors(ran.last, "position")
        top = after[before[:, 0] > length - dx, 0]
        yield Figure("final length", float(top.mean()) + 0.5 * dx, LEFT, SPREAD, "m",
                     why="in three dimensions the schemes leave 16.0 to 16.8 mm")  # fmt: skip
        yield limit("roughness of its end", float(np.ptp(top)) / dx, 0.02, "dx", why="no wave is left there")
        below = np.minimum(ran.last.fields["internal_energy"], 0.0) * ran.last.fields["mass"]
        moving = 0.5 * 210.0**2 * ran.first.fields["mass"].sum()
        yield limit("negative internal energy over initial energy", float(-below.sum() / moving), 1e-3,
                    why="none, but for round-off and the first step of the foot")  # fmt: skip
        yield limit("drift of energy", abs(float(ran.summary["conservation"]["energy_drift"])), 1e-12,
                    why="the pairs keep it to round-off")  # fmt: skip

    return Trial("Taylor bar", [Start(case)], figures)


def _in_frame(name: str, frame: float, sign: float) -> Trial:
    case = {
        "title": "a sphere on a disc",
        "kinematics": "axisymmetric",
        "resolution": 0.5e-3,
        "bodies": {"sphere": {"material": METAL, "shape": {"type": "sphere", "diameter": 4e-3},
                              "velocity": [1500.0, 0.0]},
                   "disc": {"material": METAL, "shape": {"type": "cylinder", "diameter": 10e-3, "length": 3e-3}}},
        "time": {"end": STEPS * STEP, "step": STEP},
    }  # fmt: skip
    reflection = np.array([sign, 1.0])

    def mirrored(placed: list[PlacedBody]) -> list[PlacedBody]:
        return [replace(body, positions=body.positions * reflection) for body in placed]

    def moving(particles: Particles) -> None:
        particles["velocity"] = particles["velocity"] * reflection + np.array([frame, 0.0])

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        first, second = (run.last for run in runs)
        frame_velocity = np.array([frame, 0.0])
        places = (vectors(second, "position") - frame_velocity * second.time) * reflection - vectors(first, "position")
        yield limit("positions, over dx", float(np.abs(places).max()) / 0.5e-3, 1e-9, why=ROUND_OFF)
        speeds = (vectors(second, "velocity") - frame_velocity) * reflection - vectors(first, "velocity")
        yield limit("velocities, over impact velocity", float(np.abs(speeds).max()) / 1500.0, 1e-9, why=ROUND_OFF)
        for field in ("internal_energy", "density", "pressure"):
            difference = np.abs(second.fields[field] - first.fields[field]).max() / np.abs(first.fields[field]).max()
            yield limit(f"{field.replace('_', ' ')}, over its largest", float(difference), 1e-9, why=ROUND_OFF)

    return Trial(name, [Start(case), Start(case, mirrored, moving)], figures)


PROBLEM = Problem(
    "axisymmetric_bodies", "axisymmetric particles: oscillations, Taylor bar, flat impact, rest, moving frames",
    _trials, SOLIDS,
)  # fmt: skip
