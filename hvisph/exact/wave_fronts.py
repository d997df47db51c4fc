"""Front tracking of one-dimensional impact of layers, as a chain of Riemann problems; histories and profiles.

Mass coordinates: the interfaces between materials stand still, fronts run at constant speeds between uniform states,
and only when fronts meet is there anything to solve. Layers touch or stand apart by gaps; once closed, a contact stays
closed, in tension too, as between bodies of particles whose kernel sums couple them. Outer ends are free.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import inf

import numpy as np

from hvisph.core.errors import CaseError, RunError

from .wave_curves import Law, State, Wave, bracketed_root


@dataclass(frozen=True)
class Layer:
    """One layer at the start."""

    law: Law
    begin: float  # [m]
    end: float  # [m]
    velocity: float  # [m/s]


@dataclass
class Front:
    """A straight piece of a front's path through mass and time; None is for no matter on a side."""

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
    """All fronts of a run, from which histories and profiles are read."""

    layers: Sequence[Layer]  # the layers at the start
    bounds: np.ndarray  # mass coordinates of their faces, one more than there are layers [kg/m^2]
    fronts: list[Front] = field(repr=False)  # every piece of every front
    end: float = 0.0  # time reached [s]
    weakest: float = 0.0  # part of the strongest stress below which waves were left out, at most

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
        for a, b in pairwise(alive):
            low, high = a.mass_at(time), b.mass_at(time)
            if high > low and a.right is not None:
                regions.append((low, high, a.right))
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
            after = front.left if front.speed > 0.0 else front.right
            if front.born <= time < min(front.died, self.end) and after is not None:
                passed.append((time, after))
        passed.sort(key=lambda item: item[0])
        return np.array([0.0, *(time for time, _ in passed)]), [start, *(state for _, state in passed)]

    def sample(self, position: float, times: np.ndarray, name: str = "velocity") -> np.ndarray:
        """Return a quantity of `State` at a gauge and at given times."""
        changes, states = self.gauge(position)
        index = np.searchsorted(changes, times, side="right") - 1
        return np.array([getattr(states[i], name) for i in index])

    def surface(self) -> tuple[np.ndarray, np.ndarray]:
        """Return times [s] and the velocities [m/s] that the last free surface has from each on."""
        points = sorted(
            (front.born, front.left.velocity)
            for front in self.fronts
            if front.mass == self.bounds[-1] and front.right is None and front.left is not None
        )
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


_TOGETHER = 1e-12  # events this close, in relation to the time span, are one
MOST_FRONTS = 300_000
_MANY = 50  # fronts alive from which on the limits below which waves and borders are left out rise


def track(
    layers: Sequence[Layer], end: float, strain_step: float = 0.01, weakest: float = 1e-7, border: float = 1e-7
) -> Tracked:
    """Follow all waves of an impact up to the time `end`.

    `layers`: from left to right; faces that coincide touch, others have a gap.
    `strain_step`: change of ln(rho) by which rarefactions are cut into fronts.
    `weakest`: waves weaker than this part of the strongest stress are left out. Where more than 50 fronts are alive
        both limits rise with the square of their number: elastic waves that cross would multiply without end. What they
        rose to is in the result.
    `border`: states of one material that differ by less than this part (in volume, and in the deviator by this part of
        the strongest stress) become one when waves have crossed.
    Raises `CaseError` if layers overlap or are out of order, or have no extent; `RunError` if more fronts arise than a
    minute can follow.
    """
    bounds = _checked_bounds(layers)
    tracker = _Tracker(strain_step, weakest, border)
    at_rest = [layer.law.at_rest(layer.velocity) for layer in layers]
    tracker.alive = [Front(0.0, 0.0, 0.0, None, at_rest[0], layers[0].begin)]
    clusters = []
    for i in range(1, len(layers)):
        mass, left, right = float(bounds[i]), at_rest[i - 1], at_rest[i]
        if layers[i].begin - layers[i - 1].end > 1e-12 * (layers[-1].end - layers[0].begin):
            tracker.alive.append(Front(mass, 0.0, 0.0, left, None, layers[i - 1].end))
            tracker.alive.append(Front(mass, 0.0, 0.0, None, right, layers[i].begin))
        else:
            clusters.append(Front(mass, 0.0, 0.0, left, right, layers[i].begin))
            tracker.alive.append(clusters[-1])
    tracker.alive.append(Front(float(bounds[-1]), 0.0, 0.0, at_rest[-1], None, layers[-1].end))
    for front in clusters:
        lower, upper = front.left, front.right
        if lower and upper and (lower.velocity, lower.stress) != (upper.velocity, upper.stress):
            i = tracker.alive.index(front)
            tracker.meet(i, i, 0.0)
    tracker.run(end)
    return Tracked(layers, bounds, tracker.dead + tracker.alive, end, weakest * tracker.highest)


def _checked_bounds(layers: Sequence[Layer]) -> np.ndarray:
    if not layers:
        raise CaseError("there are no layers")
    span = layers[-1].end - layers[0].begin
    bounds = [0.0]
    for number, layer in enumerate(layers):
        if not layer.end > layer.begin:
            raise CaseError(f"layer {number + 1} ends at {layer.end:g}, not beyond its begin {layer.begin:g}")
        if number and layer.begin < layers[number - 1].end - 1e-12 * span:
            raise CaseError(f"layer {number + 1} begins at {layer.begin:g}, inside the one before or ahead of it")
        bounds.append(bounds[-1] + (layer.end - layer.begin) * layer.law.at_rest(0.0).density)
    return np.array(bounds)


def _ending_at(waves: list[Wave], initial: State | None, end: State, direction: int) -> Wave:
    """Let the last wave end at the velocity and stress of `end`, across which no wave is sent.

    A wave left out must leave no jump of stress behind: it would push for good. The last wave on the other side takes
    it up, in exact balance of mass and momentum, by a slight change of speed.
    """
    flux, state = waves[-1]
    before = waves[-2][1] if len(waves) > 1 else initial
    if before is None or end.velocity == before.velocity:
        return flux, state
    changed = direction * (end.stress - before.stress) / (end.velocity - before.velocity)
    fastest = waves[-2][0] if len(waves) > 1 else 1.01 * flux
    if not 0.99 * flux < changed < fastest:
        return flux, state
    volume = before.volume - (end.stress - before.stress) / changed**2
    return changed, replace(state, velocity=end.velocity, stress=end.stress, volume=volume)


class _Tracker:
    """The fronts alive, in order of mass, and the next meeting of any two neighbours."""

    def __init__(self, strain_step: float, weakest: float, alike: float):
        self.strain_step, self.weakest, self.alike = strain_step, weakest, alike
        self.alive: list[Front] = []
        self.dead: list[Front] = []
        self.strongest = 0.0
        self.rise, self.highest = 1.0, 1.0  # of both limits: now, and at most

    def run(self, end: float) -> None:
        time = 0.0
        while True:
            times = [self._meeting(a, b, time) for a, b in pairwise(self.alive)]
            time = min(times)
            if time >= end:
                return
            first = times.index(time)
            last = first
            while last + 1 < len(times) and times[last + 1] <= time + _TOGETHER * end:
                last += 1
            self.rise = max(1.0, len(self.alive) / _MANY) ** 2
            self.highest = max(self.highest, self.rise)
            self.meet(first, last + 1, time)
            if len(self.dead) > MOST_FRONTS:
                raise RunError(f"more than {MOST_FRONTS} fronts by t = {time:.6g}; coarser rarefactions would help")

    @staticmethod
    def _meeting(a: Front, b: Front, time: float) -> float:
        if a.right is None:  # across a gap: when it closes
            left, right = a.left, b.right
            if left is None or right is None or left.velocity <= right.velocity:
                return inf
            return time + max(b.position_at(time) - a.position_at(time), 0.0) / (left.velocity - right.velocity)
        closing = a.speed - b.speed
        if closing <= 0.0:
            return inf
        return time + max(b.mass_at(time) - a.mass_at(time), 0.0) / closing

    def meet(self, first: int, last: int, time: float) -> None:
        """Replace the fronts `first` to `last`, which are at one place, by those of their interaction."""
        old = self.alive[first : last + 1]
        borders = [front for front in old if front.speed == 0.0]
        mass = borders[0].mass if borders else old[0].mass_at(time)
        left, right = old[0].left, old[-1].right
        stress = self._stress_between(left, right)
        self.strongest = max(self.strongest, abs(stress))
        rows: dict[int, list[Wave]] = {-1: [], 1: []}
        for state, direction in ((left, -1), (right, 1)):
            if state and abs(stress - state.stress) > self.rise * self.weakest * self.strongest:
                rows[direction] = state.law.waves(state, stress, direction, self.strain_step)
        for state, direction in ((left, -1), (right, 1)):
            if state and not rows[direction] and rows[-direction]:
                ahead = right if direction < 0 else left
                rows[-direction][-1] = _ending_at(rows[-direction], ahead, state, -direction)
        fronts, state = [], left
        for flux, behind in rows[-1]:
            fronts.append(Front(mass, time, -flux, state, behind))
            state = behind
        ahead, from_right = right, []
        for flux, behind in rows[1]:
            from_right.append(Front(mass, time, flux, behind, ahead))
            ahead = behind
        if state is None or ahead is None or state.law is not ahead.law or self._contact(state, ahead):
            position = next((f.position_at(time) for f in borders if f.left is None or f.right is None), 0.0)
            fronts.append(Front(mass, time, 0.0, state, ahead, position))
        elif from_right:
            from_right[-1] = replace(from_right[-1], left=state)
        elif fronts:
            fronts[-1] = replace(fronts[-1], right=ahead)
        for front in old:
            front.died = time
        self.dead += old
        self.alive[first : last + 1] = fronts + from_right[::-1]

    def _contact(self, left: State, right: State) -> bool:
        """Whether two states of one material differ so much that their border must be kept."""
        difference = abs(left.volume - right.volume) / left.volume
        scale = max(abs(left.stress), abs(right.stress), self.strongest)
        tolerance = self.rise * self.alike
        return difference > tolerance or abs(left.deviator - right.deviator) > tolerance * scale

    def _stress_between(self, left: State | None, right: State | None) -> float:
        """Stress at which both sides have one velocity; zero at a surface."""
        if left is None or right is None:
            return 0.0

        def excess(stress: float) -> float:
            ends = []
            for state, direction in ((left, -1), (right, 1)):
                waves = state.law.waves(state, stress, direction, self.strain_step)
                ends.append(waves[-1][1].velocity if waves else state.velocity)
            return ends[1] - ends[0]  # rises with the stress

        floor = 0.999999 * max(left.law.lowest_stress(), right.law.lowest_stress())
        inner = 0.5 * (left.stress + right.stress)
        value = excess(inner)
        if value == 0.0:
            return inner
        stress = left.stress + 1e-6 * abs(left.law.lowest_stress())
        flux = left.law.waves(left, stress, 1, self.strain_step)[0][0]
        acoustic = abs(left.velocity - right.velocity) * flux
        width = max(abs(left.stress - right.stress), acoustic, 1e-9 * abs(floor))
        sign = -1.0 if value > 0.0 else 1.0
        for _ in range(200):
            outer = max(inner + sign * width, floor)
            if (excess(outer) > 0.0) != (value > 0.0):
                return bracketed_root(excess, min(inner, outer), max(inner, outer))
            if outer == floor:
                break
            inner, width = outer, 2.0 * width
        raise RunError("the layers would separate: a tension beyond what the materials' laws can bear")
