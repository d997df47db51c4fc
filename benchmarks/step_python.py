"""The part of a step that is Python: cases of few particles.

    python benchmarks/step_python.py [--steps 2000] [--profile]

Wall time of a step on one thread, and what of it is spent outside compiled loops: the lowest tenth of all steps, since
what else the machine does only adds to it. Lines of the history, written once a second, are not included.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import tempfile
from pathlib import Path
from time import perf_counter

from hvisph.casefile.loader import load_case
from hvisph.compiler.lazy_import import CompiledFunction
from hvisph.core.errors import RunError
from hvisph.output.run_folder import RunFolder
from hvisph.setup.build import build
from hvisph.simulation.listener import Listener
from hvisph.simulation.loop import Run
from hvisph.simulation.run import set_threads

SMALL = ["resolution=0.5 mm", "bodies.projectile.shape.diameter=3 mm", "bodies.target.shape.size=[2 mm, 6 mm]"]
CASES = {
    "al_al_coarse, small, riemann": ("al_al_coarse", SMALL),
    "al_al_coarse, small, eulerian": ("al_al_coarse", [*SMALL, "formulation={type: eulerian}"]),
    "plate impact, 1D": ("plate_impact_al_al", ["resolution=0.1 mm"]),
}


class Timed(Run):
    """A run whose steps are timed or profiled: `seconds` and `outside` of each step."""

    profile: cProfile.Profile | None = None

    def _take_steps(self) -> None:
        self.seconds: list[float] = []
        self.outside: list[float] = []
        if self.profile:
            self.profile.enable()
        super()._take_steps()
        if self.profile:
            self.profile.disable()

    def _advance(self) -> None:
        began, LOOPS[0] = perf_counter(), 0.0
        super()._advance()
        self.seconds.append(perf_counter() - began)
        self.outside.append(self.seconds[-1] - LOOPS[0])


LOOPS = [0.0]


def timed_call(loop: CompiledFunction, *arguments: object) -> object:
    """Call a compiled loop and add its time."""
    began = perf_counter()
    result = loop.function(*arguments)
    LOOPS[0] += perf_counter() - began
    return result


def cost(name: str, changes: list[str], steps: int, profile: cProfile.Profile | None = None) -> tuple[int, Timed]:
    """Return the number of particles and the run of a case."""
    case = load_case(name, [*changes, "time.end=1 s", f"time.max_steps={steps}", "output.every=null"])
    with tempfile.TemporaryDirectory() as folder, RunFolder.create(Path(folder) / "run", True) as run_folder:
        run = Timed(case, build(case), run_folder, Listener())
        run.profile, count = profile, run.setup.particles.count
        if run.go().summary["status"] == "failed":
            raise RunError(f"{name} failed")
        return count, run


def lowest_tenth(seconds: list[float]) -> float:
    """Return what the fastest tenth of the steps takes at most [ms]."""
    return 1e3 * sorted(seconds)[len(seconds) // 10]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--profile", action="store_true", help="print where the time goes")
    arguments = parser.parse_args()
    set_threads(1)
    print(f"{'case':<32}{'particles':>10}{'ms a step':>12}{'outside loops':>15}")
    for label, (name, changes) in CASES.items():
        cost(name, changes, 5)  # compiles
        count, run = cost(name, changes, arguments.steps)
        original, CompiledFunction.__call__ = CompiledFunction.__call__, timed_call
        outside = cost(name, changes, arguments.steps)[1].outside
        CompiledFunction.__call__ = original
        print(f"{label:<32}{count:>10}{lowest_tenth(run.seconds):>12.3f}{lowest_tenth(outside):>15.3f}")
        if arguments.profile:
            profile = cProfile.Profile()
            cost(name, changes, arguments.steps, profile)
            pstats.Stats(profile).sort_stats("tottime").print_stats(35)


if __name__ == "__main__":
    main()
