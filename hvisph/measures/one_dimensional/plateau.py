"""Plateau of a one-dimensional plate impact: the state behind the two shocks that leave the interface.

The stressed region reaches from the interface to where the longitudinal stress falls to half of its
own median; of it, the part between 10 dx and half of the nearer end's distance, on both sides, is
taken. 10 dx keeps out the spike that schemes leave at the interface; half of the distance keeps out
the fronts, and the releases that come back from the free faces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.result import Result, meaningless

NEAR, FAR = 10.0, 0.5  # nearest [dx] and farthest [share of the nearer end's distance] particle taken
FEWEST = 5  # particles for a mean
WHOLE = 0.97  # of the highest mean stress of any moment: what is below has been released


@dataclass(frozen=True)
class Plateau:
    """Means over the plateau.

    Parameters
    ----------
    stress
        Longitudinal stress -sigma_xx, positive in compression [Pa]; uncertainty: its standard deviation.
    velocity
        Velocity of the material, and so of the interface [m/s]; uncertainty likewise.
    count
        Number of particles in the means.
    """

    stress: Result
    velocity: Result
    count: int


def plateau(scene: Scene) -> Plateau:
    """Measure the plateau of a plate impact; without one, both results carry the reason."""
    if scene.now.dimensions != 1:
        return _none("a plateau is measured in 1D only")
    if not scene.has_target:
        return _none("there is no target")
    if "pressure" not in scene.now.fields:
        return _none("the snapshot has no pressure")
    x = scene.position[:, 0]
    stress = longitudinal_stress(scene)
    projectile, target = scene.is_projectile, scene.is_target
    interface = 0.5 * (x[projectile].max() + x[target].min())
    top = np.quantile(stress[projectile | target], 0.99)
    if not top > 0.0:
        return _none("no part of the plates is compressed")
    level = 0.5 * float(np.median(stress[(projectile | target) & (stress > 0.1 * top)]))
    reach = min(_reach(x[body] - interface, stress[body], level) for body in (projectile, target))
    distance = np.abs(x - interface)
    chosen = (projectile | target) & (distance >= NEAR * scene.spacing) & (distance <= FAR * reach)
    if chosen.sum() < FEWEST:
        return _none("the compressed region is too short, or releases have overtaken it")
    return Plateau(
        stress=_mean(stress[chosen], "Pa"),
        velocity=_mean(scene.now.fields["velocity"].reshape(len(x), -1)[chosen, 0], "m/s"),
        count=int(chosen.sum()),
    )


def before_release(plateaus: Sequence[tuple[float, Plateau]]) -> Plateau:
    """Return the plateau of the moment at which it was longest, before releases from the free faces reached it.

    Parameters
    ----------
    plateaus
        Time [s] and plateau of moments in order; not empty. The results tell the moment that was chosen.
    """
    known = [(time, one) for time, one in plateaus if one.stress.value is not None]
    if not known:
        return plateaus[-1][1]
    highest = max(one.stress.value or 0.0 for _, one in known)
    whole = min(WHOLE * highest, highest)  # of what is in tension only the least is whole
    time, best = max(
        ((time, one) for time, one in known if (one.stress.value or 0.0) >= whole),
        key=lambda pair: (pair[1].count, pair[0]),
    )
    return Plateau(replace(best.stress, time=time), replace(best.velocity, time=time), best.count)


def longitudinal_stress(scene: Scene) -> np.ndarray:
    """Return -sigma_xx of every particle, positive in compression, shape (n,) [Pa]."""
    pressure = scene.now.fields["pressure"]
    deviator = scene.now.fields.get("deviator")
    return pressure if deviator is None else pressure - deviator[:, 0]


def _reach(x: np.ndarray, stress: np.ndarray, level: float) -> float:
    """Distance from the interface over which stress stays above `level` without a break [m]."""
    order = np.argsort(np.abs(x))
    distance, above = np.abs(x)[order], stress[order] > level
    # the spike of some schemes at the interface is tensile: look from the tenth particle on
    start = min(10, len(above) - 1)
    below = np.flatnonzero(~above[start:])
    return float(distance[start + below[0]]) if len(below) else float(distance[-1])


def _mean(sample: np.ndarray, unit: str) -> Result:
    return Result(float(sample.mean()), unit, float(sample.std(ddof=1)))


def _none(reason: str) -> Plateau:
    return Plateau(meaningless("Pa", reason), meaningless("m/s", reason), 0)
