"""Gauges: records of particles, points in space and free surfaces.

A gauge is placed once, on the initial bodies. A moving gauge follows a particle by its permanent number, so that a
resumed run has the same gauges. The gauge of a retired particle records NaN.

At a fixed point the value is f = sum_b V_b W_b f_b / sum_b V_b W_b over the particles whose kernels reach it: Shepard's
normalisation, exact for a constant up to a free surface.
"""

from dataclasses import dataclass

import numpy as np

from hvisph.case.output import Gauge
from hvisph.compiler.jit import specialise
from hvisph.core.errors import CaseError
from hvisph.core.fields import SYMMETRIC_COMPONENTS, component_names, field_of
from hvisph.core.particles import FLAGS, ID, RETIRED
from hvisph.parallel.subdomain import Subdomain
from hvisph.schemes.derived_fields import NAMES, diagnose
from hvisph.schemes.protocol import AnyStepper
from hvisph.sph.kernels import weigh

from .bodies import PlacedBody

BODY_DISTANCE = 1.0  # [dx]; a gauge further from every particle is outside all bodies


@dataclass(frozen=True)
class PlacedGauge:
    """Gauge at its position.

    `columns` are the components recorded, every `every` steps (None for every line of the history), at a fixed `point`
    [m] or of the particle of permanent number `particle`; `normal` is the outward normal of an observed free surface.
    """

    columns: tuple[str, ...]
    every: int | None
    point: np.ndarray | None = None
    particle: int = 0
    normal: np.ndarray | None = None


class Gauges:
    """Gauges of a run, `columns` ``gauge.<name>.<field>``; raises `CaseError` for a field that is not there."""

    def __init__(self, gauges: dict[str, PlacedGauge], stepper: AnyStepper):
        self._stepper, self._names = stepper, tuple(gauges)
        self._gauges = list(gauges.values())
        self.columns = tuple(f"gauge.{name}.{column}" for name, gauge in gauges.items() for column in gauge.columns)
        fields = {*stepper.particles.names, *NAMES, "stress"}
        for name, gauge in gauges.items():
            for column in gauge.columns:
                if field_of(column).name not in fields:
                    raise CaseError(
                        f"'{field_of(column).name}' is not a field of the formulation "
                        f"'{stepper.formulation.name}'; leave it out",
                        where=f"gauges.{name}.fields",
                    )
        dim, kernel = stepper.particles.dim, stepper.formulation.kernel
        at = {k: v for k, v in stepper.particles.bindings().items() if k in weigh.__code__.co_names}
        self._weigh = specialise(weigh, parallel=False, DIM=dim, shape=kernel.shape, **at)

    @property
    def surfaces(self) -> dict[str, tuple[int, np.ndarray]]:
        """Particle number and outward normal of every gauge of a free surface, by name."""
        gauges = zip(self._names, self._gauges, strict=True)
        return {name: (gauge.particle, gauge.normal) for name, gauge in gauges if gauge.normal is not None}

    def due(self, step: int) -> bool:
        """Return whether a gauge records after `step` steps."""
        return any(g.every is not None and step % g.every == 0 for g in self._gauges)

    def record(self, step: int, subdomain: Subdomain) -> list[float]:
        """Return the values of `columns`; NaN for gauges that are not due, have no particles or are retired."""
        if not self._gauges:
            return []
        due = [g.every is None or step % g.every == 0 for g in self._gauges]
        riding = [g.particle for g, is_due in zip(self._gauges, due, strict=True) if is_due and g.point is None]
        particles, numbers = self._stepper.particles, np.array(riding, np.int64)
        values = None
        if riding:
            values = _Values(
                self._stepper,
                subdomain.gather_values(numbers, particles.data),
                subdomain.gather_values(numbers, particles.tags),
            )
        record: list[float] = []
        row = 0
        for gauge, is_due in zip(self._gauges, due, strict=True):
            if not is_due:
                record += [float("nan")] * len(gauge.columns)
            elif gauge.point is not None:
                record += self._interpolate(gauge, subdomain)
            else:
                assert values is not None
                record += [values.component(column, row, gauge.normal) for column in gauge.columns]
                row += 1
        return record

    def _interpolate(self, gauge: PlacedGauge, subdomain: Subdomain) -> list[float]:
        particles = self._stepper.particles
        assert gauge.point is not None
        rows, weights = np.empty(particles.count, np.int64), np.empty(particles.count)
        reach = self._stepper.formulation.kernel.reach
        n = self._weigh(particles.data, gauge.point, reach, rows, weights)
        neighbours = rows[:n]
        tags, data, weights = (
            subdomain.gather_rows(a) for a in (particles.tags[neighbours], particles.data[neighbours], weights[:n])
        )
        if not len(tags):
            return [float("nan")] * len(gauge.columns)
        order = np.argsort(tags[:, ID])  # a sum that does not depend on where particles are kept
        values, shares = _Values(self._stepper, data[order], tags[order]), weights[order] / weights[order].sum()
        return [float(shares @ values.column(column)) for column in gauge.columns]


class _Values:
    """Fields of a few particles."""

    def __init__(self, stepper: AnyStepper, data: np.ndarray, tags: np.ndarray):
        self._particles = stepper.particles.like(len(data))
        self._particles.data[...], self._particles.tags[...] = data, tags
        self._found = diagnose(self._particles, stepper.table, stepper.models)

    def column(self, column: str) -> np.ndarray:
        """Return a component of a field, (particles,)."""
        name, dim = field_of(column).name, self._particles.dim
        if name == "stress":
            number = SYMMETRIC_COMPONENTS.index(column.rpartition("_")[2])
            return self._particles["deviator"][:, number] - (self._found["pressure"] if number < 3 else 0.0)
        if name in NAMES:
            return self._found.get(name, np.full(self._particles.count, np.nan))
        values = self._particles[name]
        return values if values.ndim == 1 else values[:, component_names(name, dim).index(column)]

    def component(self, column: str, row: int, normal: np.ndarray | None) -> float:
        """Return a component of a particle, NaN if retired; a surface lies half a spacing outwards."""
        if self._particles.tags[row, FLAGS] & RETIRED:
            return float("nan")
        value = float(self.column(column)[row])
        if normal is None or field_of(column).name != "position":
            return value
        particles = self._particles
        volume = float(particles["mass"][row] / particles["density"][row])
        if particles.kinematics.axisymmetric:
            volume /= 2.0 * np.pi * float(particles["position"][row, 1])
        spacing = volume ** (1.0 / particles.dim)
        return value + 0.5 * spacing * float(normal[component_names("position", particles.dim).index(column)])


def placed_gauges(models: dict[str, Gauge], bodies: list[PlacedBody], dx: float) -> dict[str, PlacedGauge]:
    """Place gauges on `bodies` of numbered particles; raises `CaseError` for one outside every body."""
    if not models:
        return {}
    positions = np.concatenate([body.positions for body in bodies])
    owner = np.repeat(np.arange(len(bodies)), [len(body.positions) for body in bodies])
    spacing = np.maximum(np.concatenate([body.spacing for body in bodies]), dx)
    return {name: _place_gauge(name, model, positions, owner, spacing) for name, model in models.items()}


def _place_gauge(name: str, model: Gauge, positions: np.ndarray, owner: np.ndarray, spacing: np.ndarray) -> PlacedGauge:
    """Return a gauge at its position."""
    dim = positions.shape[1]
    at = np.array(model.at, dtype=float)
    columns = tuple(c for field in model.fields for c in component_names(field, dim))
    if model.type == "fixed":
        return PlacedGauge(columns, model.every, point=at)
    distance = np.sqrt(((positions - at) ** 2).sum(axis=1))
    particle = int(distance.argmin())
    if distance[particle] > BODY_DISTANCE * spacing[particle]:
        place = ", ".join(f"{x:.6g}" for x in positions[particle])
        fault = f"({', '.join(f'{x:.6g}' for x in at)}) is outside every body; the nearest particle is at ({place})."
        raise CaseError(f"{fault} Move the gauge into a body, or make it `fixed`", where=f"gauges.{name}.at")
    if model.type == "material":
        return PlacedGauge(columns, model.every, particle=particle)
    normal = np.zeros(dim)
    normal["xyz".index(model.direction[1])] = 1.0 if model.direction[0] == "+" else -1.0
    from_at = positions - at
    height = from_at @ normal
    lateral = np.sqrt(np.maximum((from_at**2).sum(axis=1) - height**2, 0.0))
    column = (owner == owner[particle]) & (lateral <= lateral[particle] + 0.5 * spacing[particle])
    outermost = np.flatnonzero(column)[height[column].argmax()]
    return PlacedGauge(columns, model.every, particle=int(outermost), normal=normal)
