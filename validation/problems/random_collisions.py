"""Random collisions of bodies that fail: no particle energy is negative, and angular momentum is conserved."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from hvisph.verification.problem import Figure, Options, Problem, Ran, Start, Trial, limit, vectors

from .spinning_disc import angular_momentum

BRITTLE: dict[str, Any] = {
    "density": 2770.0,
    "eos": {"type": "mie_gruneisen", "sound_speed": 5328.0, "gamma": 2.0, "s1": 1.338},
    "strength": {"type": "johnson_cook", "shear_modulus": 27.6e9, "a": 0.265e9, "b": 0.426e9, "n": 0.34, "c": 0.015,
                 "m": 1.0, "melt_temperature": 775.0, "heat_capacity": 875.0, "room_temperature": 294.0},
    "damage": {"type": "johnson_cook", "d1": 0.13, "d2": 0.13, "d3": -1.5, "d4": 0.011},
}  # fmt: skip
END = 24e-6
# Matter between colliding bodies rebounds with 0.12 of the energy at 1, 0.5 and 0.25 mm; spurious energy adds to it.
REBOUND = 0.15
_REBOUNDS = "rebound of what is caught in the middle: 0.12 at 1, 0.5 and 0.25 mm"


def _trials(options: Options) -> Iterator[Trial]:
    seeds = options.seeds or (3 if options.quick else 20)
    yield collisions(f"{seeds} seeds", range(seeds), options.dx(1e-3, 1e-3))


def collisions(name: str, seeds: Iterable[int], dx: float) -> Trial:
    """Return the collisions of some seeds with the spacing `dx` [m]."""

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        complete = [ran for ran in runs if not ran.summary["failure"]]
        yield limit("stopped runs", len(runs) - len(complete), 0)
        start = {id(ran): ran.kinetic_energy(ran.first) for ran in complete}
        lowest = max((-least_energy(ran, start[id(ran)]) for ran in complete), default=float("nan"))
        yield limit("lowest internal energy over mean kinetic energy", lowest, 1e-3, why="a body cannot hold less")
        gained = max((_regained(ran) / start[id(ran)] for ran in complete), default=float("nan"))
        yield limit("regained kinetic energy over initial", gained, REBOUND, why=_REBOUNDS)
        spin = max((_spin_change(ran) for ran in complete), default=float("nan"))
        yield limit("change of angular momentum over its sum", spin, 1e-3)

    return Trial(name, [Start(_case(seed, dx)) for seed in seeds], figures, may_stop=True)


def _case(seed: int, dx: float) -> dict[str, Any]:
    """Return a case of two to four bodies that move towards the middle with offsets of up to a radius."""
    rng = np.random.default_rng(seed)
    count, bodies = int(rng.integers(2, 5)), {}
    for k in range(count):
        angle = 2.0 * np.pi * (k + 0.3 * rng.random()) / count
        size, distance = rng.uniform(10e-3, 16e-3), 22e-3
        direction = np.array([np.cos(angle), np.sin(angle)])
        aim = rng.uniform(-5e-3, 5e-3) * np.array([-direction[1], direction[0]])
        disc = {"type": "disc", "diameter": float(size)}
        box = {"type": "box", "size": [float(size), float(rng.uniform(0.6, 1.0) * size)]}
        turned = bool(rng.random() < 0.5)
        bodies[f"lump_{k}"] = {
            "material": BRITTLE,
            "shape": box if turned else disc,
            "position": (distance * direction + aim).tolist(),
            "velocity": (-rng.uniform(300.0, 1200.0) * direction).tolist(),
            "rotation": float(np.degrees(angle + rng.uniform(-0.5, 0.5))) if turned else 0.0,
        }
    return {"title": f"lumps {seed}", "kinematics": "plane_strain", "resolution": dx, "bodies": bodies,
            "time": {"end": END}}  # fmt: skip


def least_energy(ran: Ran, kinetic: float) -> float:
    """Return the least specific internal energy over the mean kinetic energy a mass at the start."""
    return float(ran.last.fields["internal_energy"].min() / (kinetic / ran.last.fields["mass"].sum()))


def _regained(ran: Ran) -> float:
    """Return the largest rise of the kinetic energy above an earlier value [J]."""
    kinetic = ran.history["kinetic_energy"]
    return float((kinetic - np.minimum.accumulate(kinetic)).max())


def _spin_change(ran: Ran) -> float:
    """Return the change of angular momentum over the sum of its sizes at the start."""
    x, u = vectors(ran.first, "position"), vectors(ran.first, "velocity")
    size = (ran.first.fields["mass"] * np.linalg.norm(x, axis=1) * np.linalg.norm(u, axis=1)).sum()
    return abs(angular_momentum(ran.last) - angular_momentum(ran.first)) / float(size)


PROBLEM = Problem(
    "random_collisions",
    "random bodies that fail collide: energies, angular momentum",
    _trials,
    slow=True,
)
