"""Materials of the problems, as mappings for case files and as objects for exact solutions."""

from __future__ import annotations

from typing import Any

from hvisph.case.case import Case
from hvisph.casefile.material_library import library_values
from hvisph.materials.material_table import Material
from hvisph.setup.materials import material_of

# Elastic aluminium of the bars, beams and discs.
RHO, YOUNGS_MODULUS, POISSON_RATIO = 2700.0, 70e9, 0.33  # [kg/m^3], [Pa], [-]
ELASTIC: dict[str, Any] = {
    "density": RHO,
    "eos": {"type": "elastic", "youngs_modulus": YOUNGS_MODULUS, "poisson_ratio": POISSON_RATIO},
    "strength": {"type": "elastic"},
}
# Water that bears no tension to speak of.
WATER: dict[str, Any] = {
    "density": 1000.0,
    "eos": {"type": "linear", "bulk_modulus": 2.2e9},
    "damage": {"type": "pressure_cutoff", "pressure": -1e3},
}


def fluid(name: str) -> dict[str, Any]:
    """Return a material of the library without its strength and damage."""
    return library_values(name) | {"strength": {"type": "none"}, "damage": {"type": "none"}}


def body_material(case: Case, body: str) -> Material:
    """Return the material of a case's body."""
    model = case.bodies[body]
    return material_of(model.material, model.internal_energy)
