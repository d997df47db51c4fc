"""Materials of a case as objects to be packed for compiled loops."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hvisph.core.errors import CaseError
from hvisph.core.text import Plain
from hvisph.materials import damage, eos, strength
from hvisph.materials.damage.fracture_energy import FractureEnergy
from hvisph.materials.material_table import Material
from hvisph.materials.melting import Lindemann, Simon
from hvisph.materials.porosity import Porosity
from hvisph.materials.slots import KEEPS_STRESS
from hvisph.output.hdf5 import SUFFIXES, read_eos_table

if TYPE_CHECKING:
    from hvisph.case.bodies import Body
    from hvisph.case.materials.damage import Damage as DamageModel
    from hvisph.case.materials.eos import Eos as EosModel
    from hvisph.case.materials.material import Material as MaterialModel

# Keys of the case for the fields that parameter classes call otherwise.
STEINBERG_KEYS = {"exponent": "n", "gamma0": "melt_gamma", "a_melt": "melt_a"}
KEYS: Mapping[type, Mapping[str, str]] = {
    eos.Elastic: {"young_modulus": "youngs_modulus"},
    eos.StiffenedGas: {"gamma0": "gamma"},
    eos.MieGrueneisen: {"gamma0": "gamma"},
    eos.UsUpTable: {"gamma0": "gamma"},
    eos.Tillotson: {"capital_b": "b_modulus", "small_a": "a", "small_b": "b"},
    eos.JonesWilkinsLee: {"capital_a": "a", "capital_b": "b"},
    strength.JohnsonCook: {"yield_stress": "a", "hardening_coefficient": "b", "hardening_exponent": "n",
                           "rate_coefficient": "c", "thermal_exponent": "m", "specific_heat": "heat_capacity"},
    strength.SteinbergGuinan: STEINBERG_KEYS,
    strength.SteinbergLund: STEINBERG_KEYS | {"rate_c1": "c1", "drag": "c2"},
    strength.ZerilliArmstrong: {"exponent": "n"},
    strength.JohnsonHolmquist: {"intact": "a", "intact_exponent": "n", "fractured": "b", "fractured_exponent": "m",
                                "rate_coefficient": "c"},
    damage.PressureCutoff: {"pressure_minimum": "pressure"},
    damage.JohnsonCookDamage: {"pressure_minimum": "pressure_cutoff"},
    Lindemann: {"gamma0": "gamma"},
}  # fmt: skip


MELTING = {"lindemann": Lindemann, "simon": Simon}


def material_of(model: MaterialModel, internal_energy: float = 0.0) -> Material:
    """Return the material of a case's `model`; `internal_energy` [J/kg] defines an ideal gas at rest."""
    heat, law = model.temperature, model.melting
    of_state = parameters(eos.REGISTRY[model.eos.type], model.eos, **_of_eos(model.eos, model.density, internal_energy))
    heat_of_melting = None
    if heat.type == "isentrope" and heat.melting_point is not None and heat.heat_of_melting is not None:
        heat_of_melting = heat.melting_point, heat.heat_of_melting
    material = Material(
        name=model.name,
        density=model.density,
        eos=of_state,
        strength=parameters(
            strength.REGISTRY[model.strength.type],
            model.strength,
            shear_modulus=model.shear_modulus,
            bulk_modulus=model.density * of_state.ambient_sound_speed(model.density) ** 2,
        ),
        damage=parameters(
            damage.REGISTRY[model.damage.type],
            model.damage,
            void_growth=getattr(model.damage, "high_triaxiality", "") == "void_growth",
        ),
        porosity=None if model.porosity is None else parameters(Porosity, model.porosity, **_ends(model.porosity)),
        heat_capacity=heat.heat_capacity or 0.0,
        room_temperature=heat.room_temperature or 0.0,
        total_energy=heat.type == "total_energy",
        melting=None if law is None or law.type not in MELTING else parameters(MELTING[law.type], law),
        entropies=(law and law.entropies) or (),
        failed_friction=_failed_friction(model.damage),
        rate_smoothing=getattr(model.strength, "rate_smoothing", 0),
        **_spall(model.damage),
        heat_capacities=getattr(heat, "heat_capacities", ()),
        heat_of_melting=heat_of_melting,
    )
    if material.entropies and model.eos.type == "table" and of_state.grid.entropy is None:
        fault = "the table has no entropy and no free energy: leave out `melting: {entropies: ...}`"
        raise CaseError(fault, file=str(model.eos.file))
    if not getattr(model.damage, "breaks", False):
        return material
    return replace(material, fracture=_fracture(model.damage, model.fracture_toughness, material))


def _ends(model: Any) -> dict[str, float]:
    """Return both ends of a crush curve of points [Pa]; nothing for other curves."""
    return {"elastic_pressure": model.crush[0][0], "solid_pressure": model.crush[-1][0]} if model.crush else {}


def parameters(kind: type[Any], model: object, **known: object) -> Any:
    """Return the parameter object `kind` of a case's model: each field from `known`, or from the key of its name.

    Fields whose key the model lacks, or has as null, keep their defaults.
    """
    keys = KEYS.get(kind, {})
    values = {
        one.name: getattr(model, keys[one.name]) if one.name in keys else getattr(model, one.name, None)
        for one in fields(kind)
    }
    values |= {name: value for name, value in known.items() if name in values}
    return kind(**{name: value for name, value in values.items() if value is not None})


def _of_eos(model: EosModel, density: float, internal_energy: float) -> Plain:
    """Return the parameters of an equation of state that are no keys of its model."""
    known: Plain = {"reference_density": density, "ambient_energy": internal_energy}
    if model.type == "linear":
        known["bulk_modulus"] = model.modulus(density)
    elif model.type == "mie_gruneisen":
        known |= dict(zip(("sound_speed", "s1", "s2", "s3"), model.hugoniot, strict=True))
        known["linear_expansion"] = model.expansion == "linear"
    elif model.type == "table":
        path = Path(model.file)
        is_table = path.suffix in SUFFIXES
        if is_table and model.format is None:
            known["grid"] = eos.Grid(**read_eos_table(path))
        else:
            known["grid"] = eos.read_table(path, model.format, model.number)
        eos.check_units(known["grid"], density, path)
    return known


def _spall(model: DamageModel) -> Plain:
    """Return spall strength [Pa], infinite if absent, its exponent [-] and its rate [1/s]."""
    exponent: float = getattr(model, "spall_exponent", 0.0)
    if model.type == "pressure_cutoff":
        spall = -model.pressure if exponent else inf
    else:
        spall = getattr(model, "spall_strength", None) or inf
    return {"spall_strength": spall, "spall_exponent": exponent, "spall_rate": getattr(model, "spall_rate", 1.0)}


def _fracture(model: Any, of_material: float | None, material: Material) -> FractureEnergy:
    """Return the energy that failure takes; a toughness K implies K^2 (1 - nu^2)/E (Irwin)."""
    energy = model.fracture_energy
    if energy is None:
        toughness: Any = of_material if model.toughness == "material" else model.toughness
        young, poisson = material.young_modulus, material.young_modulus / (2.0 * material.shear_modulus) - 1.0
        energy = toughness**2 * (1.0 - poisson**2) / young
    return FractureEnergy(energy, getattr(model, "fitted_at", None) or 0.0)


def _failed_friction(model: DamageModel) -> float:
    rest = {"unchanged": KEEPS_STRESS, "rubble": getattr(model, "friction", 0.0)}
    return rest.get(getattr(model, "failed_strength", ""), 0.0)


def start_of(name: str, model: Body, material: Material) -> tuple[float, float]:
    """Return initial density [kg/m^3] and specific internal energy [J/kg] of a body.

    Raises `CaseError` for a temperature without a state of zero pressure.
    """
    rest = material.density_at_rest
    if model.temperature is None:
        return rest, model.internal_energy or material.eos.ambient_energy
    try:
        density, energy = material.at_temperature(model.temperature)
    except CaseError as error:
        raise CaseError(error.message, where=f"bodies.{name}.temperature") from None
    return density * rest / material.density, energy
