"""Time of a run: steps from the criteria alone, the last one cut to land on the end.

Moments of output cut no step: what they show lies between two steps (`hvisph.simulation.interpolate_state`), so the
cadence of output changes nothing in the results.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor

# A step may be longer than the one before by this factor: rates change within a few steps at a shock.
GROWTH = 1.1
# A step is lengthened by up to this share rather than that a sliver is left before the end, and what differs by less
# than it is the same moment: 10 * 0.1 us and 1 us.
SLIVER = 1e-9


@dataclass
class TimeStep:
    """A step: its length [s], what limited it, and the time that it ends on where that is the run's end."""

    length: float
    criterion: str
    lands_on: float | None = None


@dataclass
class Clock:
    """Time, steps done and the step under way.

    The rates of the step under way are known before it is completed, and the next step is chosen then.

    Parameters
    ----------
    end
        Time at which the run ends [s].
    every
        Time between outputs [s]; from the end on there is one, the end.
    fixed
        Fixed step [s], or None for steps from the criteria.

    Attributes
    ----------
    time, steps
        Time [s] and number of steps done.
    outputs
        Moments of output that are done, the start not counted.
    allowed, allowed_by
        The last step that the criteria allowed, before it was cut to land on the end [s], and which did.
    """

    end: float
    every: float
    fixed: float | None = None
    time: float = 0.0
    steps: int = 0
    outputs: int = 0
    allowed: float = 0.0
    allowed_by: str = ""

    def moment(self, number: int) -> float:
        """Return the moment of output with this number [s], at most the end."""
        return self.end if number >= self._last else number * self.every

    @property
    def _last(self) -> int:
        """Number of the last moment of output, which is the end."""
        return max(ceil(self.end / self.every - SLIVER), 1)

    def choose(self, allowed: float, criterion: str, under_way: TimeStep | None) -> TimeStep:
        """Return the step after the one under way.

        Parameters
        ----------
        allowed, criterion
            Step [s] that the criteria allow now, and the one that limits it.
        under_way
            The step that is being taken; None before the first.
        """
        if self.fixed is not None:
            return TimeStep(self.fixed, "fixed")
        if under_way is not None and allowed > GROWTH * self.allowed:
            allowed, criterion = GROWTH * self.allowed, "growth"
        self.allowed, self.allowed_by = allowed, criterion
        return TimeStep(allowed, criterion)

    def last(self, time_step: TimeStep) -> TimeStep | None:
        """Return `time_step` as cut to land on the end, if it reaches that far; None otherwise, and for fixed steps."""
        left = self.end - self.time
        if self.fixed is not None or time_step.lands_on is not None or time_step.length * (1.0 + SLIVER) < left:
            return None
        return TimeStep(left, "end", self.end)

    def output_times(self, time_step: TimeStep) -> list[float]:
        """Return the moments of output strictly inside `time_step`; none with a fixed step, whose end they wait for."""
        number, moments = self.outputs + 1, []
        if self.fixed is None:
            after = time_step.lands_on if time_step.lands_on is not None else self.time + time_step.length
            while number < self._last and self.moment(number) < after - SLIVER * time_step.length:
                moments.append(self.moment(number))
                number += 1
        return moments

    def complete(self, time_step: TimeStep) -> bool:
        """Count a step as done; return whether its end is a moment of output. Those that it passed are done too."""
        self.steps += 1
        if self.fixed is not None:
            self.time = self.steps * self.fixed
            slack = SLIVER * self.fixed
        else:
            self.outputs += len(self.output_times(time_step))
            self.time = time_step.lands_on if time_step.lands_on is not None else self.time + time_step.length
            slack = SLIVER * time_step.length
        reached = self.outputs < self._last and self.time >= self.moment(self.outputs + 1) - slack
        self.outputs += reached
        return reached

    def extend(self) -> TimeStep:
        """Return the step from here after `end` was moved, in place of the one under way."""
        self.outputs = floor(self.time / self.every * (1.0 + SLIVER))
        return self.choose(self.allowed, self.allowed_by, None)

    @property
    def is_finished(self) -> bool:
        """Whether the end is reached."""
        return self.time >= self.end - SLIVER * (self.fixed or 0.0)
