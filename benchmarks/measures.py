"""Time and memory of all measures at the end of a run: a synthetic Whipple shot in 3D, with a cloud of debris.

    python benchmarks/measures.py [--particles 1e6] [--moments 20] [--memory] [--profile]

A plate of four spacings with a hole, debris on a widening shell behind it, a wall with a crater: wall-clock time and user
CPU time of `measure_snapshot`, and the peak of memory over that of the two snapshots, per particle.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import resource
import time
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np

from hvisph.measures.measure import Measures, in_time, measure_snapshot
from hvisph.measures.scene import reference
from hvisph.output.snapshot import Snapshot

DX = 0.25e-3


def plate(low: float, thick: int, across: int) -> np.ndarray:
    """Cell centres of a square plate whose front is at `low` [m], `thick` by `across` by `across` cells."""
    axes = [low + DX * (np.arange(thick) + 0.5), *[DX * (np.arange(across) - 0.5 * (across - 1))] * 2]
    return np.stack([c.ravel() for c in np.meshgrid(*axes, indexing="ij")], axis=1)


def shot(particles: int) -> tuple[Snapshot, Snapshot]:
    """Return start and end of the shot."""
    generator = np.random.default_rng(1)
    across = int(np.sqrt(0.45 * particles / 4.0))
    bumper = plate(0.0, 4, across)
    thick = max(int(0.45 * particles / across**2), 4)
    wall = plate(20e-3, thick, across)
    count = particles - len(bumper) - len(wall)
    size = int(np.ceil((6.0 * count / np.pi) ** (1.0 / 3.0)))
    ball = plate(-(size + 1) * DX, size, size)
    ball = ball[((ball - ball.mean(axis=0)) ** 2).sum(axis=1) <= (0.5 * size * DX) ** 2]
    parts = [ball, bumper, wall]
    body = np.repeat(np.arange(3), [len(part) for part in parts])
    position = np.concatenate(parts)
    velocity = np.zeros_like(position)
    velocity[body == 0, 0] = 6000.0
    count = len(position)
    fields = {
        "position": position, "velocity": velocity, "mass": np.full(count, 2785.0 * DX**3),
        "density": np.full(count, 2785.0), "pressure": np.zeros(count), "smoothing_length": np.full(count, 1.2 * DX),
    }  # fmt: skip
    metadata = {"spacing": DX, "shot": {"roles": [None] * 3, "planes": []}, "witness": 0.05}
    start = Snapshot(0.0, 0, 3, fields, body, np.zeros(count, int), np.arange(count), ["ball", "bumper", "wall"],
                     ["metal"], metadata)  # fmt: skip
    metadata |= reference(start)  # which a run stores with its first snapshot
    lateral = np.sqrt((position[:, 1:] ** 2).sum(axis=1))
    flies = (body == 0) | ((body == 1) & (lateral < 0.5 * size * DX))
    ends = position.copy()
    direction = generator.standard_normal((count, 3)) * [0.2, 0.35, 0.35] + [1.0, 0.0, 0.0]
    velocity = np.where(flies[:, None], 5000.0 * direction, 0.0)
    ends[flies] = ends[flies] * [0.1, 1.0, 1.0] + [2e-3, 0.0, 0.0] + 3e-6 * velocity[flies]
    pit = (body == 2) & (lateral < 0.5 * size * DX) & (position[:, 0] < 20e-3 + 3 * DX)
    ends[pit] -= [10e-3, 0.0, 0.0]
    end = Snapshot(3e-6, 1000, 3, fields | {"position": ends, "velocity": velocity}, body, start.material, start.id,
                   start.bodies, start.materials, metadata)  # fmt: skip
    return start, end


def between(start: Snapshot, end: Snapshot, share: float) -> Snapshot:
    """Return a moment between both."""
    if share in (0.0, 1.0):
        return start if share == 0.0 else end
    first, last = start.fields["position"], end.fields["position"]
    fields = end.fields | {"position": first + share * (last - first)}
    return replace(end, time=share * end.time, fields=fields)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--particles", type=float, default=1e6)
    parser.add_argument("--profile", action="store_true", help="print where the time goes")
    parser.add_argument("--moments", type=int, default=0, help="and what this many earlier snapshots tell, in memory")
    parser.add_argument("--memory", action="store_true", help="trace memory, which takes several times as long")
    arguments = parser.parse_args()
    start, end = shot(int(arguments.particles))
    began, used = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF).ru_utime
    profile = cProfile.Profile()
    if arguments.memory:
        tracemalloc.start()
    if arguments.profile:
        profile.enable()
    found: Measures = measure_snapshot(end, start)
    if arguments.moments:
        one = resource.getrusage(resource.RUSAGE_SELF).ru_utime - used
        print(f"of which the end alone {one:.2f} s of user CPU time")
        found = in_time(found, [Path(str(k)) for k in range(arguments.moments + 1)], start,
                        lambda path: between(start, end, int(path.name) / arguments.moments))  # fmt: skip
    profile.disable()
    wall = time.perf_counter() - began
    used = resource.getrusage(resource.RUSAGE_SELF).ru_utime - used
    print(found.answer)
    print(f"{end.count} particles: {wall:.2f} s, {used:.2f} s of user CPU time")
    if arguments.memory:
        print(f"{tracemalloc.get_traced_memory()[1] / end.count:.0f} bytes a particle at the peak")
    if arguments.profile:
        pstats.Stats(profile).sort_stats("cumulative").print_stats(35)


if __name__ == "__main__":
    main()
