"""Damage and spall models of a material."""

from collections.abc import Iterator
from typing import Annotated, Literal

from hvisph.case import units
from hvisph.case.model import BY_TYPE, Problem, StrictModel, key

PositiveToughness = Annotated[float, units.Quantity(units.TOUGHNESS, above=0)]


class NoDamage(StrictModel):
    """The material never fails."""

    type: Literal["none"] = "none"


class _Failing(StrictModel):
    """Options of all models with failure."""

    failed_strength: Literal["fluid", "rubble", "unchanged"] = key(
        "Strength of failed material: `fluid`, pressure only; `rubble`, also friction; `unchanged`, marked "
        "as failed only: with `adaptive` it converts to Eulerian particles, between which cracks open",
        "fluid",
    )
    friction: units.NonNegativeNumber = key("Coefficient of friction of `rubble`, Y = friction p up to intact [-]", 0.6)


class _Fracturing(_Failing):
    """Energy that failure takes, for each area of crack."""

    fracture_energy: Annotated[float, units.Quantity(units.SURFACE_ENERGY, above=0)] | None = key(
        "G_f, work for each area of crack [J/m^2]: the material softens after the onset of failure over a "
        "displacement, at any spacing; none unless given: failure takes what one particle holds",
        None,
    )
    toughness: PositiveToughness | Literal["material"] | None = key(
        "K_IC in place of `fracture_energy` [Pa m^0.5], G_f = K_IC^2 (1 - nu^2)/E; `material`: the "
        "`fracture_toughness` of the material",
        None,
    )

    def _faults(self) -> Iterator[Problem]:
        if self.fracture_energy is not None and self.toughness is not None:
            yield "", "give either fracture_energy or toughness, which implies it"
        if self.breaks and self.failed_strength == "unchanged":
            softens = "fracture_energy and toughness soften the material, which failed_strength: unchanged leaves as"
            yield "", f"{softens} it is; give fluid or rubble"
        yield from super()._faults()

    @property
    def breaks(self) -> bool:
        """Whether failure takes an energy."""
        return self.fracture_energy is not None or self.toughness is not None


class _Fitted(_Fracturing):
    """Width at which a strain to failure was fitted."""

    fitted_at: units.PositiveLength | None = key(
        "L_0, width of the elements or necks where the constants were fitted [m]: once the metal softens "
        "its strain counts l/L_0 times, l the particle's width, between 1/5 and 5; needs a fracture energy",
        None,
    )

    def _faults(self) -> Iterator[Problem]:
        if self.fitted_at is not None and not self.breaks:
            yield "", "fitted_at belongs to a fracture energy: give fracture_energy or toughness, too"
        yield from super()._faults()


class _Rated(_Fracturing):
    """Rate dependence of the spall strength."""

    spall_exponent: Annotated[float, units.Quantity(units.NUMBER, minimum=0, maximum=0.5)] = key(
        "m, where the spall strength is that of `spall_rate` times (rate/spall_rate)^m, from 1e4 to "
        "1e7 1/s [-], at most 0.5; plate impacts have 0.1 to 0.3. 0: the same at all rates",
        0.0,
    )
    spall_rate: Annotated[float, units.Quantity(units.RATE, minimum=1e4, maximum=1e7)] = key(
        "Rate of expansion at which it has its spall strength [1/s], 1e4 to 1e7", 1e5
    )


class _Spalling(_Failing):
    """Additional spall strength of damage models."""

    spall_strength: units.PositivePressure | None = key(
        "Tension at which the material fails for good, whatever the damage [Pa], any once it has melted; "
        "none unless given: models that add up strain or work know little of a release",
        None,
    )


class _RatedSpalling(_Spalling, _Rated):
    """Additional rate-dependent spall strength of damage models."""

    def _faults(self) -> Iterator[Problem]:
        if self.spall_exponent and self.spall_strength is None:
            yield "", "spall_exponent says how spall_strength grows with the rate: give spall_strength, too"
        yield from super()._faults()


class PressureCutoff(_Rated):
    """Tension limit p >= pressure. With `permanent` material at the limit has spalled, melt under any tension."""

    type: Literal["pressure_cutoff"] = "pressure_cutoff"
    pressure: units.NegativePressure = key("Lowest pressure, tension negative [Pa]")
    permanent: bool = key("Whether material at the limit fails permanently; if not, spall heals", False)

    def _faults(self) -> Iterator[Problem]:
        if (self.spall_exponent or self.breaks) and not self.permanent:
            yield "", f"{'spall_exponent' if self.spall_exponent else 'a fracture energy'} requires permanent: true"
        yield from super()._faults()


class JohnsonCookDamage(_RatedSpalling, _Fitted):
    """Strain to failure eps_f = (D1 + D2 exp(D3 s*)) (1 + D4 ln(rate/reference)) (1 + D5 T*).

    s* is the mean stress (tension positive) over the von Mises stress, held at 1.5; damage grows by
    d(eps_p)/eps_f, and at 1 the material has failed.
    """

    type: Literal["johnson_cook"] = "johnson_cook"
    d1: units.Number = key("Failure strain at any triaxiality, D1 [-]")
    d2: units.Number = key("Triaxiality coefficient D2 [-]", 0.0)
    d3: units.Number = key("Triaxiality exponent D3 [-]; below 0 where tension embrittles", 0.0)
    d4: units.Number = key("Rate coefficient D4 [-]", 0.0)
    d5: units.Number = key("Temperature coefficient D5 [-]; needs `johnson_cook` strength", 0.0)
    reference_rate: units.PositiveRate = key("Reference plastic strain rate [1/s]", 1.0)
    softening: Annotated[float, units.Quantity(units.NUMBER, minimum=0, below=1)] = key(
        "D_c of Borvik 2001, share of the yield stress that is lost at failure: Y is reduced to "
        "1 - D_c D of its value [-]",
        0.0,
    )
    high_triaxiality: Literal["constant", "void_growth"] = key(
        "Failure strain beyond the tested range of triaxiality: `constant` above s* = 1.5, up to which the "
        "formula was fitted; `void_growth`, for fits whose failure strain vanishes (d1 < 0 < d2, -1.5 < d3 < 0): "
        "exp(-1.5 s*) of Rice & Tracey 1969 where the fit falls faster",
        "constant",
    )
    pressure_cutoff: units.NegativePressure | None = key("Lowest pressure [Pa]; `spall_strength` fails there", None)

    def _faults(self) -> Iterator[Problem]:
        if self.high_triaxiality == "void_growth" and not (self.d1 < 0 < self.d2 and -1.5 < self.d3 < 0):
            yield "", "high_triaxiality: void_growth requires d1 < 0 < d2 and -1.5 < d3 < 0; give constant"
        if self.pressure_cutoff is not None and self.spall_strength is not None:
            yield "", "give either pressure_cutoff, which holds its tension, or spall_strength, which fails there"
        yield from super()._faults()


class GradyKippDamage(_Spalling):
    """Brittle fracture from Weibull flaws, N(<eps) = k eps^m per m^3, that cracks grow from at 0.4 c_l."""

    type: Literal["grady_kipp"] = "grady_kipp"
    weibull_k: Annotated[float, units.Quantity(units.NUMBER, above=0, maximum=1e60)] = key(
        "Weibull's k [1/m^3]; a set per cm^3 is 1e6 times smaller"
    )
    weibull_m: units.PositiveNumber = key("Weibull's m [-]")
    seed: int = key("Seed of the random flaws; another one, other fragments", 0, ge=0, le=2**31)
    brittle_ductile: units.PositivePressure | None = key(
        "p_bd, where broken `rock` is as strong as intact [Pa]: below it shear breaks at a strain of 0.01 "
        "to 0.05; no damage by shear unless given",
        None,
    )
    brittle_plastic: units.PositivePressure | None = key("p_bp above p_bd [Pa]: up to it a strain of 0.05 to 0.1", None)

    def _faults(self) -> Iterator[Problem]:
        ductile, plastic = self.brittle_ductile, self.brittle_plastic
        if (ductile is None) != (plastic is None):
            yield "", "brittle_ductile and brittle_plastic go together: give both, or neither"
        if ductile is not None and plastic is not None and plastic <= ductile:
            yield "", f"brittle_plastic must be above brittle_ductile, {ductile:g} Pa"


class GradySpallDamage(_Failing):
    """Spall by Grady's energies: the smaller of (3 rho c^2 Kc^2 rate)^(1/3) and (2 rho c^2 Y eps_c)^(1/2)."""

    type: Literal["grady_spall"] = "grady_spall"
    toughness: PositiveToughness = key("Fracture toughness K_c [Pa m^0.5]")
    yield_stress: units.NonNegativePressure = key("Y of ductile spall [Pa]; 0: brittle alone", 0.0)
    critical_strain: units.PositiveNumber = key("eps_c of ductile spall [-]", 0.15)


class PrincipalStressDamage(_RatedSpalling):
    """Permanent failure at a limit of the greatest principal stress."""

    type: Literal["principal_stress"] = "principal_stress"
    tensile_strength: units.PositivePressure = key("sigma_f, limit of the greatest principal stress [Pa]")
    shear_strength: units.PositivePressure | None = key("tau_f, limit of the maximum shear stress [Pa]", None)


class CockcroftLathamDamage(_RatedSpalling, _Fitted):
    """Damage is plastic work of the greatest principal stress in tension, sum max(sigma_1, 0) d(eps_p), over W_cr."""

    type: Literal["cockcroft_latham"] = "cockcroft_latham"
    critical_work: units.PositivePressure = key("W_cr [J/m^3 = Pa]")


class JohnsonHolmquistDamage(StrictModel):
    """JH-2: D = sum d(eps_p)/(D1 x^D2), x = (p + T)/P_HEL, with bulking; goes with the strength of that name."""

    type: Literal["johnson_holmquist"] = "johnson_holmquist"
    d1: units.PositiveNumber = key("D1 [-]")
    d2: units.NonNegativeNumber = key("D2 [-]")
    beta: units.NonNegativeNumber = key("Share of the elastic energy lost that becomes bulking [-]", 1.0)


Residual = units.Share
_RESIDUAL = "Share of shear stress, moduli and compressive strength of the fibre left by an open mode [-]"
Strengths = tuple[units.PositivePressure, units.PositivePressure, units.PositivePressure]


class HashinDamage(StrictModel):
    """Hashin's modes of fibre, matrix and delamination, each for good; goes with `orthotropic` strength."""

    type: Literal["hashin"] = "hashin"
    fibre_tension: units.PositivePressure = key("XT [Pa]")
    fibre_compression: units.PositivePressure = key("XC [Pa], beyond the confinement")
    matrix_tension: units.PositivePressure = key("YT [Pa]")
    matrix_compression: units.PositivePressure = key("YC [Pa]")
    shear: units.PositivePressure = key("S12, also S13 [Pa]")
    transverse_shear: units.PositivePressure = key("S23 [Pa]")
    delamination_tension: units.PositivePressure | None = key("ZT [Pa]; YT unless given", None)
    delamination_shear: units.PositivePressure | None = key("SZ [Pa]; S12 unless given", None)
    residual: Residual = key(_RESIDUAL, 0.2)


class MaxStressDamage(StrictModel):
    """Each stress along the material axes against its own limit; goes with `orthotropic` strength."""

    type: Literal["max_stress"] = "max_stress"
    tension: Strengths = key("X, Y, Z in tension [Pa]")
    compression: Strengths = key("X, Y, Z in compression beyond that of the other axes [Pa]")
    shear: Strengths = key("S12, S13, S23 [Pa]")
    residual: Residual = key(_RESIDUAL, 0.2)


_Isotropic = PressureCutoff | JohnsonCookDamage | GradyKippDamage | GradySpallDamage | PrincipalStressDamage
_Coupled = CockcroftLathamDamage | JohnsonHolmquistDamage
Damage = Annotated[NoDamage | _Isotropic | _Coupled | HashinDamage | MaxStressDamage, BY_TYPE]
