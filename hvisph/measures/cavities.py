"""Cavities: voids in the projectile, and inner and outer radius of a hollow body."""

from dataclasses import dataclass

import numpy as np
import scipy

from .impact_geometry import PROJECTILE, members
from .measurement_frame import Scene
from .result import Outcomes, Result, UndefinedMeasureError, measures

CELLS_PER_SPACING = 3  # grid dx/3
CLOSING_RADIUS = 5.0  # [dx]
MOST_CELLS = 60_000_000  # above it the distance transforms would need several GB


@measures("run", "void_fraction")
def void_fraction(scene: Scene) -> Result:
    """Return the area fraction of voids within the outline of the projectile's main body.

    Discs of radius dx about the particles are drawn on a grid of dx/3. The outline is their morphological closing with
    a disc of radius 5 dx, its holes filled. Below 0.07 a body is sound. As many of the largest cavities as the body had
    at the start are not counted. The scatter is half a grid cell along the outline's edge, over its area.
    """
    position = scene.position[scene.projectile]
    start = np.empty((0, 2))  # where it is not known
    if scene.start is not None:
        start = scene.start.fields["position"][np.isin(scene.start.id, scene.state.id[scene.projectile])]
    if any(np.prod(3.0 * np.ptp(x, axis=0) / scene.spacing + 40.0) > MOST_CELLS for x in (position, start) if len(x)):
        raise UndefinedMeasureError("the projectile's main body is too wide for a grid of dx/3")
    outline, voids = _voids(position, scene.spacing)
    cavities = len(_cavities(*_voids(start, scene.spacing))) if len(start) else 0
    if cavities:
        initial_voids = np.isin(scipy.ndimage.label(voids)[0], _cavities(outline, voids)[:cavities])
        outline, voids = outline & ~initial_voids, voids & ~initial_voids
    area = int(outline.sum())
    edge = area - int(scipy.ndimage.binary_erosion(outline).sum())
    return Result(float(voids.sum()) / area, scatter=0.5 * edge / area)


def _voids(position: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the cells of a body's outline, and those of them that no particle covers."""
    covered = _draw_discs(position, spacing / CELLS_PER_SPACING, spacing)
    reach = CLOSING_RADIUS * CELLS_PER_SPACING
    dilated = scipy.ndimage.distance_transform_edt(~covered) <= reach
    closed = scipy.ndimage.distance_transform_edt(dilated) > reach
    outline = scipy.ndimage.binary_fill_holes(closed | covered)
    return outline, outline & ~covered


def _cavities(outline: np.ndarray, voids: np.ndarray) -> np.ndarray:
    """Return the labels of voids within the outline that are as wide as dx or more, the largest first."""
    labels = scipy.ndimage.label(voids)[0]
    sizes = np.bincount(labels.ravel())[1:]
    sizes[np.setdiff1d(labels[scipy.ndimage.binary_dilation(~outline)], 0) - 1] = 0
    order = np.argsort(-sizes, kind="stable")
    return 1 + order[sizes[order] >= 0.25 * np.pi * CELLS_PER_SPACING**2]


def _draw_discs(position: np.ndarray, cell: float, radius: float) -> np.ndarray:
    """Return the grid cells whose centre is within `radius` of a particle, with a margin for the closing."""
    margin = int(CLOSING_RADIUS * CELLS_PER_SPACING) + CELLS_PER_SPACING + 3
    place = (position - position.min(axis=0)) / cell + margin
    shape = np.ceil(place.max(axis=0)).astype(int) + margin + 1
    covered = np.zeros(shape, dtype=bool)
    nearest = np.rint(place).astype(int)
    reach = int(np.ceil(radius / cell)) + 1
    steps = range(-reach, reach + 1)
    for i in steps:
        for j in steps:
            node = nearest + np.array([i, j])
            # the tolerance keeps cells on a disc's edge, for any shift of the body
            inside = ((node - place) ** 2).sum(axis=1) <= (radius / cell) ** 2 * (1.0 + 1e-9)
            covered[node[inside, 0], node[inside, 1]] = True
    return covered


HOLLOW_SHARE = 0.2  # share of the outer radius within which a hollow body has no particles
BULK_SPEED_SHARE = 0.1  # mean velocity over root-mean-square speed above which a body moves as a whole
BISECTIONS = 60


@dataclass(frozen=True)
class _Shell:
    """A hollow body: its number, the axes across which it is hollow, and whether it is a sphere."""

    body: int
    axes: tuple[int, ...]
    sphere: bool


@measures("run", "inner_radius", "outer_radius")
def radii(scene: Scene) -> Outcomes:
    """Return inner and outer radius of the shell's largest fragment, undefined if that no longer surrounds it [m]."""
    shell = _find_shell(scene)
    fragments = scene.fragments(shell.body)
    rows, all_rows = fragments[0].particles, np.concatenate([fragment.particles for fragment in fragments])
    mass, lateral = scene.state.fields["mass"], scene.position[:, shell.axes]
    centre = np.average(lateral[all_rows], axis=0, weights=mass[all_rows])
    mass, flat = mass[rows], lateral[rows] - np.average(lateral[rows], axis=0, weights=mass[rows])
    offset = np.hypot.reduce(np.average(lateral[rows] - centre, axis=0, weights=mass))
    if offset > HOLLOW_SHARE * np.hypot.reduce(lateral[rows] - centre, axis=1).mean():
        raise UndefinedMeasureError("the hollow body has broken: its largest fragment lies beside the middle")
    volume = float((mass / scene.state.fields["density"][rows]).sum())
    axial = [axis for axis in range(scene.state.dimensions) if axis not in shell.axes]
    for axis in axial:
        volume /= float(np.ptp(scene.position[rows, axis])) + scene.spacing
    square = float(np.average((flat**2).sum(axis=1), weights=mass)) + _particle_spread(scene, rows, len(shell.axes))
    inner, outer = np.sqrt(max(square - volume / (2.0 * np.pi), 0.0)), np.sqrt(square + volume / (2.0 * np.pi))
    if shell.sphere:
        inner, outer = _sphere_radii(volume, square)
    return {"inner_radius": float(inner), "outer_radius": float(outer)}


def _particle_spread(scene: Scene, rows: np.ndarray, axes: int) -> float:
    """Return the mean square of distances within a particle [m^2], from its present volume where that is a cell."""
    if scene.shot.whole.revolution:
        axes += 1  # the curvature of the circumference counts as a direction
        return axes * scene.spacing**2 / 12.0
    size = scene.state.fields["mass"][rows] / scene.state.fields["density"][rows]
    return float(axes * np.mean(size ** (2.0 / scene.state.dimensions)) / 12.0)


def _sphere_radii(volume: float, square: float) -> tuple[float, float]:
    cube = 0.75 * volume / np.pi  # b^3 - a^3
    low, high = 0.0, float(np.sqrt(square / 0.6))
    for _ in range(BISECTIONS):
        inner = 0.5 * (low + high)
        outer = (inner**3 + cube) ** (1.0 / 3.0)
        low, high = (inner, high) if 0.6 * (outer**5 - inner**5) / cube < square else (low, inner)
    inner = 0.5 * (low + high)
    return inner, float((inner**3 + cube) ** (1.0 / 3.0))


def _find_shell(scene: Scene) -> _Shell:
    """Return the hollow body; raises `UndefinedMeasureError` where there is none."""
    start = scene.start
    if start is None or not {"velocity", "mass"} <= start.fields.keys() or "density" not in scene.state.fields:
        raise UndefinedMeasureError("a single snapshot does not contain the initial shell")
    rows = members(start, scene.shot.roles, PROJECTILE)
    mass, velocity = start.fields["mass"][rows], start.fields["velocity"][rows]
    speed = np.sqrt(np.average((velocity**2).sum(axis=1), weights=mass))
    if np.sqrt((np.average(velocity, axis=0, weights=mass) ** 2).sum()) > BULK_SPEED_SHARE * speed:
        raise UndefinedMeasureError("a body flies as a whole")
    for body in start.present:
        position, weight = start.fields["position"][start.body == body], start.fields["mass"][start.body == body]
        for axes in _hollow_axes(scene):
            flat = position[:, axes]
            distance = np.sqrt(((flat - np.average(flat, axis=0, weights=weight)) ** 2).sum(axis=1))
            if distance.min() > HOLLOW_SHARE * distance.max() and scene.fragments(body):
                return _Shell(body, axes, len(axes) + scene.shot.whole.revolution == 3)
    raise UndefinedMeasureError("no body is hollow")


def _hollow_axes(scene: Scene) -> list[tuple[int, ...]]:
    """Return the axes across which a body may be hollow: of a ring in the plane, of a tube, of a sphere."""
    if scene.shot.whole.revolution:
        return [(1,), (0, 1)]
    if scene.state.dimensions == 2:
        return [(0, 1)]
    return [(1, 2), (0, 2), (0, 1), (0, 1, 2)]
