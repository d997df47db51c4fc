"""The plug punched out of a plate, and the lip of the hole (Young 2021 sec. 3.3).

The plug is the largest group of the target of five particles or more that holds nothing of its rim and flies on. Its
width is its extent across the shot line, between the centres of its particles; Young 2021 gives no definition, and no
other one fits its numbers. The lip is the front-most attached particles within two projectile widths of the shot line:
as many as go around a circle of that width in 3D, ten in 2D.
"""

from __future__ import annotations

import math

import numpy as np

from hvisph.measures.debris.fragments import FEWEST
from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.projectile.lengths import require_hole
from hvisph.measures.registry import Outcomes, measures
from hvisph.measures.result import Result, UndefinedMeasureError

LIP_IN_THE_PLANE = 10
RUBBLE = 0.01  # failed mass fraction of the target from which on fragments may be uncounted


@measures("run", "plug_velocity", "plug_width", "plug_thickness", needs=("layer", "motion"))
def plug(scene: Scene) -> Outcomes:
    """Return axial velocity [m/s], width and thickness [m] of the plug."""
    number = plug_of(scene)
    if number is None:
        raise UndefinedMeasureError("no group of the target is detached and flies on")
    found = scene.fragments(scene.target)[number]
    speed = scene.now.fields["velocity"][found.particles, 0]
    return {
        "plug_velocity": Result(float(found.velocity[0]), scatter=float(speed.std() / math.sqrt(found.count))),
        "plug_width": float(found.extent[1:].mean()),
        "plug_thickness": float(found.extent[0]),
    }


@measures("run", "impact_diameter", "lip_height", "lip_height_max", needs=("layer", "motion"))
def lip(scene: Scene) -> Outcomes:
    """Return twice the mean radius of the lip, its mean height and its largest height over the rear face [m]."""
    require_hole(scene)
    attached = scene.groups(scene.target).particles_of(scene.attached_groups(scene.target))
    near = attached[scene.radius[attached] <= 2.0 * scene.width]
    around = LIP_IN_THE_PLANE if scene.now.dimensions == 2 else round(math.pi * scene.width / scene.spacing)
    if len(near) < around:
        raise UndefinedMeasureError("too few particles of the plate are left near the shot line")
    x = scene.position[near, 0]
    front = np.lexsort((scene.radius[near], -x))[:around]  # by radius where they are level
    heights = x[front] - scene.face - scene.thickness
    radii = scene.radius[near[front]]
    error = 1.0 / math.sqrt(around)
    return {
        "impact_diameter": Result(2.0 * float(radii.mean()), scatter=2.0 * float(radii.std()) * error),
        "lip_height": Result(float(heights.mean()), scatter=float(heights.std()) * error),
        "lip_height_max": float(heights.max()),
    }


@measures("run", "target_fragments", needs=("layer", "motion"))
def target_fragments(scene: Scene) -> Result:
    """Return the number of detached fragments of the first layer.

    Failed material whose particles are still within the linking distance counts as attached; a note says how much.
    """
    groups, held = scene.groups(scene.target), scene.attached_groups(scene.target)
    damage, note = scene.now.fields.get("damage"), ""
    if damage is not None:
        rows = groups.particles_of(held)
        mass = scene.now.fields["mass"]
        share = float(mass[rows][damage[rows] >= 1.0].sum()) / max(float(mass[scene.is_target].sum()), 1e-300)
        if share > RUBBLE:
            note = f"{100.0 * share:.2g} % of its mass has failed and is not detached: rubble is not counted"
    return Result(float((~held & (groups.counts >= FEWEST)).sum()), note=note)


def plug_of(scene: Scene) -> int | None:
    """Return the number of the target's fragment that is the plug; None where nothing is detached and flies on."""
    if scene.now.dimensions == 1 or not scene.has_target:
        return None
    target = scene.fragments(scene.target)
    # a velocity that is not known, or not finite, does not rule a fragment out
    flies = ~scene.attached_groups(scene.target) & (target.groups.counts >= FEWEST) & ~(target.velocities[:, 0] <= 0.0)
    return int(np.argmax(flies)) if flies.any() else None
