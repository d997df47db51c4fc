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

from hvisph.core.measures import CLOUD_CATALOGUE
from hvisph.measures.layers import LayerMeasures
from hvisph.measures.perforation import YES
from hvisph.measures.plug import attached
from hvisph.measures.result import ENERGY_UNITS, MASS_UNITS, MOMENTUM_UNITS, Result, meaningless
from hvisph.measures.scene import Scene

ANGLE_BIN = np.radians(2.0)
WITNESS_BINS = 40
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
        [m]), ``mass``, ``momentum``, ``energy`` and, in 3D, ``areal_momentum`` [Pa s]; empty without a plane.
    """

    results: dict[str, Result]
    over_angle: dict[str, list[float]] = field(default_factory=dict)
    witness: dict[str, Any] = field(default_factory=dict)

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
    through = [layer for layer in layers if layer.state == YES]
    if not through or not layers or layers[0].state != YES:
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
    return Cloud(results, {"angle": ends} | over, _on_witness(scene, rows, witness, energy))


def members(scene: Scene, layers: tuple[LayerMeasures, ...]) -> np.ndarray:
    """Return the indices of the cloud's particles."""
    through = 0
    while through < len(layers) and layers[through].state == YES:
        through += 1
    body = scene.layers[through - 1]
    plate = scene.plate(body)
    assert plate is not None
    free = np.ones(scene.now.count, dtype=bool)
    for layer in scene.layers:
        for group, holds in zip(scene.fragments(layer), attached(scene, layer), strict=True):
            if holds:
                free[group.particles] = False
    known = set(np.flatnonzero([role != "other" for role in scene.shot.roles]).tolist())
    free &= np.isin(scene.now.body, list(known))
    free &= plate.depth(scene.position) > plate.thickness
    return np.flatnonzero(free & (scene.now.fields["velocity"] @ np.array(plate.basis[0]) > 0.0))


def weighted_quantile(values: np.ndarray, weights: np.ndarray, share: float) -> float:
    """Return the value that `share` of the weight does not exceed: the same for a part and its mirrored whole."""
    order = np.argsort(values, kind="stable")
    cumulated = np.cumsum(weights[order])
    at = int(np.searchsorted(cumulated, share * cumulated[-1] * (1.0 - 1e-9)))
    return float(values[order[min(at, len(order) - 1)]])


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


def impacts(scene: Scene, rows: np.ndarray, x: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return which particles would reach the plane at `x` [m], where (n, dim - 1) [m] and when [s], flying straight."""
    velocity = scene.now.fields["velocity"][rows]
    ahead = x - scene.position[rows, 0]
    reach = (velocity[:, 0] > 0.0) & (ahead >= 0.0)
    chosen = rows[reach]
    flight = ahead[reach] / velocity[reach, 0]
    where = scene.lateral[chosen] + flight[:, None] * velocity[reach, 1:]
    return chosen, where, scene.now.time + flight


def _on_witness(scene: Scene, rows: np.ndarray, x: float | None, energy: np.ndarray) -> dict[str, Any]:
    if x is None:
        return {}
    chosen, where, when = impacts(scene, rows, x)
    if len(chosen) == 0:
        return {"x": x, "mass_share": 0.0}
    mass, axial = scene.now.fields["mass"][chosen], scene.now.fields["velocity"][chosen, 0]
    radius = np.sqrt((where**2).sum(axis=1))
    width = weighted_quantile(radius, mass, 0.99) / WITNESS_BINS or scene.spacing
    number = int(np.ceil(radius.max() / width + 1e-9))
    full = np.zeros(scene.now.count)
    full[rows] = energy
    results: dict[str, Any] = {
        "x": x,
        "mass_share": float(mass.sum() / scene.now.fields["mass"][rows].sum()),
        "first": float(when.min()),
        "last": weighted_quantile(when, mass, 0.99),
        "radius": (width * (np.arange(number) + 1)).tolist(),
    } | _binned(radius, width, number, mass, axial, full[chosen])
    edges = width * np.arange(number + 1)
    size = np.pi * np.diff(edges**2) if scene.now.dimensions == 3 else 2.0 * np.diff(edges)
    results["areal_momentum"] = (np.array(results["momentum"]) / size).tolist()
    return results
