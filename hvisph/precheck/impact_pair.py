"""Impact pair: the first two bodies in contact and their closing speed, from bounding boxes; time of first contact."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from hvisph.case.bodies import Body
from hvisph.case.case import Case
from hvisph.casefile.material_library import Library, Notes, library_of
from hvisph.core.errors import CaseError, HvisphError
from hvisph.core.text import recommend
from hvisph.exact.hugoniot import Impact, impedance_match
from hvisph.geometry.placement import Solid, rotation_matrix, touch
from hvisph.geometry.shapes import Placed
from hvisph.setup.bodies import PlacedBody
from hvisph.setup.materials import material_of
from hvisph.setup.shapes import initial_velocity, shape_of

# Lower and upper corner, (dim,) each [m].
Box = tuple[np.ndarray, np.ndarray]
MOST_PAIRS = 2000  # of bodies that are looked at
ROUND = ("sphere", "cylinder", "cone", "ogive", "frustum", "dome", "rounded_cylinder", "tube")  # about x
BALLS = ("disc", "annulus", "sphere", "hollow_sphere")
TOUCHING = 1e-6  # of the larger box: what rounding leaves between faces that touch


@dataclass(frozen=True)
class ImpactPair:
    """Impact pair."""

    # their names: the one that moves faster, and the other; in the order of the file where both are as fast
    first: str
    second: str
    velocity: float  # how fast they close across the faces that meet, above 0 [m/s]


def impact_pair(case: Case) -> ImpactPair | None:
    """Return the first two bodies in contact at their initial velocities; None without contact.

    Of several that meet at once, such as core and jacket of a bullet, it is those of the highest pressure. None for
    bodies that start from another run, whose shapes and velocities are no longer those of the case.
    """
    if case.start is not None:
        return None
    names, bodies, (boxes, shifts) = list(case.bodies), list(case.bodies.values()), body_boxes(case)
    velocities = [_velocity(body, box) for body, box in zip(bodies, boxes, strict=True)]
    impedance = [_impedance(body) for body in bodies]
    turns = [None if case.drawing_dimensions != case.dim else _turn(body, case) for body in bodies]
    contacts: list[tuple[float, float, int, int, float]] = []
    for count, (a, b) in enumerate(combinations(range(len(names)), 2)):
        if count >= MOST_PAIRS:
            break
        closing = velocities[a] - velocities[b]
        threads = not closing[1:].any() and _threads(case, boxes, names, a, b)
        box_a, box_b = boxes[a], boxes[b]
        turn = turns[a] if np.linalg.norm(velocities[b]) > np.linalg.norm(velocities[a]) else turns[b]
        if turn is not None:  # along the axes of the struck body, so that a shot turned as a whole is the same
            box_a, box_b = (_box(bodies[k], case, shifts[k], turn) for k in (a, b))
            closing = closing @ turn
        contact = None if threads else _contact_time(box_a, box_b, closing)
        if contact is not None:
            pressure = contact[1] * impedance[a] * impedance[b] / max(impedance[a] + impedance[b], 1e-300)
            contacts.append((contact[0], -pressure, a, b, contact[1]))
    if not contacts:
        return None
    _, _, a, b, speed = min(contacts)
    if np.linalg.norm(velocities[b]) > np.linalg.norm(velocities[a]):
        a, b = b, a
    return ImpactPair(names[a], names[b], speed)


def _threads(case: Case, boxes: list[Box], names: list[str], a: int, b: int) -> bool:
    """Whether one of two bodies fits the hole of the other, a straight tube along x: a plug in a barrel."""
    for tube, plug in ((a, b), (b, a)):
        body = case.bodies[names[tube]]
        if body.shape.type != "tube" or body.shape.axis != "x" or body.rotation is not None:
            continue
        low, high = boxes[plug]
        middle = 0.5 * (boxes[tube][0] + boxes[tube][1])[1:]
        half_width = np.maximum(np.abs(low[1:] - middle), np.abs(high[1:] - middle))
        inner = case.bodies[names[plug]]
        round_one = inner.shape.type in ROUND and getattr(inner.shape, "axis", "x") == "x" and inner.rotation is None
        reach = half_width.max() if round_one else float(np.sqrt((half_width**2).sum()))
        if reach <= 0.5 * body.shape.inner_diameter * (1.0 + TOUCHING):
            return True
    return False


def _velocity(body: Body, box: Box) -> np.ndarray:
    """Return the velocity of a body's middle, where fields that turn and spread about it have none."""
    ends = np.nan_to_num(np.array(box), posinf=0.0, neginf=0.0)  # particles of a file have no sides here
    middle = 0.5 * (ends[0] + ends[1])
    try:
        return initial_velocity(body, middle[None], middle)[0]
    except CaseError:  # a table that cannot be read is said where bodies are made, with its place
        return np.array(body.velocity, dtype=float)


def _impedance(body: Body) -> float:
    material = material_of(body.material, body.internal_energy)
    return material.density_at_rest * material.bulk_sound_speed


def body_boxes(case: Case) -> tuple[list[Box], list[float]]:
    """Return bounding boxes of placed bodies, and how far each is along x from the origin [m]; 0 with a place."""
    bodies = list(case.bodies.values())
    boxes, shifts = [_box(body, case) for body in bodies], [0.0] * len(bodies)
    row = [k for k, body in enumerate(bodies) if body.position is None]
    front = 0.0
    if len(row) > 1:  # the second has its face at 0
        front = float(boxes[row[0]][0][0] - boxes[row[0]][1][0]) - bodies[row[1]].gap
    for before, k in zip([None, *row], row, strict=False):
        front += 0.0 if before is None else bodies[k].gap
        low, high = boxes[k]
        shifts[k] = front - low[0]
        low[0], high[0] = front, high[0] + shifts[k]
        front = high[0]
    return boxes, shifts


def _turn(body: Body, case: Case) -> np.ndarray | None:
    turn = body.rotation
    return None if turn is None else rotation_matrix(case.drawing_dimensions, turn.radians, turn.axis)


def _box(body: Body, case: Case, shift: float = 0.0, axes: np.ndarray | None = None) -> Box:
    """Return the corners of a box around a body at its stated place, about the origin where it has none.

    It stands `shift` [m] further along x. The box is along the columns of `axes`, those of the case unless given.
    """
    centre, turn = np.zeros(case.drawing_dimensions), _turn(body, case)
    if body.position is not None:
        centre[: case.dim] = body.position
    centre[0] += shift
    if axes is not None:
        centre, turn = centre @ axes, axes.T if turn is None else axes.T @ turn
    if body.shape.type in BALLS:  # as wide however it is turned
        turn = None
    try:
        low, high = Placed(shape_of(body.shape, case.drawing_dimensions), centre, turn).bounds()
    except (CaseError, ValueError):  # particles of a file: a point in the row, as wide as what it meets
        low, high = np.full(case.drawing_dimensions, -np.inf), np.full(case.drawing_dimensions, np.inf)
        low[0] = high[0] = centre[0]
    return np.array(low[: case.dim], dtype=float), np.array(high[: case.dim], dtype=float)


def _contact_time(first: Box, second: Box, closing: np.ndarray) -> tuple[float, float] | None:
    """Return when boxes closing at (dim,) [m/s] meet [s] and at which normal speed; None where they never do."""
    moving = closing != 0.0
    sizes = np.concatenate([first[1] - first[0], second[1] - second[0]])
    slack = TOUCHING * float(sizes[np.isfinite(sizes)].max(initial=0.0))
    separate = (first[1] <= second[0] + slack) | (second[1] <= first[0] + slack)
    if not moving.any() or (separate & ~moving).any():
        return None
    entry = np.where(closing > 0.0, second[0] - first[1], first[0] - second[1])  # along the axis, to the first contact
    to_exit = np.where(closing > 0.0, second[1] - first[0], first[1] - second[0])  # and to the last
    speed = np.abs(closing)
    enter, leave = entry[moving] / speed[moving], to_exit[moving] / speed[moving]
    if leave.min() <= max(enter.max(), 0.0):
        return None  # passed, or passing by
    faced = speed[moving][enter.argmax()] if (entry[moving] >= -slack).any() else speed.max()
    return max(float(enter.max()), 0.0), float(faced)


# Pairs of bodies that are followed; of a case with more, the first ones.
MOST_FOLLOWED = 200
# Bodies that touch at the start: those of a mesh to the accuracy of its distances, and what lattices that were fitted
# to their shapes may lie within each other [spacings].
CLOSED, WITHIN = 0.05, 0.25


def first_contact(bodies: list[PlacedBody]) -> tuple[float, str, str] | None:
    """Return the time of the first contact and the names of the two bodies that meet.

    Each pair is followed along its relative velocity, the mean of each body's, without what happens before it meets;
    bodies from a file of particles have no surface and are left out. Returns time [s] and two names; None where no two
    bodies meet.
    """
    contacts: list[tuple[float, str, str]] = []
    for count, (first, second) in enumerate(combinations(bodies, 2)):
        if count >= MOST_FOLLOWED:
            break
        approach = first.mean_velocity - second.mean_velocity
        speed = float(np.sqrt(approach @ approach))
        if speed == 0.0 or first.surface is None or second.surface is None:
            continue
        distance = _distance(first, second, approach / speed)
        dx = first.filling.finest
        if distance is not None and distance > -WITHIN * dx:
            contacts.append((distance / speed if distance > CLOSED * dx else 0.0, first.name, second.name))
    return min(contacts) if contacts else None


def _distance(first: PlacedBody, second: PlacedBody, direction: np.ndarray) -> float | None:
    """Return how far `first` moves along `direction` until it touches `second` [m]; None if it never does."""
    dim = len(direction)
    if dim == 1:
        front, rear = (first, second) if direction[0] > 0 else (second, first)
        gap = (rear.positions - rear.spacing[:, None] / 2).min() - (front.positions + front.spacing[:, None] / 2).max()
        return float(gap)
    # axes of which the first is the direction of approach
    basis = np.linalg.qr(np.column_stack([direction, np.eye(dim)]))[0].T[:dim]
    basis[0] = direction
    solids = []
    for body in (first, second):
        assert body.surface is not None
        rotated = Placed(body.surface, np.zeros(dim), basis)
        solids.append(Solid(rotated, body.positions @ basis.T, body.filling.finest))
    if solids[0].positions[:, 0].min() > solids[1].positions[:, 0].max():
        return None  # already behind it
    contact = touch(*solids)
    return None if contact is None else contact[1] - contact[0]


MARGIN = 0.9  # of the ends of the range that a material is known to hold in, since the estimate is a flat impact's
APART = 0.3  # of the estimate: a difference that is worth a remark


def plane_shock(case: Case) -> tuple[Impact | None, str]:
    """Return the result of impedance matching of the impact pair.

    Returns the `hvisph.exact.hugoniot.Impact`, in the frame of the second of their `impact_pair`, and an empty text; or
    None and the reason why there is none.
    """
    if case.start is not None:
        return None, "bodies start from another run"
    if len(case.bodies) < 2:
        return None, "there is only one body"
    if case.kinematics == "plane_stress":
        return None, "a sheet in plane stress thickens before it bears the pressure of a shock"
    pair = impact_pair(case)
    if pair is None:
        return None, "no two bodies approach each other"
    try:
        bodies = [case.bodies[name] for name in (pair.first, pair.second)]
        projectile, target = (material_of(body.material, body.internal_energy) for body in bodies)
        return impedance_match(projectile, target, pair.velocity), ""
    except HvisphError as error:
        return None, str(error)
    except ArithmeticError:
        return None, "the numbers of the materials or the velocity are beyond it"


def hugoniot_warnings(case: Case) -> list[str]:
    """Return a warning for each of the bodies that meet first whose material is known to miss measured shocks here."""
    matched, pair = plane_shock(case)[0], impact_pair(case)
    if matched is None or pair is None:
        return []
    library, warnings = library_of(), []
    speeds = {pair.first: pair.velocity - matched.interface_velocity, pair.second: matched.interface_velocity}
    for name, speed in speeds.items():
        body = case.bodies[name]
        if body.material.name not in library.files:
            continue
        notes = library.notes(body.material.name)
        better = _better(library, notes, speed)
        remedy = [f"bodies.{name}.material={better}"] if better else []
        fact = f"about {speed:.0f} m/s come here{f'; take {better}' if better else ''}"
        claim = f"bodies.{name}.material: '{body.material.name}' meets measured shock speeds to 2 %"
        if notes.shocks is None:
            warnings += [recommend(f"{claim} at no particle velocity, and {fact}", *remedy)] if better else []
            continue
        low, high = notes.shocks
        if not _holds(notes, speed):
            warnings.append(
                recommend(f"{claim} behind shocks of {low:g} to {high:g} m/s of particle velocity, and {fact}", *remedy)
            )
    return warnings


def _better(library: Library, notes: Notes, speed: float) -> str:
    """Return the first of the materials named one by another whose shocks are as measured; empty where none is."""
    names: list[str] = []
    while notes.beyond and notes.beyond not in names:
        names.append(notes.beyond)
        notes = library.notes(names[-1])
        if _holds(notes, speed):
            return names[-1]
    return ""


def _holds(notes: Notes, speed: float) -> bool:
    """Whether shocks are as measured at a particle velocity [m/s]; where no range is given, among the points."""
    speeds = notes.shocks or [up for points, _ in notes.hugoniot_points for up, _ in points]
    return bool(speeds) and MARGIN * min(speeds) <= speed <= max(speeds) / MARGIN


def compare_peak_pressure(case: Case, highest: float) -> tuple[dict[str, float | None], list[str]]:
    """Return the highest pressure of any particle in a run and the estimate [Pa], with a remark if they differ."""
    shock, _ = plane_shock(case)
    estimate = None if shock is None else float(shock.pressure)
    pressures: dict[str, float | None] = {"highest": highest, "impedance_match": estimate}
    if not estimate or abs(highest / estimate - 1.0) <= APART:
        return pressures, []
    scale, unit = (1.0, "") if case.units == "none" else (1e-9, " GPa")
    return pressures, [
        f"the highest pressure of any particle is {scale * highest:.3g}{unit}, {highest / estimate:.2g} times the "
        f"{scale * estimate:.3g}{unit} of a flat impact by impedance matching: "
        + (
            "particles too coarse or an impact that is not flat lower it"
            if highest < estimate
            else "a spike at the contact, or waves that met, raise it"
        )
    ]
