"""Cost of a step in 1D on a hundred thousand and a million particles, one thread, whole runs.

    python benchmarks/cost_1d.py [--steps 100]

The layers of Zisis 2013 (staggered, Gaussian kernel to 3h, variable h, density dissipation) and the
elastic-plastic plates (leapfrog, cubic spline, stiffened gas with strength), each from the case to its summary.
Processor time, so that other work on the machine counts little. Two lengths of run are subtracted, so that
building, the first and last snapshots and the summary are left out of the steps' cost; they are shown beside.
Last, the compiled passes of a step alone, the best of a dozen.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile

import numba
from pair_pass import best

from hvisph.casefile.loader import load_case
from hvisph.setup.build import build

# Resolution for about 1e5 and 1e6 particles.
CASES = {
    "published/layered/test": ("1.1e-5", "1.1e-6"),
    "plate_impact_600": ("0.2 um", "0.02 um"),
}
LONGER = 4
MEASURE = """
import resource, sys, time
from hvisph.simulation.run import run
from hvisph.casefile.loader import load_case
begin = time.process_time()
outcome = run(load_case(sys.argv[1], overrides=sys.argv[3:]), sys.argv[2], force=True, threads=1)
assert outcome.summary["status"] == "done"
print(outcome.summary["particles"], time.process_time() - begin, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
"""


def cost(case: str, folder: str, overrides: list[str]) -> tuple[int, float, int]:
    """Return particles, processor time [s] and peak memory [bytes] of a run: the best of three."""
    command = [sys.executable, "-c", MEASURE, case, f"{folder}/run", *overrides]
    runs = [subprocess.run(command, capture_output=True, text=True, check=True).stdout.split() for _ in range(3)]
    n, seconds, peak = min(runs, key=lambda row: float(row[1]))
    return int(n), float(seconds), int(peak)


def passes(case: str, overrides: list[str]) -> float:
    """Return the time of the compiled passes of a step [us per particle]: pair sums, update and criteria."""
    numba.set_num_threads(1)
    setup = build(load_case(case, overrides=overrides))
    stepper, n = setup.stepper, setup.particles.count
    stepper.start()
    stepper.permute()
    calls = (
        stepper.evaluate,
        lambda: stepper.complete(1e-20, 1e-20),
        lambda: setup.criteria.limit(
            stepper.lengths, stepper.signals, stepper.rates, stepper.place, stepper.particles.id
        ),
    )
    return 1e6 / n * sum(best(call, 12) for call in calls)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=100, help="of the smaller runs; the larger take a fifth")
    options = parser.parse_args()
    print(
        f"{'case':26}{'particles':>10}{'us per particle-step':>22}{'all else, s':>13}{'kB per particle':>17}{'passes, us':>12}"
    )
    with tempfile.TemporaryDirectory() as folder:
        for case, resolutions in CASES.items():
            # a fixed step fits the published resolution alone
            free = ["time.step=null"] if case.startswith("published") else []
            for resolution, steps in zip(resolutions, (options.steps, options.steps // 5), strict=True):
                common = [f"resolution={resolution}", *free]
                n, short, _ = cost(case, folder, [*common, f"time.max_steps={steps}"])
                _, long, peak = cost(case, folder, [*common, f"time.max_steps={LONGER * steps}"])
                step = (long - short) / ((LONGER - 1) * steps)
                print(f"{case:26}{n:>10}{1e6 * step / n:>22.3f}{short - step * steps:>13.1f}{peak / n / 1000:>17.2f}"
                      f"{passes(case, common):>12.3f}")  # fmt: skip


if __name__ == "__main__":
    main()
