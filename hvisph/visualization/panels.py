"""Pictures of curves that have an axis of their own each: a material's sheet, a material point."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hvisph.core.errors import CaseError

from .curves import COLOURS, STYLES
from .history import store

PER_ROW = 2


@dataclass
class Panel:
    """Curves over one axis.

    Parameters
    ----------
    across, up
        Labels of the axes, with units.
    curves
        Label, x and y of each.
    points
        Measured points (n, 2).
    """

    across: str
    up: str
    curves: list[tuple[str, np.ndarray, np.ndarray]] = field(default_factory=list)
    points: np.ndarray | None = None


def panels_picture(panels: Sequence[Panel], path: str | os.PathLike[str], title: str = "") -> Path:
    """Draw panels beside and below one another and store them.

    Raises
    ------
    CaseError
        Where there is nothing to draw.
    """
    from matplotlib.figure import Figure

    shown = [panel for panel in panels if panel.curves]
    if not shown:
        raise CaseError("there is nothing to draw")
    down = -(-len(shown) // PER_ROW)
    figure = Figure(figsize=(10.0, 0.6 + 3.4 * down), dpi=110, layout="constrained")
    axes = figure.subplots(down, min(PER_ROW, len(shown)), squeeze=False).ravel()
    for axis, panel in zip(axes, shown, strict=False):
        for number, (label, x, y) in enumerate(panel.curves):
            style = STYLES[number // len(COLOURS) % len(STYLES)]
            axis.plot(x, y, color=COLOURS[number % len(COLOURS)], ls=style, lw=1.4, label=label)
        if panel.points is not None:
            axis.plot(panel.points[:, 0], panel.points[:, 1], "ko", ms=3, label="measured")
        axis.set_xlabel(panel.across)
        axis.set_ylabel(panel.up)
        axis.grid(alpha=0.25, lw=0.5)
        axis.legend(fontsize=7, frameon=False)
    for axis in axes[len(shown) :]:
        axis.set_visible(False)
    figure.suptitle(title, fontsize=9)
    return store(figure, path)
