"""Cost of a step in 3D on about 100,000 particles, one thread against two, and memory per particle.

python benchmarks/cost_3d.py [--resolution 0.19] [--steps 40]
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
    """Return particles, microseconds per particle-step and peak memory [bytes] of a run."""
    done = subprocess.run([sys.executable, "-c", MEASURE, case, f"{folder}/run", str(threads), *overrides],
                          capture_output=True, text=True, check=True)  # fmt: skip
    summary = json.loads(Path(folder, "run", "summary.json").read_text())
    return summary["particles"], summary["microseconds_per_particle_step"], float(done.stdout.split("peak")[1])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--resolution", default="0.19 mm", help="dx of the 3D case")
    parser.add_argument("--steps", type=int, default=40)
    options = parser.parse_args()
    fixed = ["output.every=null", f"time.max_steps={options.steps}"]
    with tempfile.TemporaryDirectory() as folder:
        large = [f"resolution={options.resolution}", *fixed]
        cost("sphere_on_plate", folder, 1, large)  # fills the cache of compiled loops
        one = min(cost("sphere_on_plate", folder, 1, large) for _ in range(3))
        two = min(cost("sphere_on_plate", folder, 2, large) for _ in range(3))
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
