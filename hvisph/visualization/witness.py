"""Pictures of a witness plane: map of areal momentum, and mean pressure over the radius."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.measures.debris.cloud import Cloud

from .curves import COLOURS
from .history import store

CELLS = 60  # of the map, each way
WIDE = 0.99  # share of the mass that the map shows


def witness_picture(cloud: Cloud, path: str | os.PathLike[str], title: str = "") -> Path:
    """Draw what the witness plane of a cloud receives, and store it.

    Raises
    ------
    CaseError
        Without a plane, or where nothing arrives there.
    """
    from matplotlib.figure import Figure

    came = cloud.arrivals
    if came is None or len(came.when) == 0:
        reason = next((result.reason for result in cloud.results.values() if result.reason), "no particle flies there")
        raise CaseError(f"no witness plane receives anything: {reason}")
    flat = came.where.shape[1] == 1
    figure = Figure(figsize=(5.2 if flat else 10.0, 4.2), dpi=110, layout="constrained")
    axes = figure.subplots(1, 1 if flat else 2, squeeze=False)[0]
    if not flat:
        reach = float(np.sort(came.radius)[int(WIDE * (len(came.radius) - 1))])
        edges = np.linspace(-reach, reach, CELLS + 1)
        sums = np.histogram2d(came.where[:, 0], came.where[:, 1], edges, weights=came.momentum)[0]
        area = float(edges[1] - edges[0]) ** 2
        shown = np.ma.masked_less_equal(sums.T / area, 0.0)
        drawn = axes[0].pcolormesh(edges * 1e3, edges * 1e3, shown, cmap="viridis")
        figure.colorbar(drawn, ax=axes[0], label="areal momentum [Pa s]")
        axes[0].set_aspect("equal")
        axes[0].set_xlabel("y from the shot line [mm]")
        axes[0].set_ylabel("z from the shot line [mm]")
    told = cloud.witness
    radius = np.array([0.0, *told["radius"]]) * 1e3
    over = axes[-1]
    over.stairs(told["areal_momentum"], radius, color=COLOURS[0], lw=1.4, label="areal momentum")
    over.set_xlabel("radius [mm]" if not flat else "distance from the shot line [mm]")
    over.set_ylabel("areal momentum [Pa s]", color=COLOURS[0])
    other = over.twinx()
    other.stairs(np.array(told["pressure"]) * 1e-6, radius, color=COLOURS[1], lw=1.2, label="mean pressure")
    other.set_ylabel("mean pressure while it arrives [MPa]", color=COLOURS[1])
    over.grid(alpha=0.25, lw=0.5)
    arrives = f"x = {came.x * 1e3:g} mm, {told['first'] * 1e6:.3g} to {told['last'] * 1e6:.3g} us"
    figure.suptitle(f"{title}: {arrives}" if title else arrives, fontsize=9)
    return store(figure, path)
