"""Subdomain of a process: domain decomposition, load balance and particle migration.

Space is divided by recursive bisection of (coordinate, number). Every method of `Subdomain` is called by all processes
together.
"""

import time as wall
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hvisph.core.memory import peak_memory
from hvisph.integrators.time_step import Criteria
from hvisph.schemes.protocol import AnyStepper
from hvisph.sph.neighbours.ghost_rows import Plane
from hvisph.sph.neighbours.particle_layout import RowLayout

from .collectives import Collectives
from .halo import Halo
from .world import MpiProcesses, SingleProcess

# Steps between two decompositions, and between two checks for particles that left their part.
CUT_EVERY, MOVE_EVERY = 128, 16
# Ratio of the largest to the mean work of a process above which the decomposition is repeated: where particles migrate
# between any two steps; where everything is rebuilt then, which is considered SELDOM times less often.
BALANCED, SETTLED, SELDOM = 1.05, 1.2, 8


class Subdomain(Collectives):
    """Particles of this process, and their exchange with other processes."""

    def __init__(self, stepper: AnyStepper, criteria: Criteria, planes: tuple[Plane, ...], count: int):
        super().__init__(stepper, count)
        self._criteria, self._planes = criteria, planes
        self.halos: list[Halo] = []
        self._row_arrays: list[tuple[Callable[[], np.ndarray], Callable[[np.ndarray], None]]] = []
        self._interval_start, self._interval_waiting = wall.perf_counter(), 0.0
        self.imbalance = 1.0

    def follow(self, read: Callable[[], np.ndarray], write: Callable[[np.ndarray], None]) -> None:
        """Register an array with one row a particle, by its reader and writer, for migration."""
        self._row_arrays.append((read, write))

    def join(self, world: SingleProcess, parts: "Parts | None") -> None:
        """Set up communication with the other processes and attach halos to the stepper."""
        if parts is None:
            return
        assert isinstance(world, MpiProcesses)
        self.world, self._parts, stepper = world, parts, self._stepper

        def halo_for(layout: RowLayout) -> Halo:
            self.halos.append(Halo(world, layout.dim, layout.used_width, self._planes))
            return self.halos[-1]

        stepper.totals.reduce = lambda integers, extremes: (world.total(integers), world.get_maxima(extremes))
        stepper.totals.exact = self.exact_sum
        stepper.attach_halo(halo_for)

    def begin(self) -> None:
        """Reset the counters of time and messages."""
        world = self.world
        self._interval_start, self._interval_waiting = wall.perf_counter(), world.waiting_time
        self._start = self._interval_start
        world.waiting_time = self._interval_waiting = 0.0
        world.messages = world.sent_rows = 0
        for halo in self.halos:
            halo.evaluations = halo.received_count = 0

    def _keep(self, data: np.ndarray, tags: np.ndarray, arrays: dict[str, np.ndarray], rows: list[np.ndarray]) -> None:
        stepper = self._stepper
        stepper.replace_particles(data, tags, arrays)
        self._criteria.resize(len(data))
        for (_, write), values in zip(self._row_arrays, rows, strict=True):
            write(values)
        self.note_reordering()

    def rebalance(self, steps: int) -> None:
        """Migrate particles to their owners between steps, and repeat the decomposition when it is due."""
        stepper = self._stepper
        if not self._is_parallel or steps % MOVE_EVERY:
            return
        fixed_owners = stepper.keeps_order
        cut = steps % (SELDOM * CUT_EVERY if fixed_owners else CUT_EVERY) == 0
        repeated = cut and self._repeat_decomposition(SETTLED if fixed_owners else BALANCED)
        if not fixed_owners or repeated:
            self._move(cut)

    def redistribute(self) -> None:
        """Repeat the decomposition after a change of positions, and migrate the particles."""
        if self._is_parallel:
            self._repeat_decomposition(0.0, even=True)
            self._move(True)

    def _move(self, cut: bool) -> None:
        """Migrate particles to their owners; after a `cut` fit the cell grids."""
        world, stepper = self.world, self._stepper
        particles = stepper.particles
        target = self._parts.owner(stepper.owner_positions, particles.id)
        mask = target != world.rank
        arrays = stepper.get_carried()
        rows = [read() for read, _ in self._row_arrays]
        parts = [particles.data, particles.tags.astype(np.float64), *arrays.values(), *rows]
        tables = [array.reshape(len(mask), -1) for array in parts]
        widths = [table.shape[1] for table in tables]
        exports = np.concatenate([table[mask] for table in tables], axis=1)
        ranks = target[mask]
        received = world.exchange_tables({int(rank): exports[ranks == rank] for rank in np.unique(ranks)}, sum(widths))
        migration = self.get_maxima(float(mask.any() or bool(received)))[0]
        if not migration:  # on no process: replacing particles is collective
            if cut:
                stepper.fit_grid()
            return
        received_rows = np.concatenate([received[rank] for rank in sorted(received)]) if received else exports[:0]
        columns = np.split(received_rows, np.cumsum(widths)[:-1], axis=1)
        stays = ~mask
        data = [
            np.concatenate([part[stays], column.reshape(-1, *part.shape[1:])])
            for part, column in zip(parts, columns, strict=True)
        ]
        names, first = list(arrays), 2 + len(arrays)
        self._keep(data[0], data[1].astype(np.uint32), dict(zip(names, data[2:first], strict=True)), data[first:])
        if cut:
            stepper.fit_grid()

    def account(self, steps: int) -> str:
        """Return a sentence on the cost of communication over `steps`; empty for one process."""
        if not self._is_parallel or not steps:
            return ""
        halo, world = self.halos[0], self.world
        averages = [halo.received_count / max(halo.evaluations, 1), world.messages / steps, world.sent_rows / steps]
        waiting = world.waiting_time / max(wall.perf_counter() - self._start, 1e-9)
        counters = [self._stepper.particles.count, *averages, waiting, peak_memory() / 1e6]
        table = world.gather_all(np.array(counters, float))
        count, halo_rows, messages, rows, waiting, _ = table.mean(axis=0)
        return (
            f"{world.size} processes: {halo_rows:.0f} rows of others beside {count:.0f} own "
            f"({halo_rows / max(count, 1):.1%}); {messages:.1f} messages with {rows:.0f} rows a step and process; most "
            f"over mean time of work {self.imbalance:.2f} at the last cut; {waiting:.0%} of the time waiting and "
            f"sending; at most {table[0, 5]:.0f} MB of memory on the first, {table[1:, 5].max():.0f} MB on the others"
        )

    def _repeat_decomposition(self, threshold: float, even: bool = False) -> bool:
        """Repeat the decomposition by measured work, or `even`, when out of balance; return whether it was."""
        world, stepper = self.world, self._stepper
        particles, dim = stepper.particles, stepper.particles.dim
        time = wall.perf_counter()
        work = max(time - self._interval_start - (world.waiting_time - self._interval_waiting), 1e-9)
        self._interval_start, self._interval_waiting = time, world.waiting_time
        measurements = world.gather_all(np.array([work, float(particles.count)]))
        self.imbalance = float(measurements[:, 0].max() / measurements[:, 0].mean())
        if self.imbalance < threshold:
            return False
        weight = np.full((particles.count, 1), 1.0 if even else work / max(particles.count, 1))
        table = world.gather_rows(np.concatenate([stepper.owner_positions, particles.id[:, None], weight], axis=1))
        self._parts = world.broadcast_from_first(
            lambda: Parts(world.size, table[:, :dim], table[:, dim].astype(np.int64), table[:, dim + 1])
        )
        return True


@dataclass(frozen=True)
class Cut:
    """Bisection of a region, or a part (`count` 1).

    The lower side contains the particles whose (coordinate, number) is below that of the cut; `upper` is the index of
    the upper side in the list of cuts, and the lower side follows this cut.
    """

    first: int
    count: int
    axis: int = 0
    coordinate: float = 0.0
    number: int = 0
    upper: int = -1


class Parts:
    """Boxes of equal sums of `weights`, unbounded outwards, for any number of parts; the number breaks ties."""

    def __init__(self, count: int, positions: np.ndarray, numbers: np.ndarray, weights: np.ndarray | None = None):
        self.cuts: list[Cut] = []
        weights = np.ones(len(positions)) if weights is None else weights
        self._cut(positions, numbers.astype(np.int64), weights, 0, count)

    def _cut(self, positions: np.ndarray, numbers: np.ndarray, weights: np.ndarray, first: int, count: int) -> None:
        index = len(self.cuts)
        self.cuts.append(Cut(first, count))
        if count == 1:
            return
        lower = count // 2
        if not len(positions):  # no particles: all to the first part
            self._sides(index, Cut(first, count, 0, np.inf, 0), (positions, numbers, weights), np.zeros(0, bool), lower)
            return
        axis = int(np.ptp(positions, axis=0).argmax())
        order = np.lexsort((numbers, positions[:, axis]))
        cumulated = np.cumsum(weights[order])
        k = int(np.searchsorted(cumulated, cumulated[-1] * lower / count))
        first_above = order[min(max(k, 1), len(order) - 1)]
        cut = Cut(first, count, axis, float(positions[first_above, axis]), int(numbers[first_above]))
        self._sides(index, cut, (positions, numbers, weights), _is_below_cut(positions, numbers, cut), lower)

    def _sides(
        self, index: int, cut: Cut, particles: tuple[np.ndarray, np.ndarray, np.ndarray], mask: np.ndarray, lower: int
    ) -> None:
        positions, numbers, weights = particles
        self._cut(positions[mask], numbers[mask], weights[mask], cut.first, lower)
        upper = len(self.cuts)
        self._cut(positions[~mask], numbers[~mask], weights[~mask], cut.first + lower, cut.count - lower)
        self.cuts[index] = Cut(cut.first, cut.count, cut.axis, cut.coordinate, cut.number, upper)

    def owner(self, positions: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        """Return the part (n,) of each particle."""
        owners = np.zeros(len(positions), np.int64)
        numbers = numbers.astype(np.int64)
        stack = [(0, np.arange(len(positions)))]
        while stack:
            index, indices = stack.pop()
            cut = self.cuts[index]
            if cut.count == 1:
                owners[indices] = cut.first
                continue
            mask = _is_below_cut(positions[indices], numbers[indices], cut)
            stack += [(index + 1, indices[mask]), (cut.upper, indices[~mask])]
        return owners


def _is_below_cut(positions: np.ndarray, numbers: np.ndarray, cut: Cut) -> np.ndarray:
    x = positions[:, cut.axis]
    mask: np.ndarray = (x < cut.coordinate) | ((x == cut.coordinate) & (numbers < cut.number))
    return mask
