"""Spatial pass: the law of Eulerian particles over them and the particles near them, at present positions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from hvisph.compiler.jit import specialise
from hvisph.compiler.template_binding import bind
from hvisph.compiler.threads.parallel_for import particle_loop
from hvisph.sph.contact import coupling
from hvisph.sph.neighbours.contact_candidates import Selection
from hvisph.sph.neighbours.ghost_rows import Halo
from hvisph.sph.neighbours.pairs import Pairs
from hvisph.sph.neighbours.particle_layout import RowLayout
from hvisph.sph.neighbours.symmetry_planes import Plane

from . import loops as composite_passes


class SpatialPass:
    """Selection of particles near another body or an Eulerian particle, and pairs of the latter."""

    def __init__(self, formulation: Any, at: np.ndarray, h: float, planes: tuple[Plane, ...], offered: dict[str, Any]):
        dim, kernel, euler, self._h = at.shape[1], formulation.kernel, formulation.eulerian, h
        layout = RowLayout(dim, (*euler.layout(dim).fields, *coupling.FIELDS))
        to = layout.slots()
        self.parted = formulation.contact.parts
        shares = specialise(coupling.shares, DIM=dim, KIND=to["KIND"], BODY=to["BODY"], D=to["D"],
                            CONTACT=float(self.parted),
                            STRESS_AT_INTERFACE=float(formulation.stress_at_interface))  # fmt: skip
        coupled = {"COUPLED": 1, "shares": shares} | ({"HYBRID": 1} if formulation.revolved else {})
        passes = [replace(one, reads=layout, options=one.options | coupled, skips=False) for one in euler.passes(dim)]
        constants = np.append(euler.coefficients(), (kernel.reach * h) ** 2)
        self.pairs = Pairs(layout, kernel, passes, constants, at, h, planes)
        self._selection = Selection(at, kernel.reach * h, with_neighbours=formulation.spatial_correction.acts)
        packer, more = euler.pack(dim)
        write = bind(packer, more, {"DIM": dim} | to)
        self._add_rates = particle_loop(bind(composite_passes.add_rates, {}, offered))
        to_spatial = {"TO_D": to["D"], "TO_KIND": to["KIND"], "TO_BODY": to["BODY"], "write": write}
        self._pack = particle_loop(bind(composite_passes.spatial_rows, to_spatial, offered))
        self._seen: Halo | None = None
        self._chosen = 0

    @property
    def paired_rows(self) -> np.ndarray:
        """Sorted rows of the particles paired in the last evaluation."""
        return self.pairs.place[: self._chosen]

    def find_near(self, rows: np.ndarray, numbers: np.ndarray, eulerian: np.ndarray,
             bodies: np.ndarray) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """Return which particles are near another body, and which near an Eulerian one (n,), bool."""
        own = len(numbers)
        if self._seen is not None:
            dim = self.pairs.layout.dim
            shown = np.zeros((own, _selection_layout(dim).used_width))
            shown[:, :dim], shown[:, dim], shown[:, dim + 1] = rows[:own, :dim], bodies, eulerian
            # a cell is chosen by what is up to two cells away
            rows, _ = self._seen.append(shown, numbers, 3.0 * self._selection.grid.edge)
            bodies, eulerian = rows[:, dim].astype(np.uint32), rows[:, dim + 1].astype(np.uint8)
        near_body, near_eulerian = self._selection.choose(rows, eulerian, bodies)
        return near_body[:own], near_eulerian[:own]

    def rest(self) -> None:
        """Clear the pairs of this evaluation."""
        self._chosen = 0

    def add(self, chosen: np.ndarray, rows: np.ndarray, numbers: np.ndarray,
            shown: tuple[np.ndarray, np.ndarray, np.ndarray], eulerian: np.ndarray,
            rates: np.ndarray) -> None:  # fmt: skip
        """Add the pairs of the `chosen` particles (k,) to `rates`; `shown`: bodies, pressures and loads [Pa] (n,)."""
        pairs = self.pairs
        packed = np.zeros((len(chosen), pairs.layout.used_width))
        self._pack(len(chosen), rows, chosen, *shown, pairs.coefficients, packed)
        self._chosen = len(chosen)
        pairs.rows, pairs.numbers = packed, numbers[chosen]
        pairs.evaluate(self._h)
        self._add_rates(len(chosen), pairs.rates, self.paired_rows, chosen, eulerian, rates)

    def attach_halo(self, halo_for: Callable[[RowLayout], Halo]) -> None:
        """Connect to other processes by the halos that `halo_for` makes of row layouts."""
        self._seen = halo_for(_selection_layout(self.pairs.layout.dim))
        self.pairs.halo = halo_for(self.pairs.layout)

    def fit_grid(self, positions: np.ndarray) -> None:
        """Make the selection grid anew around `positions` (n, dim) [m]."""
        self._selection.fit(positions)


def _selection_layout(dim: int) -> RowLayout:
    """Return the row layout of the selection."""
    return RowLayout(dim, (("x", "vector"), ("body", "scalar"), ("eulerian", "scalar")))
