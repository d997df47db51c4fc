"""Initial fields of a body's particles: material, density, energy and history variables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.materials.damage import GradyKipp
from hvisph.materials.eos import JonesWilkinsLee
from hvisph.materials.eos.jwl import BURN_SPACINGS
from hvisph.materials.material_table import Material
from hvisph.materials.stress_update import NOTHING

from .bodies import PlacedBody
from .materials import material_of

# Fields that hold a particle's memory, in the order of `materials.stress_update.NOTHING`.
MEMORY = ("history_variable", "flaw_strain", "flaw_exponent", "flaws", "strain_rate")


def body_material(body: PlacedBody, dim: int, dx: float) -> Material:
    """Return the material of a body, with the parameters that depend on the spacing: crack growth, burn width."""
    material = material_of(body.model.material, body.model.internal_energy)
    material = with_cracks(material, float(body.volumes.mean()) * dx ** (3 - dim))
    detonation = getattr(body.model.material.eos, "detonation", None)
    if isinstance(material.eos, JonesWilkinsLee) and detonation is not None:
        speed = detonation.speed or material.eos.chapman_jouguet()[0]
        eos = replace(material.eos, burn_rate=speed / (BURN_SPACINGS * dx))
        material = replace(material, eos=eos)
    return material


def with_cracks(material: Material, volume: float) -> Material:
    """Return a material with crack growth through particles of a volume [m^3]."""
    if not isinstance(material.damage, GradyKipp):
        return material
    speed = GradyKipp.speed_share * material.longitudinal_sound_speed
    young = material.young_modulus
    damage = replace(material.damage, crack_speed=speed, young_modulus=young, particle_volume=volume)
    return replace(material, damage=damage)


def initial_history(body: PlacedBody, material: Material, dim: int, drawn: int, dx: float) -> np.ndarray:
    """Return the initial history variables of a body's particles, (count, 5)."""
    memory = np.tile(np.array(NOTHING), (len(body.positions), 1))
    memory[:, 0] = 0.0 if material.porosity is None else material.porosity.distension
    detonation = getattr(body.model.material.eos, "detonation", None)
    if isinstance(material.eos, JonesWilkinsLee):
        memory[:, 0] = 0.0
        if detonation is not None:
            points = np.array(detonation.points, dtype=float)
            if points.shape[1] != dim:
                message = f"a point has {points.shape[1]} components, needs {dim} in {dim}D"
                raise CaseError(message, where=f"bodies.{body.name}.material.eos.detonation.points")
            distance = np.sqrt(((body.positions[:, None] - points) ** 2).sum(axis=2)).min(axis=1)
            memory[:, 0] = -detonation.time - distance / (detonation.speed or material.eos.chapman_jouguet()[0])
    if isinstance(material.damage, GradyKipp):
        volume = float(body.volumes.sum()) * dx ** (3 - drawn)
        memory[:, 1:4] = material.damage.flaws(body.name, len(body.positions), volume)
    return memory
