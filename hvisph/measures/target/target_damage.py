"""What the shot left in and on a layer: hole, crater, bulge, lips, spall and mass lost.

Lengths are from surface to surface, the surface being half a spacing outside the outermost particles; depths and
heights are along the layer's own normal. All of it is about what is attached to the layer's rim.
"""

from __future__ import annotations

import numpy as np

from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.frame.target_geometry import RIM, Plate
from hvisph.measures.result import MASS_UNITS, MOMENTUM_UNITS, Result, meaningless

from .holes import Opening, opening, openings
from .perforation import YES, Perforation
from .plug import FEWEST

HOLE = ("hole_diameter", "hole_diameter_least", "hole_diameter_greatest", "hole_diameter_front",
        "hole_diameter_rear", "hole_diameter_clear", "hole_area")  # fmt: skip
CRATER = ("crater_depth", "crater_diameter", "bulge")
SPALL = ("spall_mass", "spall_thickness", "spall_velocity")
# A hole in the slices of the original thickness over what one sees through, from which on the layer may have bent away.
WIDER = 1.5
UNITS = {"hole_area": "m^2", "spall_velocity": "m/s", "mean_pressure": "Pa"}


def marks(scene: Scene, plate: Plate, hole: Perforation) -> dict[str, Result]:
    """Return the marks of a layer; those of a hole where it is perforated, those of a crater where it is not."""
    fixed = hole.attached
    depth, across = plate.depth(scene.position[fixed]), plate.across(scene.position[fixed])
    open_ = hole.state == YES
    results: dict[str, Result] = {}
    if open_:
        results |= _hole(scene, plate, depth, across)
        results |= _none(scene, CRATER, "the layer is perforated")
        results |= _none(scene, SPALL, "the layer is perforated: what flies on is in the cloud")
    else:
        reason = f"not perforated: {hole.reason}"
        results |= _none(scene, HOLE, reason)
        results |= _crater(scene, plate, depth, across)
        results |= _spall(scene, plate, hole)
    results |= _lips(scene, plate, depth, open_)
    lost = _mass_lost(scene, plate, fixed)
    return results | {"mass_lost": lost, "hole_diameter_by_mass": _by_mass(scene, plate, lost, open_, hole.reason)}


def _hole(scene: Scene, plate: Plate, depth: np.ndarray, across: np.ndarray) -> dict[str, Result]:
    through = openings(plate, depth, across, scene.spacing)
    if not through:
        return _none(scene, HOLE, "the hole is not enclosed by what is left of the layer")
    means = np.array([one.diameters.mean() for one in through])
    scatter = float(means.std(ddof=1)) if len(means) > 1 else 0.0
    clear = opening(across, np.zeros(across.shape[1]), scene.spacing)
    if _bent_away(plate, depth, across, clear, float(means.mean()), scene.spacing):
        bent = "the layer has bent out of its place at the hole, whose width is `hole_diameter_clear`"
        return _none(scene, HOLE, bent) | {"hole_diameter_clear": _clear(scene, clear)}
    area = meaningless("m^2", "a hole has an area in 3D only")
    if scene.now.dimensions == 3:
        size = float(np.mean([one.area for one in through]))
        area = Result(size, "m^2", scene.spacing * float(np.sqrt(np.pi * size)))
    return {
        "hole_diameter": _length(scene, float(means.mean()), scatter),
        "hole_diameter_least": _length(scene, float(min(one.diameters.min() for one in through))),
        "hole_diameter_greatest": _length(scene, float(max(one.diameters.max() for one in through))),
        "hole_diameter_front": _length(scene, float(means[0])),
        "hole_diameter_rear": _length(scene, float(means[-1])),
        "hole_diameter_clear": _clear(scene, clear),
        "hole_area": area,
    }


def _bent_away(plate: Plate, depth: np.ndarray, across: np.ndarray, clear: Opening | None, mean: float,
               spacing: float) -> bool:  # fmt: skip
    """Whether slices of the original thickness cut the layer where it begins to bend, and not at its hole."""
    if clear is None or not mean > WIDER * clear.diameters.mean() > 0.0:
        return False
    edge = depth[np.sqrt((across**2).sum(axis=1)) < clear.radii.max() + 2.0 * spacing]
    return bool(len(edge) and ((edge < -0.5 * spacing) | (edge > plate.thickness + 0.5 * spacing)).all())


def _clear(scene: Scene, clear: Opening | None) -> Result:
    if clear is None or not clear.diameters.mean() > 0.0:
        return meaningless("m", "attached matter hangs over the hole")
    return _length(scene, float(clear.diameters.mean()))


def _crater(scene: Scene, plate: Plate, depth: np.ndarray, across: np.ndarray) -> dict[str, Result]:
    """Return how deep the struck face is pressed in, how wide at its own level, and how far the rear stands out."""
    inner = ~plate.beyond(across, RIM)
    if not inner.any():
        return _none(scene, CRATER, "nothing of the layer is left within its rim")
    surface = _front_surface(depth, across, inner, 2.0 * scene.spacing) - 0.5 * scene.spacing
    deepest = max(float(surface.max()), 0.0)
    bulge = max(float(depth[inner].max()) + 0.5 * scene.spacing - plate.thickness, 0.0)
    results = {"crater_depth": _length(scene, deepest), "bulge": _length(scene, bulge)}
    level = (depth >= 0.0) & (depth < scene.spacing)
    wide = opening(across[level], np.zeros(across.shape[1]), scene.spacing)
    if deepest < scene.spacing or wide is None:
        results["crater_diameter"] = meaningless("m", "the struck face is whole")
    else:
        results["crater_diameter"] = _length(scene, float(wide.diameters.mean()))
    return results


def _front_surface(depth: np.ndarray, across: np.ndarray, inner: np.ndarray, cell: float) -> np.ndarray:
    """Return the least depth in each cell of the plane that holds `inner` particles, of all that are there [m]."""
    place = np.floor(across / cell + 1e-9).astype(np.int64)
    place -= place.min(axis=0)
    key = np.ravel_multi_index(tuple(place.T), tuple(place.max(axis=0) + 1))
    _, group = np.unique(key, return_inverse=True)
    least = np.full(int(group.max()) + 1, np.inf)
    np.minimum.at(least, group, depth)
    return least[np.unique(group[inner])]


def _spall(scene: Scene, plate: Plate, hole: Perforation) -> dict[str, Result]:
    """Return what has come off the rear: detached pieces that leave what is attached, with nothing of it behind them.

    However slowly: spall of a wall that held flies at some 100 m/s, whatever struck it.
    """
    along = np.array(plate.basis[0])
    mass, velocity = scene.now.fields["mass"], scene.now.fields["velocity"] @ along
    rest = float(np.average(velocity[hole.attached], weights=mass[hole.attached]))
    depth, across = plate.depth(scene.position), plate.across(scene.position)
    parts = scene.fragments(plate.body)
    loose = np.flatnonzero(~scene.attached(plate.body) & (parts.groups.counts >= FEWEST))
    pieces = [
        piece for piece in map(parts.__getitem__, loose.tolist())
        if piece.velocity @ along > rest and plate.depth(piece.centre) > 0.5 * plate.thickness
        and plate.depth(piece.centre) > _rear(depth, across, hole.attached, piece.particles)
    ]  # fmt: skip
    if not pieces:
        return _none(scene, SPALL, "nothing has come off the rear")
    rows = np.concatenate([piece.particles for piece in pieces])
    speed = float(np.average(velocity[rows], weights=mass[rows]))
    return {
        "spall_mass": Result(float(mass[rows].sum()), MASS_UNITS[scene.space]),
        "spall_thickness": _length(scene, float(np.ptp(depth[pieces[0].particles])) + scene.spacing),
        "spall_velocity": Result(speed, "m/s", float(velocity[rows].std() / np.sqrt(len(rows)))),
    }


def _rear(depth: np.ndarray, across: np.ndarray, attached: np.ndarray, piece: np.ndarray) -> float:
    """Return the greatest depth of what is attached where a piece is, across the layer [m]."""
    low, high = across[piece].min(axis=0), across[piece].max(axis=0)
    there = ((across[attached] >= low) & (across[attached] <= high)).all(axis=1)
    return float(depth[attached][there].max(initial=-np.inf))


def _lips(scene: Scene, plate: Plate, depth: np.ndarray, open_: bool) -> dict[str, Result]:
    """Return how far attached matter stands out of the struck face and, where there is a hole, of the rear."""
    if len(depth) == 0:
        return _none(scene, ("front_lip", "rear_lip"), "nothing of the layer is attached to its rim")
    half = 0.5 * scene.spacing
    rear = meaningless("m", "the layer is not perforated: its rear bulges")
    if open_:
        rear = _length(scene, max(float(depth.max()) + half - plate.thickness, 0.0))
    return {"front_lip": _length(scene, max(half - float(depth.min()), 0.0)), "rear_lip": rear}


def _mass_lost(scene: Scene, plate: Plate, fixed: np.ndarray) -> Result:
    """Return what of the layer's mass is not attached to its rim any more."""
    mass = scene.now.fields["mass"]
    known = scene.shot.masses
    before = known[plate.body] if len(known) > plate.body else float(mass[scene.now.body == plate.body].sum())
    lost = max(before - float(mass[fixed].sum()), 0.0)
    return Result(0.0 if lost < 1e-9 * before else lost, MASS_UNITS[scene.space])


def _by_mass(scene: Scene, plate: Plate, lost: Result, open_: bool, reason: str) -> Result:
    """Return the diameter of the round hole through the whole thickness from which the mass lost would have come."""
    if not open_:
        return meaningless("m", f"not perforated: {reason}")
    if scene.start is None or "density" not in scene.start.fields or scene.now.dimensions == 1:
        return meaningless("m", "the layer's density at the start is not known")
    density = float(scene.start.fields["density"][scene.start.body == plate.body].mean())
    size = (lost.value or 0.0) / (density * plate.thickness)
    return _length(scene, size if scene.space == 2 else float(np.sqrt(4.0 * size / np.pi)))


def _length(scene: Scene, value: float, scatter: float = 0.0) -> Result:
    return Result(value, "m", float(np.hypot(scene.spacing, scatter)), spacing=scene.spacing, support=scene.support)


def _none(scene: Scene, names: tuple[str, ...], reason: str) -> dict[str, Result]:
    return {name: meaningless(unit_of(name, scene.space), reason) for name in names}


def unit_of(name: str, dim: int) -> str:
    """Return the SI unit of a layer's measure: masses are per depth in 2D and per area in 1D."""
    if name == "impulse":
        return MOMENTUM_UNITS[dim]
    return MASS_UNITS[dim] if name.endswith(("_mass", "mass_lost")) else UNITS.get(name, "m")
