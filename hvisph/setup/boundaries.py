"""Faces with pressures, viscous edges and ambient layers of a case, from its particles at the start."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hvisph.case.case import Case
from hvisph.core.errors import CaseError
from hvisph.core.particles import CLAMPED, FLAGS, Particles
from hvisph.geometry.cutting_planes import Edge, face_areas, follow, is_beyond, row_shares
from hvisph.integrators.boundary_forces import AmbientLayer, Boundaries, EdgeRow, Face, MovingPlane
from hvisph.integrators.prescribed_motion import GROUP_SHIFT, LAYER_GROUP, Motion
from hvisph.materials.material_table import Material
from hvisph.schemes.riemann.scheme import Riemann
from hvisph.sph.neighbours.ghost_rows import Plane

from .bodies import PlacedBody, open_edges

MEAN_REACH = 2.0  # [dx]; radius of the mean displacement that an ambient layer follows


def boundaries_of(
    case: Case,
    formulation: Any,
    placed: Sequence[PlacedBody],
    particles: Particles,
    materials: Sequence[Material],
    planes: tuple[Plane, ...],
    loaded: Sequence[np.ndarray],
) -> Boundaries | None:
    """Return faces and edges of a case, and mark the particles of ambient layers.

    `case`, `formulation`: the case and its scheme.
    `placed`, `materials`: bodies and their materials.
    `particles`: particles of all bodies.
    `planes`: planes of symmetry.
    `loaded`: which particles lie in the region of each load (n,).
    Raises `CaseError` for a load on clamped particles, an edge in a projectile, a clamp or a rigid body, or one that
    nothing reaches.
    """
    if not case.edges and not case.loads and not any(plane.velocity for plane in case.symmetry):
        return None
    edges, dim = open_edges(case), particles.dim
    x, mirrors = particles["position"], [(plane.axis, plane.at) for plane in planes]
    faces: list[Face] = []
    edge_rows: list[EdgeRow] = []
    layers: list[tuple[np.ndarray, np.ndarray, Any]] = []
    largest = max(float(body.spacing.max()) for body in placed)
    for edge in edges:
        gap = -float(edge.distance_beyond(x).max())
        if gap > 1.5 * largest:
            message = f"no body reaches it, the nearest by {gap:.3g} m; put it where a body continues, or leave it out"
            raise CaseError(message, where=_name(edges, edge))
    for number, body in enumerate(placed):
        rows, spacing = np.flatnonzero(particles.body == number), float(body.spacing.max())
        body_edges = [edge for edge in edges if (edge.distance_beyond(x[rows]) > -1.5 * spacing).any()]
        for edge in body_edges:
            _refuse_at_edge(case, body, placed, edge)
            outside = rows[edge.distance_beyond(x[rows]) > -spacing]
            if (particles.tags[outside, FLAGS] & CLAMPED).any():
                raise CaseError(f"reaches a clamp of '{body.name}'; move one of them", where=_name(edges, edge))
        outside_edges = is_beyond(edges, x[rows])
        for edge in body_edges:
            interior = rows[~outside_edges]
            distance = edge.distance_beyond(x[interior])
            edge_layer = interior[distance > distance.max() - 0.5 * spacing]
            speed, normal = materials[number].longitudinal_sound_speed, edge.sign * np.eye(dim)[edge.axis]
            transit = (float(np.ptp(distance)) + spacing) / speed
            velocity = particles["velocity"][edge_layer].copy()
            numbers = particles.id[edge_layer].copy()
            edge_rows.append(EdgeRow(_name(edges, edge), numbers, normal, velocity, speed, transit))
        if isinstance(formulation, Riemann) and outside_edges.any():
            layer, matter = rows[outside_edges], rows[~outside_edges]
            layers.append((layer, matter, follow(x[layer], x[matter], edges, mirrors, MEAN_REACH * spacing)))
        elif body_edges:
            c_l, c_t = _wave_speeds(materials[number], particles.kinematics.thins)
            for edge in body_edges:
                near, areas, lag = _face(formulation, particles, rows, spacing, (edge.axis, edge.sign))
                impedances = np.outer(particles["density"][near], (c_l, c_t))
                normal, none = edge.sign * np.eye(dim)[edge.axis], np.zeros(1)
                numbers, velocity = particles.id[near].copy(), particles["velocity"][near].copy()
                faces.append(Face(numbers, areas, normal, none, none, impedances, velocity, lag))
    for index, load in enumerate(case.loads):
        axis, sign = "xyz".index(load.normal[1]), 1.0 if load.normal[0] == "+" else -1.0
        times, pressures = (np.array(column) for column in zip(*load.pressure, strict=True))
        for number, body in enumerate(placed):
            rows = np.flatnonzero(particles.body == number)
            pressed = rows[loaded[index][rows]]
            if not len(pressed):
                continue
            near, areas, _ = _face(formulation, particles, pressed, float(body.spacing.max()), (axis, sign))
            for plane in planes:
                if plane.axis == axis and sign * plane.side < 0.0 and (abs(x[near, axis] - plane.at) < largest).any():
                    is_axis = axis and particles.kinematics.axisymmetric
                    spot = "the axis" if is_axis else f"the plane of symmetry across {'xyz'[axis]}"
                    raise CaseError(f"its face lies at {spot}, inside the body; choose another", where=f"loads.{index}")
            if (particles.tags[near, FLAGS] & CLAMPED).any() or is_beyond(edges, x[near]).any():
                message = f"acts on particles of '{body.name}' that are clamped, rigid or beyond an edge; choose others"
                raise CaseError(message, where=f"loads.{index}")
            faces.append(Face(particles.id[near].copy(), areas, sign * np.eye(dim)[axis], times, pressures))
    for layer, _, _ in layers:
        particles.tags[layer, FLAGS] = CLAMPED | LAYER_GROUP << GROUP_SHIFT
    boundaries = Boundaries(tuple(faces), _ambient_layer(particles, layers) if layers else None, dim, case.begins)
    boundaries.edge_rows = tuple(edge_rows)
    return boundaries


def _face(
    formulation: Any, particles: Particles, near: np.ndarray, spacing: float, normal: tuple[int, float]
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return particles behind the face of `near`, their areas, and how far before the face they bear its velocity [m].

    Where gradients are corrected, the row of the face bears all of its traction, and moves as matter one spacing behind
    the face does.
    """
    volumes, kernel = particles["mass"] / particles["density"], formulation.kernel
    corrected = getattr(formulation, "conversion", None) is not None and formulation.correction.acts
    shares = np.ones(1)
    if not corrected:
        layers, lateral = kernel.layers(formulation.h_over_dx, particles.dim)
        slope = np.vectorize(lambda r: abs(kernel.slope.py_func(r / formulation.h_over_dx)))
        shares = row_shares(layers, lateral, slope)
    rows, areas, depth = face_areas(
        particles["position"][near], volumes[near], spacing, normal, shares, particles.kinematics.axisymmetric
    )
    return near[rows], areas, depth if corrected else 0.0


def _ambient_layer(particles: Particles, layers: list[tuple[np.ndarray, np.ndarray, Any]]) -> AmbientLayer:
    """Combine the layers (rows, adjacent particles, sources) of all bodies."""
    sources: list[np.ndarray] = []
    terms, starts, first, count = [], [], 0, 0
    for _, matter, followed in layers:
        sources_used, index = np.unique(followed.source, return_inverse=True)
        terms.append(index + count)
        count += len(sources_used)
        sources.append(matter[sources_used])
        starts.append(followed.starts + first)
        first += len(index)
    rows, source_rows = np.concatenate([layer for layer, _, _ in layers]), np.concatenate(sources)
    weights, signs, normals = (
        np.concatenate([getattr(f, name) for _, _, f in layers]) for name in ("weight", "signs", "normals")
    )
    x, numbers = particles["position"], particles.id
    layer_state, followed = (numbers[rows].copy(), x[rows].copy()), (numbers[source_rows].copy(), x[source_rows].copy())
    return AmbientLayer(*layer_state, *followed, np.concatenate(starts), np.concatenate(terms), weights, signs, normals)


def _wave_speeds(material: Material, thins: bool) -> tuple[float, float]:
    """Return the speeds of longitudinal and shear waves [m/s]; in plane stress those of a plate."""
    c_l, c_t = material.longitudinal_sound_speed, (material.shear_modulus / material.density) ** 0.5
    return (2.0 * c_t * (1.0 - (c_t / c_l) ** 2) ** 0.5 if thins and c_t > 0.0 else c_l), c_t


def _name(edges: Sequence[Edge], edge: Edge) -> str:
    return f"edges.{list(edges).index(edge)}"


def _refuse_at_edge(case: Case, body: PlacedBody, placed: Sequence[PlacedBody], edge: Edge) -> None:
    """Raise `CaseError` where a rigid body or one that moves among others reaches an edge."""
    where = _name(open_edges(case), edge)
    if case.bodies[body.name].rigid is not None:
        raise CaseError(f"the rigid body '{body.name}' reaches it, and no wave leaves through one", where=where)
    if body.model.inclusions is not None:
        raise CaseError(f"'{body.name}' reaches it, and inclusions do not go on beyond an edge", where=where)
    moves = bool(np.any(body.mean_velocity)) and any(not np.any(b.mean_velocity) for b in placed)
    if moves or (body.model.role == "projectile" and len(placed) > 1):
        raise CaseError(f"the projectile '{body.name}' starts in it; move one of them", where=where)


def moving_planes(case: Case, planes: tuple[Plane, ...]) -> tuple[MovingPlane, ...]:
    """Return the moving ones of the planes of symmetry, which have the velocity of the start from now on."""
    moving = []
    for model, plane in zip(case.symmetry, planes, strict=False):  # behind those of the case is the axis
        if model.velocity:
            times, velocities = (np.array(column) for column in zip(*model.velocity, strict=True))
            motion = Motion(0, times, velocities[:, None])
            plane.velocity = float(motion.velocity(case.begins)[0])
            moving.append(MovingPlane(plane, motion, plane.at, case.begins))
    return tuple(moving)
