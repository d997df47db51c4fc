"""Bars and rods: what a Taylor bar has become on its wall, and how deep a rod got.

A bar is the projectile where nothing but a rigid wall, or another body that is no wider than it, is in its way. All is
measured on the largest piece along the shot line, the foot being where it flies to.

Diameters are those of the solid section that spreads its mass as far from its middle as the particles do,

    D = D0 (r/r0),    r^2 = sum m (y - <y>)^2 / sum m  in a slice of one spacing,

r0 and D0 those of the start, D0 from the bar's volume and length. So no single particle decides, and the spacing
drops out. The foot surface is half of a particle's present thickness, dx (D0/D)^2, before the foremost particle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvisph.core.measure_catalogue import CATALOGUE
from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.frame.roles import PROJECTILE, members
from hvisph.measures.lengths import end_layers, length_of
from hvisph.measures.result import Result, meaningless
from hvisph.measures.target.targets import LayerMeasures

BAR = ("final_length", "length_ratio", "foot_diameter", "diameter_at_fifth", "undeformed_length")
WIDER = 1.5  # times the bar's width; what is wider in its way is a plate
SWOLLEN = 1.01  # times the first diameter; a section that is wider has been deformed
FOOT = 0.75  # [dx]; the layer of particles at the foot
FEWEST = 2  # particles of a slice
HALF = 0.5  # share of the mass below which the largest piece does not stand for the bar


@dataclass(frozen=True)
class Bar:
    """A bar's measures and its outline.

    Parameters
    ----------
    results
        By name; values in SI.
    profile
        ``distance`` from the foot's surface and ``diameter`` there [m], from the foot on; empty where it is no bar.
    """

    results: dict[str, Result]
    profile: dict[str, list[float]]


def bar(scene: Scene) -> Bar:
    """Measure what a bar has become; where the projectile is none, all carry the reason."""
    reason = _no_bar(scene)
    if reason:
        return Bar({name: meaningless(CATALOGUE[name].unit, reason) for name in BAR}, {})
    assert scene.start is not None
    rows = members(scene.start, scene.shot.roles, PROJECTILE)
    before = scene.start.fields["position"][rows]
    first = _section(before[:, 1:], scene.start.fields["mass"][rows])
    length = length_of(scene, before[:, 0])
    volume = float((scene.start.fields["mass"][rows] / scene.start.fields["density"][rows]).sum())
    width = volume / length if scene.space == 2 else float(np.sqrt(4.0 * volume / length / np.pi))
    main = scene.projectile
    x, mass = scene.position[main, 0], scene.now.fields["mass"][main]
    across = scene.position[main, 1:]

    def diameter(chosen: np.ndarray) -> float:
        return width * _section(across[chosen], mass[chosen]) / first

    foot = diameter(x > x.max() - FOOT * scene.spacing)
    power = 1.0 if scene.space == 2 else 2.0
    spread = min((width / foot) ** power, 1.0) if foot > 0.0 else 1.0  # a tip may be one particle
    surface = float(x.max()) + 0.5 * scene.spacing * spread
    final = surface - float(x.min()) + 0.5 * end_layers(scene)[0]
    distance, profile = [0.0], [foot]
    number = np.floor((surface - x) / scene.spacing).astype(int)
    for k in np.unique(number):
        chosen = number == k
        if chosen.sum() >= FEWEST:
            distance.append(float(np.average(surface - x[chosen], weights=mass[chosen])))
            profile.append(diameter(chosen))
    outline = {"distance": distance, "diameter": profile}
    free = _undeformed(np.array(distance), np.array(profile), width, final)
    return Bar({
        "final_length": _length(scene, final),
        "length_ratio": Result(final / length, "", scene.spacing / length),
        "foot_diameter": _length(scene, foot),
        "diameter_at_fifth": _length(scene, float(np.interp(0.2 * length, distance, profile))),
        "undeformed_length": _length(scene, free),
    }, outline)  # fmt: skip


def penetration_ratio(scene: Scene, layers: tuple[LayerMeasures, ...]) -> Result:
    """Return P/L: the depth of the first layer's crater over the length that the projectile had."""
    if scene.start is None or scene.now.dimensions == 1 or not layers:
        return meaningless("", "there is no layer whose start is known")
    depth = layers[0].results["crater_depth"]
    if depth.value is None:
        return meaningless("", depth.reason)
    rows = members(scene.start, scene.shot.roles, PROJECTILE)
    length = length_of(scene, scene.start.fields["position"][rows, 0])
    return Result(depth.value / length, "", (depth.uncertainty or 0.0) / length)


def _no_bar(scene: Scene) -> str:
    """Return why the projectile is no bar; empty where it is one."""
    if scene.now.dimensions == 1:
        return "not told in 1D"
    needed = {"velocity", "mass", "density"}
    if scene.start is None or not needed <= scene.start.fields.keys() or "mass" not in scene.now.fields:
        return "a single snapshot does not tell the bar before it struck"
    rows = members(scene.start, scene.shot.roles, PROJECTILE)
    mass, velocity = scene.start.fields["mass"][rows], scene.start.fields["velocity"][rows]
    mean = np.average(velocity, axis=0, weights=mass)
    if not mean[0] > 0.5 * np.sqrt(np.average((velocity**2).sum(axis=1), weights=mass)):
        return "the projectile does not fly at anything as a whole"
    own = float(np.ptp(scene.start.fields["position"][rows, 1]))
    if scene.has_target:
        across = scene.start.fields["position"][scene.start.body == scene.target, 1]
        if np.ptp(across) > WIDER * own + scene.spacing:
            return "no bar on a rigid wall or on its like"
    share = mass_share(scene)
    return "" if share >= HALF else f"the bar's largest piece holds {100.0 * share:.2g} % of its mass"


def mass_share(scene: Scene) -> float:
    """Return the share of the projectile's mass in its largest piece."""
    mass = scene.now.fields["mass"]
    return float(mass[scene.projectile].sum() / (scene.shot_mass or mass[scene.is_projectile].sum()))


def _section(across: np.ndarray, mass: np.ndarray) -> float:
    """Return the root of the mass mean of the squared distance from the middle [m]."""
    middle = np.average(across, axis=0, weights=mass)
    return float(np.sqrt(np.average(((across - middle) ** 2).sum(axis=1), weights=mass)))


def _undeformed(distance: np.ndarray, diameter: np.ndarray, width: float, final: float) -> float:
    """Return the length from the rear over which the diameter is less than `SWOLLEN` of the first [m]."""
    wide = np.flatnonzero(diameter > SWOLLEN * width)
    if len(wide) == 0:
        return final
    last = wide[-1]
    if last + 1 >= len(diameter):
        return 0.0
    level = SWOLLEN * width
    share = (diameter[last] - level) / (diameter[last] - diameter[last + 1])
    return float(final - (distance[last] + share * (distance[last + 1] - distance[last])))


def _length(scene: Scene, value: float) -> Result:
    return Result(value, "m", scene.spacing, spacing=scene.spacing, support=scene.support)
