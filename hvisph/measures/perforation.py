"""Whether a layer is perforated: whether a way leads through what is still attached to its edges.

The attached part of the layer, groups linked at 2 dx that hold something of its rim, is drawn as balls of 1.5 dx
on a grid in the layer's own axes. The layer is open where the space before it and the space behind it, within its
edges, are connected: so a way counts that is wider than about three spacings, wherever it is and whatever its
direction. Pieces that are stuck in it, of the projectile or of the layer, close it.

- ``yes``: open.
- ``not yet``: closed, and what flies at it still brings more than a thousandth of the shot's kinetic energy, which
  3 % of its velocity do.
- ``no``: closed, and nothing comes any more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvisph.measures.plates import RIM, Plate
from hvisph.measures.plug import attached
from hvisph.measures.scene import Scene

YES, NO, NOT_YET = "yes", "no", "not yet"
RADIUS = 1.5  # [dx] of the balls
CELL = {2: 0.5, 3: 1.0}  # [dx]
SHIFT = 0.37  # [cells]; keeps the particles of a lattice off the borders of cells
SPENT = 1e-3  # share of the shot's kinetic energy below which nothing more is to come
SLOW = 0.03  # share of the shot's speed below which a piece is stuck
MOST_CELLS = 40_000_000


@dataclass(frozen=True)
class Perforation:
    """Whether a layer is perforated, and what of it is attached.

    Parameters
    ----------
    state
        ``yes``, ``no`` or ``not yet``.
    reason
        Why it is not, in words; empty where it is.
    attached
        Indices of the particles of the layer that are still attached to its rim.
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
    groups = scene.fragments(plate.body)
    held = [group.particles for group, holds in zip(groups, attached(scene, plate.body), strict=True) if holds]
    fixed = np.concatenate(held) if held else np.zeros(0, dtype=np.int64)
    approach = _approach(scene, plate, fixed)
    if len(fixed) == 0 or _open(scene, plate, fixed):
        stuck = np.flatnonzero((np.abs(approach) < SLOW * _speed(scene)) & _within(scene, plate, fixed))
        if len(fixed) == 0 or len(stuck) == 0 or _open(scene, plate, np.concatenate([fixed, stuck])):
            return Perforation(YES, "", fixed)
        closed = "what struck it is stuck in it"
    else:
        closed = "its attached part has no opening"
    share = _to_come(scene, plate, approach, fixed)
    if share > SPENT:
        return Perforation(NOT_YET, f"{closed}, and {100.0 * share:.2g} % of the shot's energy still fly at it", fixed)
    return Perforation(NO, f"{closed}, and nothing comes any more", fixed)


def _approach(scene: Scene, plate: Plate, fixed: np.ndarray) -> np.ndarray:
    """Return every particle's velocity along the plate's normal against the attached part, shape (n,) [m/s]."""
    along = scene.now.fields["velocity"] @ np.array(plate.basis[0])
    mass = scene.now.fields["mass"]
    own = fixed if len(fixed) else np.flatnonzero(scene.now.body == plate.body)
    return np.asarray(along - np.average(along[own], weights=mass[own]))


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


def _inside(plate: Plate, low: np.ndarray, cell: float, shape: tuple[int, ...]) -> np.ndarray:
    """Return whether the cells across a layer, of which the first is at `low` [m], are within its edges."""
    axes = [corner + (np.arange(count) + 0.5 - SHIFT) * cell for corner, count in zip(low, shape, strict=True)]
    middles = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(shape))
    return (plate.outward(middles) <= RIM).reshape(shape)


def _within(scene: Scene, plate: Plate, fixed: np.ndarray) -> np.ndarray:
    """Return whether a particle is between the outermost attached ones along the normal, and none of them."""
    depth = plate.depth(scene.position)
    inside = (depth >= depth[fixed].min()) & (depth <= depth[fixed].max()) if len(fixed) else depth < -np.inf
    inside[fixed] = False
    return np.asarray(inside)


def _open(scene: Scene, plate: Plate, solid: np.ndarray) -> bool:
    """Whether the space before and the space behind `solid` (indices) are connected within the layer's edges."""
    from scipy import ndimage

    dim = scene.now.dimensions
    place = np.column_stack([plate.depth(scene.position[solid]), plate.across(scene.position[solid])])
    low = np.concatenate([[place[:, 0].min()], RIM * np.array(plate.low)])
    high = np.concatenate([[place[:, 0].max()], RIM * np.array(plate.high)])
    radius, cell = RADIUS * scene.spacing, CELL[dim] * scene.spacing
    cell = max(cell, float((np.prod(high - low + 4.0 * radius) / MOST_CELLS) ** (1.0 / dim)))
    # beyond the balls along the normal there is space; beyond the edges across it nothing is looked at
    pad = int(np.ceil(radius / cell)) + 2
    shape = np.ceil((high - low) / cell).astype(int) + 2 * pad
    index = np.floor((place - low) / cell + SHIFT).astype(int) + pad
    inside = ((index >= 0) & (index < shape)).all(axis=1)
    filled = np.zeros(shape, dtype=bool)
    filled[tuple(index[inside].T)] = True
    free = ndimage.distance_transform_edt(~filled) * cell > radius
    free = free[(slice(None), *[slice(pad, -pad)] * (dim - 1))]
    if plate.edges:  # a disc has no corners, through which there would be a way
        free &= _inside(plate, low[1:], cell, free.shape[1:])
    labels, _ = ndimage.label(free)
    return bool(np.intersect1d(labels[0], labels[-1]).max(initial=0) > 0)
