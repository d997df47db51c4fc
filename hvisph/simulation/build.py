"""From a case to the objects of a run: the only translator."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.core.kinematics import KINEMATICS
from hvisph.core.particles import BODY, CLAMPED, FLAGS, ID, MATERIAL, Particles
from hvisph.formulations.eulerian import Eulerian
from hvisph.formulations.protocol import AnyStepper
from hvisph.formulations.riemann import Riemann
from hvisph.formulations.stepper import Stepper
from hvisph.integrators.criteria import Criteria
from hvisph.integrators.scheme import SCHEMES
from hvisph.materials.table import Material
from hvisph.simulation.bodies import PlacedBody, placed_bodies
from hvisph.simulation.formulations import formulation_of
from hvisph.simulation.gauges import Gauges
from hvisph.simulation.impact_pressure import stiff_enough
from hvisph.simulation.kernel_types import filled_region, set_kernel_types, set_loads
from hvisph.simulation.share import Share
from hvisph.simulation.starting import MEMORY, body_material, remembered, start_of
from hvisph.simulation.velocities import initial_velocity
from hvisph.sph.symmetry import AXIS, Plane

if TYPE_CHECKING:
    from hvisph.case.case import Case

# Spacings that differ by more than this share of the case's are unlike; filling a shape exactly changes them by less.
UNLIKE = 0.005


@dataclass
class Setup:
    """What a run works with.

    Parameters
    ----------
    stepper, criteria
        Particles with their forces, and the limits of the step.
    bodies, materials
        Names, in the order of the particles' tags.
    planes
        Planes of symmetry.
    gauges
        What is recorded where.
    density_limits
        Density [kg/m^3] of each material below which its equation of state holds, infinite for most.
    share
        What of it this process has.
    notes
        Which sizes had to give way to the spacing of particles.
    """

    stepper: AnyStepper
    criteria: Criteria
    bodies: list[str]
    materials: list[str]
    planes: tuple[Plane, ...]
    gauges: Gauges
    density_limits: np.ndarray
    share: Share
    notes: tuple[str, ...] = ()

    @property
    def particles(self) -> Particles:
        """The state."""
        return self.stepper.particles


def build(case: Case, bodies: list[PlacedBody] | None = None) -> Setup:
    """Build the objects of a run.

    Parameters
    ----------
    case
        The case.
    bodies
        Its bodies, where they are already placed.

    Raises
    ------
    CaseError
        Where the case cannot be built: overlapping bodies, a clamp that holds nothing.
    """
    placed = bodies or placed_bodies(case)
    dim, dx = case.dim, case.resolution
    formulation = formulation_of(case)
    scheme = SCHEMES[case.time.integrator]
    h = formulation.h_over_dx * dx
    kinematics = KINEMATICS[case.kinematics]
    extra = (*formulation.fields, *scheme.extra_fields(kinematics.revolved))
    made = [body_material(body, case.drawn, dx) for body in placed]
    if any(material.remembers for material in made):
        _refuse_memory(case, made)
        extra = (*extra, *MEMORY)
    particles = Particles(dim, sum(len(b.positions) for b in placed), extra, kinematics)
    materials, first = [], 0
    for number, (body, material) in enumerate(zip(placed, made, strict=True)):
        if material not in materials:
            materials.append(material)
        part = slice(first, first + len(body.positions))
        first = part.stop
        particles["position"][part] = body.positions
        particles["velocity"][part] = initial_velocity(body.model, body.positions, body.middle)
        density, energy = start_of(body, material)
        particles["mass"][part] = density * body.volumes
        particles["density"][part] = density
        particles["internal_energy"][part] = energy
        if material.remembers:
            for name, values in zip(MEMORY, remembered(body, material, dim, case.drawn, dx).T, strict=True):
                particles[name][part] = values
        particles.tags[part, BODY] = number
        particles.tags[part, MATERIAL] = materials.index(material)
    lengths = np.full(particles.count, h)
    if isinstance(formulation, Riemann | Eulerian):  # the others have one smoothing length for all
        lengths = formulation.h_over_dx * np.concatenate([body.spacing for body in placed])
        formulation = replace(formulation, unlike=bool(np.ptp(lengths) > UNLIKE * h))
    particles["smoothing_length"] = lengths
    means = [particles["velocity"][particles.body == number].mean(axis=0) for number in range(len(placed))]
    own = [materials[particles.material[particles.body == number][0]] for number in range(len(placed))]
    formulation = stiff_enough(formulation, getattr(case.formulation, "contact", None), own, means)
    particles.tags[:, ID] = np.arange(particles.count)
    names = [body.name for body in placed]
    for number, clamp in enumerate(case.clamped):
        held = filled_region(particles, clamp, names, f"clamped.{number}")
        particles.tags[held, FLAGS] |= CLAMPED
        particles["velocity"][held] = 0.0
    set_kernel_types(particles, case, names)
    sides = {"above": 1.0, "below": -1.0}
    planes = tuple(Plane("xyz".index(plane.axis), plane.at, sides[plane.keep]) for plane in case.symmetry)
    if kinematics.revolved:
        planes = (*planes, AXIS)
    stepper = formulation.stepper(
        particles, formulation, materials, scheme.stage, scheme.previous, float(lengths.max()), planes,
        **scheme.further(),
    )  # fmt: skip
    if isinstance(stepper, Stepper):
        stepper.h_low *= float(lengths.min() / lengths.max())
    set_loads(stepper, case, names)
    criteria = Criteria(dim, particles.count, case.time.cfl, formulation.viscous_factor)
    gauges = Gauges(case.gauges, placed, dx, stepper)
    notes = tuple(
        f"{body.name}: mass {body.model.material.density * body.volumes.sum():.6g}; {body.filling.note}"
        for body in placed
        if body.filling.note
    )
    limits = np.array([_largest_density(material) for material in materials])
    return Setup(stepper, criteria, names, [material.name for material in materials], planes, gauges, limits,
                 Share(stepper, criteria, planes), notes)  # fmt: skip


def _refuse_memory(case: Case, made: list[Material]) -> None:
    """Refuse materials with a memory where a formulation's pressure has none."""
    if case.formulation.type != "projection" and case.kinematics != "plane_stress":
        return
    name, _ = next((n, m) for n, m in zip(case.bodies, made, strict=True) if m.remembers)
    raise CaseError(
        "pores, programmed burn, rate_smoothing, grady_kipp, grady_spall and johnson_holmquist damage need another "
        "formulation than projection, and other kinematics than plane_stress",
        where=f"bodies.{name}.material",
    )


def _largest_density(material: Material) -> float:
    """Return the density [kg/m^3] at which a material's equation of state ends."""
    largest = getattr(material.eos, "largest_density", None)
    return float("inf") if largest is None else float(largest(material.density))
