"""The debris cloud behind the perforated layers.

The cloud is all matter behind the rear face of the last perforated layer that moves away from it: the projectile's, and
that of layers which is not attached to their rims. Velocities, lengths and angles are quantiles of its mass, so that
they do not depend on single particles.
"""

from dataclasses import dataclass, field

import numpy as np

from hvisph.core.text import Plain
from hvisph.measures.frame.impact_geometry import OTHER
from hvisph.measures.frame.measurement_frame import Scene, memoize
from hvisph.measures.result import Outcomes, Result, UndefinedMeasureError, evaluate, measures, weighted_quantile
from hvisph.measures.target.perforation import YES, layer_state

BINS = 40
LATE = 0.99  # share of the mass that has arrived when a shower counts as over


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
    velocity, mass = scene.now.fields["velocity"][rows], scene.now.fields["mass"][rows]
    ahead = x - scene.position[rows, 0]
    reach = (velocity[:, 0] > 0.0) & (ahead >= 0.0)
    velocity, flight = velocity[reach], ahead[reach] / velocity[reach, 0]
    own = mass[reach]
    return Arrivals(
        x,
        scene.lateral[rows[reach]] + flight[:, None] * velocity[:, 1:],
        scene.now.time + flight,
        own,
        own * velocity[:, 0],
        0.5 * own * (velocity**2).sum(axis=1),
        float(own.sum() / mass.sum()),
    )


def plane_loads(came: Arrivals, round_: bool, spacing: float) -> Plain:
    """Return the loads on the plane over the radius, in plain form, in bins of width `spacing` [m] at least.

    Bins are annuli where `round_`, in the plane they are on both sides of the shot line.
    """
    if len(came.when) == 0:
        return {"x": came.x, "mass_share": 0.0}
    radius = came.radius
    width = weighted_quantile(radius, came.mass, 0.99) / BINS or spacing
    number = int(np.ceil(radius.max() / width + 1e-9))
    bins = np.minimum((radius / width + 1e-9).astype(int), number - 1)
    edges = width * np.arange(number + 1)
    size = np.pi * np.diff(edges**2) if round_ else 2.0 * np.diff(edges)
    sums = {name: np.bincount(bins, getattr(came, name), number) for name in ("mass", "momentum", "energy")}
    areal = sums["momentum"] / size
    first, last = float(came.when.min()), weighted_quantile(came.when, came.mass, LATE)
    return {
        "x": came.x,
        "mass_share": came.share,
        "first": first,
        "last": last,
        "impulse": float(came.momentum.sum()),
        "radius": edges[1:].tolist(),
        **{name: values.tolist() for name, values in sums.items()},
        "areal_momentum": areal.tolist(),
        "pressure": (areal / _durations(came, bins, number, last - first)).tolist(),
    }


def _durations(came: Arrivals, bins: np.ndarray, number: int, whole: float) -> np.ndarray:
    """Return how long the shower lasts in each bin [s], from first to 99 % of its mass; of a single one the whole's."""
    lengths = np.full(number, whole if whole > 0.0 else np.inf)
    order = np.argsort(bins, kind="stable")
    starts = np.searchsorted(bins[order], np.arange(number + 1))
    for k in range(number):
        rows = order[starts[k] : starts[k + 1]]
        if len(rows) > 1:
            lasts = weighted_quantile(came.when[rows], came.mass[rows], LATE) - float(came.when[rows].min())
            lengths[k] = lasts if lasts > 0.0 else lengths[k]
    return lengths


ANGLE_BIN = np.radians(2.0)
FEWEST = 20  # particles of a cloud


@dataclass(frozen=True)
class Cloud:
    """The debris cloud."""

    results: dict[str, Result]  # by name; values in SI
    # mass, axial momentum and kinetic energy in bins of 2 degrees between velocity and shot line: ``angle`` (upper ends
    # [rad]), ``mass``, ``momentum``, ``energy``
    over_angle: dict[str, list[float]] = field(default_factory=dict)
    # what a plane across the shot line would receive if all flew on as it does: ``x`` [m], ``radius`` (upper ends [m]),
    # ``mass``, ``momentum``, ``energy``, ``areal_momentum`` [Pa s] and the mean ``pressure`` [Pa] from the first to 99
    # % of a bin's mass, and all of it: ``impulse``, ``first``, ``last`` [s]; empty without a plane
    witness: Plain = field(default_factory=dict)
    arrivals: Arrivals | None = field(default=None, compare=False, repr=False)  # the particles behind that

    def as_dict(self) -> Plain:
        """Return the plain form for JSON."""
        measures = {name: result.as_dict() for name, result in self.results.items()}
        return {"measures": measures, "over_angle": self.over_angle, "witness": self.witness}


@memoize
def members(scene: Scene) -> np.ndarray:
    """Return the indices of the cloud's particles; raises `UndefinedMeasureError` where there are none."""
    states = [layer_state(scene, body) for body in scene.layers]
    number = next((k for k, one in enumerate(states) if one.state != YES and not one.opening), len(states))
    passed = scene.layers[:number]  # perforated, or through their initial openings
    if not any(one.state == YES for one in states[:number]):
        raise UndefinedMeasureError("no layer is perforated")
    plate = scene.plate(passed[-1])
    assert plate is not None
    free = np.ones(scene.now.count, dtype=bool)
    for layer in scene.layers:
        free[scene.groups(layer).particles_of(scene.attached_groups(layer))] = False
    free &= np.isin(scene.now.body, [body for body, role in enumerate(scene.shot.roles) if role != OTHER])
    free &= plate.depth(scene.position) > plate.thickness
    rows = np.flatnonzero(free & (scene.now.fields["velocity"] @ np.array(plate.basis[0]) > 0.0))
    if len(rows) < FEWEST:
        raise UndefinedMeasureError(f"fewer than {FEWEST} particles fly behind the perforated layer")
    return rows


@measures("cloud", "cloud_velocity")
def cloud_velocity(scene: Scene) -> Outcomes:
    """Return quantiles of the axial and radial velocity of the cloud [m/s]."""
    rows = members(scene)
    mass, velocity = scene.now.fields["mass"][rows], scene.now.fields["velocity"][rows]
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
    rows = members(scene)
    mass, x = scene.now.fields["mass"][rows], scene.position[rows, 0]
    return {
        "cloud_length": weighted_quantile(x, mass, 0.995) - weighted_quantile(x, mass, 0.005),
        "cloud_width": 2.0 * weighted_quantile(scene.radius[rows], mass, 0.99),
        "cloud_half_angle": weighted_quantile(_angles(scene, rows), mass, 0.9),
    }


@measures("cloud", "cloud_mass", "cloud_momentum", "cloud_energy")
def content(scene: Scene) -> Outcomes:
    """Return mass [kg], axial momentum [N s] and kinetic energy [J] of the cloud."""
    rows = members(scene)
    mass, velocity = scene.now.fields["mass"][rows], scene.now.fields["velocity"][rows]
    return {
        "cloud_mass": float(mass.sum()),
        "cloud_momentum": float((mass * velocity[:, 0]).sum()),
        "cloud_energy": float((0.5 * mass * (velocity**2).sum(axis=1)).sum()),
    }


def cloud(scene: Scene, witness: float | None = None) -> Cloud:
    """Return the debris cloud, and what a witness plane at `witness` along the shot line [m] receives of it."""
    results = evaluate("cloud", scene)
    try:
        if scene.now.dimensions == 1:
            return Cloud(results)
        rows = members(scene)
    except UndefinedMeasureError:
        return Cloud(results)
    mass, velocity = scene.now.fields["mass"][rows], scene.now.fields["velocity"][rows]
    angles = _angles(scene, rows)
    number = int(np.ceil(angles.max() / ANGLE_BIN + 1e-9))
    bins = np.minimum((angles / ANGLE_BIN + 1e-9).astype(int), number - 1)
    kinds = {"mass": mass, "momentum": mass * velocity[:, 0], "energy": 0.5 * mass * (velocity**2).sum(axis=1)}
    over_angle = {name: np.bincount(bins, weights, number).tolist() for name, weights in kinds.items()}
    came = arrivals(scene, rows, witness) if witness is not None else None
    plane = plane_loads(came, scene.space == 3, scene.spacing) if came is not None else {}
    ends = (ANGLE_BIN * (np.arange(number) + 1)).tolist()
    return Cloud(results, {"angle": ends} | over_angle, plane, came)


def _angles(scene: Scene, rows: np.ndarray) -> np.ndarray:
    """Return the angle of each velocity to the shot line [rad]."""
    velocity = scene.now.fields["velocity"][rows]
    return np.asarray(np.arctan2(np.sqrt((velocity[:, 1:] ** 2).sum(axis=1)), velocity[:, 0]))
