"""Histories and profiles from the paths of tracked fronts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import inf

import numpy as np

from hvisph.core.errors import CaseError

from .wave_curves import Law, State


@dataclass(frozen=True)
class Layer:
    """One layer at the start."""

    law: Law
    begin: float  # [m]
    end: float  # [m]
    velocity: float  # [m/s]


@dataclass
class Front:
    """A straight piece of a front's way through mass and time; None stands for no matter on a side."""

    mass: float  # mass coordinate at birth [kg/m^2]
    born: float  # [s]
    speed: float  # mass flux, signed [kg/(m^2 s)]
    left: State | None
    right: State | None
    position: float = 0.0  # of a surface at birth [m]
    died: float = inf  # [s]

    def mass_at(self, time: float) -> float:
        """Return the mass coordinate at `time` [kg/m^2]."""
        return self.mass + self.speed * (time - self.born)

    def position_at(self, time: float) -> float:
        """Return the position of a surface at `time` [m]."""
        side = self.left or self.right
        return self.position + (side.velocity if side else 0.0) * (time - self.born)


@dataclass
class Tracked:
    """All fronts of a run, from which histories and profiles are read.

    Parameters
    ----------
    layers
        The layers at the start.
    bounds
        Mass coordinates of their faces, one more than there are layers [kg/m^2].
    fronts
        Every piece of every front.
    end
        Time reached [s].
    weakest
        Part of the strongest stress below which waves were left out, at most.
    """

    layers: Sequence[Layer]
    bounds: np.ndarray
    fronts: list[Front] = field(repr=False)
    end: float = 0.0
    weakest: float = 0.0

    def mass_of(self, position: float) -> float:
        """Return the mass coordinate of the matter that began at `position` [m]."""
        for layer, low, high in zip(self.layers, self.bounds[:-1], self.bounds[1:], strict=True):
            if layer.begin <= position <= layer.end:
                return float(low + (high - low) * (position - layer.begin) / (layer.end - layer.begin))
        raise CaseError(f"no layer holds the point x = {position:g} at the start", where="gauge")

    def states_at(self, time: float) -> list[tuple[float, float, State]]:
        """Return (mass from, mass to, state) of the uniform regions at `time`, from left to right."""
        alive = [front for front in self.fronts if front.born <= time < front.died]
        # At a meeting place the speed decides the order, and across a gap the side.
        alive.sort(key=lambda front: (front.mass_at(time), front.speed, front.right is not None))
        regions = []
        for here, there in pairwise(alive):
            low, high = here.mass_at(time), there.mass_at(time)
            if high > low and here.right is not None:
                regions.append((low, high, here.right))
        return regions

    def gauge(self, position: float) -> tuple[np.ndarray, list[State]]:
        """Return times [s], and the states from each on, of the matter that began at `position`."""
        mass = self.mass_of(position)
        start = next(s for low, high, s in self.states_at(0.0) if low <= mass <= high)
        passed = []
        for front in self.fronts:
            if front.speed == 0.0:
                continue
            time = front.born + (mass - front.mass) / front.speed
            behind = front.left if front.speed > 0.0 else front.right
            if front.born <= time < min(front.died, self.end) and behind is not None:
                passed.append((time, behind))
        passed.sort(key=lambda item: item[0])
        return np.array([0.0, *(time for time, _ in passed)]), [start, *(state for _, state in passed)]

    def sample(self, position: float, times: np.ndarray, name: str = "velocity") -> np.ndarray:
        """Return a quantity of `State` at a gauge and at given times."""
        changes, states = self.gauge(position)
        index = np.searchsorted(changes, times, side="right") - 1
        return np.array([getattr(states[i], name) for i in index])

    def surface(self, last: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """Return times [s] and velocities [m/s] from each on of the last (or first) free surface."""
        mass = self.bounds[-1] if last else self.bounds[0]
        points = []
        for front in self.fronts:
            side, outside = (front.left, front.right) if last else (front.right, front.left)
            if front.mass == mass and outside is None and side is not None:
                points.append((front.born, side.velocity))
        points.sort()
        return np.array([time for time, _ in points]), np.array([velocity for _, velocity in points])

    def profile(self, time: float) -> tuple[np.ndarray, list[State]]:
        """Return the uniform regions at `time`: positions [m], shape (regions, 2), and their states."""
        alive = [f for f in self.fronts if f.born <= time < f.died and f.left is None and f.right is not None]
        surfaces = sorted(alive, key=lambda front: front.mass)
        edges, states = [], []
        x = surfaces[0].position_at(time)
        starts = {front.mass: front.position_at(time) for front in surfaces}
        for low, high, state in self.states_at(time):
            x = starts.get(low, x)  # a gap ends here
            edges.append((x, x + (high - low) * state.volume))
            x = edges[-1][1]
            states.append(state)
        return np.array(edges).reshape(-1, 2), states
