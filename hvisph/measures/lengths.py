"""Crater, extension, penetration, plug and lip, as the papers on the impact of a cylinder on a plate define them.

All of them are taken between particle centres: the material's surface lies half a spacing further out. In 3D the
distance from the shot line takes the place of the side of it, and diameters are twice radii.

Plug and lip follow Young 2021 sec. 3.3. The plug is the largest group of the target of five particles or more that
holds nothing of its rim and flies on. Its width is its extent across the shot line, between the centres of its
particles; Young 2021 gives no definition, and no other one fits its numbers. The lip is the front-most attached
particles within two projectile widths of the shot line: as many as go around a circle of that width in 3D, ten in 2D.
"""

import math

import numpy as np

from .fragments import FEWEST_PARTICLES
from .impact_geometry import PROJECTILE, members, own_spacings
from .measurement_frame import Scene
from .perforation import NO, NOT_YET, layer_state
from .result import Outcomes, Result, UndefinedMeasureError, measures, refuse_if

CRATER_BIN = 0.25e-3  # [m], along the plate's thickness
AXIS_STRIP = 1.0e-3  # [m], half-width of the strip about the shot line
LIP_PARTICLES = {2: 5, 3: 40}  # front-most attached particles: of each side in 2D, all round in 3D
LIP_REACH = 2.5  # [projectile widths]; largest distance of a lip from the shot line
LAYER_TOLERANCE = 1e-6  # [dx]; largest difference of x within a layer of particles
FRONT_PARTICLES = 10  # of the lip in 2D
UNCOUNTED_SHARE = 0.01  # failed mass fraction of the target above which fragments may be missed
OBLIQUE = 0.05  # angle of a plate's normal to the shot line beyond which these measures are undefined [rad]


@measures("run", "crater_diameter", "crater_diameter_min", needs=("layer",))
def crater_diameter(scene: Scene) -> Outcomes:
    """Return the crater's mean diameter and its minimum [m].

    The inner edge of the target's main body on each side of the shot line is taken in bins over the plate's original
    thickness, 0.25 mm each (a quarter of a thin plate; dx where that is coarser). The edges of the two sides added are
    a bin's diameter.
    """
    require_normal_impact(scene)
    diameter = _bin_diameters(scene)
    refuse_if(len(diameter) == 0, "the target has left the place of the plate")
    mean = Result(float(diameter.mean()), scatter=standard_error(diameter))
    return {"crater_diameter": mean, "crater_diameter_min": float(diameter.min())}


@measures("run", "crater_lip_diameter", needs=("layer",))
def crater_lip_diameter(scene: Scene) -> Result:
    """Return the distance between the five front-most particles of the two sides of the target [m].

    They are within 2.5 projectile widths of the shot line, since a film of the target on the projectile is
    attached, too; on a flat face they are those at the hole.
    """
    require_hole(scene)
    means, errors = [], []
    for side in scene.target_sides:
        candidates = side[scene.radius[side] < LIP_REACH * scene.width]
        refuse_if(len(candidates) == 0, "no attached particle of the target is near the shot line")
        radius = scene.radius[_front_most(scene, candidates, LIP_PARTICLES[scene.state.dimensions])]
        means.append(radius.mean())
        errors.append(standard_error(radius))
    share = 2.0 / len(means)
    return Result(float(share * sum(means)), scatter=share * float(np.hypot.reduce(errors)))


@measures("run", "extension")
def extension(scene: Scene) -> Result:
    """Return the length of the projectile's main body along the shot line [m].

    Within 1 mm of the shot line (a fifth of a narrow projectile; 2 dx where that is coarser), in bins of 2 dx across
    it, the median of the bins' largest x less the median of their smallest.
    """
    half_width = max(min(AXIS_STRIP, 0.2 * scene.width), 2.0 * scene.spacing)
    three_d = scene.state.dimensions == 3
    lateral = scene.radius[scene.projectile] if three_d else scene.lateral[scene.projectile, 0]
    low = 0.0 if three_d else -half_width
    inside = (lateral >= low) & (lateral < half_width)
    refuse_if(not inside.any(), "the projectile's main body has left the shot line")
    number = max(1, round((half_width - low) / (2.0 * scene.spacing)))
    bins = np.minimum(((lateral[inside] - low) * number / (half_width - low)).astype(int), number - 1)
    x = scene.position[scene.projectile[inside], 0]
    rear, front = np.full(number, np.inf), np.full(number, -np.inf)
    np.minimum.at(rear, bins, x)
    np.maximum.at(front, bins, x)
    rear, front = rear[np.isfinite(rear)], front[np.isfinite(rear)]
    scatter = float(np.hypot(standard_error(rear), standard_error(front)))
    return Result(float(np.median(front) - np.median(rear)), scatter=scatter)


@measures("run", "penetration", needs=("layer",))
def penetration(scene: Scene) -> Result:
    """Return how deep the main body is [m], 99 % quantile of x; its scatter is half of that from 98.5 to 99.5 %."""
    low, value, high = np.quantile(scene.position[scene.projectile, 0], [0.985, 0.99, 0.995])
    return Result(float(value - scene.face), scatter=float(0.5 * (high - low)))


def require_normal_impact(scene: Scene) -> None:
    """Raise `UndefinedMeasureError` where the first layer is oblique: its own measures are along its normal."""
    plate = scene.plate(scene.target)
    if plate is not None and plate.obliquity > OBLIQUE:
        oblique = f"'{scene.name(scene.target)}' is oblique by {math.degrees(plate.obliquity):.3g} degrees"
        raise UndefinedMeasureError(f"{oblique}: the layer's own measures are along its normal")


def require_hole(scene: Scene) -> None:
    """Raise `UndefinedMeasureError` where the first layer has no hole with a lip along the shot line."""
    require_normal_impact(scene)
    state = layer_state(scene, scene.target).state
    if state in (NO, NOT_YET):
        suffix = " yet" if state == NOT_YET else ""
        raise UndefinedMeasureError(f"'{scene.name(scene.target)}' is not perforated{suffix}: there is no hole's lip")


def length_of(scene: Scene, x: np.ndarray) -> float:
    """Return the length [m] of a projectile with particles at `x`, to the faces of its first and last layer."""
    return float(np.ptp(x)) + 0.5 * sum(end_layers(scene))


def initial_length(scene: Scene) -> float:
    """Return the initial length of the projectile [m]; the start must be known."""
    assert scene.start is not None
    rows = members(scene.start, scene.shot.roles, PROJECTILE)
    return length_of(scene, scene.start.fields["position"][rows, 0])


def end_layers(scene: Scene) -> tuple[float, float]:
    """Return the thickness of the projectile's first and last layer along x at the start [m]: dx unless graded."""
    spacing, start = scene.spacing, scene.start
    if start is None:
        return spacing, spacing
    rows = np.flatnonzero(members(start, scene.shot.roles, PROJECTILE))
    if np.ndim(own_spacings(start, rows, spacing)) == 0:
        return spacing, spacing
    x = np.sort(start.fields["position"].reshape(start.count, -1)[rows, 0])
    gaps = np.diff(x)[np.diff(x) > LAYER_TOLERANCE * spacing]
    if len(gaps) < 2 or gaps.min() < 0.5 * spacing:  # no layers
        return spacing, spacing
    ends = [2.0 * gap * gap / (gap + following) for gap, following in (gaps[:2], gaps[:-3:-1])]
    return float(ends[0]), float(ends[1])


def _bin_diameters(scene: Scene) -> np.ndarray:
    """Return diameters of the bins over the thickness in which every side has particles, shape (bins,) [m]."""
    width = max(min(CRATER_BIN, 0.25 * scene.thickness), scene.spacing)
    number = max(1, round(scene.thickness / width))
    x = (scene.position[:, 0] - scene.face) * number / scene.thickness
    bins = np.where((x >= 0.0) & (x < number), x, -1.0).astype(int)
    if scene.state.dimensions == 3:
        return np.array([edge for edge in _round_edges(scene, bins, number) if np.isfinite(edge)])
    edges = np.full((len(scene.target_sides), number), np.inf)
    for edge, side in zip(edges, scene.target_sides, strict=True):
        rows = side[bins[side] >= 0]
        np.minimum.at(edge, bins[rows], scene.radius[rows])
    diameter = edges.sum(axis=0) * (2.0 / len(edges))  # one side of a half model stands for both
    return diameter[np.isfinite(diameter)]


def _round_edges(scene: Scene, bins: np.ndarray, number: int) -> list[float]:
    """Return twice the mean edge radius [m] per bin, over sectors of 4 dx: no single stray particle decides."""
    side = scene.target_sides[0]
    edges = []
    for k in range(number):
        rows = side[bins[side] == k]
        if len(rows) == 0:
            continue
        radius = scene.radius[rows]
        sectors = int(np.clip(2.0 * np.pi * radius.min() / (4.0 * scene.spacing), 1, 32))
        angle = np.arctan2(scene.lateral[rows, 1], scene.lateral[rows, 0])
        sector = np.minimum(((angle / (2.0 * np.pi) + 0.5) * sectors).astype(int), sectors - 1)
        edge = np.full(sectors, np.inf)
        np.minimum.at(edge, sector, radius)
        edges.append(2.0 * float(edge[np.isfinite(edge)].mean()))
    return edges


def _front_most(scene: Scene, candidates: np.ndarray, number: int) -> np.ndarray:
    """Return the `number` particles of `candidates` with the largest x; of a flat face, those at the hole."""
    x = scene.position[candidates, 0]
    limit = np.sort(x)[-min(number, len(x))]
    tie = np.abs(x - limit) <= 1e-6 * scene.spacing
    foremost, level = candidates[(x > limit) & ~tie], candidates[tie]
    level = level[np.argsort(scene.radius[level], kind="stable")]
    return np.concatenate([foremost, level[: number - len(foremost)]])


def standard_error(sample: np.ndarray) -> float:
    """Return the standard error of a sample's mean."""
    return float(sample.std(ddof=1) / np.sqrt(len(sample))) if len(sample) > 1 else 0.0


@measures("run", "plug_velocity", "plug_width", "plug_thickness", needs=("layer", "motion"))
def plug(scene: Scene) -> Outcomes:
    """Return axial velocity [m/s], width and thickness [m] of the plug."""
    number = plug_of(scene)
    if number is None:
        raise UndefinedMeasureError("no group of the target is detached and flies on")
    fragment = scene.fragments(scene.target)[number]
    speed = scene.state.fields["velocity"][fragment.particles, 0]
    return {
        "plug_velocity": Result(float(fragment.velocity[0]), scatter=float(speed.std() / math.sqrt(fragment.count))),
        "plug_width": float(fragment.extent[1:].mean()),
        "plug_thickness": float(fragment.extent[0]),
    }


@measures("run", "impact_diameter", "lip_height", "lip_height_max", needs=("layer", "motion"))
def lip(scene: Scene) -> Outcomes:
    """Return twice the mean radius of the lip, its mean height and its largest height over the rear face [m]."""
    require_hole(scene)
    attached = scene.groups(scene.target).particles_of(scene.attached_groups(scene.target))
    candidates = attached[scene.radius[attached] <= 2.0 * scene.width]
    count = FRONT_PARTICLES if scene.state.dimensions == 2 else round(math.pi * scene.width / scene.spacing)
    refuse_if(len(candidates) < count, "too few particles of the plate are left near the shot line")
    x = scene.position[candidates, 0]
    front = np.lexsort((scene.radius[candidates], -x))[:count]  # by radius where they are level
    heights = x[front] - scene.face - scene.thickness
    radii = scene.radius[candidates[front]]
    error = 1.0 / math.sqrt(count)
    return {
        "impact_diameter": Result(2.0 * float(radii.mean()), scatter=2.0 * float(radii.std()) * error),
        "lip_height": Result(float(heights.mean()), scatter=float(heights.std()) * error),
        "lip_height_max": float(heights.max()),
    }


@measures("run", "target_fragments", needs=("layer", "motion"))
def target_fragments(scene: Scene) -> Result:
    """Return the number of detached fragments of the first layer, with a note on failed mass that is not."""
    groups, attached = scene.groups(scene.target), scene.attached_groups(scene.target)
    damage, note = scene.state.fields.get("damage"), ""
    if damage is not None:
        rows = groups.particles_of(attached)
        mass = scene.state.fields["mass"]
        share = float(mass[rows][damage[rows] >= 1.0].sum()) / max(float(mass[scene.is_target].sum()), 1e-300)
        if share > UNCOUNTED_SHARE:
            note = f"{100.0 * share:.2g} % of its mass has failed and is not detached: rubble is not counted"
    return Result(float((~attached & (groups.counts >= FEWEST_PARTICLES)).sum()), note=note)


def plug_of(scene: Scene) -> int | None:
    """Return the number of the target's fragment that is the plug; None where nothing is detached and flies on."""
    if scene.state.dimensions == 1 or not scene.has_target:
        return None
    target = scene.fragments(scene.target)
    # a velocity that is not known, or not finite, does not rule a fragment out
    large = target.groups.counts >= FEWEST_PARTICLES
    flies = ~scene.attached_groups(scene.target) & large & ~(target.velocities[:, 0] <= 0.0)
    return int(np.argmax(flies)) if flies.any() else None
