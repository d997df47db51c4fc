"""The plot of the page on performance, from the table on it.

python tools/performance_plot.py
"""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt

DOCS = Path(__file__).parents[1] / "docs"
HEADER = "| code | 2D | 3D |"


def rows(text: str) -> list[tuple[str, float, float]]:
    """Return codes and their costs of a particle-step [us], not a number where there is none."""
    lines = text[text.index(HEADER) :].splitlines()[2:]
    found = []
    for line in lines[: lines.index("")]:
        name, *costs = (part.strip() for part in line.strip("|").split("|"))
        found.append((name, *(float(cost or "nan") for cost in costs)))
    return found


def main() -> None:
    """Draw it."""
    table = rows((DOCS / "performance.md").read_text())[::-1]
    figure, axes = plt.subplots(figsize=(7.0, 3.2), layout="constrained")
    for shift, column, colour in ((0.2, 1, "#1f5f8b"), (-0.2, 2, "#d98032")):
        values = [row[column] for row in table]
        bars = axes.barh([k + shift for k in range(len(table))], values, 0.38, color=colour, label=f"{column + 1}D")
        axes.bar_label(bars, [f"{value:g}" if value == value else "" for value in values], padding=3, fontsize=8)
    axes.set_yticks(range(len(table)), [row[0] for row in table])
    axes.set_xscale("log")
    axes.set_xlim(0.02, 5.0)
    axes.set_xlabel("microseconds of a particle-step, one core")
    axes.legend(frameon=False, loc="lower right")
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(DOCS / "images" / "particle_step.png", dpi=130)


if __name__ == "__main__":
    main()
