"""Time of a run: the next step from the criteria, landing on the moments of output."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

# A step may be longer than the one before by this factor: rates change within a few steps at a shock.
GROWTH = 1.1


@dataclass
class Step:
    """A step: its length [s], what limited it, and the moment of output that it ends on, if any."""

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
        Time between outputs [s]; None for the end alone.
    fixed
        Fixed step [s], or None for steps from the criteria.

    Attributes
    ----------
    time, steps
        Time [s] and number of steps done.
    outputs
        Moments of output that are done, the start not counted.
    allowed, allowed_by
        The last step that the criteria allowed, before it was cut to land on an output [s], and which did.
    """

    end: float
    every: float | None = None
    fixed: float | None = None
    time: float = 0.0
    steps: int = 0
    outputs: int = 0
    allowed: float = 0.0
    allowed_by: str = ""

    def moment(self, number: int) -> float:
        """Return the moment of output with this number [s], at most the end."""
        return self.end if self.every is None else min(number * self.every, self.end)

    def choose(self, allowed: float, criterion: str, under_way: Step | None) -> Step:
        """Return the step after the one under way.

        Parameters
        ----------
        allowed, criterion
            Step [s] that the criteria allow now, and the one that limits it.
        under_way
            The step that is being taken; None before the first.
        """
        if self.fixed is not None:
            return Step(self.fixed, "fixed")
        if under_way is not None and allowed > GROWTH * self.allowed:
            allowed, criterion = GROWTH * self.allowed, "growth"
        self.allowed, self.allowed_by = allowed, criterion
        start, outputs = self.time, self.outputs
        if under_way is not None:
            start = under_way.lands_on if under_way.lands_on is not None else start + under_way.length
            outputs += under_way.lands_on is not None
        target = self.moment(outputs + 1)
        left = target - start
        if left <= 0.0:  # the end: nothing follows
            return Step(allowed, criterion)
        if allowed >= left:
            return Step(left, "output", target)
        # two even steps instead of a whole one and a sliver
        return Step(0.5 * left, "output") if 2.0 * allowed > left else Step(allowed, criterion)

    def complete(self, step: Step) -> bool:
        """Count `step` as done; return whether a moment of output is reached."""
        self.steps += 1
        if self.fixed is not None:
            self.time = self.steps * self.fixed
            reached = self.time >= self.moment(self.outputs + 1) - 1e-9 * self.fixed
        else:
            self.time = step.lands_on if step.lands_on is not None else self.time + step.length
            reached = step.lands_on is not None
        self.outputs += reached
        return reached

    def extend(self) -> Step:
        """Return the step from here after `end` was moved, in place of the one under way."""
        if self.every is not None:
            self.outputs = floor(self.time / self.every * (1.0 + 1e-12))
        return self.choose(self.allowed, self.allowed_by, None)

    @property
    def done(self) -> bool:
        """Whether the end is reached."""
        return self.time >= self.end - 1e-9 * (self.fixed or 0.0)
