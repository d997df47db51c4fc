"""Threads and small cases: what a second thread gives or costs, by number of particles, on the machine as it is.

    python benchmarks/small_cases.py [--resolutions 0.5,0.25,0.1] [--steps 300] [--spin 0,20000] [--formulation riemann]

Every configuration is a process of its own that steps the al_al_coarse's impact at some resolution; configurations take
turns, so that what else the machine does falls on all alike. Best and median wall time and median CPU time a step,
files aside, and the ratio of wall times to one thread's in the same turn. ``--busy N`` keeps N processes spinning beside them.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from hvisph.precheck.estimate import available_threads


def measure(resolution: float, formulation: str, threads: int, steps: int) -> dict[str, float]:
    """Step one case in this process; return particles, wall and CPU time a step [ms]."""
    from hvisph.casefile.loader import load_case
    from hvisph.output.run_folder import RunFolder
    from hvisph.setup.build import build
    from hvisph.simulation.listener import Listener
    from hvisph.simulation.loop import Run
    from hvisph.simulation.run import set_threads

    class Timed(Run):
        wall = cpu = 0.0

        def _advance(self) -> None:
            wall, cpu = time.perf_counter(), time.process_time()
            super()._advance()
            self.wall += time.perf_counter() - wall
            self.cpu += time.process_time() - cpu

    changes = [f"resolution={resolution} mm", "output.every=null", f"time.max_steps={steps}"]
    case = load_case("al_al_coarse", [*changes, f"formulation={{type: {formulation}}}"])
    set_threads(threads)
    with tempfile.TemporaryDirectory() as folder, RunFolder.create(Path(folder) / "run", True) as run_folder:
        run = Timed(case, build(case), run_folder, Listener())
        particles = run.setup.particles.count  # a run that has ended holds none
        run.go()
        milliseconds = 1e3 / run.clock.steps
        return {"particles": particles, "wall": milliseconds * run.wall, "cpu": milliseconds * run.cpu}


def apart(arguments: list[str], spin: str) -> dict[str, float]:
    """Return what a process of its own measures."""
    environment = {name: value for name, value in os.environ.items() if not name.endswith("NUM_THREADS")}
    command = [sys.executable, __file__, "--measure", *arguments]
    done = subprocess.run(command, env=environment | {"GOMP_SPINCOUNT": spin}, capture_output=True, check=True)
    return dict(json.loads(done.stdout.splitlines()[-1]))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--resolutions", default="0.25,0.15,0.1")
    parser.add_argument("--formulation", default="eulerian")
    parser.add_argument("--threads", default=f"1,{available_threads()}")
    parser.add_argument("--spin", default="0,20000", help="GOMP_SPINCOUNT of more than one thread")
    parser.add_argument("--steps", default="300")
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--busy", type=int, default=0)
    parser.add_argument("--measure", nargs=4, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        resolution, formulation, threads, steps = options.measure
        print(json.dumps(measure(float(resolution), formulation, int(threads), int(steps))))
        return
    spinners = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(options.busy)]
    try:
        print(
            f"{'particles':>9}{'threads':>8}{'spin':>7}{'wall best':>11}{'median':>8}{'cpu':>8}{'ratio':>7}  [ms a step]"
        )
        for resolution in options.resolutions.split(","):
            ways = [("1", "0")]
            ways += [(n, s) for n in options.threads.split(",") if n != "1" for s in options.spin.split(",")]
            apart([resolution, options.formulation, "1", "3"], "0")  # compiles
            turns = [[apart([resolution, options.formulation, n, options.steps], s) for n, s in ways]
                     for _ in range(options.turns)]  # fmt: skip
            for k, (threads, spin) in enumerate(ways):
                wall = [turn[k]["wall"] for turn in turns]
                ratio = statistics.median(turn[k]["wall"] / turn[0]["wall"] for turn in turns)
                cpu = statistics.median(turn[k]["cpu"] for turn in turns)
                print(f"{turns[0][0]['particles']:>9}{threads:>8}{spin:>7}{min(wall):>11.2f}"
                      f"{statistics.median(wall):>8.2f}{cpu:>8.2f}{ratio:>7.2f}", flush=True)  # fmt: skip
    finally:
        for process in spinners:
            process.kill()


if __name__ == "__main__":
    main()
