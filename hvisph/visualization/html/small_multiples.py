"""Pictures of the final states of a sweep on one colour scale."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hvisph.casefile.embedded_case import symmetry_axes
from hvisph.core.errors import OutputError
from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.output.snapshot import Snapshot
from hvisph.visualization.inline import embedded_pixels
from hvisph.visualization.particles import Look, Moment, field_of, thumbnail, usual_view

MOST, WIDTH = 60, 220  # pictures, pixels across
SHARE = 0.995  # of the particles are not faster than the scale's end


def multiples(folders: Sequence[Path]) -> dict[Path, str]:
    """Return pictures of the last states of runs, coloured by speed, as addresses of images that hold themselves.

    Those of the first `MOST` runs that kept a snapshot; 1D runs have none.
    """
    kept = [folder for folder in folders if _last(folder) is not None][:MOST]
    fastest = 0.0
    for folder in kept:
        state = _last(folder)
        if state is not None:
            fastest = max(fastest, float(np.quantile(field_of(state, "speed"), SHARE)))
    return {folder: _picture(folder, max(fastest, 1e-30)) for folder in kept}


def _last(folder: Path) -> Snapshot | None:
    try:
        files = list_snapshots(folder)
        state = read_snapshot(files[-1]) if files else None
    except OutputError:
        return None
    return state if state is not None and state.dimensions > 1 else None


def _picture(folder: Path, fastest: float) -> str:
    state = _last(folder)
    assert state is not None
    moment = Moment(state, symmetry_axes(state.metadata.get("case")))
    return embedded_pixels(thumbnail(moment, Look(view=usual_view(moment)), (0.0, fastest), WIDTH))
