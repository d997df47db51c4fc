"""Initial state of all particles."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hvisph.case.case import Case
from hvisph.case.output import BoxRegion, Region
from hvisph.core.catalogues import KINEMATICS
from hvisph.core.errors import CaseError
from hvisph.core.fields import CRACK, HISTORY
from hvisph.core.particles import BODY, CLAMPED, FLAGS, ID, MATERIAL, Particles
from hvisph.core.text import Plain
from hvisph.integrators.boundary_forces import Boundaries
from hvisph.integrators.prescribed_motion import GROUP_SHIFT, Motion
from hvisph.integrators.rigid_body import RigidMotion
from hvisph.integrators.scheme import SCHEMES
from hvisph.materials.material_table import Material
from hvisph.measures.fragments import connected_groups
from hvisph.schemes.riemann.scheme import Riemann
from hvisph.schemes.standard.scheme import Eulerian
from hvisph.setup.formulations import stiff_enough
from hvisph.sph.contact.penalty_contact import Pressing
from hvisph.sph.kernels import KERNELS
from hvisph.sph.neighbours.ghost_rows import AXIS, Plane

from .bodies import PlacedBody, placed_bodies
from .boundaries import boundaries_of
from .formulations import formulation_of
from .gauges import PlacedGauge, placed_gauges
from .initial_fields import add_overburden, body_material, initial_history, refuse_unsupported
from .materials import material_axes, start_of
from .rigid_bodies import describe_rigid, rigid_material, rigid_motions
from .start import origin_of

EULERIAN = "eulerian"


def in_region(particles: Particles, region: Region, names: list[str]) -> np.ndarray:
    """Return which particles lie in a case's region, a `box` and `bodies` (n,)."""
    inside = in_box(region.box, particles["position"])
    if region.bodies:
        inside &= np.isin(particles.body, [names.index(name) for name in region.bodies])
    return inside


def in_box(box: BoxRegion, positions: np.ndarray) -> np.ndarray:
    """Return which positions (n, dim) lie in a case's box (n,)."""
    inside = np.ones(len(positions), bool)
    for axis, corner in enumerate(box.min):
        if corner is not None:
            inside &= positions[:, axis] >= corner
    for axis, corner in enumerate(box.max):
        if corner is not None:
            inside &= positions[:, axis] <= corner
    return inside


def held_particles(clamps: Sequence[Region], name: str, positions: np.ndarray) -> np.ndarray:
    """Return which particles of the body `name` are clamped (n,)."""
    clamped = np.zeros(len(positions), bool)
    for clamp in clamps:
        if not clamp.bodies or name in clamp.bodies:
            clamped |= in_box(clamp.box, positions)
    return clamped


def filled_region(particles: Particles, region: Region, names: list[str], where: str) -> np.ndarray:
    """Return which particles lie in a region; raise `CaseError` for an empty one."""
    inside = in_region(particles, region, names)
    if not inside.any():
        raise CaseError("this region holds no particle; check its corners and bodies", where=where)
    return inside


def set_kernel_types(particles: Particles, case: Case, names: list[str]) -> None:
    """Set the kernel type of every particle, for formulations with several."""
    if "kernel_type" not in particles.names:
        return
    kinds = [body.formulation or case.formulation.type for body in case.bodies.values()]
    particles["kernel_type"] = np.array([float(kernel != EULERIAN) for kernel in kinds])[particles.body]
    for number, region in enumerate(getattr(case.formulation, "eulerian_regions", ())):
        where = f"formulation.eulerian_regions.{number}"
        particles["kernel_type"][filled_region(particles, region, names, where)] = 0.0


def set_loads(stepper: Any, case: Case, names: list[str]) -> None:
    """Apply the case's initial loads."""
    for load in case.initial_loads:
        stepper.loads[in_region(stepper.particles, load, names)] += load.pressure


def refuse_outside(particles: Particles, domain: BoxRegion | None, names: list[str]) -> None:
    """Raise `CaseError` where particles start outside the case's `domain`."""
    outside = np.flatnonzero(~in_box(domain, particles["position"])) if domain is not None else np.zeros(0, int)
    if len(outside):
        body = names[int(particles.body[outside[0]])]
        raise CaseError(f"{len(outside)} particles start outside, the first of body '{body}'", where="domain")


# Relative difference above which spacings are unequal; filling a shape exactly changes them by less.
SPACING_TOLERANCE = 0.005
# Kinds of shapes that may have several separate parts.
MULTIPART_SHAPES = ("union", "intersection", "difference", "repeat", "prism", "honeycomb", "mesh", "particles")


@dataclass
class InitialState:
    """Initial state of a run: particles of all bodies or of a part.

    `longest` is the largest smoothing length [m], `spreads` (materials, 2) the least and the largest of each material
    over it; `count` is the number of particles of all bodies. For a part, `observed` has the numbers of particles whose
    pressures the history records, by column, and `sequence` (n,) their places in the order of all, if the scheme keeps
    an order. `origin` tells of the other run that this one starts from, see `start.Origin.as_dict`; `rigid` are the
    motions of rigid bodies, `boundaries` faces and edges.
    """

    particles: Particles
    formulation: Any
    materials: list[Material]
    planes: tuple[Plane, ...]
    longest: float
    spreads: np.ndarray
    bodies: list[str]
    gauges: dict[str, PlacedGauge]
    notes: tuple[str, ...]
    count: int
    observed: dict[str, np.ndarray] | None = None
    sequence: np.ndarray | None = None
    origin: Plain = field(default_factory=dict)
    rigid: tuple[RigidMotion, ...] = ()
    boundaries: Boundaries | None = None


def begin(case: Case, bodies: list[PlacedBody] | None = None) -> InitialState:
    """Create the particles of a case and their initial fields.

    Raises `CaseError` for overlapping bodies, a clamp without particles, a domain that is too small.
    """
    placed = bodies or placed_bodies(case)
    formulation = formulation_of(case)
    parts = [
        rigid_material(part, body_material(part, case.drawing_dimensions, case.resolution))
        for body in placed
        for part in body.parts
    ]
    if case.late:
        parts = [replace(material, late=True) for material in parts]
    particles, materials = _state(case, formulation.fields, placed, parts)
    if "band_width" in particles.offsets:
        is_new = np.concatenate([np.full(len(body.positions), not body.carried) for body in placed])
        particles["band_width"][is_new] *= getattr(formulation, "band_spacings", 1.0)
    lengths = np.full(particles.count, formulation.h_over_dx * case.resolution)
    if isinstance(formulation, Riemann | Eulerian):  # the others have one smoothing length for all
        h = formulation.h_over_dx * case.resolution
        lengths = formulation.h_over_dx * np.concatenate([body.spacing for body in placed])
        formulation = replace(formulation, unequal_spacings=bool(np.ptp(lengths) > SPACING_TOLERANCE * h))
        if isinstance(formulation, Riemann) and formulation.corrected_variant:
            formulation = replace(formulation, fractures=any(material.fracture is not None for material in parts))
        contact: Any = getattr(case.formulation, "contact", None)
        if _has_several_parts(case, contact, placed):
            formulation = replace(formulation, has_contact=True, friction=contact.friction, fragment_contact=True)
    if isinstance(formulation, Riemann) and case.edges:
        formulation = replace(formulation, edges=True)
    if isinstance(formulation, Riemann) and any(material.has_axes for material in parts):
        formulation = replace(formulation, anisotropic=True)
    particles["smoothing_length"] = lengths
    if isinstance(formulation, Riemann | Eulerian):
        _set_carried(particles, placed, "smoothing_length")
    means = [particles["velocity"][particles.body == number].mean(axis=0) for number in range(len(placed))]
    body_materials = [materials[particles.material[particles.body == number][0]] for number in range(len(placed))]
    formulation = stiff_enough(formulation, getattr(case.formulation, "contact", None), body_materials, means)
    names = [body.name for body in placed]
    _apply_clamps(case, particles, names)
    sides = {"above": 1.0, "below": -1.0}
    planes = tuple(Plane("xyz".index(plane.axis), plane.at, sides[plane.keep]) for plane in case.symmetry)
    rigid = rigid_motions(case, particles, placed, parts, planes)
    if rigid and isinstance(formulation, Riemann | Eulerian) and formulation.has_contact:
        of_rigid: Any = {"rigid": True, "turns": case.dim > 1 and not particles.kinematics.axisymmetric}
        formulation = replace(formulation, **of_rigid)
    elif rigid and isinstance(getattr(formulation, "contact", None), Pressing):
        formulation = replace(formulation, contact=replace(formulation.contact, rigid=True))
    _set_carried(particles, placed, "kernel_type")
    refuse_outside(particles, case.domain, names)
    if particles.kinematics.axisymmetric:
        planes = (*planes, AXIS)
    refuse_unsupported(case, placed, particles, planes, rigid)
    loaded = [filled_region(particles, load, names, f"loads.{number}") for number, load in enumerate(case.loads)]
    boundaries = boundaries_of(case, formulation, placed, particles, body_materials, planes, loaded)
    unit = {1: " kg/m^2", 2: " kg/m", 3: " kg"}[case.drawing_dimensions] if case.units == "si" else ""
    notes = tuple(
        f"{body.name}: mass {particles['mass'][particles.body == number].sum():.6g}{unit}; {body.filling.note}"
        for number, body in enumerate(placed)
        if body.filling.note
    )
    masses = zip(placed, body_materials, strict=True)
    stiff = [(body, material) for body, material in masses if body.model.rigid is not None]
    notes = (*notes, *(f"{body.name}: rigid, {describe_rigid(case, body, material)}" for body, material in stiff))
    origin = {} if case.start is None else origin_of(case).as_dict()
    if origin:
        notes = (*notes, "craters, bulges and penetration are measured from the bodies at the start of this run")
    if origin.get("lost_on_mapping"):
        joule = " J" if case.units == "si" else ""
        notes = (*notes, f"contact energy of the run, {origin['lost_on_mapping']:.6g}{joule}, does not go on")
    gauges = placed_gauges(case.gauges, placed, case.resolution)
    longest = float(lengths.max())
    of_materials = [lengths[particles.material == number] for number in range(len(materials))]
    spreads = np.array([[h_.min() / longest, h_.max() / longest] for h_ in of_materials])
    return InitialState(particles, formulation, materials, planes, longest, spreads, names, gauges, notes,
                     particles.count, origin=origin, rigid=rigid, boundaries=boundaries)  # fmt: skip


def _set_carried(particles: Particles, placed: list[PlacedBody], name: str) -> None:
    """Set a field of the bodies that start from another run to its values there."""
    for number, body in enumerate(placed):
        if name in body.carried and name in particles.offsets:
            particles[name][particles.body == number] = body.carried[name]


def _has_several_parts(case: Case, contact: Any, placed: list[PlacedBody]) -> bool:
    """Return whether the only body of a case has several components in frictional contact."""
    if len(placed) > 1 or contact is None or contact.type != "frictional" or contact.self_contact is not None:
        return False
    (body,) = placed
    if body.model.shape.type not in MULTIPART_SHAPES:
        return False
    reach = KERNELS[case.formulation.kernel].reach * case.formulation.h_over_dx
    return bool(connected_groups(body.positions, float(body.spacing.max()), reach).any())


def _state(
    case: Case, fields: tuple[str, ...], placed: list[PlacedBody], part_materials: list[Material]
) -> tuple[Particles, list[Material]]:
    """Return the particles of `placed` bodies, and the distinct materials."""
    dim, dx, kinematics = case.dim, case.resolution, KINEMATICS[case.kinematics]
    scheme = SCHEMES[case.time.integrator]
    fields = tuple(name for name in fields if scheme.previous or not name.startswith("previous_"))
    names = (*fields, *scheme.extra_fields(kinematics.axisymmetric))
    if any(material.has_history for material in part_materials):
        _refuse_memory(case, part_materials)
        names = (*names, *HISTORY)
        if any(material.fracture is not None for material in part_materials):
            names = (*names, *CRACK)
    if any(material.has_axes for material in part_materials):
        names = (*names, "material_axes", "failure_modes")
    particles = Particles(dim, sum(len(b.positions) for b in placed), names, kinematics)
    materials: list[Material] = []
    first = 0
    parts = [(number, part) for number, body in enumerate(placed) for part in body.parts]
    for (number, body), material in zip(parts, part_materials, strict=True):
        if material not in materials:
            materials.append(material)
        part = slice(first, first + len(body.positions))
        first = part.stop
        particles["position"][part] = body.positions
        particles["velocity"][part] = body.velocity
        density, energy = start_of(body.name, body.model, material)
        particles["mass"][part] = density * body.volumes
        particles["density"][part] = density
        particles["internal_energy"][part] = energy
        if material.has_history and not body.carried:
            history = initial_history(body, material, dim, case.drawing_dimensions, dx, case.begins)
            for name, values in zip((*HISTORY, *CRACK), history.T, strict=True):
                if name in particles.offsets:
                    particles[name][part] = values
        if material.has_axes and not body.carried:
            particles["material_axes"][part] = material_axes(case, body.name, body.model, material)
        elif body.model.axes is not None and not material.has_axes:
            fault = f"'{material.name or 'its material'}' is the same in all directions; leave it out"
            raise CaseError(fault, where=f"bodies.{body.name}.axes")
        particles.tags[part, BODY] = number
        particles.tags[part, MATERIAL] = materials.index(material)
    add_overburden(case, [body for _, body in parts], part_materials, particles)
    for name in {name for body in placed for name in body.carried}:
        _set_carried(particles, placed, name)
    particles.tags[:, ID] = np.arange(particles.count)
    return particles, materials


def _apply_clamps(case: Case, particles: Particles, names: list[str]) -> None:
    """Clamp particles and set kernel types; raise an error for regions without particles."""
    for number, clamp in enumerate(case.clamped):
        clamped = filled_region(particles, clamp, names, f"clamped.{number}")
        for index, (name, body) in enumerate(case.bodies.items() if case.start is None else ()):
            moves = (any(body.velocity) and body.velocity != clamp.velocity) or body.initial_velocity
            if moves and body.rigid is None and clamped[particles.body == index].all():
                fault = f"holds all of '{name}', and takes the velocity that it starts with; leave one of them out"
                raise CaseError(fault, where=f"clamped.{number}")
        particles.tags[clamped, FLAGS] |= CLAMPED
        particles.tags[clamped, FLAGS] &= (1 << GROUP_SHIFT) - 1
        particles["velocity"][clamped] = 0.0
        if clamp.moves:
            particles.tags[clamped, FLAGS] |= (number + 1) << GROUP_SHIFT
            times, velocities = clamp.motion(case.dim)
            particles["velocity"][clamped] = Motion(0, np.array(times), np.array(velocities)).velocity(case.begins)
    set_kernel_types(particles, case, names)
    for number, load in enumerate(case.initial_loads):
        filled_region(particles, load, names, f"initial_loads.{number}")


def _refuse_memory(case: Case, part_materials: list[Material]) -> None:
    """Raise an error for materials with history variables in formulations without their pressure."""
    if case.formulation.type != "projection" and case.kinematics != "plane_stress":
        return
    names = [name for name, body in case.bodies.items() for _ in range(1 if body.inclusions is None else 2)]
    name, _ = next((n, m) for n, m in zip(names, part_materials, strict=True) if m.has_history)
    raise CaseError(
        "pores, programmed burn, rate_smoothing, a fracture energy, grady_kipp, grady_spall and johnson_holmquist "
        "damage need another formulation than projection, and other kinematics than plane_stress",
        where=f"bodies.{name}.material",
    )
