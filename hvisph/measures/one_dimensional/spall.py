"""Spall as a free surface shows it: the pull-back of its velocity, and the strength that follows from it.

    sigma = rho0 c_b du / 2

du is how far the velocity falls from its peak until the wave from the spall plane raises it again, c_b the bulk sound
speed. The acoustic formula is low by what strength and the hardening of the release leave out, some 5 to 20 %.
Novikov, Divnov & Ivanov 1966 (as in Antoun et al., Spall Fracture, 2003).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hvisph.measures.result import Result, meaningless
from hvisph.output.snapshot import Snapshot

LEAST_FALL = 0.03  # of the highest velocity: what falls by less rings
LEAST_RISE = 0.1  # of the fall: what rises by less has not been pulled back


def pull_back(history: Mapping[str, np.ndarray] | None, now: Snapshot) -> dict[str, Result]:
    """Return the pull-back velocity [m/s] and the spall strength [Pa] of the first free-surface gauge that shows one.

    Parameters
    ----------
    history
        Columns of ``history.csv``.
    now
        The moment; its metadata name the gauges under ``surfaces``: `axis`, `sign` and `impedance` rho0 c_b
        [Pa s/m] of the material behind the surface.
    """
    surfaces: Mapping[str, Any] = now.metadata.get("surfaces", {})
    reason = "there is no gauge of the type 'free_surface'"
    for name, surface in surfaces.items():
        column = f"gauge.{name}.velocity_{'xyz'[int(surface['axis'])]}"
        if history is None or column not in history or "time" not in history:
            reason = f"the history has no column '{column}'"
            continue
        seen = _fall(np.asarray(history["time"], float), float(surface["sign"]) * np.asarray(history[column], float),
                      now.time)  # fmt: skip
        if seen is None:
            reason = f"the surface at gauge '{name}' has not been pulled back"
            continue
        time, fall, spread = seen
        half = 0.5 * float(surface["impedance"])
        return {"pull_back_velocity": Result(fall, "m/s", spread, time=time),
                "spall_strength": Result(half * fall, "Pa", half * spread, time=time)}  # fmt: skip
    return {"pull_back_velocity": meaningless("m/s", reason), "spall_strength": meaningless("Pa", reason)}


def _fall(time: np.ndarray, velocity: np.ndarray, until: float) -> tuple[float, float, float] | None:
    """Return when a surface was slowest before it was pulled back [s], its fall from the peak and how sure [m/s]."""
    kept = np.isfinite(velocity) & (time <= until * (1.0 + 1e-12))
    time, velocity = time[kept], velocity[kept]
    if len(velocity) < 5:
        return None
    peak = least = 0
    highest = float(velocity.max())
    for k in range(1, len(velocity)):
        fall = velocity[peak] - velocity[least]
        if fall > LEAST_FALL * highest and velocity[k] - velocity[least] > LEAST_RISE * fall:
            around = np.concatenate([velocity[max(peak - 1, 0) : peak + 2] - velocity[peak],
                                     velocity[max(least - 1, 0) : least + 2] - velocity[least]])  # fmt: skip
            return float(time[least]), float(fall), float(np.abs(around).max())
        if velocity[k] > velocity[peak]:
            peak = least = k
        elif velocity[k] < velocity[least]:
            least = k
    return None
