"""What is left of the projectile: mass, length, velocity and direction of its pieces, erosion and depth."""

from __future__ import annotations

import numpy as np

from hvisph.core.measure_catalogue import PROJECTILE_CATALOGUE
from hvisph.measures.debris.cloud import unit_of
from hvisph.measures.frame.has_passed import held_back, in_pieces
from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.lengths import length_of
from hvisph.measures.result import Result, meaningless
from hvisph.measures.target.targets import LayerMeasures

PIECE = 0.01  # share of the projectile's mass from which on a group counts as a piece


def residue(scene: Scene, layers: tuple[LayerMeasures, ...]) -> dict[str, Result]:
    """Return the measures of the projectile; what is residual only where it has left all layers behind (`behind`)."""
    dim = scene.now.dimensions
    if not {"velocity", "mass"} <= scene.now.fields.keys():
        return _none(scene.space, "the snapshot has no velocity or no mass")
    groups, mass = scene.shot_groups, scene.now.fields["mass"]
    whole = scene.shot_mass or float(mass[scene.is_projectile].sum())
    largest = groups.heaviest
    share, broken = largest.mass / whole, in_pieces(scene)
    pieces = np.flatnonzero(groups.masses >= PIECE * whole)
    results = {
        "largest_share": Result(share, ""),
        "pieces_share": Result(sum(groups.masses[pieces].tolist()) / whole, ""),
        "erosion": meaningless("m", "a single snapshot does not tell the length at the start"),
        "depth": meaningless("m", "there is no layer whose start is known"),
    }
    length = _length(scene, length_of(scene, scene.position[largest.particles, 0]))
    results["length"] = meaningless("m", broken or "not told in 1D") if broken or dim == 1 else length
    if scene.start is not None and dim > 1:
        before = scene.start.fields["position"][np.isin(scene.start.body, _bodies(scene)), 0]
        if not broken:
            results["erosion"] = _length(scene, length_of(scene, before) - (length.value or 0.0))
        else:
            results["erosion"] = meaningless("m", broken)
    if scene.shot.plates and dim > 1:
        plate = scene.shot.plates[0]
        deepest = plate.depth(scene.position[largest.particles]).max() + 0.5 * scene.spacing
        results["depth"] = _length(scene, float(deepest))
    results |= _residual(scene, layers, broken, whole)
    behind = results["residual_mass"]  # as long as it has no meaning, no more has a residual length
    results["residual_length"] = meaningless("m", behind.reason) if behind.value is None else results["length"]
    return {name: results[name].finite() for name in PROJECTILE_CATALOGUE}


def _residual(scene: Scene, layers: tuple[LayerMeasures, ...], broken: str, whole: float) -> dict[str, Result]:
    names = ("residual_mass", "residual_velocity_largest", "residual_angle", "residual_velocity_pieces",
             "residual_velocity_all")  # fmt: skip
    reason = held_back(scene, layers)
    if reason:
        return {name: meaningless(unit_of(name, scene.space), reason) for name in names}
    velocity, mass = scene.now.fields["velocity"], scene.now.fields["mass"]
    groups = scene.shot_groups
    large = groups.masses >= PIECE * whole
    pieces = groups.groups.joined(large) if large.any() else groups.heaviest.particles
    results = {
        "residual_mass": Result(float(mass[pieces].sum()), unit_of("residual_mass", scene.space)),
        "residual_velocity_pieces": _mean(velocity[:, 0], mass, pieces),
        "residual_velocity_all": _mean(velocity[:, 0], mass, np.flatnonzero(scene.is_projectile)),
    }
    if broken:
        return results | {name: meaningless(unit_of(name, scene.space), broken) for name in names[1:3]}
    main = groups.heaviest
    lateral = float(np.sqrt((main.velocity[1:] ** 2).sum()))
    angle = float(np.arctan2(lateral, main.velocity[0]))
    results["residual_velocity_largest"] = _mean(velocity[:, 0], mass, main.particles)
    return results | {"residual_angle": Result(angle if lateral > 1e-9 * main.speed else 0.0, "rad")}


def _mean(velocity: np.ndarray, mass: np.ndarray, rows: np.ndarray) -> Result:
    spread = float(velocity[rows].std() / np.sqrt(len(rows)))
    return Result(float(np.average(velocity[rows], weights=mass[rows])), "m/s", spread)


def _bodies(scene: Scene) -> list[int]:
    return [body for body, role in enumerate(scene.shot.roles) if role == "projectile"]


def _length(scene: Scene, value: float) -> Result:
    return Result(value, "m", scene.spacing, spacing=scene.spacing, support=scene.support)


def _none(dim: int, reason: str) -> dict[str, Result]:
    return {name: meaningless(unit_of(name, dim), reason) for name in PROJECTILE_CATALOGUE}
