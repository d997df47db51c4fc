"""Whether a layer is perforated: whether a way leads through what is still attached to its edges.

The attached part of the layer, groups linked at 2 dx that hold something of its rim, is drawn as balls of 1.5 dx
on a grid in the layer's own axes. The layer is open where the space before it and the space behind it, within its
edges, are connected: so a way counts that is wider than about three spacings, wherever it is and whatever its
direction. Pieces that are stuck in it, of the projectile or of the layer, close it. Loose rubble closes nothing and
holds nothing: what has failed and is drawn apart so far that grains of it would not touch any more, thinner than the
loosest packing of spheres (Onoda & Liniger 1990). Of a layer that was open before it was struck only a way counts that
was not there (`ways`).

- ``yes``: open.
- ``not yet``: closed, and what flies at it still brings more than a thousandth of the shot's kinetic energy, which
  3 % of its velocity do.
- ``no``: closed, and nothing comes any more.
- no answer: without a new way the projectile has a way, or had one, through an opening of the layer's own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvisph.measures.debris.groups import connected_groups
from hvisph.measures.frame.boundary_rim import Rim
from hvisph.measures.frame.impact_geometry import own_spacings
from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.frame.target_geometry import Plate
from hvisph.measures.statistics import weighted_quantile

from .perforation_path import has_opened, is_open, place_of

YES, NO, NOT_YET = "yes", "no", "not yet"
SPENT = 1e-3  # share of the shot's kinetic energy below which nothing more is to come
LOOSE = 0.56  # share of the density at the start below which grains do not touch
SLOW = 0.03  # share of the shot's speed below which a piece is stuck


@dataclass(frozen=True)
class Perforation:
    """Whether a layer is perforated, and what of it is attached.

    Parameters
    ----------
    state
        ``yes``, ``no`` or ``not yet``; empty where nothing but an opening of its own lets the projectile through.
    reason
        Why it is not, in words; empty where it is.
    attached
        Indices of the particles of the layer that are still attached to its rim; without loose rubble, and what
        hangs on it, where that alone closes the way.
    """

    state: str
    reason: str
    attached: np.ndarray


def perforation(scene: Scene, plate: Plate) -> Perforation:
    """Return whether a layer is perforated; a projectile that is still within it has perforated it if a way is open.

    Parameters
    ----------
    scene
        The moment, in 2D or 3D, with velocities and masses.
    plate
        The layer.
    """
    fixed = scene.groups(plate.body).joined(scene.attached(plate.body))
    if plate.open and scene.start is None:
        return Perforation("", "it had openings, and a single snapshot does not tell where", fixed)
    loose = _loose(scene)
    closes = _closes(scene, plate, fixed)
    if closes and loose[fixed].any():
        held = _held(scene, plate, fixed[~loose[fixed]])
        if len(held) and not _closes(scene, plate, held):
            fixed, closes = held, False
    approach = _approach(scene, plate, fixed)
    if not closes:
        within = np.flatnonzero(_within(scene, plate, fixed) & ~loose)
        stuck = within[np.abs(_slides(scene, plate, within, fixed)) < SLOW * _speed(scene)]
        if len(fixed) == 0 or len(stuck) == 0 or _open(scene, plate, np.concatenate([fixed, stuck])):
            return Perforation(YES, "", fixed)
        closed = "what struck it is stuck in it"
    else:
        closed = "its attached part has no opening"
    if plate.open:
        closed = "no way leads through it that was not there at the start"
        if plate.clear or is_behind(scene, plate):
            through = "was open along the projectile's path" if plate.clear else "let the projectile through as it was"
            return Perforation("", f"it {through}: {closed}", fixed)
    share = _to_come(scene, plate, approach, fixed)
    if share > SPENT:
        return Perforation(NOT_YET, f"{closed}, and {100.0 * share:.2g} % of the shot's energy still fly at it", fixed)
    return Perforation(NO, f"{closed}, and nothing comes any more", fixed)


def _closes(scene: Scene, plate: Plate, fixed: np.ndarray) -> bool:
    return len(fixed) > 0 and not _open(scene, plate, fixed)


def _loose(scene: Scene) -> np.ndarray:
    """Return whether a particle is loose rubble, shape (n,); no where damage or the density at the start is unknown."""
    now, start = scene.now, scene.start
    if start is None or not scene.permanent or not now.fields.keys() >= {"damage", "density"} <= start.fields.keys():
        return np.zeros(now.count, dtype=bool)
    order = np.argsort(start.id)
    place = order[np.searchsorted(start.id, now.id, sorter=order)]
    return np.asarray((now.fields["damage"] >= 1.0) & (now.fields["density"] < LOOSE * start.fields["density"][place]))


def _held(scene: Scene, plate: Plate, rows: np.ndarray) -> np.ndarray:
    """Return what of `rows` hangs on the layer's rim by itself."""
    labels = connected_groups(scene.position[rows], scene.spacings(rows))
    return rows[np.isin(labels, labels[scene.rim(plate.body)[rows]])]


def _approach(scene: Scene, plate: Plate, fixed: np.ndarray) -> np.ndarray:
    """Return every particle's velocity along the plate's normal against the attached part, shape (n,) [m/s]."""
    along = scene.now.fields["velocity"] @ np.array(plate.basis[0])
    mass = scene.now.fields["mass"]
    own = fixed if len(fixed) else np.flatnonzero(scene.now.body == plate.body)
    return np.asarray(along - np.average(along[own], weights=mass[own]))


def _slides(scene: Scene, plate: Plate, rows: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """Return the velocity of `rows` along the normal against the nearest attached particle of each [m/s].

    A free plate bends and swings: what is stuck in its middle has not the velocity of the whole.
    """
    if len(rows) == 0:
        return np.zeros(0)
    from scipy.spatial import cKDTree

    along = scene.now.fields["velocity"] @ np.array(plate.basis[0])
    _, nearest = cKDTree(scene.position[fixed]).query(scene.position[rows])
    return np.asarray(along[rows] - along[fixed][nearest])


def _speed(scene: Scene) -> float:
    if scene.shot.speed is not None:
        return scene.shot.speed
    return float(np.sqrt((scene.now.fields["velocity"] ** 2).sum(axis=1).max()))


def _to_come(scene: Scene, plate: Plate, approach: np.ndarray, fixed: np.ndarray) -> float:
    """Return the share of the shot's kinetic energy that other bodies, not yet behind the layer, bring along."""
    depth = plate.depth(scene.position)
    rear = max(plate.thickness, float(depth[fixed].max(initial=0.0)))  # a bulge is in the way still
    coming = (scene.now.body != plate.body) & (depth < rear) & (approach > 0.0)
    energy = 0.5 * float((scene.now.fields["mass"] * np.where(coming, approach, 0.0) ** 2).sum())
    whole = scene.shot.energy
    if whole is None:
        whole = 0.5 * float((scene.now.fields["mass"][:, None] * scene.now.fields["velocity"] ** 2).sum())
    return energy / whole if whole > 0.0 else 0.0


def _within(scene: Scene, plate: Plate, fixed: np.ndarray) -> np.ndarray:
    """Return whether a particle is between the outermost attached ones along the normal, and none of them."""
    depth = plate.depth(scene.position)
    inside = (depth >= depth[fixed].min()) & (depth <= depth[fixed].max()) if len(fixed) else depth < -np.inf
    inside[fixed] = False
    return np.asarray(inside)


def is_behind(scene: Scene, plate: Plate) -> bool:
    """Whether half of the projectile's mass or more is behind a layer's rear face, which moves along with its rim."""
    own = np.flatnonzero(scene.is_projectile)
    mass = scene.now.fields["mass"][own]
    if not mass.sum() > 0.0:
        return False
    rear = plate.thickness + float(_carried(scene, plate) @ np.array(plate.basis[0]))
    return weighted_quantile(plate.depth(scene.position[own]), mass, 0.5) > rear


def _open(scene: Scene, plate: Plate, solid: np.ndarray) -> bool:
    """Whether a way leads through `solid` (indices); of a layer that was open, one that was not there at the start."""
    place = place_of(plate, scene.position[solid], scene.spacings(solid), scene.spacing)
    if not plate.open or scene.start is None:  # what was open is not asked for without its start
        return is_open(plate, place, scene.spacing)
    own = np.flatnonzero(scene.start.body == plate.body)
    position = scene.start.fields["position"][own] + _carried(scene, plate)
    return has_opened(plate, place, place_of(plate, position, own_spacings(scene.start, own, scene.spacing),
                                             scene.spacing), scene.spacing)  # fmt: skip


def _carried(scene: Scene, plate: Plate) -> np.ndarray:
    """Return how far a layer has gone as a whole: its rim in the mean since the start, shape (dim,) [m]."""
    now = np.flatnonzero(scene.rim(plate.body))
    if scene.start is None or len(now) == 0:
        return np.zeros(scene.now.dimensions)
    began = scene.first_rim(plate.body) if scene.permanent else Rim(scene.start.id, scene.start.fields["position"])
    before = np.isin(began.numbers, scene.now.id[now])
    if before.sum() != len(now):
        return np.zeros(scene.now.dimensions)
    return np.asarray(scene.position[now].mean(axis=0) - began.position[before].mean(axis=0))
