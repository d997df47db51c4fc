"""Velocities left after the impact, and the momentum handed over."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hvisph.measures.layers import LayerMeasures
from hvisph.measures.perforation import NO, NOT_YET
from hvisph.measures.result import Result, meaningless
from hvisph.measures.roles import LAYER, PROJECTILE, members
from hvisph.measures.scene import Scene
from hvisph.output.snapshot import Snapshot


def residual_velocity(scene: Scene, layers: Sequence[LayerMeasures]) -> Result:
    """Return the mass-mean axial velocity of the projectile's main body behind all layers [m/s].

    It has a meaning where all of them are perforated and the main body holds half of the projectile's mass or more.
    Its uncertainty is the standard error of the mean over the particles.
    """
    if not {"velocity", "mass"} <= scene.now.fields.keys():
        return meaningless("m/s", "the snapshot has no velocity or no mass")
    holds = next((layer for layer in layers if layer.state in (NO, NOT_YET)), None)
    if holds is not None:
        return meaningless("m/s", f"'{holds.body}' is not perforated{' yet' if holds.state == NOT_YET else ''}")
    chosen, mass = scene.projectile, scene.now.fields["mass"]
    share = float(mass[chosen].sum() / (scene.shot_mass or mass[scene.is_projectile].sum()))
    if share < 0.5:
        return meaningless("m/s", f"the projectile's largest piece holds {100.0 * share:.2g} % of its mass")
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
