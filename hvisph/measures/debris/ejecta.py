"""Ejecta: matter that rises from the struck face, and the momentum that it carries away.

    beta = 1 + sum m (-v_n) / (m_s U_n)

The sum is over all matter above the first layer's struck face by two spacings that moves away from it, with the
velocity v_n along the normal n of the layer. m_s and U_n are mass and normal velocity of the projectile at the start.
By conservation of momentum, beta is the momentum of what stays over that of the projectile, once all has left.

Launch is where and how fast each particle crossed the struck face, on its ballistic way back: straight, and under
`gravity` a parabola along the normal, with G M/R^2 of a sphere. What escapes is launched faster than `escape`, or has
an energy m (v^2/2 - G M/r) above zero in the field of a sphere; in a uniform one nothing does.
"""

import numpy as np

from hvisph.core.text import PlainMapping
from hvisph.measures.frame.impact_geometry import PROJECTILE, members
from hvisph.measures.frame.measurement_frame import Scene, memoize
from hvisph.measures.frame.target_geometry import Plate
from hvisph.measures.result import Outcome, Outcomes, Result, UndefinedMeasureError, measures

ABOVE = 2.0  # least height over the struck face, in spacings: beyond the disorder of a free surface
PER_DECADE = 10  # bins of the launch speed


@memoize
def _launch(scene: Scene, plate: Plate) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the rising particles, their launch speed [m/s], angle from the face [rad] and radius [m], (n,) each."""
    normal = np.array(plate.basis[0])
    velocity, depth = scene.now.fields["velocity"], plate.depth(scene.position)
    rows = np.flatnonzero((depth < -ABOVE * scene.spacing) & (velocity @ normal < 0.0))
    height, up = -depth[rows], -(velocity[rows] @ normal)
    along = velocity[rows] @ np.array(plate.basis[1:]).reshape(-1, len(normal)).T
    pull = pull_of(scene, normal)
    first = np.sqrt(np.maximum(up**2 + 2.0 * pull * height, 0.0))
    since = 2.0 * height / (first + up)
    place = plate.in_plane(scene.position[rows]) - along * since[:, None]
    across = np.sqrt((along**2).sum(axis=1))
    return rows, np.hypot(first, across), np.arctan2(first, across), np.sqrt((place**2).sum(axis=1))


def pull_of(scene: Scene, normal: np.ndarray) -> float:
    """Return the acceleration towards the layer, along its normal [m/s^2]."""
    field: PlainMapping = scene.now.metadata.get("gravity", {})
    if "mass_parameter" in field:
        return float(field["mass_parameter"] / field["radius"] ** 2)
    return float(np.array(field.get("acceleration", 0.0 * normal)) @ scene.shot.back(normal))


def _escapes(scene: Scene, plate: Plate) -> np.ndarray | str:
    """Return whether rising particles escape (n,), or the reason why it is unknown."""
    rows, speed, _, _ = _launch(scene, plate)
    field: PlainMapping = scene.now.metadata.get("gravity", {})
    if "escape" in scene.now.metadata:
        return np.asarray(speed > float(scene.now.metadata["escape"]))
    if not field:
        return np.ones(len(rows), dtype=bool)
    if "mass_parameter" not in field:
        return "nothing escapes from a uniform field; give `escape`, the least launch speed of what does"
    place, velocity = scene.shot.case_axes(scene.now.time)(scene.position[rows], scene.now.fields["velocity"][rows])
    distance = np.sqrt(((place - np.array(field["centre"])) ** 2).sum(axis=1))
    return np.asarray(0.5 * (velocity**2).sum(axis=1) > field["mass_parameter"] / distance)


@measures("run", "beta", "ejecta_mass", "ejecta_momentum", needs=("layer", "start", "motion"))
def ejecta(scene: Scene) -> Outcomes:
    """Return beta [-], and mass [kg] and momentum along the outward normal [N s] of the ejecta of the first layer."""
    assert scene.start is not None
    plate = _struck_plate(scene)
    normal = np.array(plate.basis[0])
    shot = members(scene.start, scene.shot.roles, PROJECTILE)
    before = scene.start.fields["velocity"].reshape(scene.start.count, -1)[shot] @ normal
    brought = float((scene.start.fields["mass"][shot] * before).sum())
    rows, *_ = _launch(scene, plate)
    mass = scene.now.fields["mass"][rows]
    carried = -mass * (scene.now.fields["velocity"][rows] @ normal)
    own = scene.now.body[rows] == scene.target
    both, escapes = own | scene.is_projectile[rows], _escapes(scene, plate)
    variants: dict[str, Outcome] = dict.fromkeys(("all", "target", "escaping"), "the projectile has no momentum")
    if brought > 0.0:
        chosen = {"all": both, "target": own, "escaping": escapes if isinstance(escapes, str) else both & escapes}
        for name, which in chosen.items():
            gain = 0.0 if isinstance(which, str) else float(carried[which].sum()) / brought
            beta = Result(1.0 + gain, discretization=scene.discretization * gain)
            variants[name] = which if isinstance(which, str) else beta
    return {"beta": variants, "ejecta_mass": float(mass[own].sum()), "ejecta_momentum": float(carried[own].sum())}


@measures("layer", "ejecta_angle", "ejecta_radius", needs=("motion",))
def launch(scene: Scene, plate: Plate) -> Outcomes:
    """Return the mass-mean angle [rad] and radius [m] at which the ejecta of a layer left its struck face."""
    rows, _, angle, radius = _launch(scene, plate)
    own = scene.now.body[rows] == plate.body
    if not own.any():
        raise UndefinedMeasureError("nothing rises from the struck face")
    mass = scene.now.fields["mass"][rows][own]
    return {
        "ejecta_angle": float(mass @ angle[own] / mass.sum()),
        "ejecta_radius": float(mass @ radius[own] / mass.sum()),
    }


def ejecta_over_speed(scene: Scene) -> dict[str, list[float]]:
    """Return mass [kg] and normal momentum [N s] of the first layer's ejecta launched at a `speed` [m/s] or faster.

    Beside them mass-mean `angle` [rad] and `radius` [m] of the launch from that speed to the next, ten a decade.
    """
    try:
        plate = _struck_plate(scene)
    except UndefinedMeasureError:
        return {}
    rows, speed, angle, radius = _launch(scene, plate)
    own = (scene.now.body[rows] == scene.target) & (speed > 0.0)
    if not own.any():
        return {}
    rows, speed, angle, radius = (one[own] for one in (rows, speed, angle, radius))
    mass, along = scene.now.fields["mass"][rows], scene.now.fields["velocity"][rows] @ np.array(plate.basis[0])
    bins = np.floor(PER_DECADE * np.log10(speed) + 1e-9).astype(int)
    first, bins = int(bins.min()), bins - bins.min()
    own_mass = np.bincount(bins, mass)
    table: dict[str, np.ndarray] = {"speed": 10.0 ** ((first + np.arange(len(own_mass))) / PER_DECADE)}
    kept = own_mass > 0.0
    for name, values in (("mass", own_mass), ("momentum", np.bincount(bins, -mass * along))):
        table[name] = np.cumsum(values[::-1])[::-1]
    for name, values in (("angle", angle), ("radius", radius)):
        table[name] = np.bincount(bins, mass * values) / np.where(kept, own_mass, 1.0)
    return {name: values[kept].tolist() for name, values in table.items()}


def _struck_plate(scene: Scene) -> Plate:
    plate = scene.plate(scene.target)
    if plate is None or not scene.has_motion or scene.now.dimensions == 1:
        raise UndefinedMeasureError("the layer's struck face is unknown")
    return plate
