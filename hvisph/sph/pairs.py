"""The pairs of one stage: rows sorted into cells, and passes of pair laws over them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hvisph.core.binding import bind
from hvisph.core.jit import specialise
from hvisph.core.simd import EIGHT

from . import cells, rates, traversal
from .kernels import Kernel
from .kernels.kernel import scale
from .rows import RowLayout, aligned_zeros
from .symmetry import Plane, image_numbers, mirror, with_images


@dataclass(frozen=True)
class Pass:
    """One pass of a pair law over all pairs.

    Parameters
    ----------
    law
        The law's loop, a template with the free names DIM, the slots of its row and their number WIDTH,
        `scale`, `slope`, `shape` and `write_rates`, and those in `options`.
    reads
        The layout of what it reads of each neighbour.
    options
        Constants and compiled functions bound into the law.
    into_rows
        Whether the law writes into the particles' own rows, for a later pass to read, instead of rates.
    density_rate
        Whether the law writes a rate of ln(rho) behind the other rates.
    slips
        Whether it writes the heat of slip between bodies behind that.
    rings
        Whether it writes the rate of the rings' circumference behind that.
    """

    law: Any
    reads: RowLayout
    options: dict[str, Any]
    into_rows: bool = False
    density_rate: bool = False
    slips: bool = False
    rings: bool = False


class Pairs:
    """Sorted particles and their rates.

    Parameters
    ----------
    layout
        The widest row that the passes need.
    kernel
        The smoothing kernel.
    passes
        The passes of an evaluation, in order.
    coefficients
        Numbers that the laws read.
    positions, h
        Positions at the start (n, dim) [m], for the grid's extent, and the largest smoothing length [m].
    planes
        Planes of symmetry.

    Attributes
    ----------
    rows, numbers
        Packed rows (n, width) of the stage, and their permanent numbers (n,) uint64, each once.
    """

    def __init__(self, layout: RowLayout, kernel: Kernel, passes: Sequence[Pass], coefficients: np.ndarray,
                 positions: np.ndarray, h: float, planes: tuple[Plane, ...] = ()):  # fmt: skip
        dim = layout.dim
        self.layout, self.kernel, self.planes = layout, kernel, planes
        self.coefficients = coefficients
        self._further = max(3 * one.rings or 2 * one.slips or int(one.density_rate) for one in passes)
        self.count = len(positions)
        self.slots = layout.slots()
        self.rows = np.zeros((self.count, layout.width))
        self.numbers = np.arange(self.count, dtype=np.uint64)
        self.grid = cells.Grid.around(positions, kernel.reach * h)
        self.capacity = 64 * 4 ** (dim - 1)
        self._room = 0
        self._make_room(self.count)
        shared = {
            "DIM": dim,
            "scale": specialise(scale, DIM=dim, NORM=kernel.norm(dim)),
            "slope": kernel.slope,
            "shape": kernel.shape,
            "write_rates": rates.writer(dim),
        }
        self._sweeps = []
        for one in passes:
            law = bind(one.law, one.options, shared | self.slots | rates.slots(dim) | {"WIDTH": one.reads.used})
            self._sweeps.append((traversal.loop(dim, self.slots["H"], law), one.into_rows))

    def _make_room(self, count: int) -> None:
        """Make the arrays hold `count` rows, with the far row behind them."""
        if count > self._room:
            self._room = count if count == self.count else count + count // 4
            dim, width = self.layout.dim, self.layout.width
            self.sorted = aligned_zeros(self._room + 1, width)
            self.columns = np.zeros((dim + 1, self._room + EIGHT))
            self.rates = np.zeros((self._room, rates.width(dim) + self._further))
            self.cells = np.zeros(self._room, np.uint32)
            self.order = np.zeros(self._room, np.uint32)
            self.place = np.zeros(self._room, np.uint32)
        far = self.sorted[count]
        far[:] = 0.0
        far[: self.layout.dim] = traversal.FAR
        far[self.slots["H"]] = 1.0
        if "RHO" in self.slots:
            far[self.slots["RHO"]] = 1.0
        self.present = count

    def evaluate(self, h: float) -> None:
        """Sort the packed `rows` and run all passes: `rates[place[i]]` are then those of particle i.

        They depend neither on the order of the rows nor on the grid.

        Parameters
        ----------
        h
            Largest smoothing length [m].

        Raises
        ------
        RunError
            When a particle has too many neighbours to be anything but a collapse.
        """
        rows, numbers = self.rows, self.numbers
        if self.planes:
            rows, made = with_images(rows, self.planes, self.layout, self.kernel.reach * h)
            numbers = image_numbers(numbers, made)
        if len(rows) != self.present:
            self._make_room(len(rows))
        n = self.present
        self.grid.edge = self.kernel.reach * h
        cells.sort(self.grid, rows, numbers, self.slots["H"], self.cells[:n], self.order[:n], self.place[:n],
                   self.sorted[:n], self.columns, self.layout.dim)  # fmt: skip
        for sweep, into_rows in self._sweeps:
            self._run(sweep, self.sorted if into_rows else self.rates)
            if self.planes and into_rows:
                for images in made:
                    target = self.place[images.first : images.first + len(images.source)]
                    source = self.sorted[self.place[images.source]]
                    self.sorted[target] = mirror(source, images.plane, self.layout)

    def _run(self, sweep: Any, out: np.ndarray) -> None:
        self.capacity = traversal.complete_sweep(
            sweep, self.sorted, self.columns, self.order, (self.present, len(self.rows)), self.grid, self.kernel.reach,
            self.coefficients, self.capacity, lambda capacity: out)  # fmt: skip
