"""From the case's materials to the objects that the compiled loops are packed from."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hvisph.core.errors import CaseError
from hvisph.materials.damage import (
    CockcroftLatham,
    GradyKipp,
    GradySpall,
    JohnsonCookDamage,
    JohnsonHolmquistDamage,
    NoDamage,
    PressureCutoff,
    PrincipalStress,
)
from hvisph.materials.eos import (
    Elastic,
    Grid,
    IdealGas,
    JonesWilkinsLee,
    Linear,
    MieGrueneisen,
    Murnaghan,
    Polynomial,
    StiffenedGas,
    Table,
    Tillotson,
    UsUpTable,
    read_grid,
)
from hvisph.materials.material_table import Material
from hvisph.materials.melting import Lindemann, Simon
from hvisph.materials.porosity import Porosity
from hvisph.materials.slots import KEEPS_STRESS, EquationOfState, Model
from hvisph.materials.strength import (
    CowperSymonds,
    ElasticStrength,
    JohnsonCook,
    JohnsonHolmquist,
    LinearHardening,
    NoStrength,
    Rock,
    SteinbergGuinan,
    SteinbergLund,
    VonMises,
    ZerilliArmstrong,
)
from hvisph.output.eos_table import SUFFIXES, read_eos_table

if TYPE_CHECKING:
    from hvisph.case.materials.damage import Damage as DamageModel
    from hvisph.case.materials.eos import Eos as EosModel
    from hvisph.case.materials.material import Material as MaterialModel
    from hvisph.case.materials.strength import Strength as StrengthModel
    from hvisph.case.materials.thermal import Melting as MeltingModel
    from hvisph.case.materials.thermal import Temperature as TemperatureModel


def material_of(model: MaterialModel, internal_energy: float = 0.0) -> Material:
    """Return the material that a case's `model` describes.

    Parameters
    ----------
    model
        A `hvisph.case.materials.material.Material`.
    internal_energy
        Specific internal energy that its body starts with [J/kg]: an ideal gas at rest is known by it.
    """
    shear, heat, pores = model.shear_modulus, model.temperature, model.porosity
    return Material(
        model.name,
        model.density,
        _eos(model.eos, model.density, internal_energy),
        _strength(model.strength, shear),
        _damage(model.damage),
        None if pores is None else Porosity(pores.distension, pores.elastic_pressure, pores.solid_pressure),
        heat.heat_capacity or 0.0,
        heat.room_temperature or 0.0,
        heat.type == "total_energy",
        _melting(model.melting),
        _failed_friction(model.damage),
        getattr(model.strength, "rate_smoothing", 0),
        *_spall(model.damage),
        getattr(heat, "heat_capacities", ()),
        _heat_of_melting(heat),
    )


def _spall(damage: DamageModel) -> tuple[float, float, float]:
    """Return spall strength [Pa], infinite where none is given, its exponent [-] and the rate of it [1/s]."""
    exponent: float = getattr(damage, "spall_exponent", 0.0)
    if damage.type == "pressure_cutoff":
        return (-damage.pressure if exponent else inf), exponent, damage.spall_rate
    return getattr(damage, "spall_strength", None) or inf, exponent, getattr(damage, "spall_rate", 1.0)


def _heat_of_melting(heat: TemperatureModel) -> tuple[float, float] | None:
    if heat.type != "isentrope" or heat.melting_point is None or heat.heat_of_melting is None:
        return None
    return heat.melting_point, heat.heat_of_melting


def _melting(melting: MeltingModel | None) -> Lindemann | Simon | None:
    if melting is None:
        return None
    if melting.type == "lindemann":
        return Lindemann(melting.temperature, melting.gamma, melting.a)
    return Simon(melting.temperature, melting.a, melting.c)


def _failed_friction(damage: DamageModel) -> float:
    if damage.type == "none" or damage.type == "johnson_holmquist":
        return 0.0
    return (
        KEEPS_STRESS
        if damage.failed_strength == "unchanged"
        else damage.friction
        if damage.failed_strength == "rubble"
        else 0.0
    )


def _eos(eos: EosModel, density: float, internal_energy: float) -> EquationOfState:
    match eos.type:
        case "linear":
            return Linear(eos.modulus(density))
        case "elastic":
            return Elastic(eos.youngs_modulus, eos.poisson_ratio)
        case "stiffened_gas":
            return StiffenedGas(eos.sound_speed, eos.gamma)
        case "mie_gruneisen":
            c0, s1, s2, s3 = eos.hugoniot
            return MieGrueneisen(c0, eos.gamma, s1, s2, s3, eos.a, eos.expansion == "linear")
        case "us_up_table":
            return UsUpTable(eos.us_up, eos.gamma)
        case "tillotson":
            return Tillotson(eos.bulk_modulus, eos.b_modulus, eos.a, eos.b, eos.reference_energy, eos.alpha, eos.beta,
                             eos.incipient_energy, eos.vaporization_energy, eos.expansion,
                             eos.low_density)  # fmt: skip
        case "polynomial":
            return Polynomial(eos.a1, eos.a2, eos.a3, eos.b0, eos.b1, eos.t1 or 0.0, eos.t2)
        case "murnaghan":
            return Murnaghan(eos.bulk_modulus, eos.exponent, eos.gamma)
        case "jwl":
            return JonesWilkinsLee(eos.a, eos.b, eos.r1, eos.r2, eos.omega, eos.detonation_energy, density)
        case "table":
            return Table(_grid(Path(eos.file), eos.number), density)
        case "ideal_gas":
            return IdealGas(eos.gamma, internal_energy)
    raise ValueError(eos.type)


def _grid(path: Path, number: int | None) -> Grid:
    return Grid(**read_eos_table(path)) if path.suffix in SUFFIXES else read_grid(path, number)


def _strength(strength: StrengthModel, shear: float) -> Model:
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
        case "steinberg_guinan" | "steinberg_lund":
            shared = (shear, strength.yield_stress, strength.yield_limit, strength.beta, strength.n,
                      strength.pressure_coefficient, strength.heat_coefficient, strength.melt_temperature,
                      strength.melt_gamma, strength.melt_a, strength.initial_strain)  # fmt: skip
            if strength.type == "steinberg_guinan":
                return SteinbergGuinan(*shared)
            return SteinbergLund(*shared, strength.c1, strength.activation_energy, strength.peierls_stress, strength.c2)
        case "zerilli_armstrong":
            return ZerilliArmstrong(shear, strength.lattice, strength.c0, strength.c3, strength.c4, strength.c1,
                                    strength.c2, strength.c5, strength.n, strength.melt_temperature or inf)  # fmt: skip
        case "cowper_symonds":
            return CowperSymonds(shear, strength.yield_stress, strength.reference_rate, strength.exponent,
                                 strength.hardening_modulus)  # fmt: skip
        case "rock":
            return Rock(shear, strength.cohesion, strength.friction, strength.limit or inf, strength.broken_friction,
                        strength.melt_energy or inf, strength.melt_temperature or inf)  # fmt: skip
        case "johnson_holmquist":
            return JohnsonHolmquist(shear, strength.hugoniot_elastic_limit, strength.hel_pressure, strength.tension,
                                    strength.a, strength.n, strength.b, strength.m, strength.c,
                                    strength.fractured_limit or inf)  # fmt: skip
    raise ValueError(strength.type)


def _damage(damage: DamageModel) -> Model:
    match damage.type:
        case "none":
            return NoDamage()
        case "pressure_cutoff":
            return PressureCutoff(damage.pressure, damage.permanent)
        case "grady_kipp":
            return GradyKipp(damage.weibull_k, damage.weibull_m, damage.seed)
        case "grady_spall":
            return GradySpall(damage.toughness, damage.yield_stress, damage.critical_strain)
        case "principal_stress":
            return PrincipalStress(damage.tensile_strength, damage.shear_strength or inf)
        case "cockcroft_latham":
            return CockcroftLatham(damage.critical_work)
        case "johnson_holmquist":
            return JohnsonHolmquistDamage(damage.d1, damage.d2, damage.beta)
        case "johnson_cook":
            cutoff = -inf if damage.pressure_cutoff is None else damage.pressure_cutoff
            strain = (damage.d1, damage.d2, damage.d3, damage.d4, damage.d5, damage.reference_rate)
            return JohnsonCookDamage(*strain, cutoff, damage.softening, damage.high_triaxiality == "void_growth")
    raise ValueError(damage.type)


def start_of(name: str, model: Any, material: Material) -> tuple[float, float]:
    """Return density [kg/m^3] and specific internal energy [J/kg] that a body of the case starts with.

    Raises
    ------
    CaseError
        For a temperature that the material cannot have at no pressure.
    """
    rest = material.density_at_rest
    if model.temperature is None:
        return rest, model.internal_energy or material.eos.ambient_energy
    try:
        density, energy = material.at_temperature(model.temperature)
    except CaseError as error:
        raise CaseError(error.message, where=f"bodies.{name}.temperature") from None
    return density * rest / material.density, energy
