"""What flies on behind the first perforated layers: the debris cloud, and what it does to a witness plane.

The cloud is all matter that lies behind the rear face of the last perforated layer and moves away from it: the
projectile's, and that of layers which is not attached to their rims. Its front velocity is the one that 99.9, 99 or
90 % of its mass stay below, its rear velocity the one that 99 % exceed, its radial velocity likewise; lengths and
angles leave out 1 % of its mass, so that no single particle decides.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hvisph.core.measure_catalogue import CLOUD_CATALOGUE
from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.result import ENERGY_UNITS, MASS_UNITS, MOMENTUM_UNITS, Result, meaningless
from hvisph.measures.statistics import weighted_quantile
from hvisph.measures.target.perforation import YES
from hvisph.measures.target.targets import LayerMeasures

from .witness_plate import Arrivals, arrivals, received

ANGLE_BIN = np.radians(2.0)
FEWEST = 20  # particles of a cloud


@dataclass(frozen=True)
class Cloud:
    """The debris cloud.

    Parameters
    ----------
    results
        By name; values in SI.
    over_angle
        Mass, axial momentum and kinetic energy in bins of 2 degrees between velocity and shot line: ``angle`` (upper
        ends [rad]), ``mass``, ``momentum``, ``energy``.
    witness
        What a plane across the shot line would receive if all flew on as it does: ``x`` [m], ``radius`` (upper ends
        [m]), ``mass``, ``momentum``, ``energy``, ``areal_momentum`` [Pa s] and the mean ``pressure`` [Pa] from the
        first to 99 % of a bin's mass, and all of it: ``impulse``, ``first``, ``last`` [s]; empty without a plane.
    arrivals
        The particles behind that.
    """

    results: dict[str, Result]
    over_angle: dict[str, list[float]] = field(default_factory=dict)
    witness: dict[str, Any] = field(default_factory=dict)
    arrivals: Arrivals | None = field(default=None, compare=False, repr=False)

    def as_dict(self) -> dict[str, Any]:
        """Return the plain form for JSON."""
        measures = {name: result.as_dict() for name, result in self.results.items()}
        return {"measures": measures, "over_angle": self.over_angle, "witness": self.witness}


def cloud(scene: Scene, layers: tuple[LayerMeasures, ...], witness: float | None = None) -> Cloud:
    """Measure the debris cloud.

    Parameters
    ----------
    scene
        The moment.
    layers
        What the shot did to the layers.
    witness
        Coordinate of a witness plane along the shot line [m]; None for no plane.
    """
    units = {name: unit_of(name, scene.space) for name in CLOUD_CATALOGUE}
    through = layers[: _passed(layers)]
    if not any(layer.state == YES for layer in through):
        reason = "no layer is perforated" if scene.now.dimensions > 1 else "a cloud has no meaning in 1D"
        return Cloud({name: meaningless(unit, reason) for name, unit in units.items()})
    rows = members(scene, layers)
    if len(rows) < FEWEST:
        reason = f"fewer than {FEWEST} particles fly behind the perforated layer"
        return Cloud({name: meaningless(unit, reason) for name, unit in units.items()})
    mass = scene.now.fields["mass"][rows]
    velocity = scene.now.fields["velocity"][rows]
    radial = _radial_velocity(scene, rows)
    values = _velocities(mass, velocity[:, 0], radial) | _lengths(scene, rows, mass)
    energy = 0.5 * mass * (velocity**2).sum(axis=1)
    values |= {"cloud_mass": float(mass.sum()), "cloud_momentum": float((mass * velocity[:, 0]).sum()),
               "cloud_energy": float(energy.sum())}  # fmt: skip
    results = {name: _result(scene, name, values[name], units[name]) for name in CLOUD_CATALOGUE}
    lateral = np.sqrt((velocity[:, 1:] ** 2).sum(axis=1))
    angles = np.arctan2(lateral, velocity[:, 0])
    number = int(np.ceil(angles.max() / ANGLE_BIN + 1e-9))
    over = _binned(angles, ANGLE_BIN, number, mass, velocity[:, 0], energy)
    ends = (ANGLE_BIN * (np.arange(number) + 1)).tolist()
    came = arrivals(scene, rows, witness) if witness is not None else None
    told = received(came, scene.space == 3, scene.spacing) if came is not None else {}
    return Cloud(results, {"angle": ends} | over, told, came)


def members(scene: Scene, layers: tuple[LayerMeasures, ...]) -> np.ndarray:
    """Return the indices of the cloud's particles."""
    body = scene.layers[_passed(layers) - 1]
    plate = scene.plate(body)
    assert plate is not None
    free = np.ones(scene.now.count, dtype=bool)
    for layer in scene.layers:
        free[scene.groups(layer).joined(scene.attached(layer))] = False
    known = set(np.flatnonzero([role != "other" for role in scene.shot.roles]).tolist())
    free &= np.isin(scene.now.body, list(known))
    free &= plate.depth(scene.position) > plate.thickness
    return np.flatnonzero(free & (scene.now.fields["velocity"] @ np.array(plate.basis[0]) > 0.0))


def _passed(layers: tuple[LayerMeasures, ...]) -> int:
    """Return how many layers from the first on are perforated, or had openings that let the projectile through."""
    return next((k for k, layer in enumerate(layers) if layer.state != YES and not layer.opening), len(layers))


def unit_of(name: str, dim: int) -> str:
    """Return the SI unit of a measure of the cloud or the projectile; masses and energies are per depth in 2D."""
    for ending, units in (("mass", MASS_UNITS), ("momentum", MOMENTUM_UNITS), ("energy", ENERGY_UNITS)):
        if name.endswith(ending):
            return units[dim]
    if "velocity" in name:
        return "m/s"
    return "rad" if "angle" in name else "" if "share" in name else "m"


def _radial_velocity(scene: Scene, rows: np.ndarray) -> np.ndarray:
    """Return the velocity away from the shot line [m/s]."""
    radius = np.maximum(scene.radius[rows], 1e-3 * scene.spacing)
    return np.asarray((scene.now.fields["velocity"][rows, 1:] * scene.lateral[rows]).sum(axis=1) / radius)


def _velocities(mass: np.ndarray, axial: np.ndarray, radial: np.ndarray) -> dict[str, float]:
    return {
        "front_velocity": weighted_quantile(axial, mass, 0.999),
        "front_velocity_99": weighted_quantile(axial, mass, 0.99),
        "front_velocity_90": weighted_quantile(axial, mass, 0.9),
        "rear_velocity": weighted_quantile(axial, mass, 0.01),
        "radial_velocity": weighted_quantile(radial, mass, 0.999),
        "radial_velocity_99": weighted_quantile(radial, mass, 0.99),
        "radial_velocity_90": weighted_quantile(radial, mass, 0.9),
    }


def _lengths(scene: Scene, rows: np.ndarray, mass: np.ndarray) -> dict[str, float]:
    x, radius = scene.position[rows, 0], scene.radius[rows]
    velocity = scene.now.fields["velocity"][rows]
    lateral = np.sqrt((velocity[:, 1:] ** 2).sum(axis=1))
    return {
        "cloud_length": weighted_quantile(x, mass, 0.995) - weighted_quantile(x, mass, 0.005),
        "cloud_width": 2.0 * weighted_quantile(radius, mass, 0.99),
        "half_angle": weighted_quantile(np.arctan2(lateral, velocity[:, 0]), mass, 0.9),
    }


def _result(scene: Scene, name: str, value: float, unit: str) -> Result:
    if unit == "m":
        return Result(value, unit, scene.spacing, spacing=scene.spacing, support=scene.support)
    return Result(value, unit)


def _binned(where: np.ndarray, width: float, number: int, mass: np.ndarray, axial: np.ndarray, energy: np.ndarray
            ) -> dict[str, list[float]]:  # fmt: skip
    bins = np.minimum((where / width + 1e-9).astype(int), number - 1)
    kinds = {"mass": mass, "momentum": mass * axial, "energy": energy}
    return {name: np.bincount(bins, weights, number).tolist() for name, weights in kinds.items()}
