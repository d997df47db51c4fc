"""Crater diameter, extension and penetration.

All of them are taken between particle centres: the material's surface lies half a spacing further
out. Every uncertainty holds dx, by which two edges together are uncertain, and the scatter of what
the mean or the median was taken over, added in quadrature.

In 3D the distance from the shot line takes the place of the side of it, and diameters are twice radii.
"""

from __future__ import annotations

import numpy as np

from hvisph.measures.frame.impact_geometry import own_spacings
from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.frame.roles import PROJECTILE, members

from .result import Result, meaningless

CRATER_BIN = 0.25e-3  # [m], along the plate's thickness
AXIS_STRIP = 1.0e-3  # [m], half-width of the strip about the shot line
LIP_PARTICLES = {2: 5, 3: 40}  # front-most attached particles: of each side in 2D, all round in 3D
LIP_REACH = 2.5  # in projectile widths: how far from the shot line a lip may be
SAME = 1e-6  # [dx]; particles of a layer are no farther apart along x
CRATER_NAMES = ("crater_diameter", "crater_diameter_minimum", "crater_lip_to_lip")


def crater_diameter(scene: Scene) -> dict[str, Result]:
    """Return the crater's mean diameter, its minimum and the distance from lip to lip.

    The inner edge of the target's main body on each side of the shot line is taken in bins over
    the plate's original thickness, 0.25 mm each (a quarter of a thin plate; dx where that is
    coarser). The two sides' edges added give a bin's diameter. The lip is where the five front-most
    (largest x) particles of each side are, of a flat face those at the hole, within 2.5 projectile
    widths of the shot line; a film of the target that still hangs on the projectile is attached, too.

    Returns
    -------
    dict
        `crater_diameter` (mean over the bins), `crater_diameter_minimum`, `crater_lip_to_lip` [m].
    """
    reason = ""
    if scene.now.dimensions == 1:
        reason = "a crater has no meaning in 1D"
    elif not scene.has_target:
        reason = "there is no target"
    if reason:
        return dict.fromkeys(CRATER_NAMES, meaningless("m", reason))
    diameter = _bin_diameters(scene)
    if len(diameter) == 0:
        empty = meaningless("m", "the target has left the place of the plate")
        return dict.fromkeys(CRATER_NAMES[:2], empty) | {CRATER_NAMES[2]: _lip(scene)}
    return {
        "crater_diameter": _length(scene, diameter.mean(), _standard_error(diameter)),
        "crater_diameter_minimum": _length(scene, diameter.min(), 0.0),
        "crater_lip_to_lip": _lip(scene),
    }


def extension(scene: Scene) -> Result:
    """Return the length of the projectile's main body along the shot line [m].

    Within 1 mm of the shot line (a fifth of a narrow projectile; 2 dx where that is coarser), in
    bins of 2 dx across it, the median of the bins' largest x less the median of their smallest.
    """
    if scene.now.dimensions == 1:
        return meaningless("m", "the extension along the shot line has no meaning in 1D")
    half_width = max(min(AXIS_STRIP, 0.2 * scene.width), 2.0 * scene.spacing)
    three_d = scene.now.dimensions == 3
    across = scene.radius[scene.projectile] if three_d else scene.lateral[scene.projectile, 0]
    low = 0.0 if three_d else -half_width
    inside = (across >= low) & (across < half_width)
    if not inside.any():
        return meaningless("m", "the projectile's main body has left the shot line")
    number = max(1, round((half_width - low) / (2.0 * scene.spacing)))
    bins = np.minimum(((across[inside] - low) * number / (half_width - low)).astype(int), number - 1)
    x = scene.position[scene.projectile[inside], 0]
    rear, front = np.full(number, np.inf), np.full(number, -np.inf)
    np.minimum.at(rear, bins, x)
    np.maximum.at(front, bins, x)
    filled = np.isfinite(rear)
    rear, front = rear[filled], front[filled]
    scatter = np.hypot(_standard_error(rear), _standard_error(front))
    return _length(scene, np.median(front) - np.median(rear), scatter)


def length_of(scene: Scene, x: np.ndarray) -> float:
    """Return the length [m] of a projectile that has particles at `x`, to the faces of its first and last layer."""
    return float(np.ptp(x)) + 0.5 * sum(end_layers(scene))


def end_layers(scene: Scene) -> tuple[float, float]:
    """Return how thick the projectile's first and last layer along x are at the start [m]: dx unless it is graded."""
    spacing, start = scene.spacing, scene.start
    if start is None:
        return spacing, spacing
    rows = np.flatnonzero(members(start, scene.shot.roles, PROJECTILE))
    if np.ndim(own_spacings(start, rows, spacing)) == 0:
        return spacing, spacing
    x = np.sort(start.fields["position"].reshape(start.count, -1)[rows, 0])
    gaps = np.diff(x)[np.diff(x) > SAME * spacing]
    if len(gaps) < 2 or gaps.min() < 0.5 * spacing:  # no layers
        return spacing, spacing
    return _layer(*gaps[:2]), _layer(*gaps[:-3:-1])


def _layer(gap: float, following: float) -> float:
    """Return the thickness of an outermost layer from its distance to the next one and from that to the one after."""
    return float(2.0 * gap * gap / (gap + following))


def penetration(scene: Scene) -> Result:
    """Return how far the projectile's main body has come beyond the struck face [m].

    The 99 % quantile of x, so that a loose particle ahead does not count. Its scatter is half the
    distance between the 98.5 % and the 99.5 % quantile. Negative before contact.
    """
    if scene.now.dimensions == 1:
        return meaningless("m", "penetration has no meaning in 1D")
    if not scene.has_target:
        return meaningless("m", "there is no target")
    low, value, high = np.quantile(scene.position[scene.projectile, 0], [0.985, 0.99, 0.995])
    return _length(scene, value - scene.face, 0.5 * (high - low))


def _bin_diameters(scene: Scene) -> np.ndarray:
    """Diameters of the bins over the thickness in which every side has particles, shape (bins,) [m]."""
    width = max(min(CRATER_BIN, 0.25 * scene.thickness), scene.spacing)
    number = max(1, round(scene.thickness / width))
    x = (scene.position[:, 0] - scene.face) * number / scene.thickness
    bins = np.where((x >= 0.0) & (x < number), x, -1.0).astype(int)
    if scene.now.dimensions == 3:
        return np.array([edge for edge in _round_edges(scene, bins, number) if np.isfinite(edge)])
    edges = np.full((len(scene.target_sides), number), np.inf)
    for edge, side in zip(edges, scene.target_sides, strict=True):
        within = side[bins[side] >= 0]
        np.minimum.at(edge, bins[within], scene.radius[within])
    # a half model shows one side; the other is its mirror image
    diameter = edges.sum(axis=0) * (2.0 / len(edges))
    return diameter[np.isfinite(diameter)]


def _round_edges(scene: Scene, bins: np.ndarray, number: int) -> list[float]:
    """Twice the mean radius of the inner edge in each bin; the mean goes over sectors round the shot line.

    Sectors are about 4 dx wide at the edge, so each holds particles and one stray does not decide.
    """
    side = scene.target_sides[0]
    edges = []
    for k in range(number):
        within = side[bins[side] == k]
        if len(within) == 0:
            edges.append(np.inf)
            continue
        radius = scene.radius[within]
        sectors = int(np.clip(2.0 * np.pi * radius.min() / (4.0 * scene.spacing), 1, 32))
        angle = np.arctan2(scene.lateral[within, 1], scene.lateral[within, 0])
        sector = np.minimum(((angle / (2.0 * np.pi) + 0.5) * sectors).astype(int), sectors - 1)
        edge = np.full(sectors, np.inf)
        np.minimum.at(edge, sector, radius)
        edges.append(2.0 * float(edge[np.isfinite(edge)].mean()))
    return edges


def _lip(scene: Scene) -> Result:
    """Distance between the front-most attached particles of the two sides [m]."""
    means, errors = [], []
    for side in scene.target_sides:
        near = side[scene.radius[side] < LIP_REACH * scene.width]
        if len(near) == 0:
            return meaningless("m", "no attached particle of the target is near the shot line")
        radius = scene.radius[_front_most(scene, near, LIP_PARTICLES[scene.now.dimensions])]
        means.append(radius.mean())
        errors.append(_standard_error(radius))
    share = 2.0 / len(means)
    return _length(scene, share * sum(means), share * float(np.hypot.reduce(errors)))


def _front_most(scene: Scene, near: np.ndarray, number: int) -> np.ndarray:
    """Pick the `number` particles of `near` with the largest x; of a flat face, those at the hole."""
    x = scene.position[near, 0]
    limit = np.sort(x)[-min(number, len(x))]
    tie = np.abs(x - limit) <= 1e-6 * scene.spacing
    ahead, level = near[(x > limit) & ~tie], near[tie]
    level = level[np.argsort(scene.radius[level], kind="stable")]
    return np.concatenate([ahead, level[: number - len(ahead)]])


def _standard_error(sample: np.ndarray) -> float:
    return float(sample.std(ddof=1) / np.sqrt(len(sample))) if len(sample) > 1 else 0.0


def _length(scene: Scene, value: float, scatter: float) -> Result:
    uncertainty = float(np.hypot(scene.spacing, scatter))
    return Result(float(value), "m", uncertainty, spacing=scene.spacing, support=scene.support)
