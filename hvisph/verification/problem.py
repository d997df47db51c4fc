"""What a problem is: trials, each of one or several runs, and how figures are drawn from them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from hvisph.core.particles import Particles
from hvisph.setup.bodies import PlacedBody
from hvisph.visualization.curves import Curve

from .check import Figure
from .finished_run import Ran

SOLIDS = ("riemann", "eulerian", "total_lagrangian", "adaptive")  # those with an equation of state
EULERIAN = ("riemann", "eulerian")  # those whose density may start anywhere
ALL = (*SOLIDS, "projection")


@dataclass(frozen=True)
class Options:
    """What a user may ask of a problem.

    Parameters
    ----------
    quick
        The coarse form: seconds.
    spacing
        Particle spacing in place of the problem's own, in the units of its cases.
    seeds
        Number of random starts, where there are such.
    """

    quick: bool = False
    spacing: float | None = None
    seeds: int | None = None

    def dx(self, full: float, quick: float) -> float:
        """Return the spacing to take."""
        return self.spacing or (quick if self.quick else full)


@dataclass(frozen=True)
class Start:
    """One run: a case without its formulation, and what a case file cannot say of the start.

    Parameters
    ----------
    case
        A mapping with the keys of a case file; of the formulation, only options that the problem is about.
    place
        Changes the bodies' particles before anything is built.
    state
        Changes the state once it is built: all but positions and masses.
    """

    case: dict[str, Any]
    place: Callable[[list[PlacedBody]], list[PlacedBody]] | None = None
    state: Callable[[Particles], None] | None = None


@dataclass(frozen=True)
class Trial:
    """One line-up of a problem: its runs and its figures.

    Parameters
    ----------
    name
        What sets it apart from the problem's other trials.
    starts
        The runs.
    figures
        Draws the figures from the runs.
    curves
        Draws what there is to see, by panel; exact curves are marked as such.
    across
        What runs along the axis of `curves`: ``x`` or ``time``.
    units
        SI units of panels that are not named after a field; empty for plain numbers.
    may_stop
        Whether figures are drawn from runs that have stopped themselves, too.
    """

    name: str
    starts: Sequence[Start]
    figures: Callable[[Sequence[Ran]], Iterable[Figure]]
    curves: Callable[[Sequence[Ran]], dict[str, list[Curve]]] | None = None
    across: str = "x"
    units: Mapping[str, str] = field(default_factory=dict)
    may_stop: bool = False


@dataclass(frozen=True)
class Problem:
    """A problem with an exact solution.

    Parameters
    ----------
    name, title
        Its name, and what it shows in one line.
    trials
        Makes the trials.
    formulations
        Those that can run it, by `type`.
    why_not
        Why the others cannot.
    slow
        Whether the full form takes more than a minute or two a formulation.
    agree
        Name of the figure in which formulations are to agree with one another, and the share by which they may differ.
    """

    name: str
    title: str
    trials: Callable[[Options], Iterable[Trial]]
    formulations: tuple[str, ...] = SOLIDS
    why_not: str = "projection has no equation of state"
    slow: bool = False
    agree: tuple[str, float] | None = None
