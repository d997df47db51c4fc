"""Construction of a run's objects from its case."""

from copy import deepcopy
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hvisph.case.case import Case
from hvisph.case.formulations.riemann import bears_any_tension
from hvisph.core.errors import CaseError, locate
from hvisph.core.particles import Particles
from hvisph.core.text import Plain
from hvisph.integrators.gravity import UNIFORM
from hvisph.integrators.prescribed_motion import Motion, PrescribedMotion
from hvisph.integrators.rigid_body import RigidMotion
from hvisph.integrators.scheme import SCHEMES
from hvisph.integrators.time_step import Criteria
from hvisph.materials.material_table import Material, late_material
from hvisph.parallel.subdomain import Subdomain
from hvisph.schemes.protocol import AnyStepper
from hvisph.schemes.stepper import Stepper
from hvisph.sph.neighbours.ghost_rows import Plane

from .bodies import PlacedBody
from .boundaries import moving_planes
from .gauges import Gauges
from .initial_fields import gravity_of, gravity_option
from .initial_state import InitialState, begin, set_loads

MODULUS_FACTOR = 10.0  # least bulk modulus of a late stage, of the largest pressure


@dataclass
class Setup:
    """Objects of a run.

    `bodies` and `materials` are names in the order of the particles' tags, `density_limits` the density [kg/m^3] at
    which the equation of state of each material ends, `notes` the sizes adjusted to the spacing, `observed` as of
    `InitialState`, `bears_any_tension` whether the equation of state alone limits the tension in a body,
    `driven` whether a clamp moves, a body is rigid or a pressure acts, `supported` whether clamps, planes or rigid
    bodies take momentum, `substances` the models of `materials`,
    `origin` as of `InitialState`.
    """

    stepper: AnyStepper
    criteria: Criteria
    bodies: list[str]
    materials: list[str]
    planes: tuple[Plane, ...]
    gauges: Gauges
    density_limits: np.ndarray
    subdomain: Subdomain
    notes: tuple[str, ...] = ()
    observed: dict[str, np.ndarray] | None = None
    bears_any_tension: tuple[bool, ...] = ()
    driven: bool = False
    supported: bool = False
    substances: tuple[Material, ...] = ()
    origin: Plain = field(default_factory=dict)

    @property
    def particles(self) -> Particles:
        """Particles of the run."""
        return self.stepper.particles


def build(case: Case, bodies: list[PlacedBody] | None = None) -> Setup:
    """Build the objects of a run; arguments and errors as of `initial_state.begin`."""
    return set_up(case, begin(case, bodies))


def set_up(case: Case, start: InitialState) -> Setup:
    """Return the objects of a run from its initial state, all of it or a part."""
    scheme, particles, formulation = SCHEMES[case.time.integrator], start.particles, start.formulation
    options = scheme.stepper_options() | gravity_option(case) | _late_option(case, start)
    stages = scheme.stage, scheme.previous, start.longest, start.planes
    stepper = formulation.stepper(particles, formulation, start.materials, *stages, **options)
    if isinstance(stepper, Stepper):
        stepper.h_limits *= start.spreads
    if start.sequence is not None:
        stepper.keep_order(start.sequence)
    set_loads(stepper, case, start.bodies)
    driven = [(number + 1, clamp.motion(particles.dim)) for number, clamp in enumerate(case.clamped) if clamp.moves]
    motions: list[Motion | RigidMotion] = [Motion(k, np.array(times), np.array(u)) for k, (times, u) in driven]
    motions += deepcopy(list(start.rigid))  # a run moves its own
    if motions:
        stepper.motion = PrescribedMotion(tuple(motions), particles.dim)
        stepper.motion.time = case.begins
    criteria = Criteria(particles.dim, particles.count, case.time.cfl, formulation.viscous_factor)
    limits = np.array([_largest_density(material) for material in start.materials])
    subdomain = Subdomain(stepper, criteria, start.planes, start.count)
    if start.boundaries is not None:
        stepper.boundaries = start.boundaries
        stepper.boundaries.share = subdomain
        stepper.boundaries.moving = moving_planes(case, start.planes)
    pushed = bool(motions or case.loads or any(plane.velocity for plane in case.symmetry))
    return Setup(stepper, criteria, start.bodies, [material.name for material in start.materials], start.planes,
                 Gauges(start.gauges, stepper), limits, subdomain, start.notes, start.observed,
                 tuple(bears_any_tension(case.bodies[name]) for name in start.bodies),
                 pushed, pushed or bool(case.clamped or case.symmetry),
                 tuple(start.materials), start.origin)  # fmt: skip


def _late_option(case: Case, start: InitialState) -> dict[str, Any]:
    """Return the option of a stepper that follows from the late stages of a case.

    Raises `CaseError` for a bulk modulus above that of a material, or below ten times the pressure of its weight.
    """
    if not case.late:
        return {}
    late_materials, materials, gravity, weight = [], start.materials, gravity_of(case), 0.0
    if gravity is not None and gravity.kind == UNIFORM and (case.overburden is not None or case.settle is not None):
        height = start.particles["position"] @ np.array(gravity.vector)
        for number, m in enumerate(materials):
            weight = max(weight, m.density_at_rest * float(np.ptp(height[start.particles.material == number])))
    for number, stage in enumerate(case.late):
        with locate(f"late.{number}"):
            modulus = stage.bulk_modulus or min(m.bulk_modulus for m in materials)  # until the state decides
            if modulus < MODULUS_FACTOR * weight:
                fault = f"is below ten times the pressure at the bottom, {weight:.3g} Pa, so that the stage would stop"
                raise CaseError(f"{fault} the run; give {100.0 * weight:.3g} Pa or more", where="bulk_modulus")
            late_materials.append([late_material(m, modulus, stage.nu) for m in materials])
    return {"later": late_materials}


def _largest_density(material: Material) -> float:
    """Return the largest density [kg/m^3] of a material's equation of state."""
    largest = getattr(material.eos, "largest_density", None)
    return float("inf") if largest is None else float(largest(material.density))
