"""Strength models of a material."""

from typing import Annotated, Literal

from pydantic import Field

from hvisph.case import units
from hvisph.case.model import BY_TYPE, StrictModel, key

InversePressure = Annotated[float, units.Quantity(units.INVERSE_PRESSURE, minimum=0)]
InverseTemperature = Annotated[float, units.Quantity(units.INVERSE_TEMPERATURE, minimum=0)]
Pair = tuple[units.PositivePressure, units.PositivePressure]
Triple = tuple[units.PositivePressure, units.PositivePressure, units.PositivePressure]
_SHEAR = "Shear modulus G [Pa]; left out where the equation of state is `elastic`, which implies it"


class RateDependent(StrictModel):
    """Options of rate-dependent models."""

    rate_smoothing: Annotated[int, Field(strict=True, ge=0, le=10_000)] = key(
        "Steps over which the strain rate is smoothed, such as 10; 0: that of the step, noise and all", 0
    )


class NoStrength(StrictModel):
    """A fluid: no deviatoric stress."""

    type: Literal["none"] = "none"


class ElasticStrength(StrictModel):
    """Linear elastic in shear, without a limit."""

    type: Literal["elastic"] = "elastic"
    shear_modulus: units.PositivePressure | None = key(_SHEAR, None)


class VonMisesStrength(StrictModel):
    """Elastic and perfectly plastic."""

    type: Literal["von_mises"] = "von_mises"
    shear_modulus: units.PositivePressure | None = key(_SHEAR, None)
    yield_stress: units.PositivePressure = key("Yield stress Y in uniaxial tension [Pa]")


class LinearHardeningStrength(StrictModel):
    """Y = Y0 + H eps_p."""

    type: Literal["linear_hardening"] = "linear_hardening"
    shear_modulus: units.PositivePressure | None = key(_SHEAR, None)
    yield_stress: units.PositivePressure = key("Initial yield stress Y0 [Pa]")
    hardening_modulus: units.NonNegativePressure = key("Plastic hardening modulus H = dY/d(eps_p) [Pa]")


class JohnsonCookStrength(RateDependent):
    """Y = (A + B eps_p^n) (1 + C ln(rate/reference)) (1 - T*^m), T* = (T - T_room)/(T_melt - T_room)."""

    type: Literal["johnson_cook"] = "johnson_cook"
    shear_modulus: units.PositivePressure | None = key(_SHEAR, None)
    a: units.PositivePressure = key("Yield stress A at the reference rate and room temperature [Pa]")
    b: units.NonNegativePressure = key("Hardening coefficient B [Pa]")
    n: units.PositiveNumber = key("Hardening exponent n [-]")
    c: units.NonNegativeNumber = key("Rate coefficient C [-]")
    m: units.PositiveNumber = key("Thermal softening exponent m [-]")
    reference_rate: units.PositiveRate = key("Reference plastic strain rate [1/s]", 1.0)
    room_temperature: units.PositiveTemperature = key("T_room, at the start [K]", 300.0)
    melt_temperature: units.PositiveTemperature = key("Melting temperature T_melt [K], above room temperature")
    heat_capacity: units.PositiveHeatCapacity = key("Specific heat capacity, for the temperature [J/(kg K)]")


class SteinbergGuinanStrength(StrictModel):
    """Y = min(Y0 (1 + beta (eps_p + eps_i))^n, Ymax) f, G = G0 f, f = 1 + A p/eta^(1/3) - B (T - 300 K)."""

    type: Literal["steinberg_guinan"] = "steinberg_guinan"
    shear_modulus: units.PositivePressure | None = key(_SHEAR, None)
    yield_stress: units.PositivePressure = key("Y0 [Pa]")
    yield_limit: units.PositivePressure = key("Ymax, limit of work hardening [Pa], not below Y0")
    beta: units.NonNegativeNumber = key("beta of work hardening [-]")
    n: units.NonNegativeNumber = key("n of work hardening [-]")
    pressure_coefficient: InversePressure = key("A [1/Pa]")
    heat_coefficient: InverseTemperature = key("B [1/K]")
    melt_temperature: units.PositiveTemperature = key("T_m0 of his melting law [K], not the ambient one")
    melt_gamma: units.NonNegativeNumber = key("Grueneisen coefficient of his melting law [-]")
    melt_a: units.NonNegativeNumber = key("a of his melting law [-], not that of the equation of state")
    initial_strain: units.NonNegativeNumber = key("eps_i [-]", 0.0)


class SteinbergLundStrength(SteinbergGuinanStrength, RateDependent):
    """Y = (Y_T(rate, T) + min(Y_A (1 + beta (eps_p + eps_i))^n, Ymax)) f: Steinberg-Guinan with a rate."""

    type: Literal["steinberg_lund"] = "steinberg_lund"  # type: ignore[assignment]
    yield_stress: units.PositivePressure = key("Y_A [Pa]")
    c1: units.PositiveRate = key("C1 [1/s]")
    c2: Annotated[float, units.Quantity(units.VISCOSITY, above=0)] = key("C2, drag [Pa s]")
    activation_energy: units.PositiveNumber = key("U [eV]")
    peierls_stress: units.PositivePressure = key("Y_P, limit of Y_T [Pa]")


class ZerilliArmstrongStrength(RateDependent):
    """fcc: Y = C0 + C2 eps_p^(1/2) E; bcc: Y = C0 + C1 E + C5 eps_p^n; E = exp(-C3 T + C4 T ln rate)."""

    type: Literal["zerilli_armstrong"] = "zerilli_armstrong"
    shear_modulus: units.PositivePressure | None = key(_SHEAR, None)
    lattice: Literal["fcc", "bcc"] = key("Which of the two forms")
    c0: units.NonNegativePressure = key("C0 [Pa]")
    c1: units.NonNegativePressure = key("C1 of bcc [Pa]", 0.0)
    c2: units.NonNegativePressure = key("C2 of fcc [Pa]", 0.0)
    c3: InverseTemperature = key("C3 [1/K]")
    c4: InverseTemperature = key("C4 [1/K]")
    c5: units.NonNegativePressure = key("C5 of bcc [Pa]", 0.0)
    n: units.PositiveNumber = key("n of bcc [-]", 0.5)
    melt_temperature: units.PositiveTemperature | None = key("Above it no strength is left [K]", None)


class CowperSymondsStrength(RateDependent):
    """Y = (Y0 + H eps_p) (1 + (rate/D)^(1/q))."""

    type: Literal["cowper_symonds"] = "cowper_symonds"
    shear_modulus: units.PositivePressure | None = key(_SHEAR, None)
    yield_stress: units.PositivePressure = key("Y0 [Pa]")
    hardening_modulus: units.NonNegativePressure = key("H [Pa]", 0.0)
    reference_rate: units.PositiveRate = key("D [1/s]; mild steel 40.4, aluminium 6500, stainless steel 100")
    exponent: units.PositiveNumber = key("q [-]; mild steel 5, aluminium 4, stainless steel 10")


class RockStrength(StrictModel):
    """Intact Y = Y0 + mu p/(1 + mu p/(Y_M - Y0)) (Lundborg), broken min(mu_b p, Y), weaker near the melt."""

    type: Literal["rock"] = "rock"
    shear_modulus: units.PositivePressure | None = key(_SHEAR, None)
    cohesion: units.NonNegativePressure = key("Y0, yield stress without pressure [Pa]")
    friction: units.NonNegativeNumber = key("mu_i, internal friction of the intact rock [-]")
    limit: units.PositivePressure | None = key("Y_M, limit under pressure [Pa]; Drucker-Prager unless given", None)
    tension: units.NonNegativePressure | None = key(
        "Tension borne at most, no more than the apex Y0/mu_i of the cone [Pa]; 0 of granular matter; not "
        "limited by the strength unless given",
        None,
    )
    broken_friction: units.NonNegativeNumber = key("mu_b, friction of broken rock [-]", 0.6)
    melt_energy: units.PositiveSpecificEnergy | None = key("e_melt: Y falls as 1 - e/e_melt [J/kg]", None)
    melt_temperature: units.PositiveTemperature | None = key("T_m: Y falls as tanh(1.2 (T_m/T - 1)) [K]", None)


class JohnsonHolmquistStrength(RateDependent):
    """JH-2 of glass and ceramics: q_i = s_H A x^N f, q_f = s_H B (p/P_HEL)^M f, Y = q_i - D (q_i - q_f)."""

    type: Literal["johnson_holmquist"] = "johnson_holmquist"
    shear_modulus: units.PositivePressure | None = key(_SHEAR, None)
    hugoniot_elastic_limit: units.PositivePressure = key("HEL [Pa]")
    hel_pressure: units.PositivePressure = key("P_HEL, pressure at the HEL [Pa], below HEL")
    tension: units.NonNegativePressure = key("T, greatest hydrostatic tension [Pa]")
    a: units.PositiveNumber = key("A of the intact surface [-]")
    n: units.PositiveNumber = key("N of the intact surface [-]")
    b: units.NonNegativeNumber = key("B of the fractured surface [-]")
    m: units.PositiveNumber = key("M of the fractured surface [-]")
    c: units.NonNegativeNumber = key("C of the rate [-]", 0.0)
    fractured_limit: units.PositiveNumber | None = key("SFMAX, limit of q_f/s_H [-]", None)


class OrthotropicStrength(StrictModel):
    """Three material axes, along which the body's `axes` lie: fibre 1, across in the ply 2, thickness 3."""

    type: Literal["orthotropic"] = "orthotropic"
    moduli: Triple = key("E1, E2, E3 [Pa]")
    poisson: tuple[units.Number, units.Number, units.Number] = key(
        "nu12, nu13, nu23 [-]: contraction along the second axis over the strain, pulled along the first"
    )
    shear_moduli: Triple = key("G12, G13, G23 [Pa]")


class FabricStrength(StrictModel):
    """Dry cloth: yarns along axes 1 and 2 that bear tension alone; compression is that of `porosity`."""

    type: Literal["fabric"] = "fabric"
    moduli: Pair = key("E1, E2 of the cloth [Pa]: half the fibre's times its volume fraction")
    tensile_strength: Pair = key("X1, X2 of the cloth at rest [Pa]")


_Simple = NoStrength | ElasticStrength | VonMisesStrength | LinearHardeningStrength
_Metal = JohnsonCookStrength | SteinbergGuinanStrength | SteinbergLundStrength | ZerilliArmstrongStrength
_Other = CowperSymondsStrength | RockStrength | JohnsonHolmquistStrength
_Directed = OrthotropicStrength | FabricStrength
Strength = Annotated[_Simple | _Metal | _Other | _Directed, BY_TYPE]
