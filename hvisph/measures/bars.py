"""Bars and rods: the shape of a Taylor bar after the impact, and the relative penetration of a rod.

A bar is a projectile that strikes a rigid wall, or a body that is no wider than the bar. Its largest fragment is
measured along the shot line; its front is the foot. A diameter is that of the solid section with the same second moment
of mass about its centre,

    D = D0 (r/r0),    r^2 = sum m (y - <y>)^2 / sum m  in a slice of one spacing,

with r0 and D0 at the start, D0 from volume and length. The surface of the foot lies half of a particle's present
thickness, dx (D0/D)^2, in front of the foremost particle.
"""

import numpy as np

from .impact_geometry import PROJECTILE, members
from .lengths import end_layers, initial_length
from .measurement_frame import Scene
from .residual_projectile import LEAST_SHARE
from .result import Outcomes, Result, UndefinedMeasureError, measures, refuse_if
from .target_damage import crater_of

PLATE_WIDTH = 1.5  # times the bar's width; a wider target is a plate
DEFORMED_DIAMETER = 1.01  # times the initial diameter; a wider section has been deformed
FOOT_THICKNESS = 0.75  # [dx]; thickness of the layer of particles at the foot
FEWEST_IN_SLICE = 2  # particles of a slice
FREE_FLIGHT_SPEED = 0.99  # of the impact velocity: a bar with a faster foot has not struck yet
REST_SPEED = 0.1  # of the impact velocity: mean velocity relative to the foot below which a bar is no longer deforming


@measures("run", "final_length", "length_ratio", "foot_diameter", "diameter_at_fifth", "undeformed_length")
def bar(scene: Scene) -> Outcomes:
    """Return lengths and diameters of a bar after the impact [m]; they are not final while its rear still moves."""
    _require_bar(scene)
    assert scene.start is not None
    length = initial_length(scene)
    width, surface, distance, profile = _sections(scene, length)
    final = surface - float(scene.position[scene.projectile, 0].min()) + 0.5 * end_layers(scene)[0]
    scene.profile = {"distance": distance, "diameter": profile}
    note = _motion_note(scene)
    values = {
        "final_length": final,
        "foot_diameter": profile[0],
        "diameter_at_fifth": float(np.interp(0.2 * length, distance, profile)),
        "undeformed_length": _undeformed_length(np.array(distance), np.array(profile), width, final),
    }
    results = {name: Result(value, note=note, final=not note) for name, value in values.items()}
    ratio = Result(final / length, discretization=scene.spacing / length, note=note, final=not note)
    return results | {"length_ratio": ratio}


@measures("run", "penetration_ratio", needs=("layer", "start"))
def penetration_ratio(scene: Scene) -> Result:
    """Return P/L: the depth of the first layer's crater over the initial length of the projectile."""
    plate = scene.plate(scene.target)
    if plate is None or "mass" not in scene.state.fields or "velocity" not in scene.state.fields:
        raise UndefinedMeasureError("there is no layer with a known crater")
    length, depth = initial_length(scene), crater_of(scene, plate).depth
    return Result(depth / length, discretization=scene.spacing / length)


def _sections(scene: Scene, length: float) -> tuple[float, float, list[float], list[float]]:
    """Return the initial diameter, x of the foot's surface, and distances from it with the diameters there [m]."""
    assert scene.start is not None
    rows, fields = members(scene.start, scene.shot.roles, PROJECTILE), scene.start.fields
    spread_initial = _spread(fields["position"][rows, 1:], fields["mass"][rows])
    volume = float((fields["mass"][rows] / fields["density"][rows]).sum())
    width = volume / length if scene.space == 2 else float(np.sqrt(4.0 * volume / length / np.pi))
    main = scene.projectile
    x, lateral, mass = scene.position[main, 0], scene.position[main, 1:], scene.state.fields["mass"][main]

    def diameter(rows: np.ndarray) -> float:
        return width * _spread(lateral[rows], mass[rows]) / spread_initial

    foot = diameter(x > x.max() - FOOT_THICKNESS * scene.spacing)
    power = 1.0 if scene.space == 2 else 2.0
    thinning = min((width / foot) ** power, 1.0) if foot > 0.0 else 1.0  # a tip may be one particle
    surface = float(x.max()) + 0.5 * scene.spacing * thinning
    distance, profile = [0.0], [foot]
    layer = np.floor((surface - x) / scene.spacing).astype(int)
    for k in np.unique(layer):
        part = layer == k
        if part.sum() >= FEWEST_IN_SLICE:
            distance.append(float(np.average(surface - x[part], weights=mass[part])))
            profile.append(diameter(part))
    return width, surface, distance, profile


def _require_bar(scene: Scene) -> None:
    """Raise `UndefinedMeasureError` if the projectile is not a bar."""
    names = {"velocity", "mass", "density"}
    if scene.start is None or not names <= scene.start.fields.keys() or "mass" not in scene.state.fields:
        raise UndefinedMeasureError("a single snapshot does not contain the bar before the impact")
    rows = members(scene.start, scene.shot.roles, PROJECTILE)
    mass, velocity = scene.start.fields["mass"][rows], scene.start.fields["velocity"][rows]
    mean = np.average(velocity, axis=0, weights=mass)
    if not mean[0] > 0.5 * np.sqrt(np.average((velocity**2).sum(axis=1), weights=mass)):
        raise UndefinedMeasureError("the projectile does not move as a whole towards a target")
    width = float(np.ptp(scene.start.fields["position"][rows, 1]))
    if scene.has_target:
        y = scene.start.fields["position"][scene.start.body == scene.target, 1]
        refuse_if(np.ptp(y) > PLATE_WIDTH * width + scene.spacing, "no bar on a rigid wall or an equal bar")
    share = float(scene.state.fields["mass"][scene.projectile].sum() / scene.shot_mass)
    refuse_if(share < LEAST_SHARE, f"the bar's largest fragment holds {100.0 * share:.2g} % of its mass")


def _motion_note(scene: Scene) -> str:
    """Return in words which share of the impact velocity a bar still has; empty at rest."""
    if "velocity" not in scene.state.fields or not scene.shot.speed:
        return ""
    main = scene.projectile
    x, axial, mass = scene.position[main, 0], scene.state.fields["velocity"][main, 0], scene.state.fields["mass"][main]
    foot = x > x.max() - FOOT_THICKNESS * scene.spacing
    front = float(np.average(axial[foot], weights=mass[foot])) / scene.shot.speed
    if front > FREE_FLIGHT_SPEED:
        return f"the bar has not struck: its foot moves at {100.0 * front:.3g} % of its impact velocity"
    share = float(np.average(axial, weights=mass)) / scene.shot.speed - front
    return f"the bar still moves at {100.0 * share:.2g} % of its impact velocity" if share > REST_SPEED else ""


def _spread(lateral: np.ndarray, mass: np.ndarray) -> float:
    """Return the root-mean-square distance from the centre of mass [m]."""
    middle = np.average(lateral, axis=0, weights=mass)
    return float(np.sqrt(np.average(((lateral - middle) ** 2).sum(axis=1), weights=mass)))


def _undeformed_length(distance: np.ndarray, diameter: np.ndarray, width: float, final: float) -> float:
    """Return the length from the rear over which the diameter is below `DEFORMED_DIAMETER` of the initial one [m]."""
    deformed = np.flatnonzero(diameter > DEFORMED_DIAMETER * width)
    if len(deformed) == 0:
        return final
    last = deformed[-1]
    if last + 1 >= len(diameter):
        return 0.0
    share = (diameter[last] - DEFORMED_DIAMETER * width) / (diameter[last] - diameter[last + 1])
    return float(final - (distance[last] + share * (distance[last + 1] - distance[last])))
