"""From the case's materials to the objects that the compiled loops are packed from."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import Any

from hvisph.materials.damage import FailureMark, JohnsonCookDamage, NoDamage, PressureCutoff
from hvisph.materials.eos import (
    Elastic,
    IdealGas,
    JonesWilkinsLee,
    Linear,
    MieGrueneisen,
    Murnaghan,
    Polynomial,
    StiffenedGas,
    Table,
    Tillotson,
    read_grid,
)
from hvisph.materials.strength import ElasticStrength, JohnsonCook, LinearHardening, NoStrength, VonMises
from hvisph.materials.table import Material


def material_of(model: Any, internal_energy: float = 0.0) -> Material:
    """Return the material that a case's `model` describes.

    Parameters
    ----------
    model
        A `hvisph.case.materials.Material`.
    internal_energy
        Specific internal energy that its body starts with [J/kg]: an ideal gas at rest is known by it.
    """
    shear = model.shear_modulus
    return Material(
        model.name,
        model.density,
        _eos(model.eos, model.density, internal_energy),
        _strength(model.strength, shear),
        _damage(model.damage),
    )


def _eos(eos: Any, density: float, internal_energy: float) -> Any:
    match eos.type:
        case "linear":
            return Linear(eos.modulus(density))
        case "elastic":
            return Elastic(eos.youngs_modulus, eos.poisson_ratio)
        case "stiffened_gas":
            return StiffenedGas(eos.sound_speed, eos.gamma)
        case "mie_gruneisen":
            c0, s1, s2, s3 = eos.hugoniot
            return MieGrueneisen(c0, eos.gamma, s1, s2, s3, eos.a)
        case "tillotson":
            return Tillotson(eos.bulk_modulus, eos.b_modulus, eos.a, eos.b, eos.reference_energy, eos.alpha, eos.beta,
                             eos.incipient_energy, eos.complete_energy, eos.cold_tension == "linear",
                             eos.low_density)  # fmt: skip
        case "polynomial":
            return Polynomial(eos.a1, eos.a2, eos.a3, eos.b0, eos.b1, eos.t1 or 0.0, eos.t2)
        case "murnaghan":
            return Murnaghan(eos.bulk_modulus, eos.exponent, eos.gamma)
        case "jwl":
            return JonesWilkinsLee(eos.a, eos.b, eos.r1, eos.r2, eos.omega, eos.energy_density, density)
        case "table":
            return Table(read_grid(Path(eos.file), eos.number), density)
        case "ideal_gas":
            return IdealGas(eos.gamma, internal_energy)
    raise ValueError(eos.type)


def _strength(strength: Any, shear: float) -> Any:
    match strength.type:
        case "none":
            return NoStrength()
        case "elastic":
            return ElasticStrength(shear)
        case "von_mises":
            return VonMises(shear, strength.yield_stress)
        case "linear_hardening":
            return LinearHardening(shear, strength.yield_stress, strength.hardening_modulus)
        case "johnson_cook":
            return JohnsonCook(shear, strength.a, strength.b, strength.n, strength.c, strength.m,
                               strength.melt_temperature, strength.heat_capacity, strength.room_temperature,
                               strength.reference_rate)  # fmt: skip
    raise ValueError(strength.type)


def _damage(damage: Any) -> Any:
    match damage.type:
        case "none":
            return NoDamage()
        case "pressure_cutoff":
            return PressureCutoff(damage.pressure)
        case "johnson_cook":
            cutoff = -inf if damage.pressure_cutoff is None else damage.pressure_cutoff
            model = FailureMark if damage.failed == "keeps_stress" else JohnsonCookDamage
            return model(damage.d1, damage.d2, damage.d3, damage.d4, damage.d5, damage.reference_rate, cutoff)
    raise ValueError(damage.type)
