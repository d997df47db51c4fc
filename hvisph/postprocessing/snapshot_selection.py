"""Selection of snapshots for pictures, their titles, and pictures of final states."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from hvisph.casefile.document import formulation, symmetry_axes
from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.core.measure_catalogue import axis_unit, format_time
from hvisph.output.reader import snapshots_at
from hvisph.output.snapshot import Snapshot
from hvisph.visualization.particles import Look, Moment, usual_view, view_picture


def shown_moments(
    path: Path, at: Sequence[float] | str | None, named: bool, bodies: Sequence[str] | None = None
) -> list[Moment]:
    """Return moments of a run, or a snapshot's file, with time, spacing and formulation as their titles.

    `path`: folder of a run, or a snapshot.
    `at`: times [s], ``all``, or None for the last.
    `named`: whether titles begin with the run's name.
    `bodies`: names of those to show; None for all.

    Raises `CaseError` when there is no such run or body, or the run holds no snapshot; `OutputError` when one is
    damaged.
    """
    if not path.exists():
        raise CaseError(f"there is no run at {path}")
    return [moment_of(_part(snapshot, bodies), path.name if named else "") for snapshot in snapshots_at(path, at)]


def _part(snapshot: Snapshot, bodies: Sequence[str] | None) -> Snapshot:
    """Return the particles of the bodies with these names alone."""
    if bodies is None:
        return snapshot
    for name in bodies:
        if name not in snapshot.bodies:
            raise CaseError(f"there is no body '{name}'{suggest_nearest(name, snapshot.bodies)}", where="--bodies")
    return snapshot.part(np.isin(snapshot.body, [snapshot.bodies.index(name) for name in bodies]))


def draw_last_states(runs: Mapping[str, Path], path: Path, field: str) -> Path:
    """Draw the last states of runs (folders, or snapshots, by name) side by side, coloured by a field, and store it."""
    moments = [moment_of(next(snapshots_at(source, None)), name) for name, source in runs.items()]
    return view_picture(moments, path, Look(field, view=usual_view(moments[0])))


def moment_of(snapshot: Snapshot, name: str = "") -> Moment:
    """Return a snapshot to show, with its name, and below it time, spacing and formulation, in its title."""
    unitless = snapshot.metadata.get("units") == "none"
    parts = []
    parts.append(f"t = {snapshot.time:.4g}" if unitless else f"t = {format_time(snapshot.time, '.2f')}")
    spacing = snapshot.metadata.get("spacing")
    if isinstance(spacing, float):
        unit, factor = axis_unit("mm", [spacing])
        parts.append(f"dx = {spacing:.3g}" if unitless else f"dx = {spacing * factor:.3g} {unit}")
    case = snapshot.metadata.get("case")
    parts.append(formulation(case))
    words = ", ".join(part for part in parts if part)
    return Moment(snapshot, symmetry_axes(case), f"{name}\n{words}" if name else words)
