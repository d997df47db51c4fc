"""Pairs of one stage: rows sorted into cells, and passes of pair laws over them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hvisph.compiler.jit import CompiledFunction, Options, PythonFunction, bind, bind_constants, specialise
from hvisph.compiler.parallel_for import particle_loop
from hvisph.compiler.tensors import SIZE, broadcast_singles
from hvisph.compiler.vector import api
from hvisph.compiler.vector.api import EIGHT
from hvisph.core.errors import RunError
from hvisph.sph.kernels import Kernel, scale

from . import cells, particle_layout, traversal
from .ghost_rows import Halo, ImageCopies, Plane
from .particle_layout import RowLayout, aligned_zeros

# Fields of a row that are zero, and those that agree, among particles that have no rates.
ZERO_AT_REST = ("t", "r", "p", "hoop", "spin_stress", "gu_before", "correction_decay", "density_relaxation")
EQUAL_AT_REST = ("u", "body")
# Evaluations without a search for undisturbed cells after one that found none.
PAUSE = 16
# Replacements for laws in single precision: vectors, and constants whose squares are within its range.
IN_SINGLES: Options = {"LANES": api.SINGLES, "broadcast_lanes": api.broadcast_singles, "broadcast": broadcast_singles}
RANGE_OF_SINGLES: Options = {"TINY": 1e-18, "UNLIMITED": 1e18, "STEEP": 1e30}


@dataclass(frozen=True)
class Pass:
    """One pass of a pair law over all pairs.

    `law`: the law's loop, a template. Its free names are DIM, the slots of its row, WIDTH (the slots that it reads) and
    WHOLE (all slots), `scale`, `slope`, `shape`, `write_rates`, and the names in `options`.
    `reads`: layout of the row of a neighbour.
    `options`: constants and compiled functions that are bound into the law.
    `parts`: templates that the law calls by name, bound likewise.
    `only`: vector of the rows, such as `N_RAW`, whose zero excludes a particle; empty for all particles.
    `own_reach`: whether the law also sums over the kernel at the particle's own h.
    `into_rows`: whether the law writes into the particle's row, for a later pass, instead of rates.
    `density_rate`, `corrects_density`, `has_friction`, `axisymmetric`, `angular_momentum`, `adjoint`: rates behind the
    velocity gradient that the law writes: of ln(rho); of the density correction; heat of slip; hoop strain rate; rate
    of the torque residual; renormalised velocity gradient.
    `skips_undisturbed`: whether undisturbed particles can be left out (`cells.find_undisturbed`).
    """

    law: PythonFunction
    reads: RowLayout
    options: Options
    parts: tuple[PythonFunction, ...] = ()
    only: str = ""
    own_reach: bool = False
    into_rows: bool = False
    density_rate: bool = False
    corrects_density: bool = False
    has_friction: bool = False
    axisymmetric: bool = False
    angular_momentum: bool = False
    adjoint: bool = False
    skips_undisturbed: bool = False

    def count_further_rates(self, dim: int) -> int:
        """Return the number of rates behind the velocity gradient."""
        if self.adjoint or self.angular_momentum:
            return 3 + SIZE["axial"][dim - 1] + dim * dim * self.adjoint
        return 4 * self.axisymmetric or 3 * self.has_friction or 2 * self.corrects_density or int(self.density_rate)


class Pairs:
    """Sorted particles and their rates.

    `layout`: the widest row that the passes need.
    `kernel`: the smoothing kernel.
    `passes`: the passes of an evaluation, in order.
    `coefficients`: numbers that the laws read.
    `positions`, `h`: positions at the start (n, dim) [m], for the grid's extent, and the largest smoothing length [m].
    `planes`: planes of symmetry.
    `single`: whether laws are evaluated in single precision: sorted rows are of float32, with the smoothing length at
    the start, rounded to a power of two, as unit of length, and what rounding takes of positions and velocities.
    It holds:
    `rows`, `numbers`: packed rows (n, packed) of the stage, and their permanent numbers (n,), each once. Where passes
    compute enough slots of a row, and none is read after an evaluation, packed rows are stored in those slots of the
    sorted rows, in the order of the particles; an evaluation preserves only their position and velocity.
    `unit`: unit of length of the sorted rows [m].
    `halo`, `images`: copies that are appended to them: rows of other processes, images at the planes.
    `workspace`: storage that is free between evaluations: sorted rows and their columns (k,), or, where packed rows are
    stored in these, their first slots (n, packed).
    """

    def __init__(self, layout: RowLayout, kernel: Kernel, passes: Sequence[Pass], coefficients: np.ndarray,
                 positions: np.ndarray, h: float, planes: tuple[Plane, ...] = (), single: bool = False):  # fmt: skip
        dim = layout.dim
        self.unit, self._units, self._constants = 1.0, cells.NO_UNITS, coefficients
        self._extra_rates = max(pass_.count_further_rates(dim) for pass_ in passes)
        if single:
            self.unit = 2.0 ** np.floor(np.log2(h))
            self._units = layout.single_units(self.unit)
            rate_units = particle_layout.single_units(layout, particle_layout.width(dim) + self._extra_rates, self.unit)
            self._constants = np.append(coefficients, rate_units)
            layout = layout.single()
            passes = [replace(pass_, reads=pass_.reads.single()) for pass_ in passes]
        self.layout, self.kernel, self.planes, self.single = layout, kernel, planes, single
        self.coefficients = coefficients
        self.count = len(positions)
        self.slots = layout.slots()
        computed = layout.used_width - layout.packed_width
        rigid = self.slots["BODY"] if any(pass_.options.get("RIGID") for pass_ in passes) else 0
        late_fields = {"N_PREVIOUS", "FALLBACKS"} & self.slots.keys() or rigid
        shares = not single and 2 * computed >= layout.packed_width and not late_fields
        self._spare = max(layout.packed_width - computed, 0) if shares else 0
        self._shared: np.ndarray | None = None
        self.rows = np.zeros((self.count, 0 if shares else layout.packed_width))  # close together
        self.numbers = np.arange(self.count, dtype=np.uint64)
        self.halo: Halo | None = None
        self.images = ImageCopies(planes, layout) if planes else None
        self.grid = cells.Grid.from_positions(positions, kernel.reach * h)
        self.capacity = 64 * 4 ** (dim - 1)
        self._allocated = self._pause = 0
        options: Options = {"PACKED": layout.packed_width, "SHOWN": 2 * dim}
        self._show = particle_loop(specialise(show_stage, **options), short=True)
        self._ensure_capacity(self.count, shares)
        bindings = {
            "DIM": dim,
            "scale": specialise(scale, DIM=dim, NORM=kernel.norm(dim)),
            "slope": bind_constants(kernel.slope, **RANGE_OF_SINGLES) if single else kernel.slope,
            "shape": bind_constants(kernel.shape, **RANGE_OF_SINGLES) if single else kernel.shape,
            **(IN_SINGLES if single else {}),
        }
        self._sweeps = []
        self._skips = all(pass_.skips_undisturbed for pass_ in passes)
        self._zero, self._equal = layout.slots_of(ZERO_AT_REST), layout.slots_of(EQUAL_AT_REST)
        if single:
            slots = np.arange(self.slots["U_REST"], self.slots["U_REST"] + dim, dtype=np.uint64)
            self._equal = np.concatenate([self._equal, slots])
        if "RING" in self.slots:  # a radial velocity strains the hoop
            self._zero = np.append(self._zero, np.uint64(self.slots["U"] + 1))
        plain = [pass_ for pass_ in passes if not pass_.only]
        common = len(plain) > 1 and len({pass_.own_reach for pass_ in plain}) == 1
        for pass_ in passes:
            widths = {"WIDTH": pass_.reads.used_width, "WHOLE": layout.used_width}
            names = (
                (_limit_range(pass_) if single else {}) | bindings | self.slots | particle_layout.slots(dim) | widths
            )
            law = bind(
                pass_.law,
                pass_.options,
                names | {"write_rates": particle_layout.writer(dim, pass_.has_friction)},
                parts=pass_.parts,
            )
            only = self.slots[pass_.only] if pass_.only else 0
            first = (layout.packed_width if pass_.into_rows else 0) if self._skips else None
            lists = traversal.FORGETS
            if common and not only:
                lists = traversal.KEEPS if pass_ is plain[0] else traversal.TAKES
            units = len(coefficients) if single and not pass_.into_rows else 0
            sweep = traversal.loop(dim, law, only, pass_.own_reach, first, lists, single, units, rigid)
            self._sweeps.append((sweep, pass_.into_rows))
        self._vectors = self.slots["U"] if single else 0, self.slots.get("X_REST", 0), self.slots.get("U_REST", 0)

    def _ensure_capacity(self, count: int, shares: bool = False) -> None:
        """Allocate arrays for `count` rows, each in whole cache lines, and the far row."""
        if count > self._allocated:
            self._allocated = count if count == self.count else count + count // 4
            backup = None
            if shares and self._shared is not None:  # released before others are allocated
                backup, self.rows = self.rows.copy(), np.zeros((0, 0))
                self.workspace = self.sorted = self.columns = self.rates = self._lists = self.cells = self.rows
                self._shared = None
            dim, width = self.layout.dim, -(-self.layout.width // 8) * 8 if self.single else self.layout.width
            if self._spare:
                width = -(-(self.layout.used_width + self._spare) // 4) * 4
            rows, column_length = (self._allocated + 1) * width // (2 if self.single else 1), self._allocated + EIGHT
            self.workspace = aligned_zeros(1, rows + (dim + 1) * column_length)[0]
            precision = np.float32 if self.single else np.float64
            self.sorted = self.workspace[:rows].view(precision).reshape(-1, width)
            self.columns = self.workspace[rows:].reshape(-1, column_length)
            self.rates = np.zeros((self._allocated, particle_layout.width(dim) + self._extra_rates))
            self._lists = self.rates.view(np.uint32)
            self.cells = np.zeros(self._allocated, np.uint32)
            self.order = np.zeros(self._allocated, np.uint32)
            self.place = np.zeros(self._allocated, np.uint32)
            if shares:
                packed = self.layout.packed_width
                self.workspace = self.sorted[: self.count, :packed]
                self.rows = self._shared = self.sorted[: self.count, packed : 2 * packed]
                if backup is not None:
                    self.rows[:] = backup
        self.present = count

    def _put_far(self) -> None:
        """Put the far row behind the sorted ones, whose storage may have been overwritten."""
        row = self.sorted[self.present]
        row[:] = 0.0
        row[: self.layout.dim] = traversal.FAR_SINGLE if self.single else traversal.FAR
        row[self.slots["H"]] = 1.0
        if "RHO" in self.slots:
            row[self.slots["RHO"]] = 1.0

    def evaluate(self, h: float, active: int | None = None) -> None:
        """Sort the packed `rows` and run all passes: `rates[place[i]]` are then those of particle i.

        They depend neither on the order of the rows nor on the grid.

        `h`: largest smoothing length [m].
        `active`: how many of the rows, the first, the laws are summed for; others are neighbours alone. All unless
        given.
        Raises `RunError` when a particle has too many neighbours to be anything but a collapse.
        """
        rows, numbers, edge = self.rows, self.numbers, self.kernel.reach * h
        count = len(rows)
        if self.halo is not None:
            rows, numbers = self.halo.append(rows, numbers, edge)
            self.rows = rows[:count]  # in front of the others': the next stage is packed there
        shared, packed, n = self.rows is self._shared, 0, len(rows)
        if self.images is not None:
            images, numbers = self.images.find(rows, numbers, edge)
            n += len(images)
            rows = images if shared else np.concatenate([rows, images])
        if n != self.present:
            self._ensure_capacity(n, shared)
        self._put_far()
        self.grid.edge = edge
        if shared:
            packed = self.layout.packed_width
            if self.images is not None:
                self.sorted[count:n, packed : 2 * packed] = images
            rows = self.sorted[:n]
        cells.sort(self.grid, rows, numbers, self.slots["H"], self.cells[:n], self.order[:n], self.place[:n],
                   self.sorted[:n], self.columns, self.layout.dim, self._units, self._vectors, packed)  # fmt: skip
        self._pause = max(self._pause - 1, 0)
        if self._skips and not self._pause:
            limit = n if self.halo is None else count
            cells.find_undisturbed(self.grid, self.order, limit, self.sorted, self._zero, self._equal, self.layout.dim)
            self._pause = 0 if self.grid.undisturbed.any() else PAUSE
        failure = None
        for sweep, into_rows in self._sweeps:
            try:
                if failure is None:
                    self._run(sweep, self.sorted if into_rows else self.rates, count if active is None else active)
            except RunError as error:  # other processes wait for the rows of this one
                failure = error
                self.rates[:] = 0.0  # lists may be there
            for copies in (self.halo, self.images) if into_rows else ():
                if copies is not None:
                    copies.refresh(self.sorted, self.place)
        if shared:
            self._show(count, self.sorted, self.place)
        if failure is not None:
            raise failure

    def replace_rows(self, rows: np.ndarray, numbers: np.ndarray) -> None:
        """Replace all packed rows (n, width) and their numbers, sorted in the order given."""
        gap = self._shared is not None  # loops are compiled for one layout
        self.rows = np.zeros((len(rows), rows.shape[1] + gap))[:, : rows.shape[1]]
        self.rows[:], self.numbers, self.count = rows, numbers, len(rows)
        if self._allocated > 2 * self.count:  # many have gone to other processes
            self._allocated = 0
        self._ensure_capacity(self.count)
        self.sorted[: self.count, : rows.shape[1]] = rows * self._units if self.single else rows
        self.place[: self.count] = np.arange(self.count, dtype=np.uint32)

    def _run(self, sweep: CompiledFunction, out: np.ndarray, active: int) -> None:
        self.capacity = traversal.complete_sweep(
            sweep, self.sorted, self.columns, self.order, (self.present, active), self.grid, self.kernel.reach,
            self._constants, self.capacity, lambda capacity: out, self._lists)  # fmt: skip


def show_stage(i, rows, place):
    """Copy position and velocity of particle `i` from its sorted row into its packed row."""
    for f in range(np.uint64(SHOWN)):
        rows[i, np.uint64(PACKED) + f] = rows[np.uint64(place[i]), f]


def _limit_range(pass_: Pass) -> Options:
    """Return the compiled functions that the law of a pass and its parts call, with `RANGE_OF_SINGLES`."""
    functions = {}
    for template in (pass_.law, *pass_.parts):
        for name in template.__code__.co_names:
            function = template.__globals__.get(name)
            if isinstance(function, CompiledFunction):
                functions[name] = bind_constants(function, **RANGE_OF_SINGLES)
    return functions
