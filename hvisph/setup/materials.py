"""Materials of a case as objects to be packed for compiled loops, and the axes of anisotropic ones."""

from collections.abc import Mapping
from dataclasses import fields, replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from hvisph.case.bodies import Body
from hvisph.case.case import Case
from hvisph.case.materials.damage import Damage as DamageModel
from hvisph.case.materials.eos import Eos as EosModel
from hvisph.case.materials.material import Material as MaterialModel
from hvisph.core.catalogues import KINEMATICS
from hvisph.core.errors import CaseError, locate
from hvisph.core.text import Plain
from hvisph.geometry.placement import rotation_matrix
from hvisph.materials import damage, eos, strength
from hvisph.materials.damage.fracture_energy import FractureEnergy
from hvisph.materials.material_table import Material
from hvisph.materials.melting import Lindemann, Simon
from hvisph.materials.porosity import Porosity
from hvisph.materials.slots import KEEPS_STRESS
from hvisph.output.hdf5 import SUFFIXES, read_eos_table

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


def parameters(model_type: type[Any], model: object, **derived: object) -> Any:
    """Return the parameters `model_type` of a case model, of `derived` or keys of their names; null keeps defaults."""
    keys = KEYS.get(model_type, {})
    values = {
        entry.name: getattr(model, keys[entry.name]) if entry.name in keys else getattr(model, entry.name, None)
        for entry in fields(model_type)
    }
    values |= {name: value for name, value in derived.items() if name in values}
    return model_type(**{name: value for name, value in values.items() if value is not None})


def _of_eos(model: EosModel, density: float, internal_energy: float) -> Plain:
    """Return the parameters of an equation of state that are no keys of its model."""
    derived: Plain = {"reference_density": density, "ambient_energy": internal_energy}
    if model.type == "linear":
        derived["bulk_modulus"] = model.modulus(density)
    elif model.type == "mie_gruneisen":
        derived |= dict(zip(("sound_speed", "s1", "s2", "s3"), model.hugoniot, strict=True))
        derived["linear_expansion"] = model.expansion == "linear"
    elif model.type == "table":
        path = Path(model.file)
        is_hdf5 = path.suffix in SUFFIXES and model.format is None
        with locate("eos.file", str(path)):
            grid = eos.Grid(**read_eos_table(path)) if is_hdf5 else eos.read_table(path, model.format, model.number)
            eos.check_units(grid, density)
        derived["grid"] = grid
    return derived


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
    coefficients = {"unchanged": KEEPS_STRESS, "rubble": getattr(model, "friction", 0.0)}
    return coefficients.get(getattr(model, "failed_strength", ""), 0.0)


def start_of(name: str, model: Body, material: Material) -> tuple[float, float]:
    """Return density [kg/m^3] and energy [J/kg] of a body; `CaseError` for a temperature without zero pressure."""
    density_at_rest = material.density_at_rest
    if model.temperature is None:
        return density_at_rest, model.internal_energy or material.eos.ambient_energy
    with locate(f"bodies.{name}.temperature"):
        density, energy = material.at_temperature(model.temperature)
    return density * density_at_rest / material.density, energy


_PARALLEL = 1e-6  # sine of the angle between directions that are the same


def material_axes(case: Case, name: str, model: Body, material: Material) -> np.ndarray:
    """Return the quaternion (4,) of a body's material axes; `CaseError` without, or not as symmetric as the case."""
    where = f"bodies.{name}"
    kinematics = KINEMATICS[case.kinematics]
    _refuse_kinematics(case, where)
    if model.axes is None:
        if kinematics.dim == 3:
            fault = f"missing: '{material.name or material.strength.name}' has directions; give them, such as"
            raise CaseError(f"{fault} {{one: [0, 1, 0], two: [0, 0, 1]}} for a plate across x", where=f"{where}.axes")
        triad = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    else:
        e1, e2 = (np.array(direction) / np.linalg.norm(direction) for direction in (model.axes.one, model.axes.two))
        triad = np.array([e1, e2, np.cross(e1, e2)])
    if model.rotation is not None and kinematics.dim == 3:
        triad = triad @ rotation_matrix(3, model.rotation.radians, model.rotation.axis).T
    strength: Any = material.strength
    if kinematics.dim < 3:
        parallel = [k for k in range(3) if abs(triad[k, 0]) > 1.0 - _PARALLEL]
        if not (
            parallel
            and strength.is_same_about(parallel[0])
            and (kinematics.dim == 1 or _has_isotropic_failure(material.damage, parallel[0]))
        ):  # uniaxial strain stays so
            raise CaseError(
                f"{kinematics.words} needs a material that is the same in all directions about x, such as a "
                "quasi-isotropic laminate or a cloth with both yarns alike, axis 3 along x (E1 = E2, nu13 = nu23, "
                "G13 = G23, G12 = E1/(2 (1 + nu12)), damage none, pressure_cutoff or max_stress with 1 and 2 alike); "
                "other materials need 3D",
                where=f"{where}.axes",
            )
    for number, plane in enumerate(case.symmetry):
        normal = np.eye(3)["xyz".index(plane.axis)]
        cosines = np.abs(triad @ normal)
        equal = [k for k in range(3) if cosines[k] < _PARALLEL and strength.is_same_about(k)]
        if not (cosines.max() > 1.0 - _PARALLEL or (equal and _has_isotropic_failure(material.damage, equal[0]))):
            raise CaseError(
                f"the material of '{name}' is not its own image there: none of its axes lies "
                f"along {plane.axis}; turn the axes, or leave the plane out",
                where=f"symmetry.{number}",
            )
    return quaternion_of(triad.T)


def _refuse_kinematics(case: Case, where: str) -> None:
    """Raise an error where no anisotropic stress is computed."""
    axisymmetric = KINEMATICS[case.kinematics].axisymmetric
    if case.dim == 2 and not axisymmetric:
        raise CaseError(
            f"an anisotropic material in {KINEMATICS[case.kinematics].words} is not available: fibres out "
            "of the plane would turn into it; use three_d, or axisymmetric",
            where=f"{where}.material",
        )
    formulation, contact = case.formulation.type, getattr(case.formulation, "contact", None)
    if formulation == "projection":
        fault = "'projection' has no trace of the stress beside its own pressure, which an anisotropic"
        raise CaseError(f"{fault} material needs; use another formulation", where="formulation.type")
    if getattr(case.formulation, "variant", None) == "elastic":
        raise CaseError(
            "the elastic variant extrapolates the stress with isotropic moduli, which an anisotropic material does not "
            "have; use the default variant, or total_lagrangian",
            where="formulation.variant",
        )
    if axisymmetric and (
        formulation in ("total_lagrangian", "adaptive") or (contact is not None and contact.type == "penalty")
    ):
        fault = f"'{formulation}' takes the hoop stress from a deviator without trace, which an anisotropic material"
        raise CaseError(f"{fault} does not have; use riemann, eulerian or three_d", where="formulation.type")


def _has_isotropic_failure(damage: Any, axis: int) -> bool:
    """Return whether failure is the same in all directions about an axis as far as these are principal."""
    if damage.name == "hashin":
        return False
    if damage.name == "max_stress":
        i, j = (k for k in range(3) if k != axis)
        out = {0: (0, 1), 1: (0, 2), 2: (1, 2)}[axis]  # S12, S13, S23 with that axis
        isotropic = (
            (damage.tension[i], damage.tension[j]),
            (damage.compression[i], damage.compression[j]),
            (damage.shear[out[0]], damage.shear[out[1]]),
        )
        return axis == 2 and all(a == b for a, b in isotropic)
    return True


def quaternion_of(r: np.ndarray) -> np.ndarray:
    """Return the unit quaternion w, x, y, z (4,) of a rotation matrix (3, 3): the eigenvector of Bar-Itzhack 2000."""
    k = np.array(
        [
            [r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [0.0, r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [0.0, 0.0, r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1]],
            [0.0, 0.0, 0.0, r[2, 2] - r[0, 0] - r[1, 1]],
        ]
    )
    vectors = np.linalg.eigh(k + np.triu(k, 1).T)[1]
    return np.asarray(vectors[:, 3])
