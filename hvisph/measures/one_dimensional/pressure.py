"""Centre pressure: which particles to watch, and the peaks of their recorded histories.

The run records, every step, `centre_pressure` (mean pressure of the projectile particles that began
within 0.3 mm of its centre) and `axis_pressure_min` (lowest pressure of any projectile particle that
began within dx of the shot line). Peaks are the largest and smallest samples, without interpolation:
with a value at every step there is nothing to gain from it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hvisph.measures.result import Result, meaningless

CENTRE_RADIUS = 0.3e-3  # [m]
CENTRE_COLUMN, AXIS_COLUMN = "centre_pressure", "axis_pressure_min"


def centre_particles(
    position: np.ndarray, spacing: float, axis: np.ndarray | None = None, radius: float | None = None
) -> np.ndarray:
    """Choose the particles that began near the projectile's centre.

    Parameters
    ----------
    position
        The projectile's particles at the start, shape (n, dim) [m].
    spacing
        dx [m].
    axis
        Lateral coordinates of the shot line, shape (dim - 1,) [m], as `Scene.axis` gives them;
        by default those of the body's own centre.
    radius
        How near [m]; by default 0.3 mm, or a tenth of the width of a projectile below 3 mm.

    Returns
    -------
    numpy.ndarray
        Rows of `position`. Where none is so near, all that are nearest.
    """
    centre = np.concatenate([position[:, :1].mean(axis=0), _axis(position, axis)])
    if radius is None:
        width = np.ptp(position[:, 0]) + spacing
        radius = min(CENTRE_RADIUS, 0.1 * float(width))
    distance = np.sqrt(((position - centre) ** 2).sum(axis=1))
    # a node of the lattice on the limit, or one of several nearest, must not depend on round-off
    limit = max(radius, float(distance.min())) + 1e-6 * spacing
    return np.flatnonzero(distance <= limit)


def axis_particles(position: np.ndarray, spacing: float, axis: np.ndarray | None = None) -> np.ndarray:
    """Choose the particles that began within dx of the shot line; all of them in 1D.

    Parameters
    ----------
    position
        The projectile's particles at the start, shape (n, dim) [m].
    spacing
        dx [m].
    axis
        As for `centre_particles`.

    Returns
    -------
    numpy.ndarray
        Rows of `position`.
    """
    lateral = position[:, 1:] - _axis(position, axis)
    distance = np.sqrt((lateral**2).sum(axis=1))
    return np.flatnonzero(distance <= max(spacing, float(distance.min())) + 1e-6 * spacing)


def centre_pressure_peak(history: Mapping[str, np.ndarray] | None, until: float = np.inf) -> Result:
    """Return the largest recorded centre pressure [Pa] up to time `until` [s], and when it was."""
    return _peak(history, CENTRE_COLUMN, 1.0, until)


def centre_tension_peak(history: Mapping[str, np.ndarray] | None, until: float = np.inf) -> Result:
    """Return the largest recorded tension [Pa] on the shot line up to time `until` [s], and when it was.

    Tension is positive: minus the lowest pressure. Zero where no particle went into tension.
    """
    return _peak(history, AXIS_COLUMN, -1.0, until)


def _axis(position: np.ndarray, axis: np.ndarray | None) -> np.ndarray:
    return position[:, 1:].mean(axis=0) if axis is None else np.asarray(axis, dtype=float)


def _peak(history: Mapping[str, np.ndarray] | None, column: str, sign: float, until: float) -> Result:
    """Largest of sign * column; its uncertainty is the step to the neighbouring samples."""
    if history is None:
        return meaningless("Pa", "there is no history: a single snapshot, or files of another code")
    if column not in history or "time" not in history:
        return meaningless("Pa", f"the history has no column '{column}'")
    try:
        time = np.asarray(history["time"], dtype=float)
        value = sign * np.asarray(history[column], dtype=float)
    except ValueError:
        return meaningless("Pa", f"column '{column}' of the history holds something else than numbers")
    kept = np.isfinite(value) & (time <= until * (1.0 + 1e-12))
    time, value = time[kept], value[kept]
    if len(value) == 0:
        return meaningless("Pa", f"column '{column}' of the history has no value up to this time")
    at = int(np.argmax(value))
    around = value[max(at - 1, 0) : at + 2]
    step = float(np.abs(around - value[at]).max())
    return Result(max(float(value[at]), 0.0), "Pa", step, time=float(time[at]))
