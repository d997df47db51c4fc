"""Validation record: differences of runs from experiments of the same kind.

The figures are those of `docs/validation.md`; a test holds them against its results.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .regime import Regime, against_wall

if TYPE_CHECKING:
    from hvisph.case.bodies import Body
    from hvisph.case.case import Case

PAGE = "docs/validation.md"
THIN = 1.0  # a plate thinner than this many diameters of the sphere is perforated with a cloud behind it
FURTHEST = 2.0  # times slower or faster than any of its shots a set says nothing of a case
ENOUGH = 0.75  # of the particles across of the page: with fewer its figures do not speak for a case


@dataclass(frozen=True)
class Experience:
    """Differences of runs from one set of experiments.

    Parameters
    ----------
    what
        The shots.
    figures
        Mean size of the differences by quantity, as shares; of verdicts the share that is right.
    across
        Particles across the projectile, the bar or the bumper in the runs.
    velocities
        Of the slowest and the fastest shot [m/s].
    over
        What the particles are counted across, for people.
    verdicts
        Whether the figures are of verdicts.
    """

    what: str
    figures: Mapping[str, float]
    across: float
    velocities: tuple[float, float]
    over: str = ""
    verdicts: bool = False


# By set of `cases/validation`.
KNOWN = {
    "taylor": Experience(
        "41 Taylor bars", {"length_ratio": 0.036, "foot_diameter": 0.039, "outline": 0.035}, 24, (100.0, 350.0)
    ),
    "cloud": Experience(
        "a sphere through a plate at 6.2 km/s",
        {"crater_rim_diameter": 0.010, "cloud_ratio": 0.099},
        40,
        (6180.0, 6180.0),
    ),
    "shield": Experience(
        "27 Whipple shields", {"perforated": 0.815}, 8, (2600.0, 7400.0), " the bumper", verdicts=True
    ),
    "crater": Experience("craters at 7 km/s, by the equation", {"crater_depth": 0.035}, 16, (7000.0, 7000.0)),
}


def experience(case: Case, kind: Regime) -> str:
    """Return the validation record of similar experiments; empty without any."""
    name = _set_of(case, kind)
    if not name:
        return ""
    known = KNOWN[name]
    if not known.velocities[0] / FURTHEST <= kind.velocity <= known.velocities[1] * FURTHEST:
        return ""
    first, *others = case.bodies.values()
    if known.verdicts:
        said = f"{100 * next(iter(known.figures.values())):.0f} % of the verdicts are right"
        here = min(others[0].shape.extent()) / case.resolution
    else:
        said = ", ".join(f"{quantity.replace('_', ' ')} {100 * off:.1f} %" for quantity, off in known.figures.items())
        said += " off in the mean"
        here = _width(first) / case.resolution
    text = f"{known.what}: {said}, with {known.across:g} particles across{known.over} ({PAGE})"
    if here < ENOUGH * known.across:
        text += f"; here are {here:.2g}, too few for these figures"
    return text


def _set_of(case: Case, kind: Regime) -> str:
    bodies = list(case.bodies.values())
    if kind.velocity <= 0.0 or kind.strength is None or case.dim == 1 or case.units != "si":
        return ""
    if len(bodies) == 1:
        return "taylor" if against_wall(case) > 0.0 and bodies[0].shape.type == "cylinder" else ""
    if len(bodies) not in (2, 3) or bodies[0].shape.type != "sphere" or not kind.words.startswith("shock"):
        return ""
    if case.kinematics not in ("three_d", "axisymmetric"):
        return ""
    sizes = bodies[1].shape.extent()
    if not sizes:  # a mesh or a combination is neither of the plates that were shot at
        return ""
    thin = min(sizes) < THIN * _width(bodies[0])
    if len(bodies) == 3:
        return "shield" if thin else ""
    return "cloud" if thin else "crater"


def _width(body: Body) -> float:
    """Return the extent of a body across the shot line [m]."""
    return float(sorted(body.shape.extent()[1:])[0])
