"""Cost of a step in 3D on about 100,000 particles, one thread against two, and memory per particle.

python benchmarks/cost_3d.py [--resolution 0.19] [--steps 20,100]
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

MEASURE = """
import resource, sys
from hvisph.simulation.run import run
from hvisph.casefile.loader import load_case
case, out, threads, overrides = sys.argv[1], sys.argv[2], int(sys.argv[3]), sys.argv[4:]
outcome = run(load_case(case, overrides=overrides), out, force=True, threads=threads)
print("peak", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
"""


def cost(case: str, folder: str, threads: int, overrides: list[str]) -> tuple[int, float, float]:
    """Return particles, wall time of the loop with its output [s] and peak memory [bytes] of a run."""
    process = subprocess.run([sys.executable, "-c", MEASURE, case, f"{folder}/run", str(threads), *overrides],
                          capture_output=True, text=True, check=True)  # fmt: skip
    summary = json.loads(Path(folder, "run", "summary.json").read_text())
    return summary["particles"], summary["wall_seconds"], float(process.stdout.split("peak")[1])


def stepping(folder: str, threads: int, overrides: list[str], counts: tuple[int, int]) -> tuple[int, float]:
    """Return particles and microseconds per particle-step between two numbers of steps: output is in neither."""
    runs = [cost("sphere_on_plate", folder, threads, [*overrides, f"time.max_steps={steps}"]) for steps in counts]
    particles, (short, long) = runs[0][0], (wall for _, wall, _ in runs)
    return particles, 1e6 * (long - short) / (counts[1] - counts[0]) / particles


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--resolution", default="0.19 mm", help="dx of the 3D case")
    parser.add_argument("--steps", default="20,100", help="steps are timed from the first number to the second")
    options = parser.parse_args()
    counts = tuple(int(count) for count in options.steps.split(","))
    with tempfile.TemporaryDirectory() as folder:
        large = [f"resolution={options.resolution}", "output.every=null", "expected={}"]
        cost("sphere_on_plate", folder, 1, [*large, "time.max_steps=1"])  # fills the cache of compiled loops
        turns = [[stepping(folder, threads, large, counts) for threads in (1, 2)] for _ in range(3)]
        one, two = (min(turn[k] for turn in turns) for k in range(2))
        print(
            f"3D, {one[0]} particles: {one[1]:.3f} us per particle-step on one thread, {two[1]:.3f} on two: {one[1] / two[1]:.2f} times"
        )
        for name, sizes in (("al_al", ("0.1 mm", "0.025 mm")), ("sphere_on_plate", ("0.5 mm", "0.1 mm"))):
            (n, _, low), (m, _, high) = (
                cost(name, folder, 1, [f"resolution={dx}", "output.every=null", "time.max_steps=3"]) for dx in sizes
            )
            print(
                f"{name}: {(high - low) / (m - n) / 1000:.2f} kB per particle between {n} and {m} particles, output included"
            )


if __name__ == "__main__":
    main()
