"""One step of a formulation: evaluate the pair forces, then carry every particle on."""

from __future__ import annotations

import numpy as np

from hvisph.core.jit import specialise
from hvisph.core.particles import Particles
from hvisph.materials import response
from hvisph.materials.table import Material, pack
from hvisph.sph.pairs import Pairs
from hvisph.sph.symmetry import Plane

from . import update as single
from .formulation import Formulation

# Steps between two sortings of the state itself into cell order, which keeps memory access near.
PERMUTE_EVERY = 16


class Stepper:
    """Particles, their pairs and the compiled loops that move them.

    Parameters
    ----------
    particles
        The state at the start; its `extra` fields are those of formulation and scheme.
    formulation
        The published scheme.
    materials
        Materials, in the order of the particles' tags.
    stage, previous
        theta and w of the integrator.
    h
        Smoothing length at the start [m].
    planes
        Planes of symmetry.

    Attributes
    ----------
    lengths, signals, pressures
        Smoothing length [m], speed of signals [m/s] and pressure [Pa] of every particle at the stage.
    sums
        Sums over the completed state, columns as named in `update`.
    """

    def __init__(self, particles: Particles, formulation: Formulation, materials: list[Material], stage: float,
                 previous: float, h: float, planes: tuple[Plane, ...] = ()):  # fmt: skip
        dim, count = particles.dim, particles.count
        self.particles, self.formulation, self.stage_share = particles, formulation, stage
        self.table, self.models = pack(materials)
        self.coefficients = formulation.coefficients()
        layout = formulation.layout(dim)
        self.pairs = Pairs(layout, formulation.kernel, formulation.passes(dim), self.coefficients,
                           particles["position"], h, planes)  # fmt: skip
        smoothing = formulation.smoothing
        self.h_low, self.h_high = smoothing.smallest * h, smoothing.largest * h
        self.h_max = h
        self.lengths, self.signals, self.pressures = np.zeros(count), np.zeros(count), np.zeros(count)
        self._partial = np.zeros((-(-count // single.CHUNK), single.SUMS))
        slots = layout.slots()
        packer, options = formulation.pack()
        names = packer.__code__.co_names
        bound = {k: v for k, v in ({"DIM": dim} | options | slots).items() if k in names}
        used = single.update.__code__.co_names
        columns = {k: v for k, v in particles.bindings().items() if k in used}
        if previous == 0.0:  # never read: the branches that name them are compiled away
            columns |= {k: 0 for k in used if k.startswith("S_PREVIOUS")}
        self._update = specialise(
            single.update, parallel=True, DIM=dim, U=slots["U"], PREVIOUS=int(previous != 0.0),
            VARIABLE_H=int(smoothing.variable), respond=response.respond,
            longitudinal_speed=response.longitudinal_speed, shear_speed=response.shear_speed,
            pack=specialise(packer, **bound), **columns,
        )  # fmt: skip
        self.pairs.place[:count] = np.arange(count, dtype=np.uint32)

    @property
    def rates(self) -> np.ndarray:
        """Rows of rates in cell order; `place` says which is whose."""
        return self.pairs.rates

    @property
    def place(self) -> np.ndarray:
        """Row of each particle's rates (n,)."""
        return self.pairs.place[: self.particles.count]

    def start(self) -> None:
        """Evaluate the forces of the state as it stands, without a step."""
        self.pairs.rates[:] = 0.0
        self._carry(0.0, 0.0, complete=False)
        self.evaluate()

    def evaluate(self) -> None:
        """Evaluate the pair forces at the stage."""
        self.pairs.evaluate(self.h_max)

    def complete(self, step: float, following: float) -> None:
        """Carry the state over `step` [s] with the last rates, and predict the stage of the step `following`."""
        self._carry(step, self.stage_share * following, complete=True)

    def predict(self, following: float) -> None:
        """Predict the stage of the step `following` [s] from the state and the last rates."""
        self._carry(0.0, self.stage_share * following, complete=False)

    def _carry(self, step: float, stage: float, complete: bool) -> None:
        pairs, particles = self.pairs, self.particles
        self._update(particles.data, particles.tags, self.place, pairs.rates, pairs.sorted, self.table, self.models,
                     self.coefficients, step, stage, complete, self.h_low, self.h_high, pairs.rows, self.lengths,
                     self.signals, self.pressures, self._partial)  # fmt: skip
        self.sums = self._partial.sum(axis=0)
        self.sums[single.FASTEST] = np.sqrt(self._partial[:, single.FASTEST].max())
        self.sums[single.LONGEST] = self._partial[:, single.LONGEST].max()
        self.h_max = float(self.sums[single.LONGEST])

    def permute(self) -> np.ndarray:
        """Put state and rates into cell order; return the order taken. Call it between `complete` steps only."""
        count, pairs = self.particles.count, self.pairs
        order = pairs.order[: pairs.present]
        order = order[order < count].copy()
        self.particles.permute(order)
        for values in (self.lengths, self.signals, self.pressures):
            values[:] = values[order]
        pairs.rows[:] = pairs.rows[order]
        pairs.place[:count] = pairs.place[order]
        return order
