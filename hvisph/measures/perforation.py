"""State of a layer: perforated or not.

A layer is perforated if a path leads through its attached part: the groups, linked at 2 dx, that contain particles of
the rim. Each particle is represented by a ball of radius 1.5 dx on a grid in the layer's own axes; the layer is open if
the space in front of it and the space behind it are connected within its edges. A path is therefore wider than about
three spacings, in any direction. Fragments stuck in the layer close it. Loose failed material does not, if its density
is below that of the loosest packing of spheres (Onoda & Liniger 1990). A layer that was open before the impact is
perforated by a path that did not exist then.

- ``yes``: open.
- ``not yet``: closed, and bodies that approach it carry more than a thousandth of the initial kinetic energy.
- ``no``: closed otherwise.
- empty: there is no new path, and the projectile passes through an initial opening.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from .fragments import connected_groups
from .impact_geometry import own_spacings
from .measurement_frame import Rim, Scene, memoize
from .result import weighted_quantile
from .target_geometry import Plate, has_opened, is_open, place_of

YES, NO, NOT_YET = "yes", "no", "not yet"
LEAST_ENERGY_SHARE = 1e-3  # share of the initial kinetic energy below which approaching bodies cannot perforate
LOOSE_DENSITY = 0.56  # share of the initial density below which grains do not touch
STUCK_SPEED_SHARE = 0.03  # share of the impact speed below which a fragment is stuck


@dataclass(frozen=True)
class Perforation:
    """State of a layer: perforated or not, and which of its particles are attached."""

    state: str  # ``yes``, ``no`` or ``not yet``; empty where a perforation is undefined
    reason: str  # why it is not perforated; empty where it is
    # indices of the particles attached to the layer's rim; without loose failed material, and what only that connects,
    # where the layer is open without these; None if unknown
    attached: np.ndarray | None = None

    @property
    def opening(self) -> bool:
        """Whether it has no state because the projectile passed through an initial opening."""
        return self.attached is not None and not self.state


@memoize
def layer_state(scene: Scene, body: int) -> Perforation:
    """Return the state of a layer."""
    plate = scene.plate(body)
    if scene.state.dimensions == 1:
        return Perforation("", "a perforation is undefined in 1D")
    if plate is None:
        return Perforation("", "a single snapshot does not contain the plate before the impact")
    if not scene.has_motion:
        return Perforation("", "the snapshot has no velocity or no mass")
    return perforation(scene, plate)


def perforation(scene: Scene, plate: Plate) -> Perforation:
    """Return the state of a layer in 2D or 3D; the projectile may still be within an open one."""
    fixed = scene.groups(plate.body).particles_of(scene.attached_groups(plate.body))
    if plate.open and scene.start is None:
        return Perforation("", "it had openings, and a single snapshot does not contain their place", fixed)
    loose = _is_loose(scene)
    closed = _is_closed(scene, plate, fixed)
    if closed and loose[fixed].any():
        rows = fixed[~loose[fixed]]
        labels = connected_groups(scene.position[rows], scene.spacings(rows))
        supported = rows[np.isin(labels, labels[scene.rim(plate.body)[rows]])]  # by the rim, without loose rubble
        if len(supported) and not _is_closed(scene, plate, supported):
            fixed, closed = supported, False
    if not closed:
        depth, inside = plate.depth(scene.position), np.zeros(scene.state.count, bool)
        if len(fixed):  # between the outermost attached ones along the normal, and none of them
            inside = (depth >= depth[fixed].min()) & (depth <= depth[fixed].max())
            inside[fixed] = False
        candidates = np.flatnonzero(inside & ~loose)
        speed = scene.shot.speed
        if speed is None:
            speed = float(np.sqrt((scene.state.fields["velocity"] ** 2).sum(axis=1).max()))
        stuck = candidates[np.abs(_relative_velocity(scene, plate, candidates, fixed)) < STUCK_SPEED_SHARE * speed]
        if len(fixed) == 0 or len(stuck) == 0 or _is_open(scene, plate, np.concatenate([fixed, stuck])):
            return Perforation(YES, "", fixed)
    reason = "its attached part has no opening" if closed else "a fragment is stuck in it"
    if plate.open:
        reason = "no path leads through it that was not there at the start"
        if plate.clear or is_behind(scene, plate):
            through = "was open along the projectile's path" if plate.clear else "let the projectile pass as it was"
            return Perforation("", f"it {through}: {reason}", fixed)
    share = _approaching_energy(scene, plate, fixed)
    if share > LEAST_ENERGY_SHARE:
        percent = f"{100.0 * share:.2g} % of the initial kinetic energy"
        return Perforation(NOT_YET, f"{reason}, and bodies that approach it carry {percent}", fixed)
    return Perforation(NO, f"{reason}, and nothing approaches it", fixed)


def _is_closed(scene: Scene, plate: Plate, fixed: np.ndarray) -> bool:
    return len(fixed) > 0 and not _is_open(scene, plate, fixed)


def _is_loose(scene: Scene) -> np.ndarray:
    """Return which particles are loose failed material, shape (n,); none if damage or initial density is unknown."""
    state, start = scene.state, scene.start
    if start is None or not scene.permanent or not state.fields.keys() >= {"damage", "density"} <= start.fields.keys():
        return np.zeros(state.count, dtype=bool)
    place = scene.rows_at_start(slice(None))
    thin = state.fields["density"] < LOOSE_DENSITY * start.fields["density"][place]
    return np.asarray((state.fields["damage"] >= 1.0) & thin)


def _normal_velocity(scene: Scene, plate: Plate) -> np.ndarray:
    return np.asarray(scene.state.fields["velocity"] @ np.array(plate.basis[0]))


def _relative_velocity(scene: Scene, plate: Plate, rows: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """Return normal velocities of `rows` relative to the nearest attached particle [m/s]: a plate may vibrate."""
    if len(rows) == 0:
        return np.zeros(0)
    velocity = _normal_velocity(scene, plate)
    _, nearest = scipy.spatial.cKDTree(scene.position[fixed]).query(scene.position[rows])
    return np.asarray(velocity[rows] - velocity[fixed][nearest])


def _approaching_energy(scene: Scene, plate: Plate, fixed: np.ndarray) -> float:
    """Return the share of kinetic energy that other bodies carry along the normal towards the attached part."""
    depth, mass = plate.depth(scene.position), scene.state.fields["mass"]
    rows = fixed if len(fixed) else np.flatnonzero(scene.state.body == plate.body)
    velocity = _normal_velocity(scene, plate)
    approach = velocity - np.average(velocity[rows], weights=mass[rows])
    rear = max(plate.thickness, float(depth[fixed].max(initial=0.0)))  # also of a bulge
    coming = (scene.state.body != plate.body) & (depth < rear) & (approach > 0.0)
    energy = 0.5 * float((scene.state.fields["mass"] * np.where(coming, approach, 0.0) ** 2).sum())
    initial_energy = scene.shot.energy
    if initial_energy is None:
        initial_energy = 0.5 * float((scene.state.fields["mass"][:, None] * scene.state.fields["velocity"] ** 2).sum())
    return energy / initial_energy if initial_energy > 0.0 else 0.0


@memoize
def is_behind(scene: Scene, plate: Plate) -> bool:
    """Whether half of the projectile's mass or more is behind a layer's rear face, which moves along with its rim."""
    rows = np.flatnonzero(scene.is_projectile)
    mass = scene.state.fields["mass"][rows]
    if not mass.sum() > 0.0:
        return False
    rear = plate.thickness + float(_rim_displacement(scene, plate) @ np.array(plate.basis[0]))
    return weighted_quantile(plate.depth(scene.position[rows]), mass, 0.5) > rear


def _is_open(scene: Scene, plate: Plate, solid: np.ndarray) -> bool:
    """Return whether a path leads through the particles `solid`; in a layer that was open, a new one."""
    place = place_of(plate, scene.position[solid], scene.spacings(solid), scene.spacing)
    if not plate.open or scene.start is None:
        return is_open(plate, place, scene.spacing)
    rows = np.flatnonzero(scene.start.body == plate.body)
    position = scene.start.fields["position"][rows] + _rim_displacement(scene, plate)
    return has_opened(
        plate,
        place,
        place_of(plate, position, own_spacings(scene.start, rows, scene.spacing), scene.spacing),
        scene.spacing,
    )


def _rim_displacement(scene: Scene, plate: Plate) -> np.ndarray:
    """Return the mean displacement of a layer's rim since the start, shape (dim,) [m]."""
    rows = np.flatnonzero(scene.rim(plate.body))
    if scene.start is None or len(rows) == 0:
        return np.zeros(scene.state.dimensions)
    initial = scene.first_rim(plate.body) if scene.permanent else Rim(scene.start.id, scene.start.fields["position"])
    before = np.isin(initial.numbers, scene.state.id[rows])
    if before.sum() != len(rows):
        return np.zeros(scene.state.dimensions)
    return np.asarray(scene.position[rows].mean(axis=0) - initial.position[before].mean(axis=0))
