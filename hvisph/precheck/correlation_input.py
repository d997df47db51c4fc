"""Correlations of a case: a sphere on plates or on a thick layer, and metal driven by an explosive."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from hvisph.case.bodies import Body
from hvisph.case.case import Case
from hvisph.core.catalogues import KINEMATICS
from hvisph.geometry.placement import rotation_matrix
from hvisph.measures.correlations import GROUNDS, Correlation, Impact, Wall, alloy_of, correlation, correlations
from hvisph.setup.shapes import shape_of

from .impact_pair import TOUCHING, body_boxes, impact_pair

WIDE = 4.0  # width of a slab of explosive over its thickness, above which little is lost at its edges
GURNEY_VELOCITY = {"tnt": 2370.0, "composition-b": 2700.0, "c-4": 2660.0, "petn": 2930.0, "pbx-9404": 2900.0}  # [m/s]
LIGHTEST, HEAVIEST = 0.1, 10.0  # metal over the mass of the explosive, where the balance of energy holds
SHELLS = {("cylinder", "tube"): 0.5, ("sphere", "hollow_sphere"): 0.6}  # share of the products that moves with them


def correlations_of(case: Case) -> tuple[list[Correlation], str]:
    """Return every correlation whose range covers a case, and where there is none, the reason."""
    velocities = list(_driven_bodies(case))
    if velocities:
        return velocities, ""
    impact, reason = impact_of(case)
    return ([] if impact is None else correlations(impact)), reason


def _driven_bodies(case: Case) -> Iterator[Correlation]:
    """Yield the final velocities of bodies that touch the only explosive of a case."""
    charges = [name for name, body in case.bodies.items() if _gurney_velocity(body)]
    if len(charges) != 1 or case.units != "si" or case.start is not None:
        return
    boxes = dict(zip(case.bodies, body_boxes(case)[0], strict=True))
    charge, (low, high) = case.bodies[charges[0]], boxes[charges[0]]
    gurney, size = _gurney_velocity(charge), high - low
    slack = TOUCHING * float(size.max())
    for name, body in case.bodies.items():
        inside: Any = charge.shape
        outside: Any = body.shape
        products = SHELLS.get((inside.type, outside.type))
        if products is None or abs(outside.inner_diameter - inside.diameter) > slack:
            continue
        ratio = _mass(case, body) / _mass(case, charge)
        if inside.type == "cylinder":
            ratio *= inside.length / outside.length
        if LIGHTEST <= ratio <= HEAVIEST:
            yield correlation("gurney", name, gurney / math.sqrt(ratio + products), unit="m/s")
    if len(size) > 1 and (size[1:].min() < WIDE * size[0] or charge.shape.type not in ("box", "rectangle", "cylinder")):
        return
    sides: dict[int, tuple[str, float]] = {}  # before the explosive, behind it: body and its mass over the explosive's
    thick = _areal_density(charge, size)
    for name, body in case.bodies.items():
        extent = boxes[name][1] - boxes[name][0]
        for side, gap in ((0, low[0] - boxes[name][1][0]), (1, boxes[name][0][0] - high[0])):
            if body is not charge and abs(gap) <= slack and (extent[1:] >= 0.9 * size[1:]).all():
                sides[side] = name, _areal_density(body, extent) / thick
    mirrored = [
        side
        for side, face in ((0, low[0]), (1, high[0]))
        for plane in case.symmetry
        if plane.axis == "x" and abs(plane.at - face) <= slack
    ]
    for side, (name, ratio) in sides.items():
        opposite = sides.get(1 - side, ("", 0.0))[1]
        if 1 - side in mirrored:  # half of a slab with such a plate on both faces
            ratio = opposite = 0.5 * ratio
        if LIGHTEST <= ratio <= HEAVIEST:
            lever = (1.0 + 2.0 * ratio) / (1.0 + 2.0 * opposite)
            products = (1.0 + lever**3) / (3.0 * (1.0 + lever))
            velocity = gurney / math.sqrt(products + opposite * lever**2 + ratio)
            yield correlation("gurney", name, velocity, unit="m/s")


def _gurney_velocity(body: Body) -> float:
    """Return the Gurney velocity of an explosive of the library, varied or not [m/s]; 0 of other materials."""
    return GURNEY_VELOCITY.get(str(body.material.name).partition(",")[0], 0.0)


def _density(body: Body) -> float:
    """Return the density of a body with its pores [kg/m^3]."""
    pores = body.material.porosity
    return float(body.material.density / (1.0 if pores is None else pores.distension))


def _mass(case: Case, body: Body) -> float:
    return _density(body) * shape_of(body.shape, case.drawing_dimensions).volume


def _areal_density(body: Body, size: np.ndarray) -> float:
    """Return the mass per area across x of a body that fills a box of this size [kg/m^2]."""
    return _density(body) * float(size[0])


def impact_of(case: Case) -> tuple[Impact | None, str]:
    """Return the impact of a case, and where it is none that correlations know, the reason."""
    if not (case.dim == 3 or KINEMATICS[case.kinematics].axisymmetric) or case.units != "si":
        return None, "correlations are for spheres on plates in 3D or axisymmetric, in SI units"
    names = list(case.bodies)
    shots = [name for name in names if case.bodies[name].shape.type == "sphere" and any(case.bodies[name].velocity)]
    if len(shots) != 1:
        return None, "correlations are for one sphere that flies at plates"
    shot = case.bodies[shots[0]]
    targets = [name for name in names if name != shots[0] and case.bodies[name].role != "other"]
    cores = [name for name in targets if case.bodies[name].shape.type == "honeycomb"]
    plates = [name for name in targets if name not in cores]
    if not plates or any(case.bodies[name].shape.type not in ("box", "cylinder") for name in plates):
        return None, "correlations are for plates: boxes, or short cylinders"
    if targets[0] in cores or targets[-1] in cores:
        return None, "correlations are for honeycomb between two plates"
    pair = impact_pair(case)
    if pair is None or shots[0] not in (pair.first, pair.second):
        return None, "the sphere flies past the plates, or away from them"
    velocity = np.array(shot.velocity) - np.array(case.bodies[targets[0]].velocity)
    speed = float(np.sqrt((velocity**2).sum()))
    walls, fronts = [], []
    for name in plates:
        normal, thickness = _plate(case.bodies[name])
        fronts.append((name, normal, thickness))
    cosine = abs(float(velocity @ fronts[0][1])) / speed
    gaps, cells = _fill(case, targets, _gaps(case, targets))
    for (name, _, thickness), gap, cell in zip(fronts, gaps, cells, strict=True):
        body = case.bodies[name]
        cloth, alloy = body.material.strength.type == "fabric", alloy_of(str(body.material.name))
        walls.append(Wall(name, thickness, _density(body), gap, alloy, cloth, ground_of(body), cell))
    field = case.gravity
    pull = math.hypot(*field.acceleration) if field is not None and field.type == "uniform" else 0.0
    angle = math.acos(min(cosine, 1.0))
    impact = Impact(shot.shape.extent()[0], shot.material.density, speed, angle, tuple(walls), pull)
    ground = walls[0].ground
    if ground and not pull and not GROUNDS[ground].strength:
        return impact, f"craters in {ground} have no size without strength or a uniform `gravity`"
    return impact, ""


def _fill(case: Case, names: list[str], gaps: list[float]) -> tuple[list[float], list[float]]:
    """Return gaps before the plates among `names` over the honeycombs in them [m], and the least width of cells [m]."""
    widths: list[float] = []
    cells: list[float] = []
    gap = cell = 0.0
    for name, before in zip(names, gaps, strict=True):
        shape: Any = case.bodies[name].shape
        gap += before
        if shape.type == "honeycomb":
            gap, cell = gap + shape.size[0], min(cell or shape.cell, shape.cell)
            continue
        widths.append(gap)
        cells.append(cell)
        gap = cell = 0.0
    return widths, cells


def ground_of(body: Body) -> str:
    """Return the class of matter by which craters in a body are scaled; empty for metals, plastics and cloth.

    Water is recognised by its name. A material with the strength of rock is ice if its density without pores is below
    1000 kg/m^3; otherwise its cohesion decides. The bounds are the geometric means of the strengths of the classes;
    sand has less than 1 kPa.
    """
    material = body.material
    if str(material.name).startswith("water"):
        return "water"
    if material.strength.type != "rock":
        return ""
    if material.density < 1000.0:
        return "ice"
    names = ("sand", "dry soil", "wet soil", "hard rock")
    strengths = [GROUNDS[name].strength for name in names[1:]]
    bounds = [1e3, *(math.sqrt(a * b) for a, b in pairwise(strengths))]
    return names[sum(material.strength.cohesion >= bound for bound in bounds)]


def _plate(body: Body) -> tuple[np.ndarray, float]:
    """Return the normal and the thickness of a plate: its least extent."""
    extent = np.array(body.shape.extent())
    axis = 0 if body.shape.type == "honeycomb" else int(np.argmin(extent))
    normal = np.eye(3)[axis, : len(body.velocity)]
    if body.rotation is not None:
        normal = rotation_matrix(3, body.rotation.radians, body.rotation.axis) @ normal
    return normal, float(extent[axis])


def _gaps(case: Case, names: list[str]) -> list[float]:
    """Return the distance of each plate from the one before it [m]; 0 for the first."""
    gaps, shifts = [0.0], dict(zip(case.bodies, body_boxes(case)[1], strict=True))

    def centre(name: str) -> np.ndarray:
        row = [shifts[name], *np.zeros(case.dim - 1)]
        return np.array(row if case.bodies[name].position is None else case.bodies[name].position)

    for before, name in pairwise(names):
        previous, current = case.bodies[before], case.bodies[name]
        if previous.position is None and current.position is None:
            gaps.append(float(current.gap))
        else:
            distance = abs(float((centre(name) - centre(before)) @ _plate(current)[0]))
            gaps.append(distance - 0.5 * (_plate(previous)[1] + _plate(current)[1]))
    return gaps
