"""Exact histories of layered barotropic impact (Zisis 2013).

Layers with p = K (rho/rho0 - 1): shocks obey p = rho0 u U with U = (u + sqrt(u^2 + 4 c^2))/2,
rarefactions du = c drho/rho; both are followed through all reflections by `fronts.track`.
Any consistent units do; Zisis's have rho0 = 1 for the projectile and K = rho0/Ca.
"""

from __future__ import annotations

from collections.abc import Sequence

from hvisph.core.errors import CaseError
from hvisph.materials.eos import Elastic, Linear
from hvisph.materials.material_table import Material

from .wave_curves import LinearLaw
from .wave_fronts import track
from .wave_history import Layer, Tracked


def barotropic_law(material: Material) -> LinearLaw:
    """Return the waves of a material whose pressure depends on density alone.

    Raises
    ------
    CaseError
        If its equation of state is not `linear` or `elastic`, or it has strength.
    """
    if not isinstance(material.eos, Linear | Elastic):
        raise CaseError(
            f"layered impact is exact for the 'linear' equation of state, not '{material.eos.name}'",
            where=material.name,
        )
    if material.shear_modulus != 0.0:
        raise CaseError("layered impact is exact for materials without strength", where=material.name)
    return LinearLaw.from_material(material)


def layered_impact(
    layers: Sequence[tuple[Material, float, float, float]], end: float, strain_step: float = 0.01
) -> Tracked:
    """Follow the impact of barotropic layers.

    Parameters
    ----------
    layers
        (material, begin [m], end [m], velocity [m/s]) from left to right; gaps are allowed.
    end
        Time to follow [s].
    strain_step
        Change of ln(rho) by which rarefactions are cut into fronts.

    Returns
    -------
    Histories by `.sample(position, times, "velocity")`, profiles by `.profile(time)`.
    """
    laws: dict[Material, LinearLaw] = {}
    made = []
    for material, begin, finish, velocity in layers:
        law = laws.setdefault(material, barotropic_law(material))
        made.append(Layer(law, begin, finish, velocity))
    return track(made, end, strain_step)
