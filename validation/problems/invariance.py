"""An oblique impact, the same turned by angles and seen from a frame that moves at 10 km/s: nothing else changes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hvisph.core.particles import Particles
from hvisph.setup.bodies import PlacedBody
from hvisph.verification.problem import ALL, Figure, Options, Problem, Ran, Start, Trial, limit, vectors

from .random_collisions import BRITTLE

FRAME = np.array([6000.0, 8000.0])  # [m/s]
STEPS, STEP = 60, 6e-9  # the same for all, so that the same steps are compared [s]
SPEED = 1500.0
WHY = "round-off of 60 steps, in which impacts let it grow"


def _trials(options: Options) -> Iterator[Trial]:
    dx = options.dx(0.5e-3, 0.5e-3)
    for angle in (37.0,) if options.quick else (37.0, 90.0, 200.0):
        yield _trial(f"rotated by {angle:g} degrees", dx, np.radians(angle), np.zeros(2))
    yield _trial("moving frame, 10 km/s", dx, 0.0, FRAME)
    yield _trial("mixed correction, at 37 degrees", dx, np.radians(37.0), np.zeros(2), "mixed")


def _trial(name: str, dx: float, angle: float, frame: np.ndarray, correction: str = "") -> Trial:
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    metal = "aluminium-howell-ball"
    box = {"type": "box", "size": [4e-3, 6e-3]}
    case: dict[str, Any] = {
        "title": "oblique impact",
        "kinematics": "plane_strain",
        "resolution": dx,
        "bodies": {
            "projectile": {"material": metal, "shape": box, "velocity": [SPEED, 300.0]},
            "plate": {"material": BRITTLE, "shape": box},
            "backing": {"material": "steel-howell-ball", "shape": box},
        },
        "time": {"end": STEPS * STEP, "step": STEP},
        "formulation": {"correction": {"type": correction}} if correction else {},
    }

    def turned(placed: list[PlacedBody]) -> list[PlacedBody]:
        return [replace(body, positions=body.positions @ turn.T) for body in placed]

    def moving(particles: Particles) -> None:
        particles["velocity"] = particles["velocity"] @ turn.T + frame

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        first, second = runs[0].last, runs[1].last
        back = (vectors(second, "position") - frame * second.time) @ turn
        yield limit("positions, over dx", float(np.abs(back - vectors(first, "position")).max()) / dx, 1e-9, why=WHY)
        speeds = (vectors(second, "velocity") - frame) @ turn - vectors(first, "velocity")
        yield limit("velocities, over impact velocity", float(np.abs(speeds).max()) / SPEED, 1e-9, why=WHY)
        for field in ("internal_energy", "density", "pressure"):
            scale = np.abs(first.fields[field]).max()
            difference = float(np.abs(second.fields[field] - first.fields[field]).max() / scale)
            yield limit(f"{field.replace('_', ' ')}, over its largest", difference, 1e-9, why=WHY)

    return Trial(name, [Start(case), Start(case, turned, moving)], figures)


PROBLEM = Problem("invariance", "rotated or in a moving frame an impact is the same to round-off", _trials, ALL)
