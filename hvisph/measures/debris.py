"""Debris: the cloud behind the perforated layers, and the ejecta of the struck face.

The cloud is all material behind the rear face of the last perforated layer that moves away from it: that of the
projectile, and that of layers if it is not attached to their rims. Velocities, lengths and angles are quantiles of its
mass, so that they do not depend on single particles.

Ejecta carry away momentum:

    beta = 1 + sum m (-v_n) / (m_s U_n)

The sum is over all material more than two spacings above the first layer's struck face that moves away from it, with
the velocity v_n along the normal n of the layer. m_s and U_n are mass and normal velocity of the projectile at the
start. By conservation of momentum, once all ejecta have left, beta is the momentum of the target over that of the
projectile.

Launch position and speed are those at which each particle crossed the struck face, traced back along a straight line
or, under `gravity`, a parabola along the normal, with G M/R^2 of a sphere. A particle escapes if it is launched faster
than `escape`, or if its energy m (v^2/2 - G M/r) in the field of a sphere is above zero; in a uniform field none does.
"""

from dataclasses import dataclass, field

import numpy as np

from hvisph.core.text import Plain, PlainMapping

from .impact_geometry import OTHER, PROJECTILE, members
from .measurement_frame import Scene, memoize
from .perforation import YES, layer_state
from .result import (
    Outcome,
    Outcomes,
    Result,
    UndefinedMeasureError,
    evaluate,
    measures,
    plain_results,
    refuse_if,
    weighted_quantile,
)
from .target_geometry import Plate

BINS = 40
LOAD_SHARE = 0.99  # mass fraction after whose arrival the load ends


@dataclass(frozen=True)
class Arrivals:
    """The particles that reach a witness plane at `x` along the shot line [m].

    Of each: place on the plane from the shot line (n, dim - 1) [m], time (n,) [s], and mass, axial momentum and kinetic
    energy (n,) [kg, N s, J; per metre in 2D]; `share` is the mass fraction of the cloud that arrives.
    """

    x: float
    where: np.ndarray
    when: np.ndarray
    mass: np.ndarray
    momentum: np.ndarray
    energy: np.ndarray
    share: float

    @property
    def radius(self) -> np.ndarray:
        """Distances from the shot line, shape (n,) [m]."""
        return np.asarray(np.sqrt((self.where**2).sum(axis=1)))


def arrivals(scene: Scene, rows: np.ndarray, x: float) -> Arrivals:
    """Return which of the particles `rows` reach the plane at `x` [m], where and when."""
    velocity, mass = scene.state.fields["velocity"][rows], scene.state.fields["mass"][rows]
    distance = x - scene.position[rows, 0]
    reach = (velocity[:, 0] > 0.0) & (distance >= 0.0)
    velocity, flight = velocity[reach], distance[reach] / velocity[reach, 0]
    mass_arriving = mass[reach]
    return Arrivals(
        x,
        scene.lateral[rows[reach]] + flight[:, None] * velocity[:, 1:],
        scene.state.time + flight,
        mass_arriving,
        mass_arriving * velocity[:, 0],
        0.5 * mass_arriving * (velocity**2).sum(axis=1),
        float(mass_arriving.sum() / mass.sum()),
    )


def plane_loads(load: Arrivals, is_round: bool, spacing: float) -> Plain:
    """Return the plane's loads in bins of radius, `spacing` wide at least: annuli where `round_`, else both sides."""
    if len(load.when) == 0:
        return {"x": load.x, "mass_share": 0.0}
    radius = load.radius
    width = weighted_quantile(radius, load.mass, 0.99) / BINS or spacing
    number = int(np.ceil(radius.max() / width + 1e-9))
    bins = np.minimum((radius / width + 1e-9).astype(int), number - 1)
    edges = width * np.arange(number + 1)
    size = np.pi * np.diff(edges**2) if is_round else 2.0 * np.diff(edges)
    sums = {name: np.bincount(bins, getattr(load, name), number) for name in ("mass", "momentum", "energy")}
    areal = sums["momentum"] / size
    first, last = float(load.when.min()), weighted_quantile(load.when, load.mass, LOAD_SHARE)
    return {
        "x": load.x,
        "mass_share": load.share,
        "first": first,
        "last": last,
        "impulse": float(load.momentum.sum()),
        "radius": edges[1:].tolist(),
        **{name: values.tolist() for name, values in sums.items()},
        "areal_momentum": areal.tolist(),
        "pressure": (areal / _durations(load, bins, number, last - first)).tolist(),
    }


def _durations(load: Arrivals, bins: np.ndarray, number: int, total: float) -> np.ndarray:
    """Return the duration of the load in each bin [s], to 99 % of its mass; with one particle, of the whole load."""
    lengths = np.full(number, total if total > 0.0 else np.inf)
    order = np.argsort(bins, kind="stable")
    starts = np.searchsorted(bins[order], np.arange(number + 1))
    for k in range(number):
        rows = order[starts[k] : starts[k + 1]]
        if len(rows) > 1:
            lasts = weighted_quantile(load.when[rows], load.mass[rows], LOAD_SHARE) - float(load.when[rows].min())
            lengths[k] = lasts if lasts > 0.0 else lengths[k]
    return lengths


ANGLE_BIN = np.radians(2.0)
FEWEST_OF_CLOUD = 20  # particles of a cloud


@dataclass(frozen=True)
class Cloud:
    """The debris cloud."""

    results: dict[str, Result]  # by name; values in SI
    # mass, axial momentum and kinetic energy in bins of 2 degrees between velocity and shot line: ``angle`` (upper ends
    # [rad]), ``mass``, ``momentum``, ``energy``
    over_angle: dict[str, list[float]] = field(default_factory=dict)
    # received by a plane across the shot line if all particles kept their velocities: ``x`` [m], ``radius`` (upper
    # ends [m]), ``mass``, ``momentum``, ``energy``, ``areal_momentum`` [Pa s] and the mean ``pressure`` [Pa] from the
    # first to 99 % of a bin's mass, and all of it: ``impulse``, ``first``, ``last`` [s]; empty without a plane
    witness: Plain = field(default_factory=dict)
    arrivals: Arrivals | None = field(default=None, compare=False, repr=False)  # the particles behind that

    def as_dict(self) -> Plain:
        """Return the plain form for JSON."""
        measures = plain_results(self.results)
        return {"measures": measures, "over_angle": self.over_angle, "witness": self.witness}


@memoize
def cloud_particles(scene: Scene) -> np.ndarray:
    """Return the indices of the cloud's particles; raises `UndefinedMeasureError` where there are none."""
    states = [layer_state(scene, body) for body in scene.layers]
    number = next((k for k, state in enumerate(states) if state.state != YES and not state.opening), len(states))
    passed = scene.layers[:number]  # perforated, or through their initial openings
    refuse_if(not any(state.state == YES for state in states[:number]), "no layer is perforated")
    plate = scene.plate(passed[-1])
    assert plate is not None
    free = np.ones(scene.state.count, dtype=bool)
    for layer in scene.layers:
        free[scene.groups(layer).particles_of(scene.attached_groups(layer))] = False
    free &= np.isin(scene.state.body, [body for body, role in enumerate(scene.shot.roles) if role != OTHER])
    free &= plate.depth(scene.position) > plate.thickness
    rows = np.flatnonzero(free & (scene.state.fields["velocity"] @ np.array(plate.basis[0]) > 0.0))
    refuse_if(len(rows) < FEWEST_OF_CLOUD, f"fewer than {FEWEST_OF_CLOUD} particles fly behind the perforated layer")
    return rows


@measures("cloud", "cloud_velocity")
def cloud_velocity(scene: Scene) -> Outcomes:
    """Return quantiles of the axial and radial velocity of the cloud [m/s]."""
    rows = cloud_particles(scene)
    mass, velocity = scene.state.fields["mass"][rows], scene.state.fields["velocity"][rows]
    radius = np.maximum(scene.radius[rows], 1e-3 * scene.spacing)
    radial = np.asarray((velocity[:, 1:] * scene.lateral[rows]).sum(axis=1) / radius)
    shares = {
        "front": 0.999,
        "front_99": 0.99,
        "front_90": 0.9,
        "rear": 0.01,
        "radial": 0.999,
        "radial_99": 0.99,
        "radial_90": 0.9,
    }
    return {
        name: weighted_quantile(radial if name.startswith("radial") else velocity[:, 0], mass, share)
        for name, share in shares.items()
    }


@measures("cloud", "cloud_length", "cloud_width", "cloud_half_angle")
def extent(scene: Scene) -> Outcomes:
    """Return length and width of the cloud [m], and its half angle [rad]."""
    rows = cloud_particles(scene)
    mass, x = scene.state.fields["mass"][rows], scene.position[rows, 0]
    return {
        "cloud_length": weighted_quantile(x, mass, 0.995) - weighted_quantile(x, mass, 0.005),
        "cloud_width": 2.0 * weighted_quantile(scene.radius[rows], mass, 0.99),
        "cloud_half_angle": weighted_quantile(_angles(scene, rows), mass, 0.9),
    }


@measures("cloud", "cloud_mass", "cloud_momentum", "cloud_energy")
def content(scene: Scene) -> Outcomes:
    """Return mass [kg], axial momentum [N s] and kinetic energy [J] of the cloud."""
    rows = cloud_particles(scene)
    mass, velocity = scene.state.fields["mass"][rows], scene.state.fields["velocity"][rows]
    return {
        "cloud_mass": float(mass.sum()),
        "cloud_momentum": float((mass * velocity[:, 0]).sum()),
        "cloud_energy": float((0.5 * mass * (velocity**2).sum(axis=1)).sum()),
    }


def cloud(scene: Scene, witness: float | None = None) -> Cloud:
    """Return the debris cloud, and the loads on a witness plane at `witness` along the shot line [m]."""
    results = evaluate("cloud", scene)
    try:
        if scene.state.dimensions == 1:
            return Cloud(results)
        rows = cloud_particles(scene)
    except UndefinedMeasureError:
        return Cloud(results)
    mass, velocity = scene.state.fields["mass"][rows], scene.state.fields["velocity"][rows]
    angles = _angles(scene, rows)
    number = int(np.ceil(angles.max() / ANGLE_BIN + 1e-9))
    bins = np.minimum((angles / ANGLE_BIN + 1e-9).astype(int), number - 1)
    kinds = {"mass": mass, "momentum": mass * velocity[:, 0], "energy": 0.5 * mass * (velocity**2).sum(axis=1)}
    over_angle = {name: np.bincount(bins, weights, number).tolist() for name, weights in kinds.items()}
    load = arrivals(scene, rows, witness) if witness is not None else None
    plane = plane_loads(load, scene.space == 3, scene.spacing) if load is not None else {}
    ends = (ANGLE_BIN * (np.arange(number) + 1)).tolist()
    return Cloud(results, {"angle": ends} | over_angle, plane, load)


def _angles(scene: Scene, rows: np.ndarray) -> np.ndarray:
    """Return the angle of each velocity to the shot line [rad]."""
    velocity = scene.state.fields["velocity"][rows]
    return np.asarray(np.arctan2(np.sqrt((velocity[:, 1:] ** 2).sum(axis=1)), velocity[:, 0]))


# Relative error of mass and momentum of ejecta over dx/w, w being the width of the projectile: 2.5 to 3.5 in granite,
# porous basalt and aluminium that are struck at 6 km/s, by extrapolation from 4, 8 and 16 particles across.
EJECTA_ERROR = 3.0
EJECTA_HEIGHT = 2.0  # [dx]; least height of ejecta over the struck face, above the disorder of a free surface
BINS_PER_DECADE = 10  # bins of the launch speed


@memoize
def _launch(scene: Scene, plate: Plate) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the rising particles, their launch speed [m/s], angle from the face [rad] and radius [m], (n,) each."""
    normal = np.array(plate.basis[0])
    velocity, depth = scene.state.fields["velocity"], plate.depth(scene.position)
    rows = np.flatnonzero((depth < -EJECTA_HEIGHT * scene.spacing) & (velocity @ normal < 0.0))
    height, rise = -depth[rows], -(velocity[rows] @ normal)
    tangential = velocity[rows] @ np.array(plate.basis[1:]).reshape(-1, len(normal)).T
    pull = gravity_towards_layer(scene, normal)
    first = np.sqrt(np.maximum(rise**2 + 2.0 * pull * height, 0.0))
    flight_time = 2.0 * height / (first + rise)
    place = plate.in_plane(scene.position[rows]) - tangential * flight_time[:, None]
    tangential_speed = np.sqrt((tangential**2).sum(axis=1))
    return rows, np.hypot(first, tangential_speed), np.arctan2(first, tangential_speed), np.sqrt((place**2).sum(axis=1))


def gravity_towards_layer(scene: Scene, normal: np.ndarray) -> float:
    """Return the acceleration of gravity towards the layer, along its normal [m/s^2]."""
    field: PlainMapping = scene.state.metadata.get("gravity", {})
    if "mass_parameter" in field:
        return float(field["mass_parameter"] / field["radius"] ** 2)
    return float(np.array(field.get("acceleration", 0.0 * normal)) @ scene.shot.back(normal))


def _escapes(scene: Scene, plate: Plate) -> np.ndarray | str:
    """Return whether rising particles escape (n,), or the reason why it is unknown."""
    rows, speed, _, _ = _launch(scene, plate)
    field: PlainMapping = scene.state.metadata.get("gravity", {})
    if "escape" in scene.state.metadata:
        return np.asarray(speed > float(scene.state.metadata["escape"]))
    if not field:
        return np.ones(len(rows), dtype=bool)
    if "mass_parameter" not in field:
        return "nothing escapes from a uniform field; give `escape`, the least launch speed of what does"
    place, velocity = scene.shot.case_axes(scene.state.time)(scene.position[rows], scene.state.fields["velocity"][rows])
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
    initial_momentum = float((scene.start.fields["mass"][shot] * before).sum())
    rows, *_ = _launch(scene, plate)
    mass = scene.state.fields["mass"][rows]
    momentum = -mass * (scene.state.fields["velocity"][rows] @ normal)
    own = scene.state.body[rows] == scene.target
    ejected, escapes = own | scene.is_projectile[rows], _escapes(scene, plate)
    error = min(EJECTA_ERROR * scene.relative_spacing, 1.0)
    variants: dict[str, Outcome] = dict.fromkeys(("all", "target", "escaping"), "the projectile has no momentum")
    if initial_momentum > 0.0:
        masks = {"all": ejected, "target": own, "escaping": escapes if isinstance(escapes, str) else ejected & escapes}
        for name, rows_or_reason in masks.items():
            gain = 0.0 if isinstance(rows_or_reason, str) else float(momentum[rows_or_reason].sum()) / initial_momentum
            beta = Result(1.0 + gain, discretization=error * gain)
            variants[name] = rows_or_reason if isinstance(rows_or_reason, str) else beta
    sums = {"ejecta_mass": float(mass[own].sum()), "ejecta_momentum": float(momentum[own].sum())}
    return {"beta": variants} | {name: Result(value, discretization=error * value) for name, value in sums.items()}


@measures("layer", "ejecta_angle", "ejecta_radius", needs=("motion",))
def launch(scene: Scene, plate: Plate) -> Outcomes:
    """Return the mass-mean angle [rad] and radius [m] at which the ejecta of a layer left its struck face."""
    rows, _, angle, radius = _launch(scene, plate)
    of_layer = scene.state.body[rows] == plate.body
    refuse_if(not of_layer.any(), "nothing rises from the struck face")
    mass = scene.state.fields["mass"][rows][of_layer]
    return {
        "ejecta_angle": float(mass @ angle[of_layer] / mass.sum()),
        "ejecta_radius": float(mass @ radius[of_layer] / mass.sum()),
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
    of_target = (scene.state.body[rows] == scene.target) & (speed > 0.0)
    if not of_target.any():
        return {}
    rows, speed, angle, radius = (values[of_target] for values in (rows, speed, angle, radius))
    mass, v = scene.state.fields["mass"][rows], scene.state.fields["velocity"][rows] @ np.array(plate.basis[0])
    bins = np.floor(BINS_PER_DECADE * np.log10(speed) + 1e-9).astype(int)
    first, bins = int(bins.min()), bins - bins.min()
    own_mass = np.bincount(bins, mass)
    table: dict[str, np.ndarray] = {"speed": 10.0 ** ((first + np.arange(len(own_mass))) / BINS_PER_DECADE)}
    occupied = own_mass > 0.0
    for name, values in (("mass", own_mass), ("momentum", np.bincount(bins, -mass * v))):
        table[name] = np.cumsum(values[::-1])[::-1]
    for name, values in (("angle", angle), ("radius", radius)):
        table[name] = np.bincount(bins, mass * values) / np.where(occupied, own_mass, 1.0)
    return {name: values[occupied].tolist() for name, values in table.items()}


def _struck_plate(scene: Scene) -> Plate:
    plate = scene.plate(scene.target)
    if plate is None or not scene.has_motion or scene.state.dimensions == 1:
        raise UndefinedMeasureError("the layer's struck face is unknown")
    return plate
