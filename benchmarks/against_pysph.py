"""A step of the Al-Al impact by hvisph and by PySPH, in turn, on one core: user CPU time of a particle-step.

    pip install pysph
    python benchmarks/against_pysph.py [--python PYTHON_WITH_PYSPH] [--rounds 3] [--resolution 0.1]

Standard SPH with one evaluation a step in both (`pysph_al_al.py`). The cost is that of the steps between a short run and a
longer one, so that neither start nor compilation counts.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile

from against_lammps import HERE, ours, user_seconds

SHORT, LONG = 20, 320  # steps


def theirs(python: str, folder: str, dx: float, steps: int) -> tuple[float, int]:
    """Return user time [s] and particles of a run of PySPH."""
    seconds, text = user_seconds([python, str(HERE / "pysph_al_al.py"), str(dx), str(steps), f"{folder}/pysph"], folder)
    words = text.split()
    return seconds, int(words[words.index("particles") + 1])


def of_a_step(python: str, folder: str, dx: float) -> tuple[float, float]:
    """Return the costs of a particle-step by hvisph and by PySPH [us]."""
    settings = f"resolution={dx}mm", "output.formats=[hdf5]"
    low, high = (ours(folder, "al_al", *settings, f"time.max_steps={steps}") for steps in (SHORT, LONG))
    short_run, long_run = (theirs(python, folder, dx, steps) for steps in (SHORT, LONG))
    hvisph_cost = 1e6 * (high[0] - low[0]) / (LONG - SHORT) / high[1]
    pysph_cost = 1e6 * (long_run[0] - short_run[0]) / (LONG - SHORT) / long_run[1]
    print(f"  hvisph {hvisph_cost:.3f} us, {high[1]} particles; PySPH {pysph_cost:.3f} us, {long_run[1]}", flush=True)
    return hvisph_cost, pysph_cost


def main() -> None:
    """Run both in turn and print the median ratio."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--python", default=sys.executable, help="the Python that PySPH is installed for")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--resolution", type=float, default=0.1, help="dx [mm]")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        ours(folder, "al_al", "time.max_steps=2")
        theirs(options.python, folder, options.resolution, 2)
        rows = [of_a_step(options.python, folder, options.resolution) for _ in range(options.rounds)]
    print(f"  median ratio PySPH / hvisph {statistics.median(pysph / hvisph for hvisph, pysph in rows):.2f}")


if __name__ == "__main__":
    main()
