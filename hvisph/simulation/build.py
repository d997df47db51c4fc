"""From a case to the objects of a run: the only translator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.core.particles import BODY, CLAMPED, FLAGS, ID, MATERIAL, Particles
from hvisph.formulations.stepper import Stepper
from hvisph.integrators.criteria import Criteria
from hvisph.integrators.scheme import SCHEMES
from hvisph.simulation.bodies import PlacedBody, placed_bodies
from hvisph.simulation.formulations import formulation_of
from hvisph.simulation.materials import material_of
from hvisph.sph.symmetry import Plane


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
    """

    stepper: Stepper
    criteria: Criteria
    bodies: list[str]
    materials: list[str]
    planes: tuple[Plane, ...]

    @property
    def particles(self) -> Particles:
        """The state."""
        return self.stepper.particles


def build(case: Any, bodies: list[PlacedBody] | None = None) -> Setup:
    """Build the objects of a run.

    Parameters
    ----------
    case
        A `hvisph.case.case.Case`.
    bodies
        Its bodies, where they are already placed.

    Raises
    ------
    CaseError
        Where the case cannot be built: overlapping bodies, a clamp that holds nothing.
    """
    if case.kinematics == "plane_stress":
        raise CaseError("'plane_stress' is not available yet; use plane_strain", where="kinematics")
    placed = bodies or placed_bodies(case)
    dim, dx = case.dim, case.resolution
    formulation = formulation_of(case.formulation)
    scheme = SCHEMES[case.time.integrator]
    h = formulation.h_over_dx * dx
    particles = Particles(dim, sum(len(b.positions) for b in placed), (*formulation.fields, *scheme.extra_fields()))
    materials, first = [], 0
    for number, body in enumerate(placed):
        material = material_of(body.model.material, body.model.internal_energy)
        if material not in materials:
            materials.append(material)
        part = slice(first, first + len(body.positions))
        first = part.stop
        particles["position"][part] = body.positions
        particles["velocity"][part] = body.model.velocity
        particles["mass"][part] = material.density * body.volumes
        particles["density"][part] = material.density
        particles["internal_energy"][part] = body.model.internal_energy
        particles.tags[part, BODY] = number
        particles.tags[part, MATERIAL] = materials.index(material)
    particles["smoothing_length"] = h
    particles.tags[:, ID] = np.arange(particles.count)
    names = [body.name for body in placed]
    for number, clamp in enumerate(case.clamped):
        held = _held(particles, clamp, names)
        if not held.any():
            raise CaseError("this region holds no particle; check its corners and bodies", where=f"clamped.{number}")
        particles.tags[held, FLAGS] |= CLAMPED
        particles["velocity"][held] = 0.0
    planes = tuple(Plane("xyz".index(plane.axis), plane.at) for plane in case.symmetry)
    stepper = Stepper(particles, formulation, materials, scheme.stage, scheme.previous, h, planes)
    criteria = Criteria(dim, particles.count, case.time.cfl, formulation.viscous_factor)
    return Setup(stepper, criteria, names, [material.name for material in materials], planes)


def _held(particles: Particles, clamp: Any, names: list[str]) -> np.ndarray:
    """Return which particles a clamp holds (n,)."""
    position = particles["position"]
    held = np.ones(particles.count, bool)
    for axis, corner in enumerate(clamp.box.min):
        if corner is not None:
            held &= position[:, axis] >= corner
    for axis, corner in enumerate(clamp.box.max):
        if corner is not None:
            held &= position[:, axis] <= corner
    if clamp.bodies:
        held &= np.isin(particles.body, [names.index(name) for name in clamp.bodies])
    return held
