"""Velocities left after the impact, and the momentum handed over."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hvisph.measures.frame.has_passed import held_back, in_pieces
from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.frame.roles import LAYER, PROJECTILE, members
from hvisph.measures.result import Result, meaningless
from hvisph.measures.target.targets import LayerMeasures
from hvisph.output.snapshot import Snapshot


def residual_velocity(scene: Scene, layers: Sequence[LayerMeasures]) -> Result:
    """Return the mass-mean axial velocity of the projectile's main body behind all layers [m/s].

    It has a meaning where that is behind all of them (`behind`) and holds half of the projectile's mass or more.
    Its uncertainty is the standard error of the mean over the particles.
    """
    reason = held_back(scene, layers) or in_pieces(scene)
    if reason:
        return meaningless("m/s", reason)
    chosen, mass = scene.projectile, scene.now.fields["mass"]
    velocity = _axial(scene.now)[chosen]
    mean = float(np.average(velocity, weights=mass[chosen]))
    return Result(mean, "m/s", float(velocity.std() / np.sqrt(len(chosen))))


def momentum_transfer(scene: Scene) -> Result:
    """Return beta: the layers' change of axial momentum over the projectile's momentum at the start."""
    if not scene.has_target:
        return meaningless("", "there is no target")
    if scene.start is None:
        return meaningless("", "a single snapshot does not tell the momentum at the start")
    if not {"velocity", "mass"} <= scene.now.fields.keys():
        return meaningless("", "the snapshot has no velocity or no mass")
    brought = _momentum(scene, scene.start, PROJECTILE)
    before = _momentum(scene, scene.start, LAYER)
    scale = float(np.abs(scene.start.fields["mass"] * _axial(scene.start)).sum())
    # what round-off leaves of a symmetric collision's momentum is no measure
    if not abs(brought) > 1e-12 * scale:
        return meaningless("", "the projectile had no axial momentum at the start")
    return Result((_momentum(scene, scene.now, LAYER) - before) / brought, "")


def _axial(snapshot: Snapshot) -> np.ndarray:
    return snapshot.fields["velocity"].reshape(snapshot.count, -1)[:, 0]


def _momentum(scene: Scene, snapshot: Snapshot, role: str) -> float:
    chosen = members(snapshot, scene.shot.roles, role)
    return float((snapshot.fields["mass"][chosen] * _axial(snapshot)[chosen]).sum())
