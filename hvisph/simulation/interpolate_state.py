"""Interpolation of the state within a step, and release of a finished run's arrays.

So snapshots may show any moment, and no step is cut for them. Velocity, density, energy, stress and damage are
linear in time, as the integrator takes them to be, and a stress between two on the yield surface is not beyond it.
A straight velocity carries less kinetic energy than the straight line between the two energies; what is missing,
s (1 - s) |dv|^2 / 2 at the share s of the step, is internal, so the total is that of the steps to round-off.
"""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np

from hvisph.core.particles import Particles


def interpolate_state(before: np.ndarray, particles: Particles, share: float, dt: float) -> Particles:
    """Return the state at a `share` 0 to 1 of a step `dt` [s]; overwrites `before` (count, width)."""
    at = copy(particles)
    at.data = before
    gained = particles["velocity"] - at["velocity"]
    for now, column in zip(particles.data.T, before.T, strict=True):  # a column at a time: no copy of the whole
        column += share * (now - column)
    bulge = 0.5 * share * (1.0 - share)
    at["position"] -= bulge * dt * gained
    at["internal_energy"] += bulge * (gained**2).sum(axis=1)
    if "kernel_type" in at.offsets:  # there is nothing between the two
        at["kernel_type"] = particles["kernel_type"]
    return at


def release_arrays(holder: Any, _seen: set[int] | None = None) -> None:
    """Release the arrays of an object and of the objects it contains; it cannot be used afterwards."""
    seen = set() if _seen is None else _seen
    if id(holder) in seen or not hasattr(holder, "__dict__") or not type(holder).__module__.startswith("hvisph."):
        return
    seen.add(id(holder))
    frozen = getattr(type(holder), "__dataclass_params__", None)
    if frozen is not None and frozen.frozen:
        return
    for name, value in vars(holder).items():
        if isinstance(value, np.ndarray):
            vars(holder)[name] = np.empty((0, *value.shape[1:]), value.dtype)
        elif isinstance(value, list | tuple):
            for one in value:
                release_arrays(one, seen)
        else:
            release_arrays(value, seen)
