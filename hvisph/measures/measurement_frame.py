"""Measurement frame: the whole model at one moment in the axes of the shot.

x is along the shot line, and mirror images are added. The axis is the line along x through the initial centre of the
projectile; the struck face is that of the first layer. They follow from the run's first snapshot. A single snapshot has
them in its metadata (`reference`); without these, y = 0, x = 0, the thickness of the outermost tenth of the target's
main bodies and the projectile's present width replace them.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, wraps
from typing import Any, TypeVar, cast

import numpy as np

from hvisph.core.errors import OutputError
from hvisph.core.text import Plain
from hvisph.output.snapshot import Snapshot

from .fragments import LINK_DISTANCE, Fragments, Groups, connected_groups, main_body
from .impact_geometry import PROJECTILE, Shot, line_of, members, own_spacings, shot_of, spacing_of
from .target_geometry import RIM_SHARE, Plate, plate_of

F = TypeVar("F", bound=Callable[..., Any])


@dataclass(frozen=True)
class Rim:
    """A layer's rim at the start: permanent numbers (n,) and positions (n, dim) of its particles [m]."""

    numbers: np.ndarray
    position: np.ndarray


def rim_at_start(start: Snapshot, plate: Plate, spacing: float) -> Rim:
    """Return the rim of a layer at the start, and those of its parts that do not reach there; `spacing` is dx [m]."""
    rows = np.flatnonzero(start.body == plate.body)
    position = start.fields["position"][rows]
    outer = plate.is_beyond(plate.in_plane(position), RIM_SHARE)
    if plate.pieces > 1:
        groups = connected_groups(position, own_spacings(start, rows, spacing))
        for group in range(groups.max() + 1):
            part = groups == group
            if not outer[part].any():
                piece = plate_of(plate.body, position[part], position[part, 1:].mean(axis=0), spacing)
                outer[part] = piece.is_beyond(piece.in_plane(position[part]), RIM_SHARE)
    return Rim(start.id[rows][outer], position[outer])


def rim_between(layer: np.ndarray, lateral: np.ndarray, main: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return which particles are the rim of a layer now, between the edges of its main bodies, shape (n,).

    `layer` says which are the layer's (n,), `main` holds the indices of the main bodies, `lateral` coordinates from the
    shot line (n, dim - 1), and `axis` those of that line (dim - 1,) [m].
    """
    low, high = lateral[main].min(axis=0), lateral[main].max(axis=0)
    basis = tuple(map(tuple, np.eye(len(axis) + 1).tolist()))
    flat = Plate(-1, basis, 0.0, 1.0, tuple(axis.tolist()), tuple(low.tolist()), tuple(high.tolist()))
    rim, outward = layer.copy(), flat.outward(lateral[layer])
    rim[layer] = (outward >= RIM_SHARE) & (outward <= 1.0)
    return rim


class InitialReference:
    """Reference from a run's first snapshot `start` as stored, the same for all moments of the run."""

    def __init__(self, start: Snapshot):
        self.start = start
        self._shots: dict[int, Shot] = {}
        self._start_in_frame: tuple[Shot, Snapshot] | None = None
        self.rims: dict[int, Rim] = {}

    def shot(self, snapshot: Snapshot) -> Shot:
        """Return the shot that a snapshot is a moment of; only how many bodies that has can differ."""
        bodies = max(len(snapshot.bodies), int(snapshot.body.max(initial=-1)) + 1)
        if bodies not in self._shots:
            self._shots[bodies] = shot_of(self.start, snapshot)
        return self._shots[bodies]

    def start_in_frame(self, shot: Shot) -> Snapshot:
        """Return the start of the whole model in the axes of the shot, which is the same at all moments."""
        if self._start_in_frame is None or self._start_in_frame[0] != shot:
            self._start_in_frame = (shot, shot.in_frame(self.start))
        return self._start_in_frame[1]


def reference(start: Snapshot) -> Plain:
    """Return the metadata with which later snapshots can be measured alone, from a run's first snapshot.

    They are `shot`, `axis` (dim - 1 coordinates), `width` of the projectile and, where there is a target, its `face`
    (x of the struck plane) and `thickness` [m], in the axes of the shot. The metadata of `start` contain `spacing` and,
    under ``shot``, `roles` and `planes` of the case.
    """
    scene = Scene.from_snapshot(start, start)
    frame: Plain = {"shot": scene.shot.as_dict(), "axis": scene.axis.tolist(), "width": scene.width}
    return frame | {"face": scene.face, "thickness": scene.thickness} if scene.has_target else frame


def memoize(function: F) -> F:
    """Return the function of a scene and hashable arguments with its results stored in the scene."""

    @wraps(function)
    def compute_once(scene: "Scene", *arguments: Any) -> Any:
        key = (function.__qualname__, arguments)
        if key not in scene.memo:
            scene.memo[key] = function(scene, *arguments)
        return scene.memo[key]

    return cast(F, compute_once)


@dataclass
class Scene:
    """One moment of a run in the axes of its shot."""

    state: Snapshot  # the moment to measure: the whole model in the axes of the shot
    start: Snapshot | None = None  # the run's first snapshot, where there is one, likewise
    shot: Shot = field(default_factory=lambda: Shot(()))  # impact geometry
    # reference from the start, the same for all moments of a run
    initial: InitialReference | None = field(default=None, repr=False)
    # columns of ``history.csv`` by name, where there are any
    history: Mapping[str, np.ndarray] | None = field(default=None, repr=False)
    # the snapshots up to this one, where they are known
    timeline: Any = field(default=None, repr=False)  # a `Timeline`, whose moments have scenes themselves
    # outline of a bar, if there is one; filled by its measures
    profile: dict[str, list[float]] = field(default_factory=dict, init=False, repr=False)
    # results of functions that are computed once for each scene, by their name and arguments
    memo: dict[object, object] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        if not self.shot.roles:
            self.shot = shot_of(self.start, self.state)

    @classmethod
    def from_snapshot(cls, snapshot: Snapshot, initial: InitialReference | Snapshot | None = None) -> "Scene":
        """Return the scene of a snapshot as a file holds it; `initial` is the run's first one, or its reference."""
        moved_planes = snapshot.metadata.get("moved_planes", ())
        if initial is None:
            shot = shot_of(None, snapshot).at_moment(moved_planes)
            return cls(shot.in_frame(snapshot), None, shot)
        initial = initial if isinstance(initial, InitialReference) else InitialReference(initial)
        shot = initial.shot(snapshot)
        start = initial.start_in_frame(shot)
        shot = shot.at_moment(moved_planes)
        return cls(start if snapshot is initial.start else shot.in_frame(snapshot), start, shot, initial)

    @cached_property
    def position(self) -> np.ndarray:
        """Positions now (n, dim) [m]; raises `OutputError` where one is not finite: no length has a meaning."""
        position = self.state.fields["position"]
        if not np.isfinite(position).all():
            number = int(self.state.id[np.flatnonzero(~np.isfinite(position).all(axis=1))[0]])
            raise OutputError(f"the position of particle {number} is not finite at t = {self.state.time:.6g} s")
        return position

    @cached_property
    def spacing(self) -> float:
        """Spacing dx [m], from the metadata, or for other codes' files from the mass of a particle."""
        return spacing_of(self.state)

    def spacings(self, rows: np.ndarray) -> float | np.ndarray:
        """Return the spacing of `rows` [m]: dx, or of each its own by its initial smoothing length."""
        start = self.start
        if start is None or "smoothing_length" not in start.fields or not len(rows):
            return self.spacing
        images = self.shot.whole.images  # whose numbers follow those of their particles
        at = np.searchsorted(start.id[: start.count // images], self.state.id[rows] // images * images)
        return own_spacings(start, at, self.spacing)

    def rows_at_start(self, rows: np.ndarray | slice) -> np.ndarray:
        """Return where the particles `rows` are in the run's first snapshot, which is known."""
        assert self.start is not None
        order = np.argsort(self.start.id)
        return np.asarray(order[np.searchsorted(self.start.id, self.state.id[rows], sorter=order)])

    @cached_property
    def support(self) -> float:
        """Kernel support [m]; 2h with h = 1.4 dx if the files do not contain it."""
        reach = float(self.state.metadata.get("kernel_reach", 2.0))
        h = self.state.fields.get("smoothing_length")
        return reach * (float(np.median(h)) if h is not None else 1.4 * self.spacing)

    @cached_property
    def axis(self) -> np.ndarray:
        """Lateral coordinates of the shot line, shape (dim - 1,) [m]."""
        if "axis" in self.state.metadata:
            return np.atleast_1d(np.asarray(self.state.metadata["axis"], dtype=float))
        if self.start is not None:
            return line_of(self.start, self.shot.roles)
        return np.zeros(self.state.dimensions - 1)

    @property
    def space(self) -> int:
        """Dimensions of the whole, to which masses and energies refer: 3 for a solid of revolution."""
        return 3 if self.shot.whole.revolution else self.state.dimensions

    @cached_property
    def lateral(self) -> np.ndarray:
        """Coordinates across the shot line, shape (n, dim - 1) [m]."""
        return self.position[:, 1:] - self.axis

    @cached_property
    def radius(self) -> np.ndarray:
        """Distance from the shot line, shape (n,) [m]."""
        return np.sqrt((self.lateral**2).sum(axis=1))

    @cached_property
    def is_projectile(self) -> np.ndarray:
        """Whether a particle belongs to the projectile, shape (n,)."""
        return members(self.state, self.shot.roles, PROJECTILE)

    @cached_property
    def layers(self) -> tuple[int, ...]:
        """Indices of the bodies that are layers and have particles, in the order along the shot line."""
        ordered = [plate.body for plate in self.shot.plates]
        ordered += [body for body, role in enumerate(self.shot.roles) if role == "layer" and body not in ordered]
        bodies = set(self.state.present)
        return tuple(body for body in ordered if body in bodies)

    @property
    def has_motion(self) -> bool:
        """Whether the snapshot has velocities and masses."""
        return {"velocity", "mass"} <= self.state.fields.keys()

    @property
    def has_target(self) -> bool:
        """Whether there is a layer."""
        return bool(self.layers)

    @property
    def target(self) -> int:
        """Index of the first layer's body; -1 where there is none."""
        return self.layers[0] if self.layers else -1

    @cached_property
    def is_target(self) -> np.ndarray:
        """Whether a particle belongs to the first layer, shape (n,)."""
        return np.asarray(self.state.body == self.target)

    @cached_property
    def _plate(self) -> tuple[float, float]:
        """The struck face [m] and the thickness [m] of the plate before it was struck."""
        metadata = self.state.metadata
        if "face" in metadata and "thickness" in metadata:
            return float(metadata["face"]), float(metadata["thickness"])
        if self.shot.plates and self.start is not None:
            plate = self.shot.plates[0]
            basis = np.array(plate.basis)
            x = (plate.front - basis[0, 1:] @ self.axis) / basis[0, 0]
            return float(x), float(plate.thickness / basis[0, 0])  # an oblique plate is thicker along the shot line
        sides = np.concatenate(self.target_sides)
        outer = sides[self.radius[sides] >= np.quantile(self.radius[sides], 0.9)]
        return 0.0, float(np.ptp(self.position[outer, 0]) + self.spacing)

    @property
    def face(self) -> float:
        """Plane of the target's struck face before the impact, x [m]."""
        return self._plate[0]

    @property
    def thickness(self) -> float:
        """Thickness of the target along the shot line before the impact [m]."""
        return self._plate[1]

    @cached_property
    def width(self) -> float:
        """Width of the projectile across the shot line [m], at the start if that is known; 0 without projectile."""
        if "width" in self.state.metadata:
            return float(self.state.metadata["width"])
        source = self.start or self.state
        position = source.fields["position"][members(source, self.shot.roles, PROJECTILE)]
        if not len(position):
            return 0.0
        if source.dimensions == 1:
            return float(np.ptp(position) + self.spacing)
        return float(np.ptp(position[:, 1]) + self.spacing)

    @memoize
    def fragments(self, *bodies: int) -> Fragments:
        """Return the fragments of a body, or of several as if they were one, the largest first."""
        return Fragments.from_groups(self.state, self.groups(*bodies), bodies[0])

    @memoize
    def attached_groups(self, layer: int) -> np.ndarray:
        """Return for each group of a layer whether it contains particles of the layer's rim, shape (groups,)."""
        return self.groups(layer).contain(self.rim(layer))

    @memoize
    def groups(self, *bodies: int) -> Groups:
        """Return the connected groups of a body, or of several as if they were one, the largest first.

        Groups are ordered by their number of particles. They are sought in the part that was computed, and joined
        with their images (`whole`).
        """
        _ = self.position  # raises if one is not finite
        images, count = self.shot.whole.images, self.state.count // self.shot.whole.images
        part = np.flatnonzero(np.isin(self.state.body[:count], bodies))
        spacing = self.spacings(part)
        labels = connected_groups(self.state.fields["position"][part], spacing)
        case_axes = self.shot.back(self.position[part].reshape(len(part), -1))  # axes of the planes of symmetry
        labels = self.shot.whole.join_groups(labels, case_axes, LINK_DISTANCE * spacing)
        return Groups.from_labels((part[None] + count * np.arange(images)[:, None]).ravel(), labels)

    @cached_property
    def shot_groups(self) -> Fragments:
        """Connected groups of the projectile, all its bodies together."""
        bodies = [body for body, role in enumerate(self.shot.roles) if role == PROJECTILE]
        if not bodies:
            none = np.zeros(0, dtype=np.int64)
            return Fragments.from_groups(self.state, Groups.from_labels(none, none), -1)
        return self.fragments(*bodies)

    @cached_property
    def shot_mass(self) -> float:
        """Mass of the projectile at the start, or of its particles now [kg; kg/m in 2D, kg/m^2 in 1D]."""
        masses = zip(self.shot.masses, self.shot.roles, strict=False)
        initial = float(sum(mass for mass, role in masses if role == PROJECTILE))
        return initial or float(self.state.fields["mass"][self.is_projectile].sum())

    @cached_property
    def relative_spacing(self) -> float:
        """Spacing over the projectile's width."""
        return self.spacing / self.width if self.width > 0.0 else 0.0

    def name(self, body: int) -> str:
        """Return the name of a body."""
        return self.state.bodies[body] if body < len(self.state.bodies) else f"body {body}"

    @cached_property
    def projectile(self) -> np.ndarray:
        """Indices of the projectile's main body."""
        return self.shot_groups[0].particles if self.shot_groups else np.zeros(0, dtype=np.int64)

    def plate(self, body: int) -> Plate | None:
        """Return the geometry of a layer before it was struck; None where the start is not known."""
        return next((plate for plate in self.shot.plates if plate.body == body), None)

    @cached_property
    def target_sides(self) -> list[np.ndarray]:
        """Indices of the target's main bodies: each side of the shot line in 2D (one of a half model), all in 3D."""
        plate = self.is_target
        if self.state.dimensions != 2:
            pieces = self.groups(self.target)
            return [pieces.particles(0) if len(pieces) else np.zeros(0, dtype=np.int64)]
        upper = self.lateral[:, 0] > 0.0
        sides = [np.flatnonzero(plate & side) for side in (upper, ~upper)]
        return [side[main_body(self.position[side], self.spacings(side))] for side in sides if len(side)]

    @memoize
    def rim(self, body: int) -> np.ndarray:
        """Return which particles belong to a layer's rim, its outer tenth towards any edge, (n,); none in 1D.

        With a known start and permanent numbers these are the particles there at the start, and parts of a layer that
        do not reach its edges have rims of their own; else those there now, within the edges of the main bodies.
        """
        layer = self.state.body == body
        if self.state.dimensions == 1:
            return np.zeros_like(layer)
        if self.plate(body) is not None and self.permanent:
            return np.isin(self.state.id, self.first_rim(body).numbers) & layer
        main = np.concatenate(self.target_sides) if body == self.target else self.groups(body).particles(0)
        return rim_between(layer, self.lateral, main, self.axis)

    @property
    def permanent(self) -> bool:
        """Whether the start is known and particles have permanent numbers, as in files of hvisph."""
        return self.start is not None and "spacing" in self.start.metadata

    def first_rim(self, body: int) -> Rim:
        """Return a layer's rim at the start, which is known."""
        rims = self.initial.rims if self.initial else {}
        if body not in rims:
            plate = self.plate(body)
            assert plate is not None
            assert self.start is not None
            rims[body] = rim_at_start(self.start, plate, self.spacing)
        return rims[body]
