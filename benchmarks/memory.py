"""Peak of memory of whole runs, and what `check` promises of it, from 100,000 to 1,000,000 particles in 2D and 3D.

    python benchmarks/memory.py [--only 2D] [--formulations eulerian riemann] [--particles 100000 300000 1000000]

Each run is a process of its own on one thread: few steps, so many `--moments` of output in each, the end with its
files, measures and summary. A small run of each fills the cache of compiled loops; what it takes is told, too.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile

from hvisph.casefile.loader import load_case
from hvisph.precheck.estimate import estimated_steps, rough_count

CASES = {"2D": ("al_al", 0.1), "3D": ("sphere_on_plate", 0.25)}  # and its spacing [mm]
FEW, STEPS = 3000, 4
# What begins a process counts to its peak, so the one that begins them makes no particles.
MEASURE = """
import sys
from hvisph.casefile.loader import load_case
from hvisph.precheck.estimate import estimate
from hvisph.core.memory import peak_memory
from hvisph.simulation.run import run
case = load_case(sys.argv[1], overrides=sys.argv[3:])
outcome = run(case, sys.argv[2], force=True, threads=1)
peak = peak_memory()
print("measured", outcome.summary["particles"], peak, estimate(case).memory)
"""


def measured(folder: str, name: str, settings: list[str], moments: float) -> tuple[int, float, float]:
    """Return particles, the peak of memory and what is promised [bytes] of few steps, so many `moments` in each."""
    case = load_case(name, overrides=settings)
    every = case.time.end / estimated_steps(case) / moments
    shown = [*settings, f"time.max_steps={STEPS}", f"output.every={every}", "expected=null"]
    done = subprocess.run([sys.executable, "-c", MEASURE, name, f"{folder}/run", *shown],
                          capture_output=True, text=True, check=True)  # fmt: skip
    count, peak, promised = done.stdout.split("measured")[1].split()
    return int(count), float(peak), float(promised)


def main() -> None:
    """Print a line a run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=CASES, nargs="*", default=list(CASES))
    parser.add_argument("--formulations", nargs="*", default=["eulerian", "riemann"])
    parser.add_argument("--particles", type=int, nargs="*", default=[100_000, 300_000, 1_000_000])
    parser.add_argument("--moments", type=float, default=0.7, help="moments of output a step")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for title in options.only:
            name, dx = CASES[title]
            for formulation in options.formulations:
                kind = f"formulation={{type: {formulation}}}"
                whole = rough_count(load_case(name, overrides=[kind]))
                least = 0.0
                for count in (FEW, *options.particles):
                    finer = f"resolution={dx * (whole / count) ** (1 / int(title[0])):.4g}mm"
                    if count == FEW:
                        measured(folder, name, [kind, finer], options.moments)  # fills the cache
                    n, peak, promised = measured(folder, name, [kind, finer], options.moments)
                    least = least or peak
                    print(
                        f"{title} {formulation}, {n} particles: {peak / 1e6:.0f} MB, {(peak - least) / n / 1e3:.2f} kB a "
                        f"particle above the smallest; promised {promised / 1e6:.0f} MB, {promised / peak:.2f} times that",
                        flush=True,
                    )


if __name__ == "__main__":
    main()
