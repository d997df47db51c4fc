"""Cost of a step of Total Lagrangian, Eulerian and adaptive runs of the same impact, in 2D and in 3D.

    python benchmarks/total_lagrangian.py [--rounds 3]

Whole steps on one thread, output aside. In 2D the adaptive run is timed to its end, as ever more of it turns
Eulerian, and the Total Lagrangian one for as long as it survives.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path

from hvisph.casefile.loader import load_case
from hvisph.simulation.run import run

COMMON = ["output.every=null", "output.history_every=50", "expected={}"]
NEVER = "formulation.conversion={damage: false, strain: 1e9}"
RUNS = {
    "2D, Al-Al at 0.1 mm": {
        "Total Lagrangian": ("al_al/adaptle", [NEVER, "time.max_steps=500"]),
        "Eulerian": ("al_al/sav1_artificial_stress", []),
        "Eulerian in contact": ("al_al/sav1_artificial_stress",
                                ["formulation.contact={type: penalty, stiffness: 0.025}"]),
        "adaptive": ("al_al/adaptle", []),
    },
    "3D, debris at 1 mm": {
        "Total Lagrangian": ("debris_3d/adaptle", [NEVER, "time.max_steps=700"]),
        "Eulerian in contact": ("debris_3d/eul", ["time.max_steps=700"]),
        "adaptive": ("debris_3d/adaptle", ["time.max_steps=700"]),
    },
}  # fmt: skip


def cost(case: str, overrides: list[str], folder: str) -> tuple[int, float]:
    """Return particles and microseconds per particle-step of a run."""
    run(load_case(f"published/{case}", overrides=[*COMMON, *overrides]), folder, force=True, threads=1)
    summary = json.loads(Path(folder, "summary.json").read_text())
    return summary["particles"], summary["microseconds_per_particle_step"]


def main() -> None:
    """Print the table: the least of the rounds, all taken in turn."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    rounds = parser.parse_args().rounds
    with tempfile.TemporaryDirectory() as folder:
        for title, runs in RUNS.items():
            for case, overrides in runs.values():  # fills the cache of compiled loops
                cost(case, [*overrides, "time.max_steps=2"], folder)
            rounds_costs = [{name: cost(*one, folder) for name, one in runs.items()} for _ in range(rounds)]
            lowest = {name: min(one[name] for one in rounds_costs) for name in runs}
            print(f"{title}, {lowest['adaptive'][0]} particles")
            for name, (_, value) in lowest.items():
                print(f"  {name}: {value:.3f} us per particle-step")
            dearer = max(value for name, (_, value) in lowest.items() if name != "adaptive")
            print(f"  adaptive over the dearest of its parts: {lowest['adaptive'][1] / dearer:.2f}")


if __name__ == "__main__":
    main()
