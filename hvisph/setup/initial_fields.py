"""Initial fields of a body's particles: material, density, energy and history variables."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hvisph.case.case import Case
from hvisph.core.errors import CaseError
from hvisph.core.particles import CLAMPED, FLAGS, Particles
from hvisph.integrators.gravity import GRAVITATIONAL_CONSTANT, SPHERE, UNIFORM, Gravity
from hvisph.integrators.rigid_body import RigidMotion
from hvisph.materials.damage import GradyKipp
from hvisph.materials.damage.fracture_energy import WIDTH
from hvisph.materials.eos import JonesWilkinsLee
from hvisph.materials.eos.jwl import BURN_SPACINGS
from hvisph.materials.material_table import Material
from hvisph.materials.stress_update import NO_HISTORY
from hvisph.measures.fragments import connected_groups
from hvisph.sph.neighbours.ghost_rows import Plane

from .bodies import PlacedBody
from .materials import material_of

COLUMN_POINTS = 400  # points of the column along which the pressure of the overburden is integrated
LINK_DISTANCE = 1.5  # [dx] below which particles support each other


def body_material(body: PlacedBody, dim: int, dx: float) -> Material:
    """Return the material of a body, with the parameters that depend on the spacing: crack growth, burn width."""
    material = material_of(body.model.material, body.model.internal_energy)
    material = with_cracks(material, float(_cells(body, dim, dx).mean()))
    detonation = getattr(body.model.material.eos, "detonation", None)
    if isinstance(material.eos, JonesWilkinsLee) and detonation is not None:
        speed = detonation.speed or material.eos.chapman_jouguet()[0]
        eos = replace(material.eos, burn_rate=speed / (BURN_SPACINGS * dx))
        material = replace(material, eos=eos)
    return material


def _cells(body: PlacedBody, drawing_dim: int, dx: float) -> np.ndarray:
    """Return the volumes of particles for flaws (n,) [m^3]: of axisymmetric ones the cube of the side of their section.

    An axisymmetric particle stands for 2 pi r/dx equal cells. With all of their flaws it would be as weak as the
    weakest of them.
    """
    axisymmetric = drawing_dim != body.positions.shape[1]
    return body.breadth**3 if axisymmetric else body.volumes * dx ** (3 - drawing_dim)


def with_cracks(material: Material, volume: float) -> Material:
    """Return a material with crack growth through particles of a volume [m^3]."""
    if not isinstance(material.damage, GradyKipp):
        return material
    speed = GradyKipp.speed_share * material.longitudinal_sound_speed
    young = material.young_modulus
    damage = replace(material.damage, crack_speed=speed, young_modulus=young, particle_volume=volume)
    return replace(material, damage=damage)


def initial_history(
    body: PlacedBody, material: Material, dim: int, drawing_dim: int, dx: float, begins: float = 0.0
) -> np.ndarray:
    """Return the initial history variables of a body's particles, (count, 9), in a run that begins at a time [s].

    The width of a crack band is the side of a particle's square or cube, of its section if axisymmetric.
    """
    history = np.tile(np.array(NO_HISTORY), (len(body.positions), 1))
    history[:, WIDTH] = body.breadth
    history[:, 0] = 0.0 if material.porosity is None else material.porosity.distension
    detonation = getattr(body.model.material.eos, "detonation", None)
    if isinstance(material.eos, JonesWilkinsLee):
        history[:, 0] = 0.0
        if detonation is not None:
            points = np.array(detonation.points, dtype=float)
            if points.shape[1] != dim:
                message = f"a point has {points.shape[1]} components, needs {dim} in {dim}D"
                raise CaseError(message, where=f"bodies.{body.name}.material.eos.detonation.points")
            distance = np.sqrt(((body.positions[:, None] - points) ** 2).sum(axis=2)).min(axis=1)
            history[:, 0] = (
                begins - detonation.time - distance / (detonation.speed or material.eos.chapman_jouguet()[0])
            )
    if isinstance(material.damage, GradyKipp):
        volume = float(_cells(body, drawing_dim, dx).sum())
        history[:, 1:4] = material.damage.flaws(body.name, len(body.positions), volume)
    return history


def gravity_of(case: Case) -> Gravity | None:
    """Return the field of gravity of a case, if any."""
    model = case.gravity
    if model is None:
        return None
    if model.type == "uniform":
        return Gravity(UNIFORM, model.acceleration)
    centre = model.centre or (0.0,) * case.dim
    return Gravity(SPHERE, centre, GRAVITATIONAL_CONSTANT * model.mass, model.radius)


def gravity_option(case: Case) -> dict[str, Gravity]:
    """Return the option of a stepper that follows from the gravity of a case."""
    gravity = gravity_of(case)
    return {} if gravity is None else {"gravity": gravity}


def refuse_unsupported(
    case: Case,
    placed: Sequence[PlacedBody],
    particles: Particles,
    planes: Sequence[Plane],
    rigid: Sequence[RigidMotion] = (),
) -> None:
    """Raise `CaseError` for bodies at rest under uniform gravity without a support.

    Bodies linked by `LINK_DISTANCE` spacings have common supports: planes of symmetry across all components of gravity,
    clamped particles, or a rigid body that gravity does not move.
    """
    gravity = gravity_of(case)
    if gravity is None or gravity.kind != UNIFORM or (case.overburden is None and case.settle is None):
        return
    rests = ~np.array([bool(body.mean_velocity.any()) for body in placed])[particles.body]
    spacing = np.concatenate([body.spacing for body in placed])
    groups = np.full(particles.count, -1)
    groups[rests] = connected_groups(particles["position"][rests], float(spacing.max()), LINK_DISTANCE)
    supported = (particles.tags[:, FLAGS] & CLAMPED) != 0
    falls = [m.name for m in rigid if (m.moves[:, : len(gravity.vector)] @ np.array(gravity.vector)).any()]
    supported &= ~np.array([body.name in falls for body in placed])[particles.body]
    for group in range(int(groups.max(initial=-1)) + 1):
        rows = np.flatnonzero(groups == group)
        if supported[rows].any():
            continue
        for axis, g in enumerate(gravity.vector):
            gaps = [
                float((plane.side * (particles["position"][rows, axis] - plane.at) / spacing[rows]).min())
                for plane in planes
                if plane.axis == axis and plane.side * g < 0.0
            ]
            if g and not (gaps and min(gaps) < LINK_DISTANCE):
                body = placed[int(particles.body[rows[0]])].name
                below = f"{min(gaps) - 0.5:.3g} spacings above the plane" if gaps else "on no plane"
                message = f"stands {below} along {'xyz'[axis]} and falls; move it onto its support or clamp it"
                raise CaseError(message, where=f"bodies.{body}")


def add_overburden(
    case: Case, bodies: Sequence[PlacedBody], materials: Sequence[Material], particles: Particles
) -> None:
    """Set density, mass and deviator of the bodies at rest under their own weight and that of what lies on them.

    A body carries the bodies on its top: bodies at rest of the same width whose lowest particles are at most
    `LINK_DISTANCE` spacings above its highest ones. Particles are those of the bodies, in their order.

    Raises `CaseError` for others on its top, unless they settle.
    """
    gravity, overburden = gravity_of(case), case.overburden
    if gravity is None or overburden is None:
        return
    columns, first = [], 0
    for body, material in zip(bodies, materials, strict=True):
        part = slice(first, first + len(body.positions))
        first = part.stop
        if not body.mean_velocity.any():
            columns.append((body, material, part, _heights(gravity, body.positions)))
    standing: list[tuple[PlacedBody, float, float]] = []  # bodies above, with height and stress of their lowest face
    for body, material, part, height in sorted(columns, key=lambda column: -float(column[3].max())):
        top, tolerance, borne = float(height.max()), LINK_DISTANCE * float(body.spacing.max()), [0.0]
        if body.model.rigid is not None:
            standing.append((body, float(height.min()), 0.0))
            continue
        for upper, low, stress in standing:
            if upper.name == body.name or not abs(low - top) < tolerance:
                continue
            covers, same_width = _widths(gravity, upper, body)
            if case.settle is None and (not same_width or (covers and upper.model.rigid is not None)):
                reason = "is rigid" if same_width else "is not as wide"
                fault = f"stands on '{body.name}' and {reason}: its weight is not in the stress there; give `settle`"
                raise CaseError(fault, where=f"bodies.{upper.name}")
            borne += [stress] if covers else []
        stress = _load_column(overburden.lateral, gravity, body, material, particles, part, max(borne))
        standing.append((body, float(height.min()), stress))


def _heights(gravity: Gravity, x: np.ndarray) -> np.ndarray:
    """Return heights (n,) [m] of positions (n, dim) against gravity, from the origin or the centre of a sphere on."""
    if gravity.kind == UNIFORM:
        g = np.array(gravity.vector)
        return np.asarray(-(x @ (g / np.sqrt((g * g).sum()))))
    return np.asarray(np.sqrt(((x - np.array(gravity.vector)) ** 2).sum(axis=1)))


def _widths(gravity: Gravity, above: PlacedBody, below: PlacedBody) -> tuple[bool, bool]:
    """Return whether one body covers another across gravity, to a spacing, and whether they are as wide or apart.

    About the centre of a sphere what covers another is taken to be as wide.
    """
    g = np.array(gravity.vector)
    direction = g / np.sqrt((g * g).sum()) if gravity.kind == UNIFORM else np.zeros(len(g))
    upper, lower = (body.positions - np.outer(body.positions @ direction, direction) for body in (above, below))
    slack = max(float(above.spacing.max()), float(below.spacing.max()))
    low, high = upper.min(axis=0) - lower.min(axis=0), upper.max(axis=0) - lower.max(axis=0)
    covers = bool((low < slack).all() and (high > -slack).all())
    if gravity.kind == SPHERE:
        return covers, True
    separate = ((upper.min(axis=0) > lower.max(axis=0)) | (upper.max(axis=0) < lower.min(axis=0))).any()
    return covers, bool(separate or (covers and (low > -slack).all() and (high < slack).all()))


def _load_column(
    lateral: float,
    gravity: Gravity,
    body: PlacedBody,
    material: Material,
    particles: Particles,
    part: slice,
    load: float,
) -> float:
    """Set density, mass and deviator of a body under its own weight and a load [Pa]; return the stress below it [Pa].

    The vertical stress -P follows from dP/ds = rho |g| along the depth s below the free face. With the ratio K0 of
    horizontal to vertical stress the pressure is (1 + 2 K0) P/3 and the deviator -(1 - K0) P (e e - I/3), e being the
    direction of gravity. Density follows from the pressure at the initial energy.
    """
    x, energy = body.positions, float(particles["internal_energy"][part][0])
    field = gravity.acceleration(x)
    size = np.sqrt((field**2).sum(axis=1))
    direction = field / np.where(size > 0.0, size, 1.0)[:, None]
    height = _heights(gravity, x)
    half = 0.5 * float(body.spacing[height.argmax()])
    depth = height.max() + half - height
    order = np.argsort(depth)
    points = np.linspace(0.0, float(depth.max()), COLUMN_POINTS)
    pull = np.interp(points, depth[order], size[order])
    share, step = (1.0 + 2.0 * lateral) / 3.0, float(points[1] - points[0])
    densities, weight = np.empty(COLUMN_POINTS), np.full(COLUMN_POINTS, load)
    densities[0] = density_under_pressure(material, share * load, energy)
    for k in range(1, COLUMN_POINTS):  # the midpoint rule, its density from the pressure half a step above
        mean = 0.5 * step * (pull[k - 1] + pull[k])
        middle = density_under_pressure(material, share * (weight[k - 1] + 0.5 * mean * densities[k - 1]), energy)
        weight[k] = weight[k - 1] + mean * middle
        densities[k] = density_under_pressure(material, share * weight[k], energy)
    stress = np.interp(depth, points, weight)
    particles["density"][part] = np.interp(depth, points, densities)
    particles["mass"][part] = particles["density"][part] * body.volumes
    direction_3d = np.zeros((len(x), 3))
    direction_3d[:, : x.shape[1]] = direction
    components = particles["deviator"][part].shape[1]
    places = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))[:components]
    for column, (a, b) in enumerate(places):
        shape = direction_3d[:, a] * direction_3d[:, b] - (1.0 / 3.0 if a == b else 0.0)
        particles["deviator"][part, column] = -(1.0 - lateral) * stress * shape
    return float(weight[-1] + half * size[height.argmin()] * densities[-1])


def density_under_pressure(material: Material, pressure: float, energy: float) -> float:
    """Return density [kg/m^3] at pressure [Pa] and energy [J/kg], by bisection; pores at initial distension.

    Raises `CaseError` for a pressure beyond half to twice the density.
    """
    of, distension = material.pressure_function(), 1.0 if material.porosity is None else material.porosity.distension
    low, high = 0.5 * material.density_at_rest * distension, 2.0 * material.density_at_rest * distension
    if not of(low, energy) <= pressure * distension <= of(high, energy):
        fault = f"{pressure:.3g} Pa at {energy:g} J/kg is beyond half to twice the density of '{material.name}'"
        raise CaseError(f"{fault}; check gravity and heights", where="overburden")
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if of(middle, energy) < pressure * distension else (low, middle)
    return high / distension
