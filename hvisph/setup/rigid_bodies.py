"""Rigid bodies of a case: material, mass and freedom at the start."""

import numpy as np

from hvisph.case.bodies import Rigid
from hvisph.case.case import Case
from hvisph.compiler.exact_sum import exact_sum
from hvisph.core.catalogues import KINEMATICS
from hvisph.core.errors import CaseError
from hvisph.core.particles import CLAMPED, FLAGS, Particles
from hvisph.integrators.prescribed_motion import GROUP_SHIFT, RIGID_GROUP, Motion
from hvisph.integrators.rigid_body import MassProperties, RigidMotion, cross, in_space
from hvisph.materials.eos import Linear
from hvisph.materials.material_table import Material
from hvisph.sph.neighbours.ghost_rows import Plane

from .bodies import PlacedBody

SHOCK_IMPEDANCE = 2.0  # impedance of a shocked material over that at rest: shocks of 3 km/s in metals


def rigid_material(body: PlacedBody, material: Material) -> Material:
    """Return the material of a body's particles: of a rigid one without strength, its density that of its mass."""
    rigid = body.model.rigid
    if rigid is None:
        return material
    density = material.density_at_rest
    if body.carried:
        density = float(body.carried["density"][0])
    elif rigid.mass is not None:  # of the whole body, of which planes of symmetry may keep a part
        density = rigid.mass / float(body.filling.volumes.sum())
    return Material(material.name, density, Linear(material.density * material.bulk_sound_speed**2))


def rigid_motions(
    case: Case, particles: Particles, placed: list[PlacedBody], materials: list[Material], planes: tuple[Plane, ...]
) -> tuple[RigidMotion, ...]:
    """Return the motions of rigid bodies and mark their particles; `CaseError` where a clamp or plane holds one."""
    motions: list[RigidMotion] = []
    parts = [part for body in placed for part in body.parts]
    deformable = [m for part, m in zip(parts, materials, strict=True) if part.model.rigid is None]
    impedance = SHOCK_IMPEDANCE * max([m.density * m.longitudinal_sound_speed for m in deformable] or [0.0])
    for number, body in enumerate(placed):
        rigid, rows = body.model.rigid, particles.body == number
        if rigid is None:
            continue
        where = f"bodies.{body.name}.rigid"
        if (particles.tags[rows, FLAGS] & CLAMPED).any():
            message = "a clamp holds particles of this rigid body; name other `bodies` in the clamp, or use `fixed`"
            raise CaseError(message, where=where)
        group = RIGID_GROUP + len(motions)
        particles.tags[rows, FLAGS] |= CLAMPED | group << GROUP_SHIFT
        motions.append(_motion(case, particles, body, rows, group, planes, impedance, where))
    return tuple(motions)


def _motion(
    case: Case,
    particles: Particles,
    body: PlacedBody,
    mask: np.ndarray,
    group: int,
    planes: tuple[Plane, ...],
    impedance: float,
    where: str,
) -> RigidMotion:
    rigid = body.model.rigid
    assert rigid is not None
    mass, x, u = particles["mass"][mask], particles["position"][mask], in_space(particles["velocity"][mask])
    solid = _properties(body, mass)
    moves, turns, axis = _freedom(rigid, particles)
    for plane in planes:
        normal = np.eye(3)[plane.axis]
        if (moves @ normal).any() and not _is_cut_by(body, plane):
            fault = f"the plane of symmetry across {'xyz'[plane.axis]} does not cut this body, and is no wall for it"
            raise CaseError(f"{fault}; let it move in another way, or make it or the wall deformable", where=where)
        moves = moves - np.outer(normal, normal @ moves) if (moves @ normal).any() else moves
        turns = turns and (axis is None or bool(abs(axis @ normal) == 1.0))
        axis = normal if turns and axis is None and particles.dim == 3 else axis
        turns = turns and particles.dim == 3
    r = in_space(x) - solid.centre
    velocity = moves @ np.array([exact_sum(mass * component) / solid.mass for component in u.T])
    rate = np.zeros(3)
    if turns:
        rate = _carried_rate(solid, mass, r, u, axis) if body.carried else _rate_of(body, axis)
    table = None
    if rigid.velocity:
        axis_of = "xyz".index(rigid.along)
        rows = [[value if k == axis_of else 0.0 for k in range(particles.dim)] for _, value in rigid.velocity]
        table = Motion(group, np.array([time for time, _ in rigid.velocity]), np.array(rows))
        velocity = in_space(table.velocity(case.begins)[None])[0]
        particles["velocity"][mask] = table.velocity(case.begins)
    radius = float(np.sqrt((r * r).sum(axis=1).max()))
    return RigidMotion(
        body.name, group, solid, moves, turns, axis, velocity, rate, radius, float(body.spacing.min()), impedance, table
    )


def _freedom(rigid: Rigid, particles: Particles) -> tuple[np.ndarray, bool, np.ndarray | None]:
    """Return the projection on directions of motion (3, 3), whether a body turns, and its only axis (3,), if any."""
    dim, move, axisymmetric = particles.dim, rigid.move, particles.kinematics.axisymmetric
    space = np.diag([float(k < (1 if axisymmetric else dim)) for k in range(3)])
    if move.fixed or rigid.velocity:
        return np.zeros((3, 3)), False, None
    if move.along is not None:
        direction = np.array(move.along) / np.linalg.norm(move.along)
        return np.outer(direction, direction), False, None
    if move.about is not None:
        return np.zeros((3, 3)), True, np.array(move.about) / np.linalg.norm(move.about)
    return space, dim > 1 and not axisymmetric, np.array([0.0, 0.0, 1.0]) if dim == 2 else None


def _rate_of(body: PlacedBody, axis: np.ndarray | None) -> np.ndarray:
    """Return the angular velocity at the start (3,) [rad/s]: that of the fields of its velocity."""
    rate = np.zeros(3)
    for field in body.model.initial_velocity:
        if field.type == "spin":
            direction = np.array([0.0, 0.0, 1.0] if body.positions.shape[1] == 2 else field.axis)
            rate += field.rate * direction / np.linalg.norm(direction)
    return rate if axis is None else axis * float(axis @ rate)


def _carried_rate(
    properties: MassProperties, mass: np.ndarray, r: np.ndarray, u: np.ndarray, axis: np.ndarray | None
) -> np.ndarray:
    """Return the angular velocity (3,) [rad/s] of particles at `r` (n, 3) from the centre with the velocities `u`."""
    spin = np.array([exact_sum(mass * component) for component in cross(r, u).T])
    if axis is None:
        return np.linalg.solve(properties.point_inertia, spin)
    return axis * float(axis @ spin) / float(axis @ properties.point_inertia @ axis)


def _is_cut_by(body: PlacedBody, plane: Plane) -> bool:
    """Return whether a plane of symmetry cuts the body: it stands within a spacing of its particles."""
    return bool(np.abs(body.positions[:, plane.axis] - plane.at).min() < float(body.spacing.max()))


def _properties(body: PlacedBody, mass: np.ndarray) -> MassProperties:
    """Return the mass properties of particles of `mass` (n,) [kg], or those that the case gives."""
    properties, rigid, dim = mass_properties(mass, body.positions, body.breadth), body.model.rigid, 3
    if rigid is not None and rigid.inertia:
        share, dim = float(body.volumes.sum() / body.filling.volumes.sum()), body.positions.shape[1]
        inertia = np.diag([*([0.0, 0.0] if dim == 2 else []), *rigid.inertia]) * share
        properties = MassProperties(properties.mass, properties.centre, inertia, properties.point_inertia)
    return properties


def mass_properties(mass: np.ndarray, position: np.ndarray, spacing: np.ndarray) -> MassProperties:
    """Return the mass properties of particles."""
    exact, total, x = exact_sum, exact_sum(mass), in_space(position)
    centre = np.array([exact(mass * component) for component in x.T]) / total
    r, point_inertia = x - centre, np.empty((3, 3))
    square = (r * r).sum(axis=1)
    for i in range(3):
        for j in range(3):
            point_inertia[i, j] = exact(mass * ((i == j) * square - r[:, i] * r[:, j]))
    return MassProperties(total, centre, point_inertia + np.eye(3) * exact(mass * spacing**2) / 6.0, point_inertia)


def describe_rigid(case: Case, body: PlacedBody, material: Material) -> str:
    """Return motion, mass, centre and moments of inertia about x, y, z of a rigid body, or its kept part, in words."""
    rigid, axisymmetric = body.model.rigid, KINEMATICS[case.kinematics].axisymmetric
    assert rigid is not None
    mass = body.carried["mass"] if body.carried else rigid_material(body, material).density * body.volumes
    properties = _properties(body, mass)
    words = "moves along x" if axisymmetric and rigid.words == "free" else rigid.words
    kg, metre = (" kg", " m") if case.units == "si" else ("", "")
    unit = kg and kg + ("" if axisymmetric else {1: "/m^2", 2: "/m", 3: ""}[case.dim])
    centre = ", ".join(f"{x:.6g}" for x in properties.centre[: 1 if axisymmetric else case.dim])
    text = f"{words}, mass {properties.mass:.6g}{unit}, centre {centre}{metre}"
    ignored = [name for name in ("strength", "damage") if getattr(body.model.material, name).type != "none"]
    text += f", without {' and '.join(ignored)} of its material" if ignored else ""
    if case.dim == 1 or axisymmetric or rigid.move.fixed or rigid.move.along is not None or rigid.velocity:
        return text
    moments = ", ".join(f"{x:.6g}" for x in np.diag(properties.inertia)[0 if case.dim == 3 else 2 :])
    return f"{text}, moments of inertia {moments}{kg and kg + (' m^2' if case.dim == 3 else ' m')}"
