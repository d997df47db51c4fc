"""Time of a run: steps follow the stability criteria alone; the last one ends at the end time.

Output times do not shorten steps: their states are interpolated, so that the output interval does not change results.
Velocity, density, energy, stress and damage are interpolated linearly in time, as in the integrator; interpolated
stresses do not exceed the yield surface. The linear velocity has less kinetic energy than the linear interpolation of
both energies. The difference s (1 - s) |dv|^2 / 2, at the fraction s of the step, is added to the internal energy;
total energy is that of the steps to round-off.
"""

from copy import copy
from dataclasses import dataclass
from math import ceil, floor
from typing import Any

import numpy as np

from hvisph.core.particles import SLAB, Particles

GROWTH = 1.1  # largest ratio of a step to the previous one; rates change within a few steps at a shock
# Share of a step by which the last step may be longer, so that no short remainder is left; also the relative
# tolerance of times: 10 * 0.1 us equals 1 us.
TIME_TOLERANCE = 1e-9


@dataclass
class TimeStep:
    """Time step: length [s], limiting criterion, and end time when it is the run's end."""

    length: float
    criterion: str
    lands_on: float | None = None


@dataclass
class Clock:
    """Time, number of completed steps and the present step.

    `every` is the output interval [s] and `fixed` a fixed step [s] or None; `outputs` counts output times reached.
    `allowed` and `allowed_by` are the last step of the criteria [s], before it was shortened to end at the end time;
    `begun` is the time of the start [s].
    """

    end: float
    every: float
    fixed: float | None = None
    time: float = 0.0
    steps: int = 0
    outputs: int = 0
    allowed: float = 0.0
    allowed_by: str = ""
    begun: float = 0.0

    def moment(self, number: int) -> float:
        """Return the output time with this number [s], at most the end."""
        return self.end if number >= self._last else self.begun + number * self.every

    @property
    def _last(self) -> int:
        """Number of the last output time, which is the end."""
        return max(ceil((self.end - self.begun) / self.every - TIME_TOLERANCE), 1)

    def choose(self, allowed: float, criterion: str, under_way: TimeStep | None) -> TimeStep:
        """Return the step after `under_way` (None before the first) for the step `allowed` [s] by a criterion."""
        if self.fixed is not None:
            return TimeStep(self.fixed, "fixed")
        if under_way is not None and allowed > GROWTH * self.allowed:
            allowed, criterion = GROWTH * self.allowed, "growth"
        self.allowed, self.allowed_by = allowed, criterion
        return TimeStep(allowed, criterion)

    def last(self, time_step: TimeStep) -> TimeStep | None:
        """Return `time_step` shortened to end at the end time if it reaches it; None otherwise and for fixed steps."""
        rest = self.end - self.time
        if self.fixed is not None or time_step.lands_on is not None or time_step.length * (1.0 + TIME_TOLERANCE) < rest:
            return None
        return TimeStep(rest, "end", self.end)

    def output_times(self, time_step: TimeStep) -> list[float]:
        """Return the output times strictly inside `time_step`; none with a fixed step."""
        number, moments = self.outputs + 1, []
        if self.fixed is None:
            after = time_step.lands_on if time_step.lands_on is not None else self.time + time_step.length
            while number < self._last and self.moment(number) < after - TIME_TOLERANCE * time_step.length:
                moments.append(self.moment(number))
                number += 1
        return moments

    def complete(self, time_step: TimeStep) -> bool:
        """Advance the time by a step; return whether its end is an output time."""
        self.steps += 1
        if self.fixed is not None:
            self.time = self.steps * self.fixed
            slack = TIME_TOLERANCE * self.fixed
        else:
            self.outputs += len(self.output_times(time_step))
            self.time = time_step.lands_on if time_step.lands_on is not None else self.time + time_step.length
            slack = TIME_TOLERANCE * time_step.length
        is_output = self.outputs < self._last and self.time >= self.moment(self.outputs + 1) - slack
        self.outputs += is_output
        return is_output

    def extend(self) -> TimeStep:
        """Return the present step after `end` was moved."""
        self.outputs = floor((self.time - self.begun) / self.every * (1.0 + TIME_TOLERANCE))
        return self.choose(self.allowed, self.allowed_by, None)

    @property
    def is_finished(self) -> bool:
        """Whether the end is reached."""
        return self.time >= self.end - TIME_TOLERANCE * (self.fixed or 0.0)


def interpolate_state(before: np.ndarray, particles: Particles, share: float, dt: float) -> Particles:
    """Return the state at a `share` 0 to 1 of a step `dt` [s]; overwrites `before` (count, width)."""
    at = copy(particles)
    at.data = before
    bulge = 0.5 * share * (1.0 - share)
    for first in range(0, len(before), SLAB):  # no copy of the whole
        rows = slice(first, first + SLAB)
        gained = particles["velocity"][rows] - at["velocity"][rows]
        end, slab = particles.data[rows], before[rows]
        endless = np.isinf(end)  # density without pressure of particles in free flight in a late stage: it has no mean
        slab += share * np.subtract(end, slab, out=np.zeros_like(end), where=~endless)
        slab[endless] = end[endless]
        at["position"][rows] -= bulge * dt * gained
        at["internal_energy"][rows] += bulge * (gained**2).sum(axis=1)
    if "kernel_type" in at.offsets:  # there is nothing between the two
        at["kernel_type"] = particles["kernel_type"]
    return at


def release_arrays(holder: Any, _visited: set[int] | None = None) -> None:
    """Release the arrays of an object and of the objects it contains; it cannot be used afterwards."""
    visited = set() if _visited is None else _visited
    if id(holder) in visited or not hasattr(holder, "__dict__") or not type(holder).__module__.startswith("hvisph."):
        return
    visited.add(id(holder))
    frozen = getattr(type(holder), "__dataclass_params__", None)
    if frozen is not None and frozen.frozen:
        return
    for name, value in vars(holder).items():
        if isinstance(value, np.ndarray):
            vars(holder)[name] = np.empty((0, *value.shape[1:]), value.dtype)
        elif isinstance(value, list | tuple):
            for item in value:
                release_arrays(item, visited)
        else:
            release_arrays(value, visited)
