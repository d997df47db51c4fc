"""Frictional contact between bodies in formulations by kernel sums: pressure, sliding and separation.

The pair law of the formulation excludes pairs of different bodies. They have the Riemann contact of
`schemes.riemann.law` (SEPARATING), evaluated for particles near another body and their neighbours only.
"""

from collections.abc import Callable

import numpy as np

from hvisph.compiler.jit import CompiledFunction, Options, bind
from hvisph.compiler.parallel_for import particle_loop
from hvisph.compiler.tensors import SIZE
from hvisph.compiler.vector.rows import fetch_row
from hvisph.schemes.riemann import law as riemann
from hvisph.schemes.riemann import row as riemann_row
from hvisph.sph.contact import contact_normal
from hvisph.sph.contact import variable_resolution as unlike_spacings
from hvisph.sph.kernels import Kernel
from hvisph.sph.neighbours import particle_layout as sums_of_pairs
from hvisph.sph.neighbours.contact_candidates import Selection
from hvisph.sph.neighbours.ghost_rows import Halo, Plane
from hvisph.sph.neighbours.pairs import Pairs, Pass
from hvisph.sph.neighbours.particle_layout import RowLayout
from hvisph.sph.terms.limiters import NO_RECONSTRUCTION

AHEAD = 8  # rows are prefetched so many particles before they are needed


class NoContact:
    """No contact except the kernel sums."""

    def renumber(self, bodies: np.ndarray) -> None:
        """Set the bodies of the particles."""

    def attach_halo(self, halo_for: Callable[[RowLayout], Halo]) -> None:
        """Connect to other processes by the halos that `halo_for` makes of row layouts."""

    def add(self, standard: Pairs, h: float) -> None:
        """Add the contact rates to those of the `standard` law; `h` is the largest smoothing length [m]."""


class SeparatingContact:
    """Rates of frictional contact between bodies, added to those of standard SPH."""

    def __init__(self, kernel: Kernel, h: float, positions: np.ndarray, bodies: np.ndarray, friction: float,
                 planes: tuple[Plane, ...], axisymmetric: bool = False, unequal_spacings: bool = False,
                 h_over_dx: float = 1.4, angular_momentum: bool = False, rigid: Options | None = None):  # fmt: skip
        dim, rigid = positions.shape[1], rigid or {}
        turns = bool(rigid.get("TURNS", 0))
        options = {"has_contact": True, "axisymmetric": axisymmetric, "has_unequal_spacings": unequal_spacings,
                   "turns": turns}  # fmt: skip
        layout = riemann_row.row_layout(dim, lambda option: options.get(option, False))
        common = {"RECONSTRUCTION": 0, "SEPARATING": 1, "VARIABLE_RESOLUTION": int(unequal_spacings)}
        pair_row = riemann_row.pair_layout(layout)
        passes = [
            Pass(riemann_row.gradients, pair_row, common, (contact_normal.is_other_body,), into_rows=True),
            *riemann_row.contact_passes(layout, kernel, unequal_spacings),
            Pass(riemann.accumulate, pair_row,
                 common | rigid | {"share": NO_RECONSTRUCTION.share, "CONTACT_ONLY": 1,
                                   "AXISYMMETRIC": int(axisymmetric), "ANGULAR_MOMENTUM": int(angular_momentum)},
                 riemann.PARTS, has_friction=True, axisymmetric=axisymmetric,
                 angular_momentum=angular_momentum or turns),
        ]  # fmt: skip
        depths = unlike_spacings.depths(kernel, h_over_dx) if unequal_spacings else ()
        self._pairs = Pairs(layout, kernel, passes, np.array([1.0, friction, *depths]), positions, h, planes)
        self._selection = Selection(positions, kernel.reach * h)
        self._selection_halo: Halo | None = None
        self._packed = np.zeros((0, layout.used_width))  # nothing writes what passes make, which stays zero
        self.renumber(bodies)
        self._spins = SIZE["axial"][dim - 1] if angular_momentum or turns else 0
        self._clears_spin = turns and not angular_momentum  # the standard law writes no rate of spin
        self._loops: tuple[CompiledFunction, CompiledFunction, tuple[np.ndarray, np.ndarray]] | None = None
        self._stress = SIZE["symmetric"][dim - 1]

    def renumber(self, bodies: np.ndarray) -> None:
        """Set the bodies of the particles."""
        self._bodies = bodies.astype(np.uint32)

    def attach_halo(self, halo_for: Callable[[RowLayout], Halo]) -> None:
        self._pairs.halo = halo_for(self._pairs.layout)
        self._selection_halo = halo_for(_selection_layout(self._pairs.layout.dim))

    def _select(self, rows: np.ndarray, numbers: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the indices of particles near another body, and of those near one of these."""
        if self._selection_halo is None:
            return self._selection.near_other_bodies(rows, self._bodies, reach)
        dim, count = self._pairs.layout.dim, len(rows)
        table = np.zeros((count, _selection_layout(dim).used_width))
        table[:, :dim], table[:, dim] = rows[:, :dim], self._bodies
        # cells are selected by the content of cells up to two cells away
        table, _ = self._selection_halo.append(table, numbers, 3.0 * reach)
        contacts, others = self._selection.near_other_bodies(table, table[:, dim].astype(np.uint32), reach)
        return contacts[contacts < count], others[others < count]

    def add(self, standard: Pairs, h: float) -> None:
        """Add the contact rates to those of the `standard` law; `h` is the largest smoothing length [m]."""
        rows, numbers, rates = standard.rows, standard.numbers, standard.rates
        if self._clears_spin:
            rates[:, sums_of_pairs.slots(self._pairs.layout.dim)["R_SPIN"] :] = 0.0
        contacts, others = self._select(rows, numbers, self._pairs.kernel.reach * h)
        indices = np.concatenate([contacts, others])
        if not (len(indices) if self._selection_halo is None else self._selection_halo.any_process(len(indices) > 0)):
            return
        if len(self._packed) < len(indices):
            self._packed = np.zeros((len(indices) + len(indices) // 4, self._pairs.layout.used_width))
        packed = self._packed[: len(indices)]
        if self._loops is None:
            self._loops = self._bind(standard.slots)
        pack, add, slots = self._loops
        pack(len(indices), rows, indices, slots, packed)
        self._pairs.rows, self._pairs.numbers = packed, numbers[indices].astype(np.uint64)
        self._pairs.evaluate(h, len(contacts))
        add(len(contacts), self._pairs.rates, self._pairs.place, contacts, standard.place, rates)

    def _bind(self, slots: dict[str, int]) -> tuple[CompiledFunction, CompiledFunction, tuple[np.ndarray, np.ndarray]]:
        """Return the passes that pack and add, and the common slots of both laws."""
        target, dim = self._pairs.slots, self._pairs.layout.dim
        widths = {"X": dim, "U": dim, "T": self._stress, "H": 1, "ZN": 1, "ZT": 1, "BODY": 1}
        widths |= {name: width for name, width in (("RING", 1), ("TURN_RATE", self._spins)) if name in target}
        pairs = [(target[name] + k, slots[name] + k) for name, width in widths.items() for k in range(width)]
        columns = {"OF_RHO": slots["RHO"], "OF_M": slots["M"], "STRESSES": self._stress}
        pack = particle_loop(bind(contact_rows, columns, target), short=True)
        options = {"DIM": dim, "ANGULAR_MOMENTUM": self._spins}
        add = particle_loop(bind(add_contact, options, sums_of_pairs.slots(dim)), short=True)
        table = np.array(pairs, np.uint64).T.copy()
        return pack, add, (table[0], table[1])


def _selection_layout(dim: int) -> RowLayout:
    """Return the row layout of the selection of particles near another body."""
    return RowLayout(dim, (("x", "vector"), ("body", "scalar")))


def contact_rows(k, rows, indices, slots, packed):
    """Pack the rows of the particles `indices` for contact (template).

    `slots`: slots of contact, and those of the standard law with the same content. The STRESSES stresses from T on are
    multiplied by rho^2; a particle without mass receives the mass 1.
    """
    target, source = slots
    i = np.uint64(indices[k])
    fetch_row(rows, np.uint64(indices[min(k + np.uint64(AHEAD), np.uint64(indices.shape[0] - 1))]), 0, rows.shape[1])
    rho, mass = rows[i, OF_RHO], rows[i, OF_M]
    for f in range(np.uint64(target.shape[0])):
        packed[k, np.uint64(target[f])] = rows[i, np.uint64(source[f])]
    for f in range(np.uint64(T), np.uint64(T + STRESSES)):
        packed[k, f] *= rho * rho
    packed[k, V] = mass * (1.0 / rho)
    packed[k, M] = mass if mass > 0.0 else 1.0


def add_contact(k, contact_rates, place, indices, standard_place, rates):
    """Add the rates of contact, `contact_rates`, to those of standard SPH (template).

    Exceptions: of |mu| the larger value remains, and the heat of slip is that of contact. ANGULAR_MOMENTUM is the
    number of components of the spin rate. `place` and `standard_place`: row of the rates of each chosen particle in
    `contact_rates`, and of each particle in `rates`.
    """
    row, k_contact = np.uint64(standard_place[np.uint64(indices[k])]), np.uint64(place[k])
    approach, closing = rates[row, R_APPROACH], contact_rates[k_contact, R_APPROACH]
    for f in range(np.uint64(R_GRADIENT + DIM * DIM)):
        rates[row, f] += contact_rates[k_contact, f]
    for f in range(np.uint64(R_SPIN), np.uint64(R_SPIN + ANGULAR_MOMENTUM)):
        rates[row, f] += contact_rates[k_contact, f]
    # NaN must remain NaN
    rates[row, R_APPROACH] = approach if approach > closing or approach != approach else closing
    rates[row, R_SLIP] = contact_rates[k_contact, R_SLIP]
