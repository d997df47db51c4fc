"""The cost of a particle-step against that of another state of the code: ratios of user CPU time, in turn.

    python benchmarks/against_before.py FOLDER [NAME ...] [--steps 50,250] [--rounds 3]

FOLDER is a checkout of the other state, whose package runs with this interpreter.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

NEVER = "formulation.conversion={damage: false, strain: 1e9}"
CASES = {
    "standard, 2D": ("published/al_al/sav1", []),
    "mixed correction, 2D": ("published/al_al/sav1_mixed", []),
    "Riemann, 2D": ("published/al_al/con", []),
    "Riemann with van Leer, 2D": ("published/al_al/con_van_leer", []),
    "projection, 2D": ("published/al_al/projection", []),
    "Total Lagrangian, 3D": ("published/debris_3d/adaptle", [NEVER]),
    "adaptive, 3D": ("published/debris_3d/adaptle", []),
}


def cost(checkout: str, folder: str, case: str, steps: tuple[int, int], settings: list[str]) -> float:
    """Return user CPU time of a particle-step [us] by the package in `checkout`."""
    environment = os.environ | {"PYTHONPATH": checkout, "NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    seconds = []
    for count in steps:
        command = [sys.executable, "-m", "hvisph", "run", case, "--out", "run", "--force"]
        for setting in (*settings, f"time.max_steps={count}", "output.every=null", "expected={}"):
            command += ["--set", setting]
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        process = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        summary = Path(folder, "run", "summary.json")
        if not summary.exists():
            sys.exit(process.stdout + process.stderr)
        seconds.append(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
    particles = json.loads(summary.read_text())["particles"]
    return 1e6 * (seconds[1] - seconds[0]) / (steps[1] - steps[0]) / particles


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkout")
    parser.add_argument("names", nargs="*", default=list(CASES), help=", ".join(CASES))
    parser.add_argument("--steps", default="50,250")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    first, last = (int(count) for count in options.steps.split(","))
    here = str(Path(__file__).parents[1])
    with tempfile.TemporaryDirectory() as folder:
        for title in options.names:
            case, settings = CASES[title]
            ratios = []
            for root in (here, options.checkout):  # fills the caches
                cost(root, folder, case, (1, 2), settings)
            for _ in range(options.rounds):
                now, before = (cost(root, folder, case, (first, last), settings) for root in (here, options.checkout))
                ratios.append(now / before)
                print(f"{title}: {now:.3f} us, before {before:.3f} us", flush=True)
            print(f"{title}: median ratio {statistics.median(ratios):.2f}", flush=True)


if __name__ == "__main__":
    main()
