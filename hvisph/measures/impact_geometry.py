"""Impact geometry: roles of the bodies, shot line, measurement axes and symmetry.

All of it follows from a run's first snapshot. Later snapshots hold it in their metadata under ``shot``, so that
each can be measured alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np
import scipy

from hvisph.core.errors import OutputError
from hvisph.core.fields import transform_arrays
from hvisph.core.text import Plain, PlainMapping
from hvisph.output.snapshot import Snapshot

from .fragments import EQUAL_SPACING
from .symmetry_completion import Mirror, Symmetry, whole_of
from .target_geometry import PARALLEL, Plate, plate_of, to_tuples, with_openings

PROJECTILE, LAYER, OTHER = "projectile", "layer", "other"
NUMBERS = ("frame", "speed", "masses", "energy", "drift")  # of the plain form of a shot
AT_REST = 1e-6  # share of the highest speed below which a body is at rest


def roles_of(start: Snapshot | None, state: Snapshot, of_case: Sequence[str | None] = ()) -> tuple[str, ...]:
    """Return the role of every body, in their order, from a run's first snapshot, if it is known, and the present one.

    `of_case` are the roles in the case. Otherwise the first body that moves at the start is the projectile, and with it
    those of the same velocity, unless all have it; every other body is a layer, unless it lies behind the projectile.
    Where nothing moves, or the start is not known, the first body is the projectile and all others are layers.
    """
    count = max(len(state.bodies), int(state.body.max(initial=-1)) + 1)
    stated = [*of_case, *[None] * count][:count]
    if PROJECTILE in stated or start is None or "velocity" not in start.fields:
        roles = [PROJECTILE if body == 0 and PROJECTILE not in stated else LAYER for body in range(count)]
        return tuple(role or roles[body] for body, role in enumerate(stated))
    velocity = np.array([_mean(start, "velocity", start.body == body) for body in range(count)])
    speed = np.sqrt((velocity**2).sum(axis=1))
    moves = speed > AT_REST * speed.max(initial=0.0)
    free = [body for body in range(count) if stated[body] is None]
    first = next((body for body in free if moves[body]), free[0] if free else 0)
    is_shot = np.sqrt(((velocity - velocity[first]) ** 2).sum(axis=1)) <= AT_REST * speed[first]
    if is_shot[free].all() or not moves[first]:  # two bodies at rest do not strike each other
        is_shot[:] = False
    is_shot[first] = True
    roles = [PROJECTILE if is_shot[body] else LAYER for body in range(count)]
    for body in range(count) if moves[first] else ():
        position = start.fields["position"].reshape(start.count, -1) @ (velocity[first] - velocity[body])
        part, projectile = position[start.body == body], position[is_shot[start.body]]
        if roles[body] == LAYER and len(part) and len(projectile) and part.max() < projectile.min():  # wholly behind it
            roles[body] = OTHER
    return tuple(role or roles[body] for body, role in enumerate(stated))


def shot_direction(start: Snapshot, roles: Sequence[str]) -> np.ndarray:
    """Return the unit vector (dim,) along which the projectile nears the first layer; x where nothing moves."""
    direction = np.eye(start.dimensions)[0]
    if "velocity" not in start.fields:
        return direction
    velocity = mean_of(start, "velocity", roles, PROJECTILE)
    velocity = velocity - mean_of(start, "velocity", roles, LAYER)
    speed = float(np.sqrt((velocity**2).sum()))
    size = float(np.abs(start.fields["velocity"]).max(initial=0.0))
    return velocity / speed if speed > AT_REST * size else direction


def mean_of(snapshot: Snapshot, field: str, roles: Sequence[str], role: str) -> np.ndarray:
    """Return the mass mean of a field over all bodies of a role; zeros where there are none."""
    return _mean(snapshot, field, members(snapshot, roles, role))


def members(snapshot: Snapshot, roles: Sequence[str], role: str) -> np.ndarray:
    """Return whether each particle (n,) is of a body of this role."""
    return np.isin(snapshot.body, [body for body, body_role in enumerate(roles) if body_role == role])


def line_of(start: Snapshot, roles: Sequence[str]) -> np.ndarray:
    """Return the lateral coordinates of the shot line (dim - 1,) [m]: the projectile's centre, or the origin."""
    projectile = members(start, roles, PROJECTILE)
    lateral = start.fields["position"].reshape(start.count, -1)[:, 1:]
    return np.asarray(lateral[projectile].mean(axis=0)) if projectile.any() else np.zeros(lateral.shape[1])


def _mean(snapshot: Snapshot, field: str, mask: np.ndarray) -> np.ndarray:
    """Return the mass mean of a field over the particles of a `mask` (n,); zeros where there are none."""
    values, mass = snapshot.fields[field].reshape(snapshot.count, -1)[mask], snapshot.fields.get("mass")
    weights = np.ones(len(values)) if mass is None else mass[mask]
    return np.average(values, axis=0, weights=weights) if len(values) else np.zeros(values.shape[1])


@dataclass(frozen=True)
class Shot:
    """Impact geometry from the start of a run."""

    roles: tuple[str, ...]  # of every body: ``projectile``, ``layer`` or ``other``
    whole: Symmetry = field(default_factory=Symmetry)  # how the whole follows from what was computed
    # orthonormal rows (dim, dim): the shot direction and directions across it, in the case's axes
    frame: tuple[tuple[float, ...], ...] = ()
    plates: tuple[Plate, ...] = ()  # the initial geometry of the layers, in the order along the shot line
    # of the impact: the projectile's against the first layer's [m/s]; None where it is not known
    speed: float | None = None
    masses: tuple[float, ...] = ()  # mass of every body at the start, of the whole [kg; kg/m in 2D, kg/m^2 in 1D]
    energy: float | None = None  # kinetic energy of the whole at the start, relative to the layers [J; per metre in 2D]
    # velocity of the layers at the start (dim,), in the case's axes [m/s]; empty if zero or not the same for all
    drift: tuple[float, ...] = ()

    @property
    def is_rotated(self) -> bool:
        """Whether the shot's axes are others than the case's."""
        return bool(self.frame) and not np.array_equal(self.frame, np.eye(len(self.frame)))

    def at_moment(self, moved_planes: Sequence[PlainMapping]) -> "Shot":
        """Return the shot with planes of symmetry where they are now, see `Symmetry.at_moment`."""
        return replace(self, whole=self.whole.at_moment(moved_planes)) if moved_planes else self

    def in_frame(self, snapshot: Snapshot) -> Snapshot:
        """Return the whole model in the axes of the shot, which move along with its layers."""
        return _transform(self.whole.complete(snapshot), np.array(self.frame), self.drift)

    def back(self, vectors: np.ndarray) -> np.ndarray:
        """Return vectors (.., dim) of the shot's axes in those of the case."""
        return vectors @ np.array(self.frame) if self.is_rotated else vectors

    def case_axes(self, time: float) -> Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
        """Return the transformation of a position and a velocity (dim,) at `time` [s] to the axes of the case."""
        drift = np.array(self.drift or (0.0,))
        return lambda place, velocity: (self.back(place) + time * drift, self.back(velocity) + drift)

    def as_dict(self) -> Plain:
        """Return the plain form for the metadata of snapshots."""
        return asdict(self) | {"whole": self.whole.as_dict()}

    @classmethod
    def from_dict(cls, plain: PlainMapping) -> "Shot":
        """Return the shot with the plain form `plain`; raises `OutputError` where it is damaged."""
        try:
            values: Plain = {name: None if plain[name] is None else to_tuples(plain[name]) for name in NUMBERS}
            roles, plates = tuple(map(str, plain["roles"])), tuple(map(Plate.from_dict, plain["plates"]))
            return cls(roles, Symmetry.from_dict(plain["whole"]), plates=plates, **values)
        except (KeyError, TypeError, ValueError) as error:
            raise OutputError(f"the snapshot's metadata on the shot are damaged ({error!r})") from error


def shot_of(start: Snapshot | None, state: Snapshot) -> Shot:
    """Return the shot of a snapshot `state`, by the run's first one `start` where there is one, or its metadata."""
    source = state if start is None else start
    if "shot" in source.metadata and "plates" in source.metadata["shot"]:
        return Shot.from_dict(source.metadata["shot"])
    stored = source.metadata.get("shot", {})
    planes = None if stored.get("planes") is None else list(map(Mirror.from_dict, stored["planes"]))
    roles = roles_of(start, state, stored.get("roles", ()))
    spacing = spacing_of(source)
    projectile = members(source, roles, PROJECTILE)
    if source.is_axisymmetric:
        whole = Symmetry((Mirror(1, 0.0),), revolution=True)
    else:
        whole = whole_of(source, projectile, spacing, planes) if source.dimensions > 1 else Symmetry()
    if start is None:
        return Shot(roles, whole, _as_rows(np.eye(state.dimensions)))
    complete = whole.complete(start)
    frame = _frame(complete, roles)
    framed = _transform(complete, frame)
    speed, energy = _impact(framed, roles)
    mass = framed.fields.get("mass")
    masses = [] if mass is None else np.bincount(framed.body, mass, len(roles)).tolist()
    plates = _plates(framed, roles, line_of(framed, roles), spacing)
    return Shot(roles, whole, _as_rows(frame), plates, speed, tuple(masses), energy, _drift(complete, roles))


def spacing_of(snapshot: Snapshot) -> float:
    """Return dx [m] from the metadata, or for other codes' files the edge of the cell that a particle's mass fills."""
    if "spacing" in snapshot.metadata:
        return float(snapshot.metadata["spacing"])
    if {"mass", "density"} <= snapshot.fields.keys():
        volume = np.median(snapshot.fields["mass"] / snapshot.fields["density"])
        return float(volume ** (1.0 / snapshot.dimensions))
    position = snapshot.fields["position"]
    return float(np.median(scipy.spatial.cKDTree(position).query(position, k=2)[0][:, 1]))


def _plates(framed: Snapshot, roles: tuple[str, ...], axis: np.ndarray, spacing: float) -> tuple[Plate, ...]:
    def places(rows: np.ndarray) -> np.ndarray:  # of the whole no more than needed is held
        return np.asarray(framed.fields["position"].reshape(framed.count, -1)[rows])

    projectile, plates = places(members(framed, roles, PROJECTILE)), []
    for body in (body for body, role in enumerate(roles) if role == LAYER):
        ids = np.flatnonzero(framed.body == body)
        if len(ids):
            place = places(ids)
            sizes = own_spacings(framed, ids, spacing)
            plate = plate_of(body, place, axis, spacing, sizes)
            plate = with_openings(plate, place, projectile, sizes, spacing)
            plates.append((float(place[:, 0].mean()), plate))
    return tuple(plate for _, plate in sorted(plates, key=lambda pair: pair[0]))


def own_spacings(start: Snapshot, rows: np.ndarray, spacing: float) -> float | np.ndarray:
    """Return the spacing of the particles `rows` of the start [m]: dx, or where it differs, of each its own."""
    ratio = start.metadata.get("h_over_dx")
    if ratio is None or "smoothing_length" not in start.fields or not len(rows):
        return spacing
    own = start.fields["smoothing_length"][rows] / float(ratio)
    return np.asarray(own) if own.min() < spacing / EQUAL_SPACING or own.max() > spacing * EQUAL_SPACING else spacing


def _frame(start: Snapshot, roles: tuple[str, ...]) -> np.ndarray:
    """Return the shot's axes: its direction, and across it the axes of the first layer.

    They turn with the shot and all that it hits. Where the shot flies along x and the layer's edges are along y
    and z they are the case's own.
    """
    dim = start.dimensions
    direction = shot_direction(start, roles)
    if np.abs(direction - np.eye(dim)[0]).max() < PARALLEL:
        direction = np.eye(dim)[0]
    if dim == 1:
        return np.eye(1)  # layers differ by their order
    if dim == 2:
        return np.array([direction, [-direction[1], direction[0]]])
    lateral = _lateral_axis(start, roles, direction)
    if direction[0] == 1.0 and np.sort(np.abs(lateral))[:2].max() < PARALLEL:
        return np.eye(3)
    return np.array([direction, lateral, np.cross(direction, lateral)])


def _lateral_axis(start: Snapshot, roles: tuple[str, ...], direction: np.ndarray) -> np.ndarray:
    """Return a direction across the shot line fixed to the layers: along an edge, or midway between two corners."""
    layers = members(start, roles, LAYER)
    layers = layers if layers.any() else np.ones(start.count, bool)
    flat = start.fields["position"][np.flatnonzero(layers)[np.argsort(start.id[layers])]]
    flat -= flat.mean(axis=0)
    flat -= (flat @ direction)[:, None] * direction
    values, vectors = np.linalg.eigh(flat.T @ flat)
    distance = np.sqrt((flat**2).sum(axis=1))
    corner = flat[int(np.argmax(distance >= (1.0 - 1e-9) * distance.max()))]
    if values[2] - values[1] > 1e-6 * values[2]:
        edge = vectors[:, 2] * (1.0 if corner @ vectors[:, 2] >= 0.0 else -1.0)
    else:  # round or square: the farthest particle is on a diagonal
        corner = corner / np.sqrt((corner**2).sum())
        edge = (corner - np.cross(direction, corner)) / np.sqrt(2.0)
    edge = edge - (edge @ direction) * direction
    return np.asarray(edge / np.sqrt((edge**2).sum()))


def _transform(snapshot: Snapshot, frame: np.ndarray, drift: tuple[float, ...] = ()) -> Snapshot:
    """Return a snapshot in the axes `frame` (dim, dim), which move at the velocity `drift` [m/s] since the start."""
    shift = {"position": snapshot.time * np.array(drift), "velocity": np.array(drift)} if drift else {}
    rotated = frame.size > 0 and not np.array_equal(frame, np.eye(len(frame)))
    if not shift and not rotated:
        return snapshot

    def transform(name: str, values: np.ndarray) -> np.ndarray:
        if name not in ("position", "velocity"):
            return values
        values = values - shift[name] if shift else values
        return values.reshape(snapshot.count, -1) @ frame.T if rotated else values

    return replace(snapshot, fields=transform_arrays(snapshot.fields, transform))


def _drift(start: Snapshot, roles: tuple[str, ...]) -> tuple[float, ...]:
    """Return the common velocity of all layers at the start (dim,) [m/s]; empty if zero or not the same for all."""
    if start.dimensions == 1 or not {"velocity", "mass"} <= start.fields.keys():
        return ()
    velocity = start.fields["velocity"][members(start, roles, LAYER)]
    size = float(np.abs(start.fields["velocity"]).max(initial=0.0))
    mean = mean_of(start, "velocity", roles, LAYER)
    if not len(velocity) or not np.abs(mean).max() > AT_REST * size or np.abs(velocity - mean).max() > AT_REST * size:
        return ()
    return tuple(mean.tolist())


def _impact(framed: Snapshot, roles: tuple[str, ...]) -> tuple[float | None, float | None]:
    """Return impact speed and kinetic energy relative to the layers; None where they are not known."""
    if not {"velocity", "mass"} <= framed.fields.keys():
        return None, None
    layers = mean_of(framed, "velocity", roles, LAYER)
    relative = framed.fields["velocity"].reshape(framed.count, -1) - layers
    energy = 0.5 * float((framed.fields["mass"] * (relative**2).sum(axis=1)).sum())
    speed = float(np.sqrt(((mean_of(framed, "velocity", roles, PROJECTILE) - layers) ** 2).sum()))
    return speed, energy


def _as_rows(matrix: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in matrix.tolist())
