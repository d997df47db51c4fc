"""Exact solution of a one-dimensional case by wave tracking.

Layers without strength whose pressure follows density alone are exact in closed form
(`exact.plate_impact`); other materials go through the jump conditions of an elastic-plastic solid
(`exact.plate_impact`), good to about 1e-3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.core.fields import component_names
from hvisph.exact.plate_impact import layered_impact, with_reflections
from hvisph.exact.wave_curves import State
from hvisph.exact.wave_fronts import Tracked
from hvisph.setup.bodies import PlacedBody, placed_bodies
from hvisph.setup.materials import material_of

if TYPE_CHECKING:
    from hvisph.case.case import Case
    from hvisph.case.gauges import Gauge

# What a state of the exact solution says of the columns of a gauge.
COLUMNS = {
    "velocity_x": lambda state: state.velocity,
    "pressure": lambda state: state.pressure,
    "density": lambda state: state.density,
    "stress_xx": lambda state: -state.stress,
    "deviator_xx": lambda state: state.deviator,
    "deviator_yy": lambda state: -0.5 * state.deviator,
    "deviator_zz": lambda state: -0.5 * state.deviator,
    "internal_energy": lambda state: state.energy,
}


@dataclass(frozen=True)
class ExactGauge:
    """Piecewise constant history of a gauge in the exact solution.

    Parameters
    ----------
    name
        Its name in the case.
    columns
        Those of its columns that the exact solution knows.
    times
        Times from which on the states hold [s], the first 0.
    states
        One state a time.
    """

    name: str
    columns: tuple[str, ...]
    times: np.ndarray
    states: list[State]

    def values(self, column: str) -> np.ndarray:
        """Return a column's value from each of `times` on."""
        return np.array([COLUMNS[column](state) for state in self.states])

    def sample(self, column: str, times: np.ndarray) -> np.ndarray:
        """Return a column at given times [s]."""
        return self.values(column)[np.searchsorted(self.times, times, side="right") - 1]


@dataclass(frozen=True)
class ExactSolution:
    """Waves and gauge histories of the exact solution.

    Parameters
    ----------
    tracked
        The waves.
    gauges
        Gauges that ride with the material or watch a surface, in the case's order.
    barotropic
        Whether pressure follows density alone.
    """

    tracked: Tracked
    gauges: tuple[ExactGauge, ...]
    barotropic: bool

    def histories(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """Return ``gauge.<name>.<field>`` at `times` [s]: what the columns of history.csv should be."""
        return {f"gauge.{g.name}.{column}": g.sample(column, times) for g in self.gauges for column in g.columns}

    def columns(self) -> list[str]:
        """Return the columns that a profile has."""
        known = ["velocity_x", "pressure", "density"]
        return known if self.barotropic else [*known, "stress_xx", "internal_energy"]

    def profile(self, time: float) -> dict[str, np.ndarray]:
        """Return the profile at `time` [s]: the ends x of each uniform region, and the columns at them."""
        edges, states = self.tracked.profile(time)
        profile = {"x": edges.ravel()}
        for column in self.columns():
            profile[column] = np.repeat([COLUMNS[column](state) for state in states], 2)
        return profile


def exact_solution(case: Case) -> ExactSolution:
    """Solve a case exactly.

    Gauges see what the particle sees that they ride with. Those fixed in space are left out.

    Raises
    ------
    CaseError
        Where there is no exact solution: more dimensions than one, planes of symmetry, clamps, damage,
        a strength whose shocks depend on the history.
    RunError
        Where the waves lead out of the materials' laws.
    """
    _refuse_unsolvable(case)
    placed = placed_bodies(case)
    layers = []
    for body in placed:
        # half a spacing outside of the outermost particles, which a plane of symmetry may have cut
        outer = (int(body.positions.argmin()), -0.5), (int(body.positions.argmax()), 0.5)
        faces = [float(body.positions[i, 0] + half * body.spacing[i]) for i, half in outer]
        material = material_of(body.model.material, body.model.internal_energy)
        layers.append((material, faces[0], faces[1], body.model.velocity[0]))
    for before, after in zip(range(len(layers)), range(1, len(layers)), strict=False):
        # faces of touching bodies differ by round-off
        if abs(layers[after][1] - layers[before][2]) < 1e-6 * case.resolution:
            layers[after] = (layers[after][0], layers[before][2], *layers[after][2:])
    barotropic = all(
        body.model.material.eos.type in ("linear", "elastic") and body.model.material.strength.type == "none"
        for body in placed
    )
    tracked = (layered_impact if barotropic else with_reflections)(layers, case.time.end)
    gauges = [_gauge(name, model, placed, tracked, barotropic) for name, model in case.gauges.items()
              if model.type != "fixed"]  # fmt: skip
    return ExactSolution(tracked, tuple(gauges), barotropic)


def _refuse_unsolvable(case: Case) -> None:
    reasons = {
        "kinematics": case.dim != 1 and f"a case in {case.dim}D has no exact solution here; use uniaxial_strain",
        "symmetry": bool(case.symmetry) and "planes of symmetry are not in the exact solution; write out both halves",
        "clamped": bool(case.clamped) and "clamped regions are not in the exact solution",
    }
    for where, reason in reasons.items():
        if reason:
            raise CaseError(reason, where=where)
    for name, body in case.bodies.items():
        if body.material.damage.type != "none":
            raise CaseError(
                "damage is not in the exact solution; set the type to none",
                where=f"bodies.{name}.material.damage",
            )


def _gauge(name: str, model: Gauge, placed: list[PlacedBody], tracked: Tracked, barotropic: bool) -> ExactGauge:
    positions = np.concatenate([body.positions[:, 0] for body in placed])
    start = float(positions[np.abs(positions - model.at[0]).argmin()])
    if model.type == "free_surface":
        body = next(b for b in placed if b.positions.min() <= start <= b.positions.max())
        start = float(body.positions.max() if model.direction == "+x" else body.positions.min())
    known = [c for field in model.fields for c in component_names(field, 1) if c in COLUMNS]
    if barotropic:
        known = [c for c in known if c != "internal_energy"]
    times, states = tracked.gauge(start)
    return ExactGauge(name, tuple(known), times, states)
