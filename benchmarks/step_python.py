"""The part of a step that is Python: cases of so few particles that the compiled loops take next to nothing.

    python benchmarks/step_python.py [--steps 2000] [--profile]

User CPU time of the step loop over its steps, history, watch and report included, on one thread: the best of several
runs, since what else the machine does only adds to it.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import resource
import tempfile
from pathlib import Path

from hvisph.casefile.loader import load_case
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


def user_seconds() -> float:
    """Return the user CPU time of this process so far [s]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_utime


class Timed(Run):
    """A run whose step loop is timed or profiled."""

    profile: cProfile.Profile | None = None
    seconds = 0.0

    def _take_steps(self) -> None:
        began = user_seconds()
        if self.profile:
            self.profile.enable()
        super()._take_steps()
        if self.profile:
            self.profile.disable()
        self.seconds = user_seconds() - began


def cost(name: str, changes: list[str], steps: int, profile: cProfile.Profile | None = None) -> tuple[int, float]:
    """Return particles, and user CPU time of a step [s]."""
    case = load_case(name, [*changes, "time.end=1 s", f"time.max_steps={steps}", "output.every=null"])
    with tempfile.TemporaryDirectory() as folder, RunFolder.create(Path(folder) / "run", True) as held:
        run = Timed(case, build(case), held, Listener())
        run.profile = profile
        if run.go().summary["status"] == "failed":
            raise RunError(f"{name} failed")
        return run.setup.particles.count, run.seconds / run.clock.steps


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--profile", action="store_true", help="print where the time goes")
    arguments = parser.parse_args()
    set_threads(1)
    print(f"{'case':<32}{'particles':>10}{'ms a step':>12}")
    for label, (name, changes) in CASES.items():
        cost(name, changes, 5)  # compiles
        found = [cost(name, changes, arguments.steps) for _ in range(arguments.repeats)]
        print(f"{label:<32}{found[0][0]:>10}{1e3 * min(seconds for _, seconds in found):>12.3f}")
        if arguments.profile:
            profile = cProfile.Profile()
            cost(name, changes, arguments.steps, profile)
            pstats.Stats(profile).sort_stats("tottime").print_stats(35)


if __name__ == "__main__":
    main()
