"""A free elastic disc that spins once: its angular momentum stays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from hvisph.core.particles import Particles
from hvisph.output.snapshot import Snapshot
from hvisph.verification.problem import ELASTIC, Figure, Options, Problem, Ran, Start, Trial, limit, vectors
from hvisph.visualization.curves import Curve

DIAMETER, RIM = 20e-3, 100.0  # [m], speed of the rim [m/s]
TURN = np.pi * DIAMETER / RIM  # [s]
SPIN = "angular momentum, share of the start's"


def _trials(options: Options) -> Iterator[Trial]:
    dx = options.dx(0.5e-3, 1e-3)
    turns = 0.1 if options.quick else 1.0
    case = {
        "title": "spinning disc",
        "kinematics": "plane_strain",
        "resolution": dx,
        "bodies": {"disc": {"material": ELASTIC, "position": [0.0, 0.0],
                            "shape": {"type": "disc", "diameter": DIAMETER}}},
        "time": {"end": turns * TURN},
        "output": {"every": 0.05 * turns * TURN, "history_every": 10},
    }  # fmt: skip

    def spinning(particles: Particles) -> None:
        x = particles["position"]
        particles["velocity"] = 2.0 * np.pi / TURN * np.column_stack([-x[:, 1], x[:, 0]])

    def figures(runs: Sequence[Ran]) -> Iterator[Figure]:
        start, end = angular_momentum(runs[0].first), angular_momentum(runs[0].last)
        yield limit("loss of angular momentum per turn", abs(end / start - 1.0) / turns, 1e-6)

    def curves(runs: Sequence[Ran]) -> dict[str, list[Curve]]:
        time = np.array([one.time for one in runs[0].snapshots])
        spin = np.array([angular_momentum(one) for one in runs[0].snapshots])
        return {SPIN: [
            Curve("computed", time, spin / spin[0], marked=True),
            Curve("exact", time, np.ones_like(time), exact=True)]}  # fmt: skip

    yield Trial(f"dx {1e3 * dx:g} mm", [Start(case, state=spinning)], figures, curves, across="time", units={SPIN: ""})


def angular_momentum(snapshot: Snapshot) -> float:
    """Return the angular momentum about the origin, in 2D [kg m/s, a metre of depth: kg m^2/(s m)]."""
    x, u = vectors(snapshot, "position"), vectors(snapshot, "velocity")
    return float((snapshot.fields["mass"] * (x[:, 0] * u[:, 1] - x[:, 1] * u[:, 0])).sum())


PROBLEM = Problem("spinning_disc", "a free elastic disc in rotation: angular momentum", _trials, slow=True)
