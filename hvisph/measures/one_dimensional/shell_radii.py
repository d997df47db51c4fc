"""Hollow bodies that close or open: a shell's inner and outer radius.

A shell is the first hollow body of a shot in which no body flies at another as a whole: a ring, sphere or tube that
closes or bursts. Its radii follow from two sums over its largest piece, its volume (per length) and the mass mean of
the squared distance from its middle, which are those of the round shell

    ring, tube   V = pi (b^2 - a^2),           <r^2> = (a^2 + b^2)/2
    sphere       V = 4 pi/3 (b^3 - a^3),       <r^2> = 3/5 (b^5 - a^5)/(b^3 - a^3)

so that no single particle decides. The distance is completed by that within a particle, of which each of d
directions has dx^2/12.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.frame.roles import PROJECTILE, members
from hvisph.measures.result import Result, meaningless

RADII = ("inner_radius", "outer_radius")
HOLLOW = 0.2  # share of the greatest distance from the middle within which a hollow body has nothing
AS_A_WHOLE = 0.1  # share of the root-mean-square speed that the mean velocity of a body that flies as a whole has
HALVINGS = 60


@dataclass(frozen=True)
class _Shell:
    """A hollow body: its number, the axes across which it is hollow, and whether it is a sphere."""

    body: int
    axes: tuple[int, ...]
    sphere: bool


def radii(scene: Scene) -> dict[str, Result]:
    """Return inner and outer radius [m] of the shell, or why there is none."""
    shell = _shell(scene)
    if isinstance(shell, str):
        return {name: meaningless("m", shell) for name in RADII}
    rows = scene.fragments(shell.body)[0].particles
    mass = scene.now.fields["mass"][rows]
    flat = scene.position[rows][:, shell.axes]
    flat = flat - np.average(flat, axis=0, weights=mass)
    volume = float((mass / scene.now.fields["density"][rows]).sum())
    along = [axis for axis in range(scene.now.dimensions) if axis not in shell.axes]
    for axis in along:
        volume /= float(np.ptp(scene.position[rows, axis])) + scene.spacing
    square = float(np.average((flat**2).sum(axis=1), weights=mass)) + _within(scene, rows, len(shell.axes))
    inner, outer = (_sphere if shell.sphere else _ring)(volume, square)
    return {"inner_radius": _length(scene, inner), "outer_radius": _length(scene, outer)}


def _within(scene: Scene, rows: np.ndarray, axes: int) -> float:
    """Return the mean square of distances within a particle [m^2], from its present volume where that is a cell."""
    if scene.shot.whole.revolution:
        axes += 1  # a ring's own curvature counts as a direction
        return axes * scene.spacing**2 / 12.0
    size = scene.now.fields["mass"][rows] / scene.now.fields["density"][rows]
    return float(axes * np.mean(size ** (2.0 / scene.now.dimensions)) / 12.0)


def _ring(area: float, square: float) -> tuple[float, float]:
    half = area / (2.0 * np.pi)
    return float(np.sqrt(max(square - half, 0.0))), float(np.sqrt(square + half))


def _sphere(volume: float, square: float) -> tuple[float, float]:
    cube = 0.75 * volume / np.pi  # b^3 - a^3
    low, high = 0.0, float(np.sqrt(square / 0.6))
    for _ in range(HALVINGS):
        inner = 0.5 * (low + high)
        outer = (inner**3 + cube) ** (1.0 / 3.0)
        if 0.6 * (outer**5 - inner**5) / cube < square:
            low = inner
        else:
            high = inner
    inner = 0.5 * (low + high)
    return inner, float((inner**3 + cube) ** (1.0 / 3.0))


def _shell(scene: Scene) -> _Shell | str:
    """Return the hollow body, or why there is none."""
    start = scene.start
    if scene.now.dimensions == 1:
        return "not told in 1D"
    if start is None or not {"velocity", "mass"} <= start.fields.keys() or "density" not in scene.now.fields:
        return "a single snapshot does not tell the shell at the start"
    rows = members(start, scene.shot.roles, PROJECTILE)
    mass, velocity = start.fields["mass"][rows], start.fields["velocity"][rows]
    speed = np.sqrt(np.average((velocity**2).sum(axis=1), weights=mass))
    if np.sqrt((np.average(velocity, axis=0, weights=mass) ** 2).sum()) > AS_A_WHOLE * speed:
        return "a body flies as a whole: no shell"
    for body in start.present:
        position, weight = start.fields["position"][start.body == body], start.fields["mass"][start.body == body]
        for axes in _ways(scene):
            flat = position[:, axes]
            distance = np.sqrt(((flat - np.average(flat, axis=0, weights=weight)) ** 2).sum(axis=1))
            if distance.min() > HOLLOW * distance.max() and scene.fragments(body):
                return _Shell(body, axes, len(axes) + scene.shot.whole.revolution == 3)
    return "no body is hollow"


def _ways(scene: Scene) -> list[tuple[int, ...]]:
    """Return the axes across which a body may be hollow: of a ring in the plane, of a tube, of a sphere."""
    if scene.shot.whole.revolution:
        return [(1,), (0, 1)]
    if scene.now.dimensions == 2:
        return [(0, 1)]
    return [(1, 2), (0, 2), (0, 1), (0, 1, 2)]


def _length(scene: Scene, value: float) -> Result:
    return Result(value, "m", scene.spacing, spacing=scene.spacing, support=scene.support)
