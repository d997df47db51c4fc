"""Pictures of experiments and runs: outlines, perforation maps, residual velocities and lengths."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hvisph.visualization.style import store

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK, ACCENT, FAINT, RED, GREEN = "#1b4f72", "#b9770e", "#99a3a4", "#922b21", "#1e8449"
COLOURS = ("#1b4f72", "#b9770e", "#1e8449", "#922b21", "#6c3483", "#117a65", "#515a5a", "#7d6608")
MARKS = "os^v"
BAND = 0.25  # within which the limit curve of shields is good, in diameter

Points = Sequence[Sequence[float]]


@dataclass(frozen=True)
class Panel:
    """Computed points of one shot, and measured ones beside them.

    `name`: of the shot.
    `computed`, `measured`: points (x, y).
    `scatter`: of every measured point.
    `limit`: where a measured limit stands on the axis; None for none.
    """

    name: str
    computed: Points
    measured: Points = ()
    scatter: Sequence[float] = field(default_factory=tuple)
    limit: float | None = None


@dataclass(frozen=True)
class Off:
    """Difference of a computed from a measured value: quantity, group, value, difference and scatter [%]."""

    quantity: str
    group: str
    measured: float
    off: float
    scatter: float


def _axes(count: int, most_columns: int, size: tuple[float, float]) -> tuple[Any, list[Axes]]:
    from matplotlib.figure import Figure

    columns = min(count, most_columns)
    rows = ceil(count / columns)
    figure = Figure(figsize=(size[0] * columns, size[1] * rows), dpi=110, layout="constrained")
    axes = list(figure.subplots(rows, columns, squeeze=False).flat)
    for axis in axes[count:]:
        axis.set_visible(False)
    for axis in axes:
        axis.grid(alpha=0.25, lw=0.5)
    return figure, axes


def outlines_picture(panels: Sequence[Panel], path: str | os.PathLike[str]) -> Path:
    """Draw measured points (z, r) over computed outlines, both sides of the axis [mm], and store the picture."""
    figure, axes = _axes(len(panels), 5, (2.3, 4.2))
    for axis, panel in zip(axes, panels, strict=False):
        for side, labels in ((-1.0, ("_", "_")), (1.0, ("computed", "measured"))):
            axis.plot([side * r for _, r in panel.computed], [z for z, _ in panel.computed], color=INK, lw=1.4,
                      label=labels[0])  # fmt: skip
            axis.errorbar([side * r for _, r in panel.measured], [z for z, _ in panel.measured], xerr=panel.scatter,
                          fmt="o", ms=3.5, lw=0.8, color=ACCENT, label=labels[1])  # fmt: skip
        axis.set_aspect("equal")
        axis.set_title(panel.name, fontsize=8)
        axis.set_xlabel("r [mm]")
    axes[0].set_ylabel("distance from the wall [mm]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=8)
    return store(figure, path)


def offs_picture(offs: Sequence[Off], names: Mapping[str, str], path: str | os.PathLike[str]) -> Path:
    """Draw the differences over the measured values, one panel for each quantity, and store the picture.

    `offs`: the numbers.
    `names`: what stands along the axis of each quantity; a panel each, in this order.
    `path`: file to write.
    """
    figure, axes = _axes(len(names), 3, (4.4, 3.4))
    groups = list(dict.fromkeys(point.group for point in offs))
    marks: dict[str, Any] = {}
    for axis, (name, label) in zip(axes, names.items(), strict=False):
        axis.axhline(0.0, color=FAINT, lw=0.8)
        for point in offs:
            if point.quantity == name:
                number = groups.index(point.group)
                mark, colour = MARKS[number // len(COLOURS) % len(MARKS)], COLOURS[number % len(COLOURS)]
                marks[point.group] = axis.errorbar(point.measured, point.off, yerr=point.scatter, ms=4, lw=0.8,
                                                   fmt=mark, color=colour)  # fmt: skip
        axis.set_xlabel(label)
        axis.set_ylabel("computed less measured [%]")
    if any(marks):
        figure.legend(list(marks.values()), list(marks), loc="outside lower center", ncols=4, fontsize=7)
    return store(figure, path)


def verdict_map(shots: Sequence[tuple[float, float, bool | None, bool]], path: str | os.PathLike[str]) -> Path:
    """Draw verdicts over impact velocity and diameter, beside the limit curve, and store the picture.

    `shots`: of each shot its velocity [km/s], diameter over the critical one, and whether it went through: computed
      (None where the run does not tell) and measured.
    `path`: file to write.
    """
    figure, (axis,) = _axes(1, 1, (7.5, 4.5))
    axis.axhline(1.0, color="black", lw=0.9, label="limit curve")
    axis.axhspan(1.0 - BAND, 1.0 + BAND, color=FAINT, alpha=0.2, lw=0, label=f"±{100 * BAND:.0f} %")
    words = {True: ", computed too", False: ", computed otherwise", None: ", run undecided"}
    labels = set()
    for speed, ratio, computed, measured in shots:
        right = None if computed is None else computed == measured
        label = ("perforated" if measured else "held") + words[right]
        fill = {True: None, False: "none", None: "#ffffff"}[right]
        axis.plot(speed, ratio, "v" if measured else "o", ms=7, color=RED if measured else GREEN, mfc=fill, mew=1.4,
                  label="_" if label in labels else label)  # fmt: skip
        labels.add(label)
    axis.set_xlabel("impact velocity [km/s]")
    axis.set_ylabel("sphere's diameter over the critical one")
    axis.legend(fontsize=7, ncols=2)
    return store(figure, path)


def residual_picture(panels: Sequence[Panel], path: str | os.PathLike[str]) -> Path:
    """Draw residual over impact velocity [m/s] with the measured limit, a panel a shot, and store the picture."""
    figure, axes = _axes(len(panels), 3, (4.0, 3.4))
    for axis, panel in zip(axes, panels, strict=False):
        for points, style, colour, label in ((panel.computed, "o-", INK, "computed"),
                                             (panel.measured, "s", ACCENT, "recalled")):  # fmt: skip
            if points:
                x, y = zip(*points, strict=True)
                axis.plot(x, y, style, color=colour, ms=4, lw=1.2, mfc="none", label=label)
        if panel.limit is not None:
            axis.axvline(panel.limit, color=ACCENT, lw=1.0, label="limit, measured")
        axis.set_title(panel.name, fontsize=9)
        axis.set_xlabel("impact velocity [m/s]")
        axis.set_ylabel("residual velocity [m/s]")
        axis.legend(fontsize=7)
    return store(figure, path)
