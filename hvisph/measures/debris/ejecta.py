"""Ejecta: matter that rises from the struck face, and the momentum that it carries away.

    beta = 1 + sum m (-v_n) / (m_s U_n)

The sum is over all matter above the first layer's struck face by two spacings that moves away from it, with the
velocity v_n along the normal n of the layer. m_s and U_n are mass and normal velocity of the projectile at the start.
By conservation of momentum, beta is the momentum of what stays over that of the projectile, once all has left.
Nothing is followed further: gravity takes back what is slower than the escape velocity.
"""

from __future__ import annotations

import numpy as np

from hvisph.measures.frame.impact_geometry import PROJECTILE, members
from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.result import Outcomes, Result, UndefinedMeasureError, measures

ABOVE = 2.0  # least height over the struck face, in spacings: beyond the disorder of a free surface


@measures("run", "beta", "ejecta_mass", "ejecta_momentum", needs=("layer", "start", "motion"))
def ejecta(scene: Scene) -> Outcomes:
    """Return beta [-], and mass [kg] and momentum along the outward normal [N s] of the ejecta of the first layer."""
    assert scene.start is not None
    plate = scene.plate(scene.target)
    if plate is None:
        raise UndefinedMeasureError("the layer's struck face is unknown")
    normal = np.array(plate.basis[0])

    def normal_velocity(velocity: np.ndarray) -> np.ndarray:
        return np.asarray(velocity.reshape(len(velocity), -1) @ normal)

    shot = members(scene.start, scene.shot.roles, PROJECTILE)
    masses = scene.start.fields["mass"][shot]
    brought = float((masses * normal_velocity(scene.start.fields["velocity"][shot])).sum())
    speed = normal_velocity(scene.now.fields["velocity"])
    rising = (plate.depth(scene.position) < -ABOVE * scene.spacing) & (speed < 0.0)
    carried = -scene.now.fields["mass"] * speed
    own = rising & (scene.now.body == scene.target)
    mass, momentum = float(scene.now.fields["mass"][own].sum()), float(carried[own].sum())
    variants: dict[str, Result | float | str] = dict.fromkeys(("all", "target"), "the projectile has no momentum")
    if brought > 0.0:
        for name, rows in (("all", rising & (own | scene.is_projectile)), ("target", own)):
            gain = float(carried[rows].sum()) / brought
            variants[name] = Result(1.0 + gain, discretization=scene.discretization * gain)
    return {"beta": variants, "ejecta_mass": mass, "ejecta_momentum": momentum}
