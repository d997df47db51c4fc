"""Time and memory of all measures at the end of a run: a synthetic Whipple shot in 3D, with a cloud of debris.

    python benchmarks/measures.py [--particles 1e6] [--moments 20] [--profile] [--folder F]

A plate of four spacings with a hole, debris on a widening shell behind it, a wall with a crater, written as the snapshots
of a run: wall-clock and CPU time of what a run measures at its end, reading included, and the peak of memory over that
of the bare process, per particle.
"""

from __future__ import annotations

import argparse
import cProfile
import multiprocessing
import pstats
import resource
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from hvisph.measures.measure import measure_in_time
from hvisph.measures.measurement_frame import reference
from hvisph.output import reader
from hvisph.output.hdf5 import write_hdf5
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
    fields = {**end.fields, "position": first + share * (last - first)}
    return replace(end, time=share * end.time, fields=fields)


def write(folder: Path, particles: int, moments: int) -> None:
    """Write the moments of the shot as a run would, all evenly in time, into `folder`."""
    start, end = shot(particles)
    more = {"internal_energy": 1, "temperature": 1, "sound_speed": 1, "plastic_strain": 1, "damage": 1, "deviator": 6,
            "von_mises_stress": 1}  # fmt: skip
    count = start.count
    for name, columns in more.items():
        start.fields[name] = np.zeros(count) if columns == 1 else np.zeros((count, columns))
        end.fields[name] = start.fields[name]
    for number in range(moments + 1):
        write_hdf5(folder / f"{number:06d}.vtkhdf", between(start, end, number / moments))


def measured(folder: Path, profiled: bool) -> None:
    """Measure the last moment of a folder as a run does at its end, and print what that takes."""
    import h5py  # noqa: F401
    import scipy.ndimage
    import scipy.sparse.csgraph
    import scipy.spatial  # noqa: F401

    files = reader.list_snapshots(folder)
    Path("/proc/self/clear_refs").write_text("5")  # the peak of memory is that from here on (Linux)
    resident = kibibytes("VmRSS")
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF)
    profile = cProfile.Profile()
    if profiled:
        profile.enable()
    first, last = (reader.read_snapshot(file, lazily=True) for file in (files[0], files[-1]))
    found = measure_in_time(last, files, first)
    profile.disable()
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_SELF)
    print(found.answer)
    print(f"{last.count} particles, {len(files)} snapshots: {wall:.2f} s, {after.ru_utime - before.ru_utime:.2f} s of user "
          f"and {after.ru_stime - before.ru_stime:.2f} s of system CPU time, "
          f"{1024 * (kibibytes('VmHWM') - resident) / last.count:.0f} bytes a particle at the peak")  # fmt: skip
    if profiled:
        pstats.Stats(profile).sort_stats("cumulative").print_stats(45)


def kibibytes(name: str) -> int:
    """Return a figure of this process' memory [KiB]."""
    return next(int(line.split()[1]) for line in Path("/proc/self/status").open() if line.startswith(name))


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--particles", type=float, default=1e6)
    parser.add_argument("--moments", type=int, default=20, help="how many snapshots there are beside the first")
    parser.add_argument("--profile", action="store_true", help="print where the time goes")
    parser.add_argument("--folder", type=Path, help="where the snapshots are, or are written and left")
    arguments = parser.parse_args()
    if arguments.folder is None:
        with tempfile.TemporaryDirectory() as folder:
            run(Path(folder), arguments)
    else:
        run(arguments.folder, arguments)


def run(folder: Path, arguments: argparse.Namespace) -> None:
    """Write the snapshots unless they are there, and measure them in a process of their own."""
    folder.mkdir(parents=True, exist_ok=True)
    if not any(folder.glob("*.vtkhdf")):
        write(folder, int(arguments.particles), arguments.moments)
    measuring = multiprocessing.get_context("spawn").Process(target=measured, args=(folder, arguments.profile))
    measuring.start()
    measuring.join()


if __name__ == "__main__":
    main()
