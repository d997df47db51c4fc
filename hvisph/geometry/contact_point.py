"""First contact of two bodies along x, from their surfaces.

From points on one body's surface rays run along x to the other body by sphere tracing (steps of
the distance to its surface, which cannot jump over it), and from the other body's surface back. The shortest ray
is then refined by more points about its start. Particles that would come nearer to each other than 0.9 of their spacing
before the surfaces meet stop the bodies there: that costs a fraction of a spacing, and nothing between flat faces.
"""

from dataclasses import dataclass

import numpy as np

from .shapes import Placed, Shape

TRACES = 300
ROUNDS, POINTS = 30, 48
SHRINK = 0.7  # of the neighbourhood, from round to round
MOST_SEEDS = 20_000
NEAREST = 0.9  # [mean spacings] of particles of touching bodies


@dataclass(frozen=True)
class Solid:
    """Surface and particles of a body in the same coordinates."""

    shape: Shape  # its surface
    positions: np.ndarray  # particle centres in the same coordinates, (n, dim) [m]
    spacing: float  # their spacing [m]


def touch(first: Solid, second: Solid) -> tuple[float, float] | None:
    """Return where two bodies touch that approach each other along x, `first` from the left.

    `first`, `second`: the bodies, each about its own origin.

    Returns x of the point of contact about either origin [m]; None where they pass each other.
    """
    start = max(float(first.positions[:, 0].max()), float(first.shape.bounds()[1][0])) - min(
        float(second.positions[:, 0].min()), float(second.shape.bounds()[0][0])
    )
    start += (first.spacing + second.spacing) / 2
    move = np.zeros(first.shape.dim)
    move[0] = -start
    moved = Solid(Placed(first.shape, move), first.positions + move, first.spacing)
    far, x = min(_shortest(moved, second, 1.0), _shortest(second, moved, -1.0))
    if not np.isfinite(far):
        return None
    return x + start - min(far, _between_particles(moved, second)), x


def _shortest(origin: Solid, aim: Solid, sign: float) -> tuple[float, float]:
    """Return the shortest ray from the surface of `origin` to that of `aim`, and the x of its end on the right."""
    skin = origin.positions[origin.shape.distance(origin.positions) > -1.5 * origin.spacing]
    seeds = on_surface(origin.shape, skin[:: max(1, len(skin) // MOST_SEEDS)])
    if len(seeds) == 0:
        return np.inf, 0.0
    lengths = _trace(aim.shape, seeds, sign)
    best, length = seeds[np.argmin(lengths)], float(lengths.min())
    if not np.isfinite(length):
        return np.inf, 0.0
    random, reach = np.random.default_rng(0), 2 * origin.spacing
    for _ in range(ROUNDS):
        points = on_surface(origin.shape, best + reach * random.uniform(-1, 1, (POINTS, len(best))))
        if len(points):
            lengths = _trace(aim.shape, points, sign)
            if lengths.min() < length:
                best, length = points[np.argmin(lengths)], float(lengths.min())
        reach *= SHRINK
    return length, float(best[0]) + (length if sign > 0 else 0.0)


def _trace(shape: Shape, points: np.ndarray, sign: float) -> np.ndarray:
    """Return how far each of `points` is from `shape` along x, infinite where it passes by."""
    low, high = shape.bounds()
    scale = max(shape.extent())
    end = np.abs((high if sign > 0 else low)[0] - points[:, 0]) + scale
    length = np.zeros(len(points))
    running = np.arange(len(points))
    for _ in range(TRACES):
        at = points[running].copy()
        at[:, 0] += sign * length[running]
        d = shape.distance(at)
        running, d = running[d > 1e-9 * scale], d[d > 1e-9 * scale]
        length[running] += d
        running = running[length[running] <= end[running]]
        if len(running) == 0:
            break
    at = points.copy()
    at[:, 0] += sign * length
    return np.where(shape.distance(at) < 1e-5 * scale, length, np.inf)


def _between_particles(first: Solid, second: Solid) -> float:
    """Return how far the particles of `first` may move until two are `NEAREST` each other."""
    from scipy.spatial import cKDTree

    reach = NEAREST * (first.spacing + second.spacing) / 2
    skins = [solid.positions[solid.shape.distance(solid.positions) > -1.5 * solid.spacing] for solid in (first, second)]
    if len(skins[0]) == 0 or len(skins[1]) == 0:
        return np.inf
    trees = [cKDTree(skin[:, 1:]) for skin in skins]
    pairs = trees[0].query_ball_tree(trees[1], reach)
    one = np.repeat(np.arange(len(pairs)), [len(p) for p in pairs])
    if len(one) == 0:
        return np.inf
    other = np.concatenate([np.asarray(p, dtype=int) for p in pairs])
    apart = skins[1][other] - skins[0][one]
    beside = np.minimum((apart[:, 1:] ** 2).sum(axis=1), reach**2)
    return float((apart[:, 0] - np.sqrt(reach**2 - beside)).min())


def on_surface(shape: Shape, points: np.ndarray) -> np.ndarray:
    """Return `points` (n, dim) moved to the surface; those that do not reach it are left out."""
    scale = max(shape.extent())
    points = points.copy()
    for _ in range(8):
        d = shape.distance(points)
        points -= d[:, None] * shape.outward(points, 1e-7 * scale)
    return points[np.abs(shape.distance(points)) < 1e-6 * scale]
