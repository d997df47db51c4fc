"""Step of SPH-projection: four passes over a neighbour list that lasts for many steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from hvisph.compiler.jit import CompiledFunction, PythonFunction, bind, specialise
from hvisph.compiler.parallel_for import chunk_loop, particle_loop
from hvisph.core.errors import RunError
from hvisph.core.particles import Particles
from hvisph.integrators import sums as column
from hvisph.materials import stress_update
from hvisph.materials.material_table import Material, bind_models, pack
from hvisph.schemes.projection import law
from hvisph.schemes.projection.rows import MARGIN, ProjectionRows, TrailingMean
from hvisph.schemes.protocol import Smoothing
from hvisph.schemes.stepper import fastest_sound
from hvisph.sph.kernels import CUBIC_SPLINE, Kernel, scale
from hvisph.sph.neighbours import particle_layout
from hvisph.sph.neighbours.ghost_rows import Halo, Plane
from hvisph.sph.neighbours.particle_layout import RowLayout


class ProjectionStepper:
    """Particles under SPH-projection, see `AnyStepper`: no equation of state, no stage, the field ``pressure``."""

    has_energy = keeps_order = False
    late = np.zeros(1)
    workspace = None
    stored_energy = contact_energy = 0.0

    def __init__(self, particles: Particles, formulation: Projection, materials: list[Material], stage: float,
                 previous: float, h: float, planes: tuple[Plane, ...] = ()):  # fmt: skip
        dim, count = particles.dim, particles.count
        self.particles, self.formulation = particles, formulation
        self.table, self.models = pack(materials)
        self.place = np.arange(count, dtype=np.uint32)
        self.rates = np.zeros((count, particle_layout.width(dim)))
        self.lengths, self.h_max = np.full(count, h), h
        self.signals = np.array([m.longitudinal_sound_speed for m in materials])[particles.material]
        self._h_limits = formulation.smoothing.smallest * h, formulation.smoothing.largest * h
        self._eta2 = (0.1 * h) ** 2
        self._fullness = formulation.fullness(dim)
        self._body_force = (tuple(map(float, formulation.body_force)) + (0.0,) * dim)[:dim]
        self.totals = column.Sums(particles, fastest_sound(materials), h, law.CHUNK)
        self._step = 0.0
        self._average = TrailingMean(count, formulation.pressure_average)
        self.support = formulation.kernel.reach * h
        self._rows = ProjectionRows(formulation.kernel, particles["position"], h, planes)
        self._path = np.inf  # most that a particle has moved since the list was made [m]
        self._loops = self._compile_loops()

    def _compile_loops(self) -> list[CompiledFunction]:
        """Return the loops of the four passes and of the step's completion."""
        dim, kernel = self.particles.dim, self.formulation.kernel
        bindings = (
            particle_layout.slots(dim)
            | self.particles.bindings()
            | {
                "DIM": dim,
                "slope": kernel.slope,
                "scale": specialise(scale, DIM=dim, NORM=kernel.norm(dim)),
                "respond": bind_models(stress_update.respond, self.table, self.models),
            }
        )
        sums: tuple[PythonFunction, ...] = (
            law.velocity_gradient,
            law.stress_divergence,
            law.poisson,
            law.pressure_gradient,
        )
        loops: tuple[PythonFunction, ...] = (law.stress, law.velocity, law.pressure, law.acceleration)
        functions = []
        for number, (pair_sum, loop) in enumerate(zip(sums, loops, strict=True)):
            layout = self._rows.layouts[number]
            function = bind(pair_sum, {"WIDTH": layout.used_width}, bindings | layout.slots())
            next_slots = self._rows.layouts[(number + 1) % 4].slots()
            functions.append(particle_loop(bind(loop, {pair_sum.__name__: function}, bindings | next_slots)))
        functions.append(chunk_loop(bind(law.advance, {}, bindings | self._rows.layouts[0].slots()), law.CHUNK))
        return functions

    @property
    def pressures(self) -> np.ndarray:
        """Running mean of the pressure of every particle [Pa]."""
        return self._average.mean()

    @property
    def owner_positions(self) -> np.ndarray:
        return self.particles["position"]

    def start(self) -> None:
        """Compute the initial sums; pressures are known after the first step."""
        self.totals.begin(self.particles)
        self.rates[:] = 0.0
        self._advance(0.0, complete=False)

    def evaluate(self) -> None:
        """Run the four passes of the announced step."""
        particles, dt = self.particles, self._step
        if self._is_stale():
            try:
                self._make_list(particles["position"])
            except RunError:  # others wait for this process' rows
                self._rows.exchange_after_error()
                raise
        n, data, tags = particles.count, particles.data, particles.tags
        rows, lists, scheme = self._rows, self._rows.neighbours, self.formulation
        stress, velocity, pressure, acceleration, _ = self._loops
        stress(n, data, tags, lists, *rows.get_pass_rows(0), self.rates, (self.table, self.models), dt)
        velocity(n, data, tags, lists, *rows.get_pass_rows(1), self.rates, dt, self._body_force)
        pressure(n, data, lists, *rows.get_pass_rows(2), dt, self._eta2, self._fullness, scheme.min_support,
                 scheme.original_gradient)  # fmt: skip
        acceleration(n, data, lists, rows.get_pass_rows(3)[0], self.rates, scheme.original_gradient)

    def complete(self, dt: float, next_dt: float) -> None:
        self._advance(dt, complete=True)
        self._average.add(self.particles["pressure"], dt)
        self._path += dt * float(self.sums[column.FASTEST])
        self._step = next_dt

    def predict(self, next_dt: float) -> None:
        self._advance(0.0, complete=False)
        self._path = np.inf
        self._step = next_dt

    def limits(self) -> list[tuple[float, str, int]]:
        """Return no limits: the step is fixed."""
        return []

    def permute(self) -> np.ndarray:
        order = self._rows.list.order[: self._rows.list.present]
        order = order[order < self.particles.count].copy()
        self.particles.permute(order)
        for values in (self.lengths, self.signals, self.rates):
            values[:] = values[order]
        first = self._rows.buffers[0]
        first[: len(order)] = first[order]
        self._average.permute(order)
        self._path = np.inf
        return order

    def get_carried(self) -> dict[str, np.ndarray]:
        positions = self._rows.list_positions
        positions = positions if len(positions) else np.zeros_like(self.particles["position"])
        return {
            "rates": self.rates,
            "rows": self._rows.buffers[0][: self.particles.count],
            "signals": self.signals,
            "listed_at": positions,
            **self._average.get_carried(),
        }

    def history(self) -> dict[str, np.ndarray]:
        own = {"step": np.array([self._step]), "crossed": np.array([self._path])}
        return self.totals.history() | self._average.history() | own

    def attach_halo(self, halo_for: Callable[[RowLayout], Halo]) -> None:
        self._rows.list.halo = halo_for(self._rows.list.layout)

    def replace_particles(self, data: np.ndarray, tags: np.ndarray, arrays: dict[str, np.ndarray]) -> None:
        particles = self.particles
        particles.data, particles.tags = np.ascontiguousarray(data), np.ascontiguousarray(tags)
        self.totals.resize(len(data))
        self._load(arrays)

    def fit_grid(self) -> None:
        if self.particles.count:
            self._rows.list.fit_grid(self.particles["position"])

    def restore(self, arrays: dict[str, np.ndarray], history: dict[str, np.ndarray]) -> None:
        self._step, self._path = float(history["step"][0]), float(history["crossed"][0])
        self.totals.restore(history)
        self._sum_up()
        self._average.restore(history)
        self._load(arrays)

    def _load(self, arrays: dict[str, np.ndarray]) -> None:
        """Set the data of `get_carried`, and list the neighbours at the stored positions."""
        particles = self.particles
        count = particles.count
        self.place = np.arange(count, dtype=np.uint32)
        self.rates, self.signals = np.array(arrays["rates"]), np.array(arrays["signals"])
        self.lengths = particles["smoothing_length"].copy()
        self._rows.replace_rows(np.asarray(arrays["rows"]))
        self._average.replace_particles(arrays)
        if not self._is_stale():
            path = self._path
            displacement = np.abs(arrays["listed_at"] - particles["position"]).max(initial=0.0)
            if not displacement <= MARGIN * self.h_max:
                raise ValueError("its neighbours were listed elsewhere")
            self._make_list(arrays["listed_at"])
            self._path = path

    def _advance(self, dt: float, complete: bool) -> None:
        particles = self.particles
        variable = self.formulation.smoothing.variable
        self._loops[4](particles.count, particles.data, particles.tags, self.rates, self._rows.buffers[0], self.lengths,
                       dt, complete, variable, self._h_limits, self._body_force, *self.totals.buffers)  # fmt: skip
        self._sum_up()

    def _sum_up(self) -> None:
        self.sums = self.totals.total()
        self.h_max = float(self.sums[column.LONGEST])

    def _is_stale(self) -> bool:
        """Whether unlisted particles may interact; growth of h is not considered."""
        return self.formulation.smoothing.variable or not 2.0 * self._path < MARGIN * self.h_max

    def _make_list(self, positions: np.ndarray) -> None:
        """List the neighbours of particles at `positions` (n, dim) [m]."""
        self._rows.make_list(positions, self.lengths, self.h_max, self.particles.id)
        self._path = 0.0


_POINTS = 2000  # points of the rule that integrates the kernel for the minimum support: its result is good to 1e-6


@dataclass(frozen=True)
class Projection:
    """SPH-projection."""

    # kernel, smoothing length over spacing, and how it varies
    kernel: Kernel = CUBIC_SPLINE
    h_over_dx: float = 1.5
    smoothing: Smoothing = field(default_factory=Smoothing)
    # whether the pressure gradient is eq. 31 P_a/rho_a^2 + P_b/rho_b^2, in place of the conjugate of the divergence,
    # (P_a + P_b)/(rho_a rho_b)
    original_gradient: bool = False
    min_support: float = 0.3  # a particle whose neighbourhood is less full than this has no pressure; see `fullness`
    body_force: tuple[float, ...] = ()  # acceleration of all particles [m/s^2], as many components as dimensions
    pressure_average: float = 2e-7  # time over which recorded pressures are averaged [s]

    name = "projection"
    corrects_kernels = has_friction = stores_contact_energy = False
    fields: tuple[str, ...] = ("pressure",)
    viscous_factor = 0.0
    stepper = ProjectionStepper

    def fullness(self, dim: int) -> float:
        """Return the factor that makes -A rho0 h^2 of `schemes.projection.law` 1 inside a body.

        In the limit of many neighbours A = 2/rho0 int W'(r)/r dV, so a flat surface has 1/2.
        For the cubic spline in 2D the factor is 0.175.
        """
        edges = np.linspace(0.0, self.kernel.reach, _POINTS + 1)
        middles = 0.5 * (edges[1:] + edges[:-1])
        sphere = (2.0, 2.0 * np.pi, 4.0 * np.pi)[dim - 1]
        slopes = np.array([self.kernel.derivative(q, 1.0, dim) for q in middles])
        integral = sphere * (slopes * middles ** (dim - 2)).sum() * (edges[1] - edges[0])
        return float(-1.0 / (2.0 * integral))
