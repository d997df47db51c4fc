"""The plug that a projectile punches out of a plate, and the lip that it leaves (Young 2021 sec. 3.3).

A group of the target is attached when it holds something of the target's rim (`Scene.rim`), which the
impact leaves alone; the plug is the largest group of five particles or more that is not and that flies on:
what is thrown back is ejecta.

The plug's width is its extent across the shot line, between the centres of its particles. Young 2021 gives
numbers and no definition: the 8.4 and 8.8 mm of the AdapTLE and finite-element rows cannot be an extent along
the shot line of what a 12 mm sphere punches out of a 3 mm plate, and the 0.88 mm of the rows whose plug is
torn are two particles of 1 mm side by side. The axial extent is given as the plug's thickness.

The lip is made of the front-most attached particles within two projectile widths of the shot line: as many as
go around a circle of that width in 3D, ten in 2D.
"""

from __future__ import annotations

import math

import numpy as np

from hvisph.core.measure_catalogue import CATALOGUE
from hvisph.measures.debris.fragments import Fragment
from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.result import Result, meaningless

FEWEST = 5  # particles of a plug: fewer are debris
LIP_IN_THE_PLANE = 10
PLUG = ("plug_velocity", "plug_width", "plug_thickness")
LIP = ("impact_diameter", "lip_height", "lip_height_maximum")


def plug_and_lip(scene: Scene) -> dict[str, Result]:
    """Measure plug and lip; without a perforated plate the results carry the reason."""
    if scene.now.dimensions == 1:
        return _without((*PLUG, *LIP, "target_fragments"), "a plug has no meaning in 1D")
    if not scene.has_target:
        return _without((*PLUG, *LIP, "target_fragments"), "there is no target")
    if not {"velocity", "mass"} <= scene.now.fields.keys():
        return _without((*PLUG, *LIP, "target_fragments"), "the snapshot has no velocity or no mass")
    groups, held, plug = scene.groups(scene.target), scene.attached(scene.target), plug_of(scene)
    return {
        **_plug(scene, None if plug is None else scene.fragments(scene.target)[plug]),
        **_lip(scene, groups.joined(held)),
        "target_fragments": Result(float((~held & (groups.counts >= FEWEST)).sum()), ""),
    }


def plug_of(scene: Scene) -> int | None:
    """Return which fragment of the target the plug is; None where nothing of `FEWEST` is detached and flies on."""
    if scene.now.dimensions == 1 or not scene.has_target:
        return None
    target = scene.fragments(scene.target)
    # velocities that are not known, or not finite, are no reason to have none
    flies = ~scene.attached(scene.target) & (target.groups.counts >= FEWEST) & ~(target.velocities[:, 0] <= 0.0)
    return int(np.argmax(flies)) if flies.any() else None


def _plug(scene: Scene, plug: Fragment | None) -> dict[str, Result]:
    if plug is None:
        return _without(PLUG, "no group of the target is detached and flies on")
    speed = scene.now.fields["velocity"][plug.particles, 0]
    spread = float(speed.std() / math.sqrt(plug.count))
    return {
        "plug_velocity": Result(float(plug.velocity[0]), "m/s", spread),
        "plug_width": _length(scene, float(plug.extent[1:].mean()), scene.spacing),
        "plug_thickness": _length(scene, float(plug.extent[0]), scene.spacing),
    }


def _lip(scene: Scene, attached: np.ndarray) -> dict[str, Result]:
    near = attached[scene.radius[attached] <= 2.0 * scene.width]
    around = LIP_IN_THE_PLANE if scene.now.dimensions == 2 else round(math.pi * scene.width / scene.spacing)
    if len(near) < around:
        return _without(LIP, "too few particles of the plate are left near the shot line")
    x = scene.position[near, 0]
    front = np.lexsort((scene.radius[near], -x))[:around]  # by radius where they are level
    heights = x[front] - scene.face - scene.thickness
    radii = scene.radius[near[front]]
    spread = 1.0 / math.sqrt(around)
    return {
        "impact_diameter": _length(scene, 2.0 * float(radii.mean()), 2.0 * float(radii.std()) * spread),
        "lip_height": _length(scene, float(heights.mean()), float(heights.std()) * spread),
        "lip_height_maximum": _length(scene, float(heights.max()), 0.5 * scene.spacing),
    }


def _length(scene: Scene, value: float, uncertainty: float) -> Result:
    return Result(value, "m", uncertainty, spacing=scene.spacing, support=scene.support)


def _without(names: tuple[str, ...], reason: str) -> dict[str, Result]:
    return {name: meaningless(CATALOGUE[name].unit, reason) for name in names}
