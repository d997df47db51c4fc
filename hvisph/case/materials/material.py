"""Material: density, equation of state, strength, damage, temperature, melting and porosity."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import ValidationInfo

from hvisph.case import units
from hvisph.case.model import BY_TYPE, Problem, Shorthand, StrictModel, key
from hvisph.core.errors import CaseError

from .damage import Damage, JohnsonCookDamage, NoDamage, PositiveToughness
from .eos import ElasticEos, Eos
from .strength import (
    JohnsonCookStrength,
    JohnsonHolmquistStrength,
    NoStrength,
    RockStrength,
    SteinbergGuinanStrength,
    Strength,
)


class _Temperature(StrictModel):
    heat_capacity: units.PositiveHeatCapacity | None = key("c_v [J/(kg K)]; that of the strength unless given", None)
    room_temperature: units.PositiveTemperature | None = key("Temperature at rest [K]; of the strength, or 300 K", None)


class IsentropeTemperature(_Temperature):
    """T = T_s(rho) + (e - e_s(rho))/c_v about the isentrope through the state at rest: compression is no heat."""

    type: Literal["isentrope"] = "isentrope"
    heat_capacities: tuple[tuple[units.PositiveTemperature, units.PositiveHeatCapacity], ...] = key(
        "Points [T, c_p] of the heat capacity without pressure, joined by lines and held beyond their "
        "ends, in place of a constant",
        (),
    )
    heat_of_melting: units.PositiveSpecificEnergy | None = key("Heat of melting [J/kg], with `heat_capacities`", None)
    melting_point: units.PositiveTemperature | None = key("Where it is taken up, without pressure [K]", None)

    def _faults(self) -> Iterator[Problem]:
        if self.heat_capacities and self.heat_capacity is not None:
            yield "heat_capacities", "given beside `heat_capacity`; leave one out"
        if any(later <= before for (before, _), (later, _) in pairwise(self.heat_capacities)):
            yield "heat_capacities", "temperatures must rise from point to point"
        if (self.heat_of_melting is None) != (self.melting_point is None):
            missing = "melting_point" if self.melting_point is None else "heat_of_melting"
            yield missing, "missing: heat of melting and melting point go together"
        elif self.heat_of_melting is not None and not self.heat_capacities:
            yield "heat_of_melting", "has a meaning only beside `heat_capacities`"

    @property
    def is_known(self) -> bool:
        """Whether a heat capacity is given here."""
        return self.heat_capacity is not None or bool(self.heat_capacities)


class TotalEnergyTemperature(_Temperature):
    """T = T_room + e/c_v, as Young 2021 has it: the work of compression counts as heat."""

    type: Literal["total_energy"] = "total_energy"

    @property
    def is_known(self) -> bool:
        """Whether a heat capacity is given here."""
        return self.heat_capacity is not None


Temperature = Annotated[IsentropeTemperature | TotalEnergyTemperature, BY_TYPE]


class ConstantMelting(StrictModel):
    """The melting point of the strength model, at any pressure; the type where `entropies` are given alone."""

    type: Literal["constant"] = "constant"
    entropies: tuple[units.PositiveHeatCapacity, ...] | None = key(
        "Entropies [S_rest, S_im, S_cm, S_iv, S_cv] at rest, and at 1 bar of incipient and complete "
        "melting and vaporisation [J/(kg K)]; for the measures `melt` and `vapour`",
        None,
        min_length=5,
        max_length=5,
    )

    def _faults(self) -> Iterator[Problem]:
        _, solid, liquid, boiling, gas = self.entropies or (0.0, 1.0, 2.0, 3.0, 4.0)
        if not solid < liquid <= boiling < gas:
            yield "entropies", "S_im, S_cm, S_iv and S_cv must rise in this order"


class LindemannMelting(ConstantMelting):
    """T_m = T_m0 exp(2 a (1 - 1/eta)) eta^(2 (Gamma0 - a - 1/3)), eta = rho/rho0."""

    type: Literal["lindemann"] = "lindemann"  # type: ignore[assignment]
    temperature: units.PositiveTemperature = key("T_m0, without pressure [K]")
    gamma: units.NonNegativeNumber = key("Gamma0, Grueneisen coefficient at rest [-]")
    a: units.NonNegativeNumber = key("a [-]")


class SimonMelting(ConstantMelting):
    """T_m = T_m0 (1 + p/a)^(1/c)."""

    type: Literal["simon"] = "simon"  # type: ignore[assignment]
    temperature: units.PositiveTemperature = key("T_m0, without pressure [K]")
    a: units.PositivePressure = key("a [Pa]")
    c: units.PositiveNumber = key("c [-]")


Melting = Annotated[LindemannMelting | SimonMelting | ConstantMelting, BY_TYPE]
OptionalMelting = Annotated[
    Melting | None,
    Shorthand(
        lambda value, _: (
            {"type": "constant"} | value if isinstance(value, dict) and set(value) == {"entropies"} else value
        ),
        (),
        ({"type": "object", "required": ["entropies"]},),
    ),
]


class Porosity(StrictModel):
    """P-alpha pores in the solid that `density`, `eos` and `strength` describe: p = p_s(alpha rho, e)/alpha."""

    distension: Annotated[float, units.Quantity(units.NUMBER, above=1)] = key(
        "alpha0, density of the solid over that with pores [-]"
    )
    elastic_pressure: units.NonNegativePressure | None = key("p_e, onset of crushing [Pa]; or give `crush`", None)
    solid_pressure: units.PositivePressure | None = key("p_s, end of crushing [Pa]; or give `crush`", None)
    crush: tuple[tuple[units.NonNegativePressure, Annotated[float, units.Quantity(units.NUMBER, minimum=1)]], ...] = (
        key(
            "Points [p, alpha] of the crush curve in place of the parabola, falling from alpha0 to 1, joined by lines",
            (),
            max_length=16,
        )
    )

    def _faults(self) -> Iterator[Problem]:
        elastic, solid = self.elastic_pressure, self.solid_pressure
        pressures = {"elastic_pressure": elastic, "solid_pressure": solid}
        if not self.crush:
            points = f"crush: [[1 MPa, {self.distension:g}], [100 MPa, 1]]"
            missing = [name for name, value in pressures.items() if value is None]
            yield from ((name, f"missing; or give the curve as points, {points}") for name in missing)
            if elastic is not None and solid is not None and solid <= elastic:
                yield "solid_pressure", "must be above the elastic_pressure"
            return
        given = [name for name, value in pressures.items() if value is not None]
        yield from ((name, "given beside `crush`, whose first and last point it is; leave it out") for name in given)
        for number, ((p, alpha), (further, less)) in enumerate(pairwise(self.crush), 1):
            if not (further > p and less < alpha):
                rise = f"does not fall: from [{p:g} Pa, {alpha:g}] on the pressure must rise and the distension fall"
                yield f"crush.{number}", rise
        first, last = self.crush[0][1], self.crush[-1][1]
        if first != self.distension:
            yield "crush.0", f"must begin at the distension, {self.distension:g}, not {first:g}"
        if last != 1.0:
            yield f"crush.{len(self.crush) - 1}", f"must end at 1, where pores are gone, not {last:g}"


class Material(StrictModel):
    """Material of a body."""

    name: str = key("Name in messages and output; that of the library, if it comes from there", "", max_length=64)
    source: str = key("Where the numbers come from", "")
    density: units.PositiveDensity = key("Reference density rho0 [kg/m^3]")
    eos: Eos = key("Equation of state: pressure from density and energy")
    strength: Strength = key("Strength: limits and history of the deviatoric stress", NoStrength())
    damage: Damage = key("Damage and spall", NoDamage())
    fracture_toughness: PositiveToughness | None = key("K_IC [Pa m^0.5], for `damage: {toughness: material}`", None)
    temperature: Temperature = key("How the temperature follows from density and energy", IsentropeTemperature())
    melting: OptionalMelting = key("Melting point under pressure; that of the strength model unless given", None)
    porosity: Porosity | None = key("Pores", None)

    def _faults(self) -> Iterator[Problem]:
        kind, damage = self.strength.type, self.damage
        given = getattr(self.strength, "shear_modulus", None)
        implied = self.eos.shear_modulus if isinstance(self.eos, ElasticEos) else None
        has_shear = kind not in ("none", "orthotropic", "fabric")
        if has_shear and given is None and implied is None:
            missing = "missing: the equation of state does not imply it; give G, such as 27.6 GPa"
            yield "strength.shear_modulus", missing
        if given is not None and implied is not None:
            twice = f"given twice: the `elastic` equation of state implies {implied:.4g} Pa; leave it out"
            yield "strength.shear_modulus", twice
        if has_shear and self.eos.type == "ideal_gas":
            yield "strength.type", "an ideal gas has no strength; use {type: none}"
        if isinstance(damage, JohnsonCookDamage):
            if not has_shear or kind == "elastic":
                never = f"which `strength: {{type: {kind}}}` never has; use a plastic strength"
                yield "damage.type", f"johnson_cook damage grows with plastic strain, {never}"
            elif damage.d5 and kind != "johnson_cook" and (self.melting is None or self.melting.type == "constant"):
                yield "damage.d5", "needs a melting point; use the `johnson_cook` strength, or set d5 to 0"
        if getattr(damage, "toughness", None) == "material" and self.fracture_toughness is None:
            yield "damage.toughness", "the material has no fracture_toughness; give it, or a number here"
        if getattr(damage, "breaks", False) and not has_shear:
            yield "damage.type", "a fracture energy needs a strength: a fluid does not crack"
        if getattr(damage, "brittle_ductile", None) is not None and kind != "rock":
            belongs = f"damage by shear belongs to `strength: {{type: rock}}`, not `{kind}`"
            yield "damage.brittle_ductile", f"{belongs}; give null for brittle_ductile and brittle_plastic"
        if damage.type == "johnson_holmquist" and (kind != damage.type or self.eos.type != "polynomial"):
            yield "damage.type", "goes with `strength: {type: johnson_holmquist}` and `eos: {type: polynomial}`"
        yield from self._limits()
        yield from self._anisotropic()
        yield from self._thermal()

    def _limits(self) -> Iterator[Problem]:
        """Yield the errors between constants of the strength."""
        strength = self.strength
        if isinstance(strength, JohnsonCookStrength) and strength.melt_temperature <= strength.room_temperature:
            melts, room = strength.melt_temperature, strength.room_temperature
            yield "strength.melt_temperature", f"{melts:g} K must be above the room temperature, {room:g} K"
        if isinstance(strength, JohnsonHolmquistStrength) and strength.hel_pressure >= strength.hugoniot_elastic_limit:
            yield "strength.hel_pressure", "must be below the hugoniot_elastic_limit"
        if isinstance(strength, SteinbergGuinanStrength) and strength.yield_limit < strength.yield_stress:
            yield "strength.yield_limit", "must not be below the yield_stress"
        if isinstance(strength, RockStrength) and strength.limit is not None and strength.limit <= strength.cohesion:
            yield "strength.limit", "must be above the cohesion"

    def _anisotropic(self) -> Iterator[Problem]:
        """Yield the errors of anisotropic solids and of cloth."""
        kind, directed = self.strength.type, self.strength.type == "orthotropic"
        if self.damage.type in ("hashin", "max_stress") and not directed:
            yield "damage.type", f"'{self.damage.type}' goes with `strength: {{type: orthotropic}}`"
        if not (directed or kind == "fabric"):
            return
        allowed = ("none", "pressure_cutoff", "hashin", "max_stress") if directed else ("none",)
        if self.damage.type not in allowed:
            yield "damage.type", f"`{kind}` goes with {', '.join(allowed)} alone"
        elif getattr(self.damage, "failed_strength", "fluid") != "fluid":
            yield "damage.failed_strength", "of an orthotropic solid nothing is left: leave it out"
        if directed and self.porosity is not None:
            yield "porosity", "`orthotropic` moduli are those of the whole with its pores; leave it out"
        if not directed and self.porosity is None:
            message = "missing: cloth is loose and crushes; give distension, elastic_pressure and solid_pressure"
            yield "porosity", message
        if self.eos.type in ("jwl", "ideal_gas", "elastic"):
            needs = f"`{kind}` strength needs a bulk modulus beside its own constants"
            yield "eos.type", f"{needs}: a `{self.eos.type}` equation of state has none; give mie_gruneisen"

    def _thermal(self) -> Iterator[Problem]:
        """Yield the errors of temperature, entropies and pores."""
        strength, kind = self.strength, self.eos.type
        needs = strength.type in ("steinberg_guinan", "steinberg_lund", "zerilli_armstrong")
        needs |= isinstance(strength, RockStrength) and strength.melt_temperature is not None
        if needs and not self.temperature.is_known:
            message = f"missing: `{strength.type}` strength depends on the temperature; give c_v, such as 885 J/(kg K)"
            yield "temperature.heat_capacity", message
        if self.porosity is not None and kind in ("jwl", "ideal_gas"):
            yield "porosity", f"a `{kind}` equation of state has no solid to hold pores"
        if self.melting is None or self.melting.entropies is None or kind == "table":
            return
        if kind in ("ideal_gas", "jwl", "elastic"):
            yield "melting.entropies", f"a `{kind}` equation of state has no melt and no vapour"
        elif not self.temperature.is_known and getattr(strength, "heat_capacity", None) is None:
            message = "missing: entropies are measured by it; give c_v, such as 885 J/(kg K)"
            yield "temperature.heat_capacity", message

    @property
    def shear_modulus(self) -> float:
        """Shear modulus G [Pa], 0 for a fluid and where it depends on the direction."""
        if isinstance(self.strength, NoStrength):
            return 0.0
        given = getattr(self.strength, "shear_modulus", None)
        if given is not None:
            return given
        return self.eos.shear_modulus if isinstance(self.eos, ElasticEos) else 0.0


def _by_name(value: object, info: ValidationInfo) -> object:
    """Replace the name of a material by the material of the library."""
    if not isinstance(value, str):
        return value
    if info.context and info.context.get("units") == "none":
        raise ValueError(f"the library is in SI, and the case has `units: none`; write out '{value[:64]}'")
    library = (info.context or {}).get("library")
    if library is None:
        raise ValueError(f"there is no library at hand; write out '{value[:64]}'")
    try:
        return library(value)
    except CaseError as error:
        raise ValueError(str(error)) from None


_VARIED = {"type": "object", "properties": {"base": {"type": "string"}}, "required": ["base"]}
NamedMaterial = Annotated[Material, Shorthand(_by_name, ("string",), (_VARIED,))]
