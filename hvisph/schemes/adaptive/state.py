"""Particle state of the adaptive scheme: creation, migration, storage and restoration."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from hvisph.schemes.adaptive.passes import SpatialPass
from hvisph.schemes.adaptive.penalty_contact_pass import BodyContact
from hvisph.schemes.stepper import Stepper
from hvisph.schemes.total_lagrangian.reference_update import ReferenceChanges
from hvisph.sph.neighbours import particle_layout as rate_slots
from hvisph.sph.neighbours.ghost_rows import Halo
from hvisph.sph.neighbours.particle_layout import RowLayout, aligned_zeros

# Arrays of a checkpoint beside the particles, with a row for each.
ARRAYS = ("lengths", "signals", "pressures", "jacobians", "strains", "latest", "loads", "loose", "swellings", "alone",
        "volume", "sequence")  # fmt: skip


class CompositeState(ReferenceChanges, Stepper):
    """Particle arrays of `CompositeStepper`, and their migration and restoration."""

    formulation: Any
    spatial: SpatialPass
    contact: BodyContact | None
    _one_body: bool
    _halo_for: Callable[[RowLayout], Halo] | None

    def _set_up(self) -> None:
        raise NotImplementedError

    def _classify(self) -> None:
        raise NotImplementedError

    def _allocate_arrays(self) -> None:
        """Allocate the arrays of the present particles."""
        particles, formulation, dim = self.particles, self.formulation, self.particles.dim
        count, body = particles.count, self.particles.body
        slots = rate_slots.slots(dim)
        width = slots["R_SLIP"] + 1 if formulation.has_friction else slots["R_DENSITY"]
        width = slots["R_HOOP"] + 1 if formulation.axisymmetric else width
        self._rates = np.zeros((count, width))
        self._place = np.arange(count, dtype=np.uint32)
        self.jacobians, self.strains, self.latest = np.ones(count), np.zeros(count), np.zeros(count)
        self.swellings, self.loose = np.ones(count), np.zeros(count, bool)
        identity = np.eye(dim).ravel()
        if formulation.axisymmetric:  # the hoop stretch behind F
            identity = np.append(identity, 1.0)
        self.f_start = np.tile(identity, (count if formulation.renew_strain else 1, 1))
        self._stage = 0.0
        self.rows_ = aligned_zeros(count, self.layout.width)
        convertible = formulation.conversion.bodies
        self._convertible = np.ones(count, bool) if convertible is None else np.isin(body, convertible)
        self._body_indices = body.astype(np.uint32)
        self._bodies, self._numbers = body.astype(np.float64), particles.numbers()
        self._undamaged, self._no_particles = np.zeros(count), np.zeros(count, bool)

    def get_carried(self) -> dict[str, np.ndarray]:
        extra = {"before": self.f_start} if self.formulation.renew_strain is not None else {}
        return (
            {name: getattr(self, name) for name in ARRAYS}
            | extra
            | {"rows": self.rows_[: self.particles.count], "rates": self._rates}
            | (self.contact.get_carried() if self.contact is not None else {})
        )

    def history(self) -> dict[str, np.ndarray]:
        contact = {} if self.contact is None else self.contact.history()
        return super().history() | {"stage": np.array([self._stage])} | contact

    def attach_halo(self, halo_for: Callable[[RowLayout], Halo]) -> None:
        self.copies.halo, self._halo_for = halo_for(self.copies.layout), halo_for

    def replace_particles(self, data: np.ndarray, tags: np.ndarray, arrays: dict[str, np.ndarray]) -> None:
        particles, stage = self.particles, self._stage
        particles.data, particles.tags = np.ascontiguousarray(data), np.ascontiguousarray(tags)
        self.totals.resize(len(data))
        self._allocate_arrays()
        self._take(arrays)
        self._stage = stage

    def _take(self, arrays: dict[str, np.ndarray]) -> None:
        """Set the data of `get_carried` and build all that depends on them."""
        copies = {name: np.array(arrays[name], getattr(self, name).dtype) for name in ARRAYS}
        self.volume, self.alone, self.sequence = (copies[name] for name in ("volume", "alone", "sequence"))
        self._build_reference()
        if self.any_process(copies["loose"].any()):
            self.reference.remove(self.copies.extend_rows(copies["loose"]))
        for name, values in copies.items():
            setattr(self, name, values)
        if "before" in arrays:
            self.f_start = np.array(arrays["before"])
        self.rows_[: self.particles.count], self._rates[...] = arrays["rows"], arrays["rates"]
        if self.contact is not None:
            self.contact.replace_particles(arrays)
            self._body_indices = self.contact.pieces
            self._one_piece = self._one_body and not self.any_process(copies["loose"].any())
        self._classify()

    def fit_grid(self) -> None:
        if self.particles.count:
            super().fit_grid()
            self.spatial.fit_grid(self.particles["position"])
            if self.contact is not None:
                self.contact.fit_grid()

    def restore(self, arrays: dict[str, np.ndarray], history: dict[str, np.ndarray]) -> None:
        self._set_up()
        self._take(arrays)
        if self.contact is not None:
            self.contact.restore(history)
        self._stage = float(history["stage"][0])
        self.totals.restore(history)
        if self.motion is not None:
            self.motion.restore(history)
        if self.boundaries is not None:
            self.boundaries.restore(history)
        self._sum_up()


class Neighbours(Protocol):
    """Queries of reference neighbours, and of other processes."""

    @property
    def dim(self) -> int:
        """Number of dimensions."""

    def any_process(self, condition: bool | np.bool_) -> bool:
        """Return whether a condition holds on any process."""

    def neighbours_of(self, mask: np.ndarray) -> np.ndarray:
        """Return which particles have one of `mask` (n,) among their reference neighbours (n,), bool."""


@dataclass(frozen=True)
class Conversion:
    """Parameters of the conversion to Eulerian particles."""

    # limit of the equivalent strain, None for none, 0 for Eulerian from the start; whether failed particles convert
    strain: float | None = None
    damage: bool = False
    neighbours: bool = True  # whether reference neighbours of a converted particle convert, too
    bodies: tuple[int, ...] | None = None  # indices of the bodies that convert; None for all
    # whether the fallback is active, and above which strain; None for 1.5 in 1D and 2D and 1.0 in 3D
    fallback: bool = True
    fallback_strain: float | None = None
    # whether it acts on the neighbours of failed Eulerian particles, where failed particles convert
    fallback_damage: bool = True
    smallest: float = 0.2
    largest: float = 5.0

    @property
    def is_off(self) -> bool:
        """Whether neither strain nor damage of a particle converts it."""
        return self.strain is None and not self.damage

    def find_converting(
        self,
        lagrangian: np.ndarray,
        convertible: np.ndarray,
        active: np.ndarray,
        jacobians: np.ndarray,
        strains: np.ndarray,
        damage: np.ndarray,
        neighbours: Neighbours,
    ) -> np.ndarray:
        """Return which particles convert to Eulerian now (n,), bool.

        `convertible` may convert by their own strain or damage; the deformation gradient of `active` ones is known.
        `jacobians`, `strains` and `damage` are J, equivalent strain and damage (n,).
        """
        mask = np.zeros(len(lagrangian), bool)
        candidates = lagrangian & convertible
        if self.strain is not None:
            mask |= candidates & (strains >= self.strain)
        if self.damage:
            mask |= candidates & (damage >= 1.0)
        has_fallback = self.fallback and (not self.is_off or neighbours.any_process(not lagrangian.all()))
        rupture = np.zeros_like(mask)
        if has_fallback:
            mask |= lagrangian & active & (jacobians < self.smallest)
            limit = self.fallback_strain or (1.0 if neighbours.dim == 3 else 1.5)
            rupture = (jacobians < self.smallest) | (jacobians > self.largest) | (strains > limit)
            if self.damage and self.fallback_damage:
                rupture |= damage >= 1.0
            rupture &= active & ~lagrangian
        if neighbours.any_process(mask.any() or rupture.any()):
            sources = rupture | mask if self.neighbours else rupture
            mask |= lagrangian & neighbours.neighbours_of(sources)
        return mask
