"""How the cost of a particle-step grows with the number of particles, in 2D and in 3D, on one thread.

    python benchmarks/growth.py [--rounds 3] [--formulation eulerian]

User CPU time of processes that take many steps, less that of ones that take few, sizes in turn.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile

from against_lammps import ours

# case, and for both sizes the spacing [mm] and the numbers of steps of the two processes of a measurement: about as many
# particle-steps between the two for either size, enough that what start and end of a process vary by is a percent or two
SIZES = {
    "2D": ("al_al", ((0.042, (20, 320)), (0.0133, (5, 35)))),
    "3D": ("sphere_on_plate", ((0.2, (10, 110)), (0.09, (3, 13)))),
}


def cost(folder: str, name: str, dx: float, steps: tuple[int, int], settings: list[str]) -> tuple[float, int]:
    """Return the cost of a particle-step [us], and particles."""
    runs = [ours(folder, name, f"resolution={dx}mm", f"time.max_steps={n}", *settings) for n in steps]
    (short, count, first_steps), (long, _, last_steps) = runs
    return 1e6 * (long - short) / (last_steps - first_steps) / count, count


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--formulation", default="eulerian")
    options = parser.parse_args()
    settings = [f"formulation={{type: {options.formulation}}}"]
    with tempfile.TemporaryDirectory() as folder:
        for title, (name, sizes) in SIZES.items():
            ratios = []
            cost(folder, name, sizes[0][0], (1, 2), settings)  # fills the cache
            for _ in range(options.rounds):
                (small, n), (large, m) = (cost(folder, name, *size, settings) for size in sizes)
                ratios.append(large / small)
                print(f"{title}: {n} particles {small:.3f} us, {m} particles {large:.3f} us", flush=True)
            print(f"{title}: median growth {100 * (statistics.median(ratios) - 1):.0f} %", flush=True)


if __name__ == "__main__":
    main()
