"""Whether a case's contact between bodies is stiff enough to hold, and not so stiff that it sets the step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hvisph.case.formulations.contact import PenaltyContact
from hvisph.core.text import recommend

from .impact_pair import meeting

if TYPE_CHECKING:
    from hvisph.case.case import Case

# The contact may take the step to this share of the material's without a word.
SHARE = 0.5


def contact_warnings(case: Case) -> list[str]:
    """Return what is doubtful about the contact of the two bodies that meet first; nothing where there is none."""
    model = getattr(case.formulation, "contact", None)
    chosen = isinstance(model, PenaltyContact) or getattr(model, "stiffness", None) is not None
    if not chosen or len(case.bodies) < 2:
        return []
    from hvisph.setup.formulations import contact_of
    from hvisph.setup.materials import material_of
    from hvisph.sph.kernels import KERNELS

    contact, kernel = contact_of(model), KERNELS[case.formulation.kernel]
    met = meeting(case)
    bodies = list(case.bodies.values())[:2] if met is None else [case.bodies[met.first], case.bodies[met.second]]
    materials = [material_of(body.material, body.internal_energy) for body in bodies]
    dx, dim = case.resolution, case.dim
    stiffness = min(contact.of_material(m.density, m.bulk_sound_speed, dx, dim) for m in materials)
    pressure = contact.carried_over_stiffness(kernel, case.formulation.h_over_dx, dim) * stiffness
    if not contact.stores:
        pressure *= dx**dim
    warnings = []
    if met is not None:
        # acoustic: below the shock's pressure, so that a warning is never in vain
        first, second = (m.density * m.bulk_sound_speed for m in materials)
        expected = met.velocity * first * second / (first + second)
        if expected > pressure:
            words = (
                f"formulation.contact: carries about {pressure:.3g} Pa, and the impact brings {expected:.3g} Pa: the "
                f"bodies may pass through each other; give it a higher stiffness"
            )
            warnings.append(recommend(words, _times(model, 1.01 * expected / pressure)))
    for material in materials:
        stiff = contact.closer(kernel, case.formulation.h_over_dx, dim, dx)
        omega2 = 2.0 * stiffness * stiff / material.density
        share = 2.0 / np.sqrt(omega2) * material.longitudinal_sound_speed / case.smoothing_length
        if share < SHARE:
            words = (
                f"formulation.contact: limits the step to about {share:.2g} of what '{material.name}' allows; give it "
                "a lower stiffness, or accept as many more steps"
            )
            warnings.append(recommend(words, _times(model, 0.99 * (share / SHARE) ** 2)))
            break
    return warnings


def _times(model: object, factor: float) -> str:
    """Return the setting of the stiffness with `factor` times its value."""
    key = "stiffness" if getattr(model, "absolute_stiffness", None) is None else "absolute_stiffness"
    return f"formulation.contact.{key}={factor * getattr(model, key):.3g}"
