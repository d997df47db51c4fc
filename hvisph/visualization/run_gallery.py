"""Several runs in one picture: a panel each, on the same axes and the same scale of colours."""

from __future__ import annotations

import math
import os
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.measures.frame.measurement_frame import Scene
from hvisph.output.snapshot import Snapshot

from .history import (
    body_marks,
    colour_bar_extension,
    draw_particles,
    draw_profile,
    field_range,
    field_values,
    lengths,
    store,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, TALLEST = 12.0, 7.0  # of the picture, of a panel [in]; at most
ASIDE, ABOVE, BELOW = 1.7, 0.5, 0.55  # room for the colour bar and y, for the name of each panel, for x [in]
NAME_WIDTH = 26  # characters of a panel's name on a line: what the narrowest panel takes
OUTSIDE = 0.02  # share of particles beyond each end of the colours: debris would set the scale otherwise
STRAY = 0.001  # share of each run's particles that may lie outside of the axes on either side
MOST = 40  # panels


def gallery(
    moments: Mapping[str, Snapshot],
    path: str | os.PathLike[str],
    field: str = "pressure",
) -> Path:
    """Draw snapshots side by side and store the picture.

    The colour scale is that of all particles, less the outermost 2 %.

    Parameters
    ----------
    moments
        Snapshots by the name of their run, all of the same number of dimensions.
    path
        File to write; its ending tells the format.
    field
        A field that all of them have, or ``body``.

    Raises
    ------
    CaseError
        When a snapshot has no such field, their dimensions differ, or there are none or too many.
    """
    from matplotlib.figure import Figure

    if not 1 <= len(moments) <= MOST:
        raise CaseError(f"a picture shows 1 to {MOST} runs, not {len(moments)}", where="--picture")
    dimensions = {snapshot.dimensions for snapshot in moments.values()}
    if len(dimensions) > 1:
        sizes = ", ".join(f"{name} is {snapshot.dimensions}D" for name, snapshot in moments.items())
        raise CaseError(f"runs of different dimensions have no axes in common: {sizes}", where="--picture")
    figure = Figure(dpi=150, layout="constrained")
    if dimensions == {1}:
        _profiles(figure, moments, field)
    else:
        _panels(figure, {name: Scene(snapshot) for name, snapshot in moments.items()}, field)
    return store(figure, path)


def _panels(figure: Figure, scenes: Mapping[str, Scene], field: str) -> None:
    shown = {name: _visible(scene) for name, scene in scenes.items()}
    # runs of other codes may name their bodies otherwise: the legend is that of the first, and so are the units
    first = next(iter(scenes.values())).now
    corners = _extent([scene.position[shown[name], :2] for name, scene in scenes.items()])
    unit, factor = lengths(first, corners)
    low, high = (end * factor for end in corners)
    columns = _columns(len(scenes), (high[1] - low[1]) / (high[0] - low[0]))
    rows = math.ceil(len(scenes) / columns)
    aspect = (high[1] - low[1]) / (high[0] - low[0])
    panel = min((WIDTH - ASIDE) / columns, TALLEST / aspect)
    figure.set_size_inches(panel * columns + ASIDE, rows * (panel * aspect + ABOVE) + BELOW)
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    scale, values = (0.0, 1.0), np.zeros(0)
    if field != "body":
        drawn = [field_values(scene.now, field) for scene in scenes.values()]
        values = np.concatenate([v[0][shown[name]] for name, v in zip(scenes, drawn, strict=True)])
        scale = field_range(values, drawn[0][3], OUTSIDE)
    discs: Any = None
    for axes, (name, scene) in zip(grid.flat, scenes.items(), strict=False):
        discs = draw_particles(axes, scene, shown[name], field, bare=True, shared=(unit, factor))
        if discs is not None:
            discs.set_clim(*scale)
        axes.set_title(textwrap.fill(name, NAME_WIDTH), fontsize=9)
        axes.label_outer()
    grid[0, 0].set_xlim(low[0], high[0])
    grid[0, 0].set_ylim(low[1], high[1])
    for axes in grid.flat[len(scenes) :]:
        axes.set_visible(False)
    for axes in grid.flat[max(len(scenes) - columns, 0) : len(scenes)]:
        # above a panel that is not there, the labels are still needed
        axes.set_xlabel(f"x{unit}")
        axes.tick_params(labelbottom=True)
    marks = body_marks(first, first.body)
    figure.legend(handles=marks, loc="outside upper center", ncols=len(marks), fontsize=8, frameon=False)
    if discs is not None:
        ends = colour_bar_extension(values, *discs.get_clim())
        label = field_values(first, field)[1]
        figure.colorbar(discs, ax=grid, label=label, shrink=min(1.0, 0.9 / rows + 0.2), pad=0.01, extend=ends)


def _visible(scene: Scene) -> np.ndarray:
    """Return the particles to draw: in 3D those within dx of the plane through the shot line."""
    if scene.now.dimensions == 3:
        return np.flatnonzero(np.abs(scene.lateral[:, 1]) < scene.spacing)
    return np.arange(scene.now.count)


def _extent(positions: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners that hold every run but its few strays."""
    ends = [np.quantile(x, [STRAY, 1.0 - STRAY], axis=0) for x in positions if len(x)]
    if not ends:
        return np.zeros(2), np.ones(2)
    low, high = np.min([e[0] for e in ends], axis=0), np.max([e[1] for e in ends], axis=0)
    margin = 0.03 * float((high - low).max()) + 1e-9
    return low - margin, high + margin


def _columns(count: int, aspect: float) -> int:
    """Return how many panels of this height over width make a row of a wide picture with few gaps."""
    shapes = {c: math.ceil(count / c) * aspect / c for c in range(1, count + 1)}
    fitting = [c for c, shape in shapes.items() if 0.4 <= shape <= 0.9]
    if not fitting:
        return next((c for c, shape in shapes.items() if shape <= 0.9), count)
    return min(fitting, key=lambda c: (-count % c, c))


def _profiles(figure: Figure, moments: Mapping[str, Snapshot], field: str) -> None:
    columns = 1 if len(moments) < 3 else 2 if len(moments) < 9 else 3
    rows = math.ceil(len(moments) / columns)
    figure.set_size_inches(WIDTH, 2.6 * rows)
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axes, (name, snapshot) in zip(grid.flat, moments.items(), strict=False):
        draw_profile(axes, snapshot, field)
        axes.set_title(textwrap.fill(name, NAME_WIDTH), fontsize=9)
        axes.label_outer()
    for axes in grid.flat[len(moments) :]:
        axes.set_visible(False)
