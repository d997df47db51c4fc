"""What a plane across the shot line receives of the debris cloud, if all of it flies on straight as at the end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.statistics import weighted_quantile

BINS = 40
LATE = 0.99  # share of the mass that has arrived when a shower counts as over


@dataclass(frozen=True)
class Arrivals:
    """The particles that reach a witness plane.

    Parameters
    ----------
    x
        Coordinate of the plane along the shot line [m].
    where
        Places on it from the shot line, shape (n, dim - 1) [m].
    when
        Times, shape (n,) [s].
    mass, momentum, energy
        Of each, shape (n,): mass, axial momentum and kinetic energy [kg, N s, J; per metre in 2D].
    share
        Share of the cloud's mass that arrives.
    """

    x: float
    where: np.ndarray
    when: np.ndarray
    mass: np.ndarray
    momentum: np.ndarray
    energy: np.ndarray
    share: float

    @property
    def radius(self) -> np.ndarray:
        """Distances from the shot line, shape (n,) [m]."""
        return np.asarray(np.sqrt((self.where**2).sum(axis=1)))


def arrivals(scene: Scene, rows: np.ndarray, x: float) -> Arrivals:
    """Return which of the particles `rows` reach the plane at `x` [m], where and when."""
    velocity, mass = scene.now.fields["velocity"][rows], scene.now.fields["mass"][rows]
    ahead = x - scene.position[rows, 0]
    reach = (velocity[:, 0] > 0.0) & (ahead >= 0.0)
    velocity, flight = velocity[reach], ahead[reach] / velocity[reach, 0]
    own = mass[reach]
    return Arrivals(x, scene.lateral[rows[reach]] + flight[:, None] * velocity[:, 1:], scene.now.time + flight, own,
                    own * velocity[:, 0], 0.5 * own * (velocity**2).sum(axis=1),
                    float(own.sum() / mass.sum()))  # fmt: skip


def received(came: Arrivals, round_: bool, spacing: float) -> dict[str, Any]:
    """Return what the plane receives over the radius, in plain form.

    Parameters
    ----------
    came
        What arrives.
    round_
        Whether the radius is one all round the shot line, and a bin an annulus; in the plane a bin is on both sides.
    spacing
        dx [m], a bin's width where all arrives at one place.
    """
    if len(came.when) == 0:
        return {"x": came.x, "mass_share": 0.0}
    radius = came.radius
    width = weighted_quantile(radius, came.mass, 0.99) / BINS or spacing
    number = int(np.ceil(radius.max() / width + 1e-9))
    bins = np.minimum((radius / width + 1e-9).astype(int), number - 1)
    edges = width * np.arange(number + 1)
    size = np.pi * np.diff(edges**2) if round_ else 2.0 * np.diff(edges)
    sums = {name: np.bincount(bins, getattr(came, name), number) for name in ("mass", "momentum", "energy")}
    areal = sums["momentum"] / size
    first, last = float(came.when.min()), weighted_quantile(came.when, came.mass, LATE)
    return {
        "x": came.x,
        "mass_share": came.share,
        "first": first,
        "last": last,
        "impulse": float(came.momentum.sum()),
        "radius": edges[1:].tolist(),
        **{name: values.tolist() for name, values in sums.items()},
        "areal_momentum": areal.tolist(),
        "pressure": (areal / _durations(came, bins, number, last - first)).tolist(),
    }


def _durations(came: Arrivals, bins: np.ndarray, number: int, whole: float) -> np.ndarray:
    """Return how long the shower lasts in each bin [s], from first to 99 % of its mass; of a single one the whole's."""
    lengths = np.full(number, whole if whole > 0.0 else np.inf)
    order = np.argsort(bins, kind="stable")
    starts = np.searchsorted(bins[order], np.arange(number + 1))
    for k in range(number):
        rows = order[starts[k] : starts[k + 1]]
        if len(rows) > 1:
            lasts = weighted_quantile(came.when[rows], came.mass[rows], LATE) - float(came.when[rows].min())
            lengths[k] = lasts if lasts > 0.0 else lengths[k]
    return lengths
