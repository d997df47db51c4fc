"""Draw the cost of a particle-step of several codes: `python tools/performance_plot.py`."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt

PICTURE = Path(__file__).parents[1] / "docs" / "images" / "particle_step.png"
NONE = float("nan")
# Microseconds of a particle-step on one core in 2D and 3D: `benchmarks/against_lammps.py`, `against_pysph.py`.
COSTS = {
    "PySPH": (2.02, NONE),
    "LAMMPS": (0.66, 2.04),
    "hvisph, eulerian": (0.22, 0.55),
    "by hand in C": (0.105, 0.36),
    "instructions counted": (0.04, 0.10),
}


def main() -> None:
    """Draw the picture."""
    codes = list(COSTS)[::-1]
    figure, axes = plt.subplots(figsize=(7.0, 3.2), layout="constrained")
    for shift, dim, colour in ((0.2, 2, "#1f5f8b"), (-0.2, 3, "#d98032")):
        values = [COSTS[code][dim - 2] for code in codes]
        bars = axes.barh([k + shift for k in range(len(codes))], values, 0.38, color=colour, label=f"{dim}D")
        axes.bar_label(bars, [f"{value:g}" if value == value else "" for value in values], padding=3, fontsize=8)
    axes.set_yticks(range(len(codes)), codes)
    axes.set_xscale("log")
    axes.set_xlim(0.02, 5.0)
    axes.set_xlabel("microseconds of a particle-step, one core")
    axes.legend(frameon=False, loc="lower right")
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(PICTURE, dpi=130)


if __name__ == "__main__":
    main()
