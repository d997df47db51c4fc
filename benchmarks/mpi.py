"""One case on several numbers of processes: time a step, rows of others beside the model's, messages, balance, memory.

    pip install 'hvisph[mpi]'
    python benchmarks/mpi.py [--case al_al] [--set resolution=0.2mm] [--processes 1,2,1x2] [--steps 10,60]

1x2 is one process of two threads; 2 is two processes of one.

A step takes what a run of many steps takes beyond one of few. The first turn of each compiles and does not count. Times
on a machine that has other work are ratios at best.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil

from hvisph.case.case import Case
from hvisph.casefile.loader import load_case
from hvisph.parallel.subdomain import Parts
from hvisph.setup.bodies import placed_bodies

# Rows of others over those within one spacing of a part's box, of the model. Two layers of a lattice lie within 2.8
# spacings of the outermost one, where one lies within a spacing: 2. Where a cut splits a layer by number, half of it comes
# on top on either count: 2.5 over 1.5.
LAYERS = 0.5 * (2.0 + 2.5 / 1.5)


def modelled(case: Case, processes: int) -> float:
    """Return the rows of others over own ones, mean over the parts at the start, from the sections along cuts."""
    positions = np.concatenate([body.positions for body in placed_bodies(case)])
    numbers = np.arange(len(positions))
    owner = Parts(processes, positions, numbers).owner(positions, numbers)
    shares = []
    for part in range(processes):
        inside = positions[owner == part]
        outside = positions[owner != part]
        distance = np.maximum(inside.min(axis=0) - outside, outside - inside.max(axis=0)).max(axis=1)
        shares.append(LAYERS * (distance <= 1.25 * case.resolution).sum() / len(inside))
    return float(np.mean(shares))


def watched(process: subprocess.Popen) -> list[float]:
    """Wait for the end of a run; return the most memory of each of its processes [MB], the largest first."""
    peaks: dict[int, float] = {}
    while process.poll() is None:
        with suppress(psutil.Error):
            for child in [psutil.Process(process.pid), *psutil.Process(process.pid).children(recursive=True)]:
                if "hvisph" in child.cmdline() and "-n" not in child.cmdline():
                    peaks[child.pid] = max(peaks.get(child.pid, 0.0), child.memory_info().rss / 1e6)
        time.sleep(0.25)
    return sorted(peaks.values(), reverse=True)


def one_run(
    arguments: argparse.Namespace, processes: int, threads: int, steps: int, folder: Path
) -> tuple[float, str, list[float]]:
    """Return the time of a run [ms], what the log says of the processes, and their memory [MB]."""
    launcher = shutil.which("mpiexec", path=str(Path(sys.executable).parent)) or "mpiexec"
    start = [launcher, "-n", str(processes)] if processes > 1 else []
    settings = [*arguments.set, f"time.max_steps={steps}", "output.checkpoint_every=null"]
    process = subprocess.Popen(
        [*start, sys.executable, "-m", "hvisph", "run", arguments.case, "--out", str(folder), "--force", "--quiet",
         "--threads", str(threads), *(part for one in settings for part in ("--set", one))],
        stdout=subprocess.DEVNULL,
    )  # fmt: skip
    memory = watched(process)
    summary = json.loads((folder / "summary.json").read_text())
    lines = [line for line in (folder / "run.log").read_text().splitlines() if "rows of others" in line]
    return 1e3 * summary["wall_seconds"], lines[-1].split("  ", 1)[1] if lines else "", memory


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--case", default="al_al")
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--processes", default="1,2")
    parser.add_argument("--steps", default="10,60")
    parser.add_argument("--turns", type=int, default=3)
    arguments = parser.parse_args()
    few, many = (int(one) for one in arguments.steps.split(","))
    shapes = [tuple(int(part) for part in f"{one}x1".split("x")[:2]) for one in arguments.processes.split(",")]
    times: dict[tuple[int, ...], list[float]] = {shape: [] for shape in shapes}
    told, memory = dict.fromkeys(shapes, ""), {shape: [0.0] for shape in shapes}
    with tempfile.TemporaryDirectory() as folder:
        for turn in range(arguments.turns + 1):
            for shape in shapes:
                short, _, _ = one_run(arguments, *shape, few, Path(folder) / "run")
                if turn:
                    long, told[shape], memory[shape] = one_run(arguments, *shape, many, Path(folder) / "run")
                    times[shape].append((long - short) / (many - few))
        particles = json.loads((Path(folder) / "run" / "summary.json").read_text())["particles"]
    case = load_case(arguments.case, arguments.set)
    print(f"{arguments.case} {' '.join(arguments.set)}: {particles} particles")
    print(f"{'processes':>9}{'threads each':>14}{'ms a step':>12}{'times as fast':>15}{'rows of others, model':>24}"
          f"{'most memory, MB':>20}")  # fmt: skip
    for shape in shapes:
        processes, threads = shape
        paired = [one / other for one, other in zip(times[shapes[0]], times[shape], strict=True)]
        own = re.search(r"\((\d+\.\d+)%\)", told[shape])
        rows = f"{own.group(1)} %, {100 * modelled(case, processes):.1f} %" if own else ""
        print(f"{processes:>9}{threads:>14}{statistics.median(times[shape]):>12.2f}{statistics.median(paired):>15.2f}"
              f"{rows:>24}{', '.join(f'{one:.0f}' for one in memory[shape]):>20}")  # fmt: skip
        if told[shape]:
            print(f"          {told[shape]}")


if __name__ == "__main__":
    main()
