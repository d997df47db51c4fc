"""Many small runs at once: against the same as many at a time as there are cores, and one after the other.

    python benchmarks/crowd.py [--runs 20] [--resolution 0.4] [--end "4 us"] [--rounds 3] [--formulation riemann]

Every run is a process of its own, as from a shell loop, with the number of threads that it takes by itself. The ways
take turns; the last lines have medians of their ratios, in wall and in processor time. A first run fills the cache.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor

from hvisph.precheck.estimate import available_threads


def small_run(folder: str, number: int, settings: list[str]) -> None:
    """Run the al_al_coarse's impact in a process of its own."""
    command = [
        sys.executable,
        "-m",
        "hvisph",
        "run",
        "al_al_coarse",
        "--out",
        f"{folder}/{number}",
        "--force",
        "--quiet",
    ]
    process = subprocess.run([*command, *settings], capture_output=True, text=True, check=False)
    if process.returncode not in (0, 1):  # 1: a coarse run misses what a fine one is expected to give
        sys.exit(f"run {number} failed:\n{process.stderr[-3000:]}")


def measured(folder: str, runs: int, at_once: int, settings: list[str]) -> tuple[float, float]:
    """Return wall and processor time [s] of so many runs, `at_once` at a time."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    with ThreadPoolExecutor(at_once) as pool:
        list(pool.map(lambda number: small_run(folder, number, settings), range(runs)))
    wall, after = time.monotonic() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Print times of each round and medians of the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--resolution", type=float, default=0.4, help="[mm]")
    parser.add_argument("--end", default="4 us")
    parser.add_argument("--formulation", default="eulerian")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    settings = []
    for one in (f"resolution={options.resolution} mm", f"time.end={options.end}", "output.every=null",
                f"formulation={{type: {options.formulation}}}"):  # fmt: skip
        settings += ["--set", one]
    ways = {"one after the other": 1, "one a core": available_threads(), "all at once": options.runs}
    with tempfile.TemporaryDirectory() as folder:
        measured(folder, 1, 1, settings)
        rounds = []
        for _ in range(options.rounds):
            rounds.append({name: measured(folder, options.runs, at_once, settings) for name, at_once in ways.items()})
            for name, (wall, spent) in rounds[-1].items():
                print(f"{name:>20}: {wall:6.1f} s, {spent:6.1f} s of processor time", flush=True)
    for other in ("one a core", "one after the other"):
        wall, spent = (statistics.median(one["all at once"][k] / one[other][k] for one in rounds) for k in (0, 1))
        print(f"all at once over {other}: wall {wall:.2f}, processor time {spent:.2f}")


if __name__ == "__main__":
    main()
