"""Advice on a case before its run."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hvisph.case.formulations.contact import PenaltyContact
from hvisph.core.text import recommend

from .facts import Facts, Rule
from .formulation_advice import FORMULATION_CONDITIONS
from .hugoniot_check import hugoniot_warnings
from .impact_pair import impact_pair
from .material_advice import MATERIAL_CONDITIONS

if TYPE_CHECKING:
    from hvisph.case.case import Case

FEWEST_ACROSS = 5  # particles across a body, below which its waves and its bending are not resolved
# Ratio of the time steps by contact and by material below which a warning is given.
SHARE = 0.5


@cache
def rules() -> list[Rule]:
    """Return all rules in the order of their advice."""
    texts = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    conditions = FORMULATION_CONDITIONS | MATERIAL_CONDITIONS
    return [Rule(condition, **texts[name]) for name, condition in conditions.items()]


def advice(case: Case) -> list[str]:
    """Return advice on formulation, contact, smoothing length, spacing and material."""
    facts = Facts(case)
    texts = [rule.texts(facts) for rule in rules()]
    return [*texts[0], *texts[1], *hugoniot_warnings(case), *(text for one in texts[2:] for text in one)]


def sparse(across: Mapping[str, int], resolution: float) -> list[str]:
    """Return which bodies have too few particles across, from the numbers by name at a spacing `resolution` [m]."""
    return [
        recommend(
            f"bodies.{name}: {count} particles across do not resolve its waves and its bending; {FEWEST_ACROSS} are "
            "few, 10 show what matters: give a finer resolution",
            f"resolution={0.1 * max(count, 1) * resolution:.3g}",
        )
        for name, count in across.items()
        if count < FEWEST_ACROSS
    ]


def tears(case: Case) -> str:
    """Return which solids without damage come under tension after an impact; empty where none does."""
    if Facts(case).overload < 1.0:
        return ""
    names = [
        name
        for name, body in case.bodies.items()
        if body.material.strength.type not in ("none", "fabric") and body.material.damage.type == "none"
    ]
    if not names:
        return ""
    return (
        f"release waves bring tension up to the impact pressure to {', '.join(names)}, without a model of damage: "
        "where and when a lattice of particles tears is not physics"
    )


def contact_warnings(case: Case) -> list[str]:
    """Return warnings about the contact between the impact pair."""
    model = getattr(case.formulation, "contact", None)
    chosen = isinstance(model, PenaltyContact) or getattr(model, "stiffness", None) is not None
    if not chosen or len(case.bodies) < 2:
        return []
    from hvisph.setup.formulations import contact_of
    from hvisph.setup.materials import material_of
    from hvisph.sph.kernels import KERNELS

    contact, kernel = contact_of(model), KERNELS[case.formulation.kernel]
    pair = impact_pair(case)
    bodies = list(case.bodies.values())[:2] if pair is None else [case.bodies[pair.first], case.bodies[pair.second]]
    materials = [material_of(body.material, body.internal_energy) for body in bodies]
    dx, dim = case.resolution, case.dim
    stiffness = min(contact.of_material(m.density, m.bulk_sound_speed, dx, dim) for m in materials)
    pressure = contact.carried_over_stiffness(kernel, case.formulation.h_over_dx, dim) * stiffness
    if not contact.stores:
        pressure *= dx**dim
    warnings = []
    if pair is not None:
        # acoustic: below the shock's pressure, so that a warning is never in vain
        first, second = (m.density * m.bulk_sound_speed for m in materials)
        expected = pair.velocity * first * second / (first + second)
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
