"""Damage of a layer: hole, crater, bulge, lips, spall and mass loss.

Lengths are from surface to surface, the surface being half a spacing outside the outermost particles; depths and
heights are along the layer's own normal. All are measured on the part that is attached to the rim.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy

from .debris import gravity_towards_layer
from .fragments import FEWEST_PARTICLES, NEAREST_LINK, connected_groups
from .impact_geometry import own_spacings
from .measurement_frame import Scene, memoize
from .perforation import YES, layer_state
from .result import Outcome, Outcomes, Result, measures, refuse_if
from .target_geometry import RIM_SHARE, Plate, front_surface, place_of

CENTRING_ITERATIONS = 8  # for the centroid of an opening
FEWEST_SECTORS, MOST_SECTORS = 8, 128
BORDER_WIDTH = 1e-7  # [sectors]; a particle nearer to the border of two sectors belongs to both


@dataclass(frozen=True)
class Opening:
    """An opening at one depth."""

    # distances from centre to edge (k,) [m], one for each sector; sector i is opposite to sector i + k/2
    radii: np.ndarray
    centre: np.ndarray  # of the opening in the plane, shape (dim - 1,) [m]

    @property
    def diameters(self) -> np.ndarray:
        """Diameters in different directions, shape (k / 2,) [m]."""
        half = len(self.radii) // 2
        return np.asarray(self.radii[:half] + self.radii[half:])

    @property
    def area(self) -> float:
        """Area within the edge [m^2]; in 3D only."""
        return float(np.pi * (self.radii**2).mean())


def opening(lateral: np.ndarray, centre: np.ndarray, spacing: float) -> Opening | None:
    """Return the opening about `centre` among particles at `lateral` [m]; None where they do not enclose one."""
    centre = np.array(centre, dtype=float)
    radii, number = np.zeros(0), FEWEST_SECTORS
    for _ in range(CENTRING_ITERATIONS):
        radii_found = _radii(lateral - centre, number)
        if radii_found is None:
            return None
        radii = np.maximum(radii_found - 0.5 * spacing, 0.0)
        centre += _centroid(radii, lateral.shape[1])
        number = int(np.clip(np.pi * radii_found.mean() / spacing, FEWEST_SECTORS, MOST_SECTORS)) // 8 * 8
        # particles far outside the edge are no part of it
        lateral = lateral[((lateral - centre) ** 2).sum(axis=1) <= (2.5 * radii_found.max() + 4.0 * spacing) ** 2]
    return Opening(radii, centre)


def openings(plate: Plate, depth: np.ndarray, lateral: np.ndarray, spacing: float) -> list[Opening]:
    """Return the enclosed openings in slices from the struck to the rear face of the undeformed plate."""
    number = max(1, round(plate.thickness / max(spacing, plate.thickness / 8.0)))
    bins = np.floor(depth * number / plate.thickness + 1e-9).astype(int)
    holes, basis = [], np.array(plate.basis)
    for k in range(number):
        on_line = (k + 0.5) / number * plate.thickness * basis[1:, 0] / basis[0, 0]  # where the shot line is
        enclosed = opening(lateral[bins == k], on_line, spacing)
        if enclosed is not None:
            holes.append(enclosed)
    return holes


def _radii(lateral: np.ndarray, number: int) -> np.ndarray | None:
    """Return the least distance from the origin in each of `number` sectors; None where nothing is enclosed."""
    if len(lateral) == 0:
        return None
    if lateral.shape[1] == 1:
        low, high = lateral[lateral[:, 0] < 0.0, 0], lateral[lateral[:, 0] >= 0.0, 0]
        return np.array([high.min(), -low.max()]) if len(low) and len(high) else None
    radius = np.sqrt((lateral**2).sum(axis=1))
    place = np.arctan2(lateral[:, 1], lateral[:, 0]) / (2.0 * np.pi) * number
    edge = np.full(number, np.inf)
    for shift in (-BORDER_WIDTH, BORDER_WIDTH):
        np.minimum.at(edge, np.floor(place + shift).astype(int) % number, radius)
    gaps = ~np.isfinite(edge)
    if not gaps.any():
        return edge
    neighbours = np.roll(edge, 1), np.roll(edge, -1)
    edge[gaps] = 0.5 * (neighbours[0] + neighbours[1])[gaps]
    return edge if np.isfinite(edge).all() else None


def _centroid(radii: np.ndarray, lateral: int) -> np.ndarray:
    if lateral == 1:
        return np.array([0.5 * (radii[0] - radii[1])])
    angle = 2.0 * np.pi * (np.arange(len(radii)) + 0.5) / len(radii)
    area = (radii**2).sum()
    if not area > 0.0:
        return np.zeros(2)
    return np.array([(radii**3 * np.cos(angle)).sum(), (radii**3 * np.sin(angle)).sum()]) * (2.0 / 3.0) / area


# Mean diameter of all slices, and diameter of one slice, over the clear width, above which the layer may be bent there.
WIDENING, LOCAL_WIDENING = 1.5, 2.0
BENT_VOLUME_SHARE = 0.8  # least filled share of the volume between clear width and slice of a bent layer


@memoize
def _attached_particles(scene: Scene, plate: Plate) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the attached particles (n,), their depth (n,) and coordinates in the plane (n, dim - 1) [m]."""
    fixed = layer_state(scene, plate.body).attached
    assert fixed is not None
    return fixed, plate.depth(scene.position[fixed]), plate.in_plane(scene.position[fixed])


def _require(scene: Scene, plate: Plate, perforated: bool, reason: str = "the layer is perforated") -> None:
    state = layer_state(scene, plate.body)
    refuse_if((state.state == YES) is not perforated, f"not perforated: {state.reason}" if perforated else reason)


@measures("layer", "hole_diameter", "hole_area")
def hole(scene: Scene, plate: Plate) -> Outcomes:
    """Return diameters and the mean area of the hole in slices of the layer's original thickness [m], [m^2].

    Where the layer has bent out of its place at the hole, slices cut it where the bend begins: the clear width along
    the layer's normal is the diameter then.
    """
    _require(scene, plate, perforated=True)
    fixed, depth, lateral = _attached_particles(scene, plate)
    slices = openings(plate, depth, lateral, scene.spacing)
    clear = opening(lateral, np.zeros(lateral.shape[1]), scene.spacing)
    size = float(clear.diameters.mean()) if clear is not None else 0.0
    means = np.array([slice_.diameters.mean() for slice_ in slices])
    variants: dict[str, Outcome] = {"mass_loss": _diameter_by_mass(scene, plate)}
    if not slices or _is_bent(scene, plate, fixed, clear, slices):
        bent = "the layer has bent out of its place at the hole"
        reason = bent if slices else "the rest of the layer does not enclose a hole"
        mean = Result(size, note=f"clear width: {reason}") if slices else reason
        variants |= dict.fromkeys(("min", "max", "front", "rear"), reason)
        return {"hole_diameter": variants | {"mean": mean, "clear": size if slices else reason}, "hole_area": reason}
    area = float(np.mean([slice_.area for slice_ in slices]))
    variants |= {
        "mean": Result(float(means.mean()), scatter=float(means.std(ddof=1)) if len(means) > 1 else 0.0),
        "min": float(min(slice_.diameters.min() for slice_ in slices)),
        "max": float(max(slice_.diameters.max() for slice_ in slices)),
        "front": float(means[0]),
        "rear": float(means[-1]),
        "clear": size if size > 0.0 else "attached matter covers the hole",
    }
    return {"hole_diameter": variants, "hole_area": Result(area, scatter=scene.spacing * float(np.sqrt(np.pi * area)))}


def _is_bent(scene: Scene, plate: Plate, fixed: np.ndarray, clear: Opening | None, slices: list[Opening]) -> bool:
    """Return whether the layer has bent out of its place at the hole: by its edge, or as it is whole within a slice."""
    if clear is None or not clear.diameters.mean() > 0.0:
        return False
    width, inner = float(clear.diameters.mean()), float(clear.radii.max())
    depth, lateral = plate.depth(scene.position[fixed]), plate.in_plane(scene.position[fixed])
    if float(np.mean([slice_.diameters.mean() for slice_ in slices])) > WIDENING * width:
        edge = depth[np.sqrt((lateral**2).sum(axis=1)) < inner + 2.0 * scene.spacing]
        outside = (edge < -0.5 * scene.spacing) | (edge > plate.thickness + 0.5 * scene.spacing)
        if len(edge) and outside.all():
            return True
    sizes = np.broadcast_to(np.asarray(scene.spacings(fixed)) ** scene.state.dimensions, len(fixed))
    radius = np.sqrt(((lateral - clear.centre) ** 2).sum(axis=1))
    for slice_ in slices:
        outer = float(slice_.radii.mean())
        if float(slice_.diameters.mean()) > LOCAL_WIDENING * width and outer > inner:
            flat = scene.state.dimensions == 2
            volume = plate.thickness * (2.0 * (outer - inner) if flat else np.pi * (outer**2 - inner**2))
            if float(sizes[(radius > inner) & (radius < outer)].sum()) > BENT_VOLUME_SHARE * volume:
                return True
    return False


@dataclass(frozen=True)
class Crater:
    """A crater, measured on cells of the plane of the layer."""

    depth: float  # of the deepest cell below the struck face [m]
    volume: Result  # below the struck face [m^3; m^2 in plane 2D], where depth and diameter are uncertain by dx
    diameter: Outcome  # at the level of the struck face [m]
    rim_diameter: Outcome  # between the crests of the rim [m]
    rim_height: float  # of the crest over the struck face [m]
    floor_speed: float  # of the floor into the layer, relative to its rim [m/s]
    bulge: float  # [m]
    time: float  # [s]


EARTH_GRAVITY = 9.81  # [m/s^2], for cases without gravity
CELL = 2.0  # [dx], of the cells of the crater surface
FLOOR_SHARE = 0.8  # of the greatest depth: deeper cells form the floor
FLAT_SHARE = 0.8  # share of its half width up to which the foremost row of a flat face extends
GROWTH_SHARE = 0.1  # share of the depth: a floor that would move further in the time since impact still grows


@memoize
def crater_of(scene: Scene, plate: Plate, emptied: bool = False) -> Crater:
    """Return the crater of a layer that holds.

    Its surface is the foremost attached particle of each cell, but those that fly: above the struck face by 2 dx,
    and so fast that they would have come from there within the time of the run. An `emptied` crater is without
    loose material. Depths below a curved face are from its initial surface.
    """
    _require(scene, plate, perforated=False)
    rows, depth, points = _attached_particles(scene, plate)
    spacing, dx = scene.spacing, np.broadcast_to(scene.spacings(rows), len(rows))
    face = _face_depths(scene, plate)
    half = 0.5 * dx
    if scene.start is not None and isinstance(scene.spacings(rows), np.ndarray):  # the longest edges, also along a face
        place = scene.start.fields["position"][scene.rows_at_start(rows)]
        half = np.minimum(half, np.maximum(plate.depth(place), 0.5 * spacing))
    bulge = float((depth + 0.5 * dx)[~plate.is_beyond(points, RIM_SHARE)].max(initial=0.0)) - plate.thickness
    velocity = scene.state.fields["velocity"][rows] @ np.array(plate.basis[0])
    flies = (depth < -2.0 * spacing) & (velocity * scene.state.time < depth)
    if emptied:
        flies |= _is_loose(scene, plate, rows, velocity)
    rows, depth, points, velocity, dx, half = (values[~flies] for values in (rows, depth, points, velocity, dx, half))
    refuse_if(plate.is_beyond(points, RIM_SHARE).all(), "nothing of the layer is left within its rim")
    depth = depth - face(points)
    surface, mean, middle = front_surface(depth - half, points, dx / spacing, CELL * spacing)
    inner = ~plate.is_beyond(middle, RIM_SHARE)
    surface, mean, middle = surface[inner], mean[inner], middle[inner]
    radius = np.sqrt((middle**2).sum(axis=1))
    deepest = max(float(surface.max()), 0.0)
    if scene.state.dimensions == 2 and scene.space == 3:  # both sides of the section of a solid of revolution
        area = np.pi * radius * CELL * spacing
    else:
        area = np.full(len(radius), (CELL * spacing) ** (scene.state.dimensions - 1))
    hollow = area * np.maximum(mean, 0.0)
    first = (depth > -dx) & (depth < dx)
    place = place_of(plate, scene.position[rows[first]], scene.spacings(rows[first]), spacing)
    place[:, 0] -= face(place[:, 1:])
    place = place[(place[:, 0] >= 0.0) & (place[:, 0] < spacing), 1:]
    mouth = opening(place, np.zeros(place.shape[1]), spacing)
    is_intact = deepest < spacing or mouth is None
    width = 0.0 if is_intact or mouth is None else float(mouth.diameters.mean())
    diameter: Outcome = width or "the struck face is whole"
    rim_diameter: Outcome = "the struck face is whole" if is_intact else "no rim stands out of the struck face"
    crest = 0.0
    if not is_intact:
        centre = hollow @ middle / hollow.sum()
        bins = np.floor(np.sqrt(((middle - centre) ** 2).sum(axis=1)) / (CELL * spacing)).astype(int)
        weights = np.bincount(bins, area)
        profile = np.bincount(bins, area * surface)[weights > 0.0] / weights[weights > 0.0]
        crest = max(-float(profile.min()), 0.0)
        if crest > 0.5 * spacing:
            rim_diameter = 2.0 * (float(np.flatnonzero(weights > 0.0)[profile.argmin()]) + 0.5) * CELL * spacing
    reach = float(radius[surface >= FLOOR_SHARE * deepest].max(initial=0.0))  # none where the face is whole
    floor = (depth >= FLOOR_SHARE * deepest) & (depth < deepest + CELL * dx) & ((points**2).sum(axis=1) <= reach**2)
    edge = scene.rim(plate.body)[rows]
    rim_velocity = float(velocity[edge].mean()) if edge.any() else 0.0
    speed = float(velocity[floor].mean()) - rim_velocity if floor.any() else 0.0
    error = float(hollow.sum()) * spacing * np.hypot(1.0 / max(deepest, spacing), width and (scene.space - 1) / width)
    volume = Result(float(hollow.sum()), discretization=float(error))
    return Crater(deepest, volume, diameter, rim_diameter, crest, speed, max(bulge, 0.0), scene.state.time)


@memoize
def _face_depths(scene: Scene, plate: Plate) -> Callable[[np.ndarray], np.ndarray | float]:
    """Return the function of points in the plane (n, dim - 1) that gives the initial depth of a curved face [m].

    It is zero for a flat face, whose foremost particles reach as far as the others, and where the start is not known.
    """
    if scene.start is None:
        return lambda points: 0.0
    rows = np.flatnonzero(scene.start.body == plate.body)
    position = scene.start.fields["position"][rows]
    sizes = np.broadcast_to(own_spacings(scene.start, rows, scene.spacing), len(rows))
    front, lateral = plate.depth(position) - 0.5 * sizes, plate.in_plane(position)
    distance = (lateral**2).sum(axis=1)
    if distance[front < scene.spacing].max(initial=0.0) > FLAT_SHARE**2 * distance.max():
        return lambda points: 0.0
    surface, _, middle = front_surface(front, lateral, sizes / scene.spacing, 0.5 * CELL * scene.spacing)
    tree = scipy.spatial.cKDTree(middle)
    return lambda points: surface[tree.query(points)[1]]


def _is_loose(scene: Scene, plate: Plate, rows: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Return which attached particles (n,), of normal velocity (n,) [m/s], will leave the crater.

    They are failed particles that rise fast enough to reach the struck face from their initial depth under the gravity
    of the case or of the Earth, and particles connected to the rim through such particles alone.
    """
    assert scene.start is not None
    place = scene.start.fields["position"].reshape(scene.start.count, -1)[scene.rows_at_start(rows)]
    pull = gravity_towards_layer(scene, np.array(plate.basis[0])) or EARTH_GRAVITY
    edge = scene.rim(plate.body)[rows]
    rim_velocity = float(velocity[edge].mean()) if edge.any() else 0.0
    rises = rim_velocity - velocity > np.sqrt(2.0 * max(pull, 0.0) * np.maximum(plate.depth(place), 0.0))
    loose = (scene.state.fields.get("damage", np.zeros(scene.state.count))[rows] >= 1.0) & rises
    intact = np.flatnonzero(~loose)
    sizes = scene.spacings(rows)
    groups = connected_groups(place[intact], sizes[intact] if isinstance(sizes, np.ndarray) else sizes, NEAREST_LINK)
    loose[intact] = ~np.isin(groups, groups[edge[intact]])
    return loose


def _transient(scene: Scene, plate: Plate) -> Crater | str:
    """Return the crater at the moment of its greatest volume so far, or why it is not known."""
    timeline = scene.timeline
    if timeline is None or not timeline.series:
        return "needs all moments: measure with `--at all`"
    timeline.moment(timeline.count - 1).craters[plate.body] = crater_of(scene, plate)
    moments = [timeline.moment(k).craters for k in range(timeline.count)]
    return max(
        (craters[plate.body] for craters in moments if plate.body in craters), key=lambda c: c.volume.value or 0.0
    )


@measures("layer", "crater_depth", "crater_outer_diameter", "crater_volume", "bulge_height")
def crater(scene: Scene, plate: Plate) -> Outcomes:
    """Return the crater's depth, diameter and volume and the rear's bulge; not final while the floor moves on."""
    current = crater_of(scene, plate)
    grows = current.depth > scene.spacing and current.floor_speed * scene.state.time > GROWTH_SHARE * current.depth
    note = f"still grows: its floor moves on at {current.floor_speed:.3g} m/s" if grows else ""
    to_rim = current.rim_diameter if isinstance(current.rim_diameter, str) else current.depth + current.rim_height
    variants: dict[str, dict[str, Outcome]] = {
        "depth": {"face": Result(current.depth, note=note, final=not grows), "rim": to_rim},
        "diameter": {"face": current.diameter, "rim": current.rim_diameter},
        "volume": {"face": current.volume},
    }
    largest = _transient(scene, plate)
    emptied = crater_of(scene, plate, True) if scene.start is not None and scene.has_motion else None
    for name, by_definition in variants.items():
        by_definition["emptied"] = getattr(emptied, name) if emptied else "needs the start and velocities"
        value = largest if isinstance(largest, str) else getattr(largest, name)
        time = getattr(largest, "time", None)
        result = value if isinstance(value, str | Result) else Result(value)
        by_definition["transient"] = result if isinstance(result, str) else replace(result, time=time)
    names = {"crater_depth": "depth", "crater_outer_diameter": "diameter", "crater_volume": "volume"}
    return {name: variants[quantity] for name, quantity in names.items()} | {"bulge_height": current.bulge}


@measures("layer", "spall_mass", "spall_thickness", "spall_velocity")
def spall(scene: Scene, plate: Plate) -> Outcomes:
    """Return mass, thickness and velocity of the spall: detached fragments that move away behind the layer."""
    _require(scene, plate, perforated=False, reason="the layer is perforated: its fragments are in the cloud")
    fixed, *_ = _attached_particles(scene, plate)
    normal = np.array(plate.basis[0])
    mass, velocity = scene.state.fields["mass"], scene.state.fields["velocity"] @ normal
    rim_velocity = float(np.average(velocity[fixed], weights=mass[fixed]))
    depth, lateral = plate.depth(scene.position), plate.in_plane(scene.position)

    def rear(piece: np.ndarray) -> float:
        """Return the greatest depth of attached particles at the place of a fragment, across the layer [m]."""
        low, high = lateral[piece].min(axis=0), lateral[piece].max(axis=0)
        covered = ((lateral[fixed] >= low) & (lateral[fixed] <= high)).all(axis=1)
        return float(depth[fixed][covered].max(initial=-np.inf))

    parts = scene.fragments(plate.body)
    detached = np.flatnonzero(~scene.attached_groups(plate.body) & (parts.groups.counts >= FEWEST_PARTICLES))
    pieces = [
        piece
        for piece in map(parts.__getitem__, detached.tolist())
        if piece.velocity @ normal > rim_velocity
        and plate.depth(piece.centre) > 0.5 * plate.thickness
        and plate.depth(piece.centre) > rear(piece.particles)
    ]
    refuse_if(not pieces, "nothing is detached from the rear")
    rows = np.concatenate([piece.particles for piece in pieces])
    speed = float(np.average(velocity[rows], weights=mass[rows]))
    return {
        "spall_mass": float(mass[rows].sum()),
        "spall_thickness": float(np.ptp(depth[pieces[0].particles])) + scene.spacing,
        "spall_velocity": Result(speed, scatter=float(velocity[rows].std() / np.sqrt(len(rows)))),
    }


@measures("layer", "front_lip_height", "rear_lip_height")
def lips(scene: Scene, plate: Plate) -> Outcomes:
    """Return the height of attached matter above the struck face and, where there is a hole, behind the rear [m]."""
    _, depth, _ = _attached_particles(scene, plate)
    refuse_if(len(depth) == 0, "nothing of the layer is attached to its rim")
    half = 0.5 * scene.spacing
    rear: Outcome = max(float(depth.max()) + half - plate.thickness, 0.0)
    if layer_state(scene, plate.body).state != YES:
        rear = "the layer is not perforated: its rear bulges"
    return {"front_lip_height": max(half - float(depth.min()), 0.0), "rear_lip_height": rear}


@measures("layer", "mass_loss")
def mass_loss(scene: Scene, plate: Plate) -> float:
    """Return the mass of the layer that is not attached to its rim any more [kg]."""
    mass, masses = scene.state.fields["mass"], scene.shot.masses
    before = masses[plate.body] if len(masses) > plate.body else float(mass[scene.state.body == plate.body].sum())
    loss = max(before - float(mass[_attached_particles(scene, plate)[0]].sum()), 0.0)
    return 0.0 if loss < 1e-9 * before else loss


def _diameter_by_mass(scene: Scene, plate: Plate) -> Outcome:
    """Return the diameter of the cylindrical hole of the full thickness with the mass lost [m]."""
    if scene.start is None or "density" not in scene.start.fields:
        return "the layer's density at the start is not known"
    density = float(scene.start.fields["density"][scene.start.body == plate.body].mean())
    size = mass_loss(scene, plate) / (density * plate.thickness)
    return size if scene.space == 2 else float(np.sqrt(4.0 * size / np.pi))
