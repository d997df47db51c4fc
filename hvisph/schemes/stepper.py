"""Step of a formulation: pair rates, then update of every particle."""

from collections.abc import Callable, Sequence

import numpy as np

from hvisph.compiler.jit import CompiledFunction, bind
from hvisph.compiler.parallel_for import chunk_loop
from hvisph.core.fields import CATALOGUE
from hvisph.core.particles import Particles, reorder, take_rows
from hvisph.integrators import particle_steps as steps
from hvisph.integrators import particle_update as update
from hvisph.integrators import sums as column
from hvisph.integrators.boundary_forces import Boundaries
from hvisph.integrators.gravity import NONE, Gravity, gravity_at
from hvisph.integrators.prescribed_motion import PrescribedMotion
from hvisph.materials import anisotropic_stress, plane_stress, stress_update, thermodynamics, traction_limits
from hvisph.materials.material_table import Material, bind_models, pack
from hvisph.sph.neighbours import particle_layout
from hvisph.sph.neighbours.cells import Grid
from hvisph.sph.neighbours.ghost_rows import Halo, Plane, turn_back
from hvisph.sph.neighbours.pairs import Pairs
from hvisph.sph.neighbours.particle_layout import RowLayout

from .protocol import Formulation

# Functions of a particle's material that the particle update calls.
OF_MATERIALS = (
    *(stress_update.update_stress, plane_stress.thinning, thermodynamics.longitudinal_speed),
    *(thermodynamics.shear_speed, thermodynamics.shear_modulus, traction_limits.bearable_tension),
    *(traction_limits.bearable_shear, traction_limits.acting_damage, traction_limits.softened_limits),
    *(traction_limits.has_failed, traction_limits.orderly, traction_limits.density_at_rest),
    *(anisotropic_stress.update_with_axes, anisotropic_stress.transverse_modulus, anisotropic_stress.squared_speeds),
)
PERMUTE_EVERY = 16  # steps between two sortings of the state itself into cell order, which keeps memory access near


class Stepper:
    """Particles, their pairs and the compiled loops that move them.

    `particles`: the state at the start; its `extra` fields are those of formulation and scheme.
    `formulation`: the published scheme.
    `materials`: materials, in the order of the particles' tags.
    `stage`, `previous`: theta and w of the integrator.
    `h`: smoothing length at the start [m].
    `planes`: planes of symmetry.
    `drift`: kappa of the integrator.
    `gravity`: field of gravity, if any.
    `later`: materials of the late stages, in the order of `materials`.
    It holds:
    `lengths`, `signals`, `pressures`: smoothing length [m], speed of signals [m/s] and pressure [Pa] of every particle
    at the stage.
    `sums`: sums over the completed state, columns as named in `update`.
    `pieces`: connected component of each particle (n,) uint32, its body until that separates
    (`sph.neighbours.connected_components`); None without contact between fragments.
    """

    has_energy = True

    @property
    def stored_energy(self) -> float:
        return 0.0

    @property
    def contact_energy(self) -> float:
        return 0.0

    pieces: np.ndarray | None = None
    _has_pieces = False  # whether any differs from the body
    motion: PrescribedMotion | None = None
    boundaries: Boundaries | None = None
    _tables: list[tuple[np.ndarray, np.ndarray]] = []  # noqa: RUF012 packed materials of the late stages
    late = np.zeros(1)  # energy that their softer moduli give back beyond those before [J], and their bulk moduli [Pa]
    turns_back = True  # whether particles that pass a plane of symmetry are put back
    keeps_order = False  # whether particles stay with their process until the decomposition is repeated

    @property
    def owner_positions(self) -> np.ndarray:
        return self.particles["position"]

    def __init__(self, particles: Particles, formulation: Formulation, materials: list[Material], stage: float,
                 previous: float, h: float, planes: tuple[Plane, ...] = (),
                 drift: float = 0.5, gravity: Gravity | None = None,
                 later: Sequence[list[Material]] = ()):  # fmt: skip
        dim, count = particles.dim, particles.count
        self.particles, self.formulation, self.stage_share = particles, formulation, stage
        self.table, self.models = pack(materials)
        self.coefficients = formulation.coefficients()
        self.gravity = gravity
        self._tables = [pack(stage) for stage in later]
        self.late = np.zeros(1 + len(later))
        layout = formulation.layout(dim)
        self.pairs = Pairs(layout, formulation.kernel, formulation.passes(dim), self.coefficients,
                           particles["position"], h, planes, formulation.single)  # fmt: skip
        smoothing = formulation.smoothing
        self.h_limits = h * np.tile([smoothing.smallest, smoothing.largest], (len(materials), 1))  # by material
        self.h_max = h
        self.lengths, self.signals, self.pressures = np.zeros(count), np.zeros(count), np.zeros(count)
        self.totals = column.Sums(particles, fastest_sound(materials), h, update.CHUNK)
        self._update = self._specialised_update(layout, previous, drift)
        self.pairs.place[:count] = np.arange(count, dtype=np.uint32)
        self.pairs.numbers = particles.id
        self.body_contact = formulation.body_contact(h, particles, planes)
        if formulation.fragment_contact:
            self.pieces = particles.body.copy()

    def _specialised_update(self, layout: RowLayout, previous: float, drift: float = 0.5) -> CompiledFunction:
        """Return the particle update, compiled for this formulation, its row and integrator."""
        particles, formulation = self.particles, self.formulation
        dim, smoothing = particles.dim, formulation.smoothing
        # Columns that a state lacks are never read: the branches that name them are compiled away.
        columns = {f"S_{name.upper()}": 0 for name in CATALOGUE} | particles.bindings()
        bindings = {"SHARE": 0, "C": 0} | layout.slots() | particle_layout.slots(dim) | columns | {
            "DIM": dim, "PREVIOUS": int(previous != 0.0), "DRIFT": drift, "VARIABLE_H": int(smoothing.variable),
            "DENSITY_RATE": int("previous_density_rate" in (particles.offsets if previous else formulation.fields)),
            "PLANE_STRESS": int(particles.kinematics.thins), "AXISYMMETRIC": int(particles.kinematics.axisymmetric),
            "SWITCH": self.formulation.switch,
            "REDUCES_SHEAR_VISCOSITY": int(self.formulation.reduces_shear_viscosity),
            "DENSITY_CORRECTION": int("density_correction" in particles.offsets),
            "ANGULAR_MOMENTUM": int("torque_residual" in particles.offsets), "AHEAD": self.stage_share,
            "NO_HISTORY": stress_update.NO_HISTORY, "HAS_HISTORY": int("history_variable" in particles.offsets),
            "NO_AXES": anisotropic_stress.NO_AXES, "ANISOTROPIC": int("material_axes" in particles.offsets),
            "GRAVITY": self.gravity.kind if self.gravity else NONE,
            "FRACTURES": int("band_width" in particles.offsets),
            "ADJOINT": int("GU_BEFORE" in layout.slots()),
            "SLIPS": int(self.formulation.has_friction), "ISOLATED_DENSITY": self.formulation.isolated_density(dim),
        }  # fmt: skip
        tables = [(self.table, self.models), *self._tables]
        kinds = np.concatenate([models for _, models in tables])
        bindings |= {function.py_func.__name__: bind_models(function, self.table, kinds) for function in OF_MATERIALS}
        packer, options = self.formulation.pack(dim)
        pack, limits = bind(packer, options, bindings), self.formulation.limits()
        packing = {
            "pack": pack,
            "LIMITED": int(limits is not None),
            "show_limits": bind(*limits, bindings) if limits else pack,
        }  # never called without
        self._gravity = self.gravity.numbers() if self.gravity else np.zeros((1, dim + 2))
        parts = *steps.PARTS, gravity_at, update.advance_lanes
        return chunk_loop(bind(update.update, packing, bindings, parts=parts), update.CHUNK)

    @property
    def rows(self) -> np.ndarray:
        """Packed rows of the stage, in the particles' order."""
        return self.pairs.rows

    @property
    def row_slots(self) -> dict[str, int]:
        """Slots of a packed row, by name."""
        return self.pairs.slots

    @property
    def rates(self) -> np.ndarray:
        """Rows of rates in cell order; `place` has the row of each particle."""
        return self.pairs.rates

    @property
    def workspace(self) -> np.ndarray | None:
        """Storage (k,) that is unused between evaluations; None where the history reads it."""
        return None if self.formulation.corrects_kernels else self.pairs.workspace

    @property
    def support(self) -> float:
        return float(self.pairs.kernel.reach * self.h_limits.max())

    @property
    def place(self) -> np.ndarray:
        return self.pairs.place[: self.particles.count]

    @property
    def paired_rows(self) -> np.ndarray:
        """Rows of `pairs`, sorted, of the particles that the last evaluation paired, without images."""
        return self.place

    def start(self) -> None:
        self.totals.begin(self.particles)
        self.rates[:] = 0.0
        self.predict(0.0)
        self.evaluate()
        if self.motion is not None:
            self.motion.look_ahead(self)

    def evaluate(self) -> None:
        try:
            self.pairs.evaluate(self.h_max)
            self.formulation.keep(self.pairs, self.lengths)
            if self.motion is not None:
                self.motion.note_contacts(self)
        finally:  # other processes wait for this one in the contact, also after an error
            self.body_contact.add(self.pairs, self.h_max)
        self._act()

    def _act(self) -> None:
        """Add the forces of faces and edges to the rates."""
        if self.boundaries is not None:
            self.boundaries.act(self)

    def complete(self, dt: float, next_dt: float) -> None:
        if self.motion is not None:
            self.motion.begin(self, dt)
        if self.boundaries is not None:
            self.boundaries.begin(self, dt)
        self._advance(dt, self.stage_share * next_dt, complete=True)
        if self.turns_back:
            turn_back(self.particles, self.rows, self.pairs.layout, self.rates, self.place, self.pairs.planes)

    def predict(self, next_dt: float) -> None:
        if self.motion is not None:
            self.motion.forget_step()
        self._advance(0.0, self.stage_share * next_dt, complete=False)

    def _advance(self, dt: float, stage: float, complete: bool) -> None:
        particles = self.particles
        if self.motion is not None and not complete:
            self.motion.hide_rigid(self)
        self._update(particles.count, particles.data, particles.tags, self.place, self.rates,
                     (self.table, self.models), self.coefficients, self._gravity, (dt, stage, complete),
                     self.h_limits, self.rows,
                     (self.lengths, self.signals, self.pressures), *self.totals.buffers)  # fmt: skip
        self._show_pieces()
        if self.motion is not None:
            self.motion.finish(self, stage, not complete)
        if self.boundaries is not None:
            self.boundaries.finish(self, stage)
        self._sum_up()

    def use_late_materials(self, number: int, materials: Sequence[Material] = ()) -> None:
        """Take `materials` of a late stage in place of those before; `predict` shows them to the neighbours."""
        if materials:
            self._tables[number] = pack(materials)
        self.table, self.models = self._tables[number]

    def split(self, pieces: np.ndarray) -> None:
        """Treat particles of different `pieces` (n,) as different bodies from now on."""
        self.pieces = pieces.astype(np.uint32)
        self._has_pieces = bool((self.pieces != self.particles.body).any())
        self._show_pieces()
        self.body_contact.renumber(self._contact_bodies)

    def _show_pieces(self) -> None:
        """Write the pieces into the packed rows in place of the bodies."""
        if self._has_pieces:
            self.rows[: self.particles.count, self.pairs.slots["BODY"]] = self.pieces

    @property
    def _contact_bodies(self) -> np.ndarray:
        """Body or piece of each particle (n,), as contact distinguishes them."""
        return self.particles.body if self.pieces is None else self.pieces

    def _sum_up(self) -> None:
        self.sums = self.totals.total()
        if self.motion is not None:
            self.motion.complete_sums(self.sums)
        self.h_max = float(self.sums[column.LONGEST])

    def limits(self) -> list[tuple[float, str, int]]:
        return [limit for motion in (self.motion.rigid if self.motion else ()) for limit in motion.limits()]

    def permute(self) -> np.ndarray:
        count, pairs = self.particles.count, self.pairs
        order = pairs.order[: pairs.present]
        order = order[order < count].copy()
        if (order[1:] > order[:-1]).all():  # it is in order, as in 1D at most times
            return order
        workspace = pairs.workspace
        self.particles.permute(order, workspace)
        extra = () if self.pieces is None else (self.pieces,)
        for values in (self.lengths, self.signals, self.pressures, pairs.rows, pairs.place[:count], *extra):
            reorder(values, order, workspace)
        self.body_contact.renumber(self._contact_bodies)
        return order

    def get_carried(self) -> dict[str, np.ndarray]:
        """Return the arrays that the next step needs beside the state, a row a particle; valid until it is evaluated.

        The packed rows follow from state and rates, but other compiled code might rebuild them with other last bits.
        """
        pieces = {} if self.pieces is None else {"pieces": self.pieces}
        rates = take_rows(self.rates, self.place, self.pairs.workspace)
        return {"rows": self.rows, "rates": rates, "lengths": self.lengths, "signals": self.signals,
                "pressures": self.pressures, **pieces}  # fmt: skip

    def history(self) -> dict[str, np.ndarray]:
        sources = [part for part in (self.motion, self.boundaries) if part is not None]
        return dict(item for part in (self.totals, *sources) for item in part.history().items())

    def attach_halo(self, halo_for: Callable[[RowLayout], Halo]) -> None:
        self.pairs.halo = halo_for(self.pairs.layout)
        self.body_contact.attach_halo(halo_for)

    def replace_particles(self, data: np.ndarray, tags: np.ndarray, arrays: dict[str, np.ndarray]) -> None:
        particles, pairs, count = self.particles, self.pairs, len(data)
        particles.data, particles.tags = np.ascontiguousarray(data), np.ascontiguousarray(tags)
        self.lengths, self.signals, self.pressures = (
            arrays[name].copy() for name in ("lengths", "signals", "pressures")
        )
        self.totals.resize(count)
        pairs.replace_rows(np.ascontiguousarray(arrays["rows"]), particles.id)
        pairs.rates[:count] = arrays["rates"]
        self._restore_contact_bodies(arrays)

    def _restore_contact_bodies(self, arrays: dict[str, np.ndarray]) -> None:
        if self.pieces is not None:
            self.split(arrays["pieces"])
        else:
            self.body_contact.renumber(self.particles.body)

    def fit_grid(self) -> None:
        if self.particles.count:
            self.pairs.grid = Grid.from_positions(self.particles["position"], self.pairs.grid.edge)

    def restore(self, arrays: dict[str, np.ndarray], history: dict[str, np.ndarray]) -> None:
        pairs, count = self.pairs, self.particles.count
        for name in ("rows", "lengths", "signals", "pressures"):
            getattr(self, name)[...] = arrays[name]
        self.rates[:count] = arrays["rates"]
        pairs.place[:count] = np.arange(count, dtype=np.uint32)
        pairs.numbers = self.particles.id
        self._restore_contact_bodies(arrays)
        self.totals.restore(history)
        if self.motion is not None:
            self.motion.restore(history)
        if self.boundaries is not None:
            self.boundaries.restore(history)
        self._sum_up()


def fastest_sound(materials: list[Material]) -> float:
    """Return the largest sound speed of the materials at rest [m/s]."""
    return max(material.longitudinal_sound_speed for material in materials)
