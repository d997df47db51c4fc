"""Exact solution of a one-dimensional case by wave tracking: tables, pictures, comparison with gauges of runs.

Layers without strength whose pressure depends on density alone are exact in closed form; other materials are
solved by the jump conditions of an elastic-plastic solid, to about 1e-3 (both in `exact.plate_impact`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hvisph.case.case import Case
from hvisph.case.output import Gauge
from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError, RunError
from hvisph.core.fields import component_names
from hvisph.core.text import Plain
from hvisph.exact.plate_impact import layered_impact, with_reflections
from hvisph.exact.wave_curves import State
from hvisph.exact.wave_fronts import Tracked
from hvisph.measures.compare import mean_difference
from hvisph.output import file_names
from hvisph.output.atomic_write import write_csv, write_errors
from hvisph.output.reader import read_history
from hvisph.setup.bodies import PlacedBody, placed_bodies
from hvisph.setup.materials import material_of
from hvisph.visualization.curves import Curve, curves_picture, gauge_panels, steps

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
    """Piecewise constant history of a gauge in the exact solution."""

    name: str  # its name in the case
    columns: tuple[str, ...]  # columns that the exact solution has
    times: np.ndarray  # times from which on the states hold [s], the first 0
    states: list[State]  # one state a time

    def values(self, column: str) -> np.ndarray:
        """Return a column's value from each of `times` on."""
        return np.array([COLUMNS[column](state) for state in self.states])

    def sample(self, column: str, times: np.ndarray) -> np.ndarray:
        """Return a column at given times [s]."""
        return self.values(column)[np.searchsorted(self.times, times, side="right") - 1]


@dataclass(frozen=True)
class ExactSolution:
    """Waves and gauge histories of the exact solution."""

    tracked: Tracked  # the waves
    gauges: tuple[ExactGauge, ...]  # gauges that ride with the material or watch a surface, in the case's order
    barotropic: bool  # whether pressure follows density alone

    def histories(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """Return ``gauge.<name>.<field>`` at `times` [s], the exact columns of history.csv."""
        return {f"gauge.{g.name}.{column}": g.sample(column, times) for g in self.gauges for column in g.columns}

    def columns(self) -> list[str]:
        """Return the columns that a profile has."""
        names = ["velocity_x", "pressure", "density"]
        return names if self.barotropic else [*names, "stress_xx", "internal_energy"]

    def profile(self, time: float) -> dict[str, np.ndarray]:
        """Return the profile at `time` [s]: the ends x of each uniform region, and the columns at them."""
        edges, states = self.tracked.profile(time)
        profile = {"x": edges.ravel()}
        for column in self.columns():
            profile[column] = np.repeat([COLUMNS[column](state) for state in states], 2)
        return profile


def exact_solution(case: Case) -> ExactSolution:
    """Solve a case exactly.

    Gauges move with their particles; those fixed in space are left out. Raises `CaseError` where
    there is no exact solution: more dimensions than one, planes of symmetry, clamps, damage, a strength whose shocks
    depend on the history; `RunError` where states leave the range of the material models.
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
    gauges = [
        _gauge(name, gauge, placed, tracked, barotropic) for name, gauge in case.gauges.items() if gauge.type != "fixed"
    ]
    return ExactSolution(tracked, tuple(gauges), barotropic)


def _refuse_unsolvable(case: Case) -> None:
    reasons = {
        "kinematics": case.dim != 1 and f"a case in {case.dim}D has no exact solution here; use uniaxial_strain",
        "symmetry": bool(case.symmetry) and "planes of symmetry are not in the exact solution; write out both halves",
        "clamped": bool(case.clamped) and "clamped regions are not in the exact solution",
    }
    for where, obstacle in reasons.items():
        if obstacle:
            raise CaseError(obstacle, where=where)
    for name, body in case.bodies.items():
        if body.material.damage.type != "none":
            message = "damage is not in the exact solution; set the type to none"
            raise CaseError(message, where=f"bodies.{name}.material.damage")


def _gauge(name: str, model: Gauge, placed: list[PlacedBody], tracked: Tracked, barotropic: bool) -> ExactGauge:
    positions = np.concatenate([body.positions[:, 0] for body in placed])
    start = float(positions[np.abs(positions - model.at[0]).argmin()])
    if model.type == "free_surface":
        body = next(b for b in placed if b.positions.min() <= start <= b.positions.max())
        start = float(body.positions.max() if model.direction == "+x" else body.positions.min())
    columns = [c for field in model.fields for c in component_names(field, 1) if c in COLUMNS]
    if barotropic:
        columns = [c for c in columns if c != "internal_energy"]
    times, states = tracked.gauge(start)
    return ExactGauge(name, tuple(columns), times, states)


MOST_DRAWN = 6  # moments drawn beside one another in the picture of profiles


def write_exact(solution: ExactSolution, case: Case, folder: str | Path) -> list[Path]:
    """Write gauges and profiles of an exact solution into `folder`, made if need be; return the files.

    ``gauge.NAME.csv`` holds two lines for every jump, the values before and after it, so that straight lines between
    its points are the exact history; ``profile_N.csv`` likewise two for every region, at the moments of the case's
    output. Raises `OutputError` when something cannot be written.
    """
    folder = Path(folder)
    with write_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    unitless, end = case.units == "none", case.time.end
    files: list[Path] = []
    panels: Plain = {}
    for gauge in solution.gauges:
        table = {}
        for column in gauge.columns:
            table["time"], table[column] = steps(gauge.times, gauge.values(column), end)
            panels.setdefault(column, []).append(Curve(gauge.name, table["time"], table[column]))
        files.append(_write_table(folder / f"gauge.{gauge.name}.csv", table))
    title = f"{case.title}, exact" if case.title else "exact"
    if panels:
        files.append(curves_picture(panels, folder / "gauges.png", title=title, unitless=unitless))
    interval = case.snapshot_interval  # the end itself is the first moment that the waves are not followed through
    moments = [min(k * interval, end * (1.0 - 1e-12)) for k in range(1, int(np.ceil(end / interval - 1e-9)) + 1)]
    pictured = set(np.linspace(0, len(moments) - 1, MOST_DRAWN).round().astype(int)) if moments else set()
    profiles: dict[str, list[Curve]] = {}
    for number, time in enumerate(moments):
        profile = solution.profile(time)
        files.append(_write_table(folder / f"profile_{number + 1:04d}.csv", profile))
        for column in solution.columns():
            if number in pictured:
                label = f"t = {time:.4g}" if unitless else f"t = {1e6 * time:.4g} us"
                profiles.setdefault(column, []).append(Curve(label, profile["x"], profile[column]))
    files.append(curves_picture(profiles, folder / "profiles.png", title=title, across="x", unitless=unitless))
    return files


def _write_table(path: Path, table: dict[str, np.ndarray]) -> Path:
    write_csv(path, [table, *zip(*(map(float, values) for values in table.values()), strict=True)])
    return path


@dataclass(frozen=True)
class Difference:
    """Mean difference of a gauge from the exact solution, and the range of the exact values, in SI."""

    mean: float
    exact_range: float


@dataclass
class Overlay:
    """Gauges of several runs."""

    # curves by field, for `hvisph.visualization.curves.curves_picture`
    panels: dict[str, list[Curve]] = field(default_factory=dict)
    # by run, then by column of its history: ``gauge.<name>.<field>``
    differences: dict[str, dict[str, Difference]] = field(default_factory=dict)
    without: dict[str, str] = field(default_factory=dict)  # runs without an exact solution, and why
    unitless: bool = False  # whether a case is non-dimensional


def overlay(folders: Mapping[str, Path], exact: bool = True) -> Overlay:
    """Return gauges of runs, beside exact ones if `exact`; `CaseError` or `OutputError` where there are none."""
    overlaid = Overlay()
    for name, folder in folders.items():
        if not (folder / file_names.CASE).is_file():
            raise CaseError(f"{folder} is no folder of a run: it has no {file_names.CASE}")
        case = load_case(folder / file_names.CASE)
        overlaid.unitless |= case.units == "none"
        exact_gauges = _exact(name, folder, case, overlaid) if exact else {}
        panels = gauge_panels(folder, exact_gauges, prefix=f"{name} " if len(folders) > 1 else "")
        for column, curves in panels.items():
            panel = overlaid.panels.setdefault(column, [])
            same = [(curve.x.tolist(), curve.y.tolist()) for curve in panel if curve.exact]  # of the same impact
            panel += [curve for curve in curves if not curve.exact or (curve.x.tolist(), curve.y.tolist()) not in same]
    return overlaid


def _exact(name: str, folder: Path, case: Case, overlaid: Overlay) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return the exact gauges of a run by their columns, and note the differences, or why there are none."""
    try:
        solution = exact_solution(case)
    except (CaseError, RunError) as error:
        overlaid.without[name] = str(error)
        return {}
    history = read_history(folder)
    differences = overlaid.differences.setdefault(name, {})
    gauges = {}
    for column, values in solution.histories(history["time"]).items():
        mean = mean_difference(history["time"], history[column], values)
        differences[column] = Difference(mean, float(np.ptp(values)))
    for gauge in solution.gauges:
        for column in gauge.columns:
            line = steps(gauge.times, gauge.values(column), float(history["time"][-1]))
            gauges[f"gauge.{gauge.name}.{column}"] = line
    return gauges
