"""A verification problem: its trials and materials, finished runs, and figures compared with exact values."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from math import isfinite
from pathlib import Path

import numpy as np

from hvisph.case.case import Case
from hvisph.casefile.material_library import library_values
from hvisph.core.particles import Particles
from hvisph.core.text import Plain
from hvisph.materials.material_table import Material
from hvisph.output.reader import list_snapshots, read_history, read_snapshot
from hvisph.output.snapshot import Snapshot
from hvisph.setup.bodies import PlacedBody
from hvisph.setup.materials import material_of
from hvisph.visualization.curves import Curve


@dataclass(frozen=True)
class Figure:
    """Computed and exact value of one quantity."""

    name: str  # quantity
    # computed and exact value, in `unit`
    found: float
    exact: float
    tolerance: float  # largest difference that passes: a share of `scale`, or in `unit` where `scale` is zero
    unit: str = ""  # SI unit; empty for plain numbers
    # scale of the difference, positive; the size of the exact value unless given, 0 for none
    scale: float | None = None
    why: str = ""  # why the tolerance is what it is
    at_most: bool = False  # whether `found` only must not exceed `exact` by more than the tolerance

    @property
    def off(self) -> float:
        """Difference, found - exact, over the scale, or in the unit where there is none."""
        scale = abs(self.exact) if self.scale is None else self.scale
        return (self.found - self.exact) / (scale or 1.0)

    @property
    def relative(self) -> bool:
        """Whether `off` and `tolerance` are shares."""
        return bool(abs(self.exact) if self.scale is None else self.scale)

    @property
    def passed(self) -> bool:
        """Whether the difference is within the tolerance; never for a non-finite value."""
        return isfinite(self.found) and bool((self.off if self.at_most else abs(self.off)) <= self.tolerance)

    def as_dict(self) -> Plain:
        """Return the plain form, with None for values that are not finite."""
        content = asdict(self) | {"off": self.off, "relative": self.relative, "passed": self.passed}
        return {k: None if isinstance(v, float) and not isfinite(v) else v for k, v in content.items()}


def limit(name: str, computed: float, tolerance: float, unit: str = "", why: str = "") -> Figure:
    """Return a figure that is at best zero and passes up to `tolerance`."""
    return Figure(name, computed, 0.0, tolerance, unit, 0.0, why, at_most=True)


@dataclass
class Ran:
    """A run's case, folder and summary; files are read when asked for."""

    case: Case
    folder: Path
    summary: Plain

    @cached_property
    def snapshots(self) -> list[Snapshot]:
        """All snapshots, in order of time."""
        return [read_snapshot(path) for path in list_snapshots(self.folder)]

    @property
    def first(self) -> Snapshot:
        """The start."""
        return self.snapshots[0]

    @property
    def last(self) -> Snapshot:
        """The end."""
        return self.snapshots[-1]

    @cached_property
    def history(self) -> dict[str, np.ndarray]:
        """Columns of the history."""
        return read_history(self.folder)

    @property
    def dx(self) -> float:
        """Particle spacing at the start [m]."""
        return float(self.case.resolution)

    @property
    def drift(self) -> float:
        """Change of momentum over all momentum at the start; 0 where nothing moved."""
        return float(self.summary["conservation"]["momentum_drift"] or 0.0)

    def momentum(self, body: int, snapshot: Snapshot | None = None) -> np.ndarray:
        """Return the momentum of a body, shape (dim,) [kg m/s]."""
        at = snapshot or self.last
        rows = at.body == body
        return np.atleast_1d((at.fields["mass"][rows, None] * vectors(at, "velocity")[rows]).sum(axis=0))

    def mean_velocity(self, body: int, snapshot: Snapshot | None = None) -> np.ndarray:
        """Return the velocity of a body's centre of mass, shape (dim,) [m/s]."""
        at = snapshot or self.last
        return self.momentum(body, at) / at.fields["mass"][at.body == body].sum()

    def kinetic_energy(self, snapshot: Snapshot | None = None) -> float:
        """Return the kinetic energy [J]."""
        at = snapshot or self.last
        return float(0.5 * (at.fields["mass"] * (vectors(at, "velocity") ** 2).sum(axis=1)).sum())


def vectors(snapshot: Snapshot, name: str) -> np.ndarray:
    """Return a vector field, shape (n, dim), in one dimension too."""
    return snapshot.fields[name].reshape(snapshot.count, -1)


def stress_xx(snapshot: Snapshot) -> np.ndarray:
    """Return the compressive stress along x, p - S_xx, shape (n,) [Pa]."""
    return snapshot.fields["pressure"] - snapshot.fields["deviator"].reshape(snapshot.count, -1)[:, 0]


SOLIDS = ("riemann", "eulerian", "total_lagrangian", "adaptive")  # formulations with an equation of state
EULERIAN = ("riemann", "eulerian")  # formulations with a free initial density
ALL = (*SOLIDS, "projection")


def computed_and_exact(
    x: np.ndarray, computed: Mapping[str, np.ndarray], exact_x: np.ndarray, exact: Mapping[str, np.ndarray]
) -> dict[str, list[Curve]]:
    """Return a panel a quantity of `exact` by name: the computed curve over `x`, and the exact one over `exact_x`."""
    return {
        name: [Curve("computed", x, computed[name]), Curve("exact", exact_x, values, exact=True)]
        for name, values in exact.items()
    }


@dataclass(frozen=True)
class Options:
    """Options of a problem."""

    quick: bool = False  # the coarse form: seconds
    spacing: float | None = None  # particle spacing in place of the problem's own, in the units of its cases
    seeds: int | None = None  # number of random starts, where there are such

    def dx(self, full: float, quick: float) -> float:
        """Return the spacing to take."""
        return self.spacing or (quick if self.quick else full)


@dataclass(frozen=True)
class Start:
    """One run: a case without its formulation, and changes of the start that a case file cannot describe."""

    case: Plain  # a mapping with the keys of a case file; of the formulation, only options that the problem is about
    # changes the bodies' particles before anything is built
    place: Callable[[list[PlacedBody]], list[PlacedBody]] | None = None
    state: Callable[[Particles], None] | None = None  # changes the state once it is built: all but positions and masses


@dataclass(frozen=True)
class Trial:
    """Variant of a problem: its runs and figures."""

    name: str  # identifies it among the trials of the problem
    starts: Sequence[Start]  # the runs
    figures: Callable[[Sequence[Ran]], Iterable[Figure]]  # draws the figures from the runs
    # draws what there is to see, by panel; exact curves are marked as such
    curves: Callable[[Sequence[Ran]], dict[str, list[Curve]]] | None = None
    across: str = "x"  # abscissa of `curves`: ``x`` or ``time``
    # SI units of panels that are not named after a field; empty for plain numbers
    units: Mapping[str, str] = field(default_factory=dict)
    may_stop: bool = False  # whether figures are drawn from runs that have stopped themselves, too


@dataclass(frozen=True)
class Problem:
    """A problem with an exact solution."""

    # its name, and what it shows in one line
    name: str
    title: str
    trials: Callable[[Options], Iterable[Trial]]  # makes the trials
    formulations: tuple[str, ...] = SOLIDS  # formulations that can run it, by `type`
    why_not: str = "projection has no equation of state"  # why the others cannot
    slow: bool = False  # whether the full form takes more than a minute or two a formulation
    # name of the figure in which formulations are to agree with one another, and the share by which they may differ
    agree: tuple[str, float] | None = None


# Elastic aluminium of the bars, beams and discs.
RHO, YOUNGS_MODULUS, POISSON_RATIO = 2700.0, 70e9, 0.33  # [kg/m^3], [Pa], [-]
ELASTIC: Plain = {
    "density": RHO,
    "eos": {"type": "elastic", "youngs_modulus": YOUNGS_MODULUS, "poisson_ratio": POISSON_RATIO},
    "strength": {"type": "elastic"},
}
# Water without tensile strength.
WATER: Plain = {
    "density": 1000.0,
    "eos": {"type": "linear", "bulk_modulus": 2.2e9},
    "damage": {"type": "pressure_cutoff", "pressure": -1e3},
}


def fluid(name: str) -> Plain:
    """Return a material of the library without its strength and damage."""
    return library_values(name) | {"strength": {"type": "none"}, "damage": {"type": "none"}}


def body_material(case: Case, body: str) -> Material:
    """Return the material of a case's body."""
    model = case.bodies[body]
    return material_of(model.material, model.internal_energy)
