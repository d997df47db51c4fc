"""Equations of state of a material."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import ValidationInfo, model_validator

from hvisph.case import units
from hvisph.case.model import BY_TYPE, DataFile, Problem, StrictModel, key, refuse

PoissonRatio = Annotated[float, units.Quantity(units.NUMBER, above=-1, below=0.5)]
AdiabaticIndex = Annotated[float, units.Quantity(units.NUMBER, above=1)]


class LinearEos(StrictModel):
    """p = K (rho/rho0 - 1), independent of energy.

    In a case with `units: none` a Cauchy number Ca may stand for K: p = (rho - rho0)/Ca, that is K = rho0/Ca and a
    sound speed of Ca^-1/2 whatever rho0 is. The other definition in Zisis 2013, p = (rho/rho0 - 1)/Ca, is K = 1/Ca.
    """

    type: Literal["linear"] = "linear"
    bulk_modulus: units.PositivePressure | None = key("Bulk modulus K [Pa]; unless a Cauchy number is given", None)
    cauchy_number: units.PositiveNumber | None = key(
        "Cauchy number Ca = rho0 v^2/K of the impact velocity v = 1 [-]; only with "
        "`units: none`, and in place of the modulus",
        None,
    )
    definition: Literal["density_difference", "density_ratio"] = key(
        "Definition of Ca: `density_difference` p = (rho - rho0)/Ca, `density_ratio` p = (rho/rho0 - 1)/Ca",
        "density_difference",
    )

    @model_validator(mode="after")
    def _one_stiffness(self, info: ValidationInfo) -> LinearEos:
        units = (info.context or {}).get("units")
        if self.cauchy_number is None and self.bulk_modulus is None:
            message = "missing: give the bulk modulus K" + (" or a cauchy_number" if units == "none" else "")
            refuse([("bulk_modulus", message)])
        if self.cauchy_number is not None and self.bulk_modulus is not None:
            refuse([("cauchy_number", "given beside `bulk_modulus`, which says the same; leave one out")])
        if self.cauchy_number is not None and units != "none":
            message = "has a meaning only in a case with `units: none`; give `bulk_modulus` in Pa"
            refuse([("cauchy_number", message)])
        if self.cauchy_number is None and self.definition != "density_difference":
            refuse([("definition", "has a meaning only beside `cauchy_number`; leave it out")])
        return self

    def modulus(self, density: float) -> float:
        """Return K [Pa] of a material of reference density `density` [kg/m^3]."""
        if self.bulk_modulus is not None:
            return self.bulk_modulus
        assert self.cauchy_number is not None
        return (density if self.definition == "density_difference" else 1.0) / self.cauchy_number


class ElasticEos(StrictModel):
    """p = K (rho/rho0 - 1) with K = E / (3 (1 - 2 nu)); the strength takes its G = E / (2 (1 + nu))."""

    type: Literal["elastic"] = "elastic"
    youngs_modulus: units.PositivePressure = key("Young's modulus E [Pa]")
    poisson_ratio: PoissonRatio = key("Poisson's ratio nu [-], above -1 and below 0.5")

    @property
    def bulk_modulus(self) -> float:
        """Bulk modulus K [Pa]."""
        return self.youngs_modulus / (3.0 * (1.0 - 2.0 * self.poisson_ratio))

    @property
    def shear_modulus(self) -> float:
        """Shear modulus G [Pa]."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))


class StiffenedGasEos(StrictModel):
    """p = c0^2 (rho - rho0) + (gamma - 1) rho e."""

    type: Literal["stiffened_gas"] = "stiffened_gas"
    sound_speed: units.PositiveVelocity = key("Bulk sound speed c0 at rest [m/s]")
    gamma: AdiabaticIndex = key("Exponent gamma [-]; gamma - 1 is the Grueneisen coefficient")


class MieGruneisenEos(StrictModel):
    """Mie-Grueneisen about a cubic shock Hugoniot Us = c0 + s1 up + s2 (up/Us) up + s3 (up/Us)^2 up.

    `us_up` stands for the coefficients: measured points, through which the line of least squares goes, or the curve of
    `us_up_order`.
    """

    type: Literal["mie_gruneisen"] = "mie_gruneisen"
    sound_speed: units.PositiveVelocity | None = key("Bulk sound speed c0 at rest [m/s]; unless points are given", None)
    s1: units.NonNegativeNumber | None = key("Slope s1 of the Us-up line [-]; unless points are given", None)
    s2: units.Number = key("Second coefficient s2 of the Us-up curve [-]", 0.0)
    s3: units.Number = key("Third coefficient s3 of the Us-up curve [-]", 0.0)
    us_up: tuple[tuple[units.PositiveVelocity, units.PositiveVelocity], ...] = key(
        "Points [up, Us] of the Hugoniot [m/s], two at least; for `sound_speed` and `s1`", ()
    )
    us_up_order: int = key("Coefficients fitted to the points: s1, with 2 also s2, with 3 also s3", 1, ge=1, le=3)
    gamma: units.NonNegativeNumber = key("Grueneisen coefficient Gamma0 at reference density [-]")
    a: units.Number = key("First-order volume correction to Gamma0 [-]", 0.0)
    expansion: Literal["vanishing", "linear"] = key(
        "Below the reference density: vanishing with density, or as published", "vanishing"
    )

    def _faults(self) -> Iterator[Problem]:
        if not self.us_up:
            missing = [name for name in ("sound_speed", "s1") if getattr(self, name) is None]
            yield from ((name, "missing: give it, or points of the Hugoniot as `us_up`") for name in missing)
            return
        if self.sound_speed is not None or self.s1 is not None or self.s2 or self.s3:
            yield "us_up", "given beside coefficients of the Hugoniot; leave one out"
            return
        few = ("a line needs points at two", "a curve of order 2 needs points at three")
        if len({up for up, _ in self.us_up}) < self.us_up_order + 1:
            needed = (*few, "a curve of order 3 needs points at four")[self.us_up_order - 1]
            yield "us_up", f"{needed} particle velocities at least"
            return
        c0, s1 = self.hugoniot[:2]
        if c0 <= 0.0 or s1 < 0.0:
            yield "us_up", f"the line through the points has c0 = {c0:g} m/s and s1 = {s1:g}; check them"

    @property
    def hugoniot(self) -> tuple[float, float, float, float]:
        """c0 [m/s], s1, s2 and s3, from the points where they are given."""
        if self.sound_speed is not None and self.s1 is not None:
            return self.sound_speed, self.s1, self.s2, self.s3
        from numpy.linalg import lstsq

        columns = [[1.0, *(up * (up / us) ** k for k in range(self.us_up_order))] for up, us in self.us_up]
        found = lstsq(columns, [us for _, us in self.us_up])[0].tolist()
        c0, s1, s2, s3 = [*found, 0.0, 0.0][:4]
        return c0, s1, s2, s3

    @property
    def residuals(self) -> list[float]:
        """Measured less fitted shock speed of each point [m/s]."""
        c0, s1, s2, s3 = self.hugoniot
        return [us - c0 - up * (s1 + (up / us) * (s2 + s3 * (up / us))) for up, us in self.us_up]


class UsUpTableEos(StrictModel):
    """Mie-Grueneisen about a shock Hugoniot of straight pieces in Us and up, for changes of phase."""

    type: Literal["us_up_table"] = "us_up_table"
    us_up: tuple[tuple[units.NonNegativeVelocity, units.PositiveVelocity], ...] = key(
        "Points [up, Us] of the Hugoniot [m/s], joined by lines; the first is [0, c0]", min_length=2, max_length=64
    )
    gamma: units.NonNegativeNumber = key("Grueneisen coefficient Gamma0 at reference density [-]")

    def _faults(self) -> Iterator[Problem]:
        if self.us_up[0][0] != 0.0:
            yield "us_up.0", "the first point must be [0, c0], the sound speed at rest"
        for k, ((u, speed), (later, faster)) in enumerate(pairwise(self.us_up), 1):
            if later <= u:
                yield f"us_up.{k}", f"up must be above that of the point before, {u:g} m/s"
            elif not (later * speed > u * faster and later * faster > u * speed and faster > later):
                yield f"us_up.{k}", "density and pressure must rise from point to point: up/Us, up Us, and Us above up"


class TillotsonEos(StrictModel):
    """Solid to vapour: p_c = (a + b/w) rho e + A mu + B mu^2, w = e/(E0 eta^2) + 1, blended into the vapour's."""

    type: Literal["tillotson"] = "tillotson"
    bulk_modulus: units.PositivePressure = key("A, the bulk modulus at rest [Pa]")
    b_modulus: units.NonNegativePressure = key("B, coefficient of mu^2 [Pa]")
    a: units.PositiveNumber = key("a, Grueneisen coefficient of the hot vapour [-]")
    b: units.NonNegativeNumber = key("b; a + b is the Grueneisen coefficient at rest [-]")
    reference_energy: units.PositiveSpecificEnergy = key("E0 [J/kg]")
    alpha: units.NonNegativeNumber = key("Exponent alpha of the expanded vapour [-]")
    beta: units.NonNegativeNumber = key("Exponent beta of the expanded vapour [-]")
    incipient_energy: units.PositiveSpecificEnergy = key("e_iv, energy of incipient vaporisation [J/kg]")
    vaporization_energy: units.PositiveSpecificEnergy = key("e_cv, energy of complete vaporisation [J/kg]")
    expansion: Literal["faded", "linear", "full"] = key(
        "Pressure in cold expansion: `faded` A mu eta^2 (3 - 2 eta), `linear` A mu, `full` A mu + B mu^2 "
        "as published, whose pressure rises again and does not conserve energy",
        "faded",
    )
    low_density: Annotated[float, units.Quantity(units.NUMBER, minimum=0, below=1)] = key(
        "rho/rho0 below which cold material has no pressure; 0.9 in many codes, off unless given", 0.0
    )

    def _faults(self) -> Iterator[Problem]:
        if self.vaporization_energy <= self.incipient_energy:
            yield "vaporization_energy", f"must be above the incipient_energy, {self.incipient_energy:g} J/kg"


class PolynomialEos(StrictModel):
    """p = A1 mu + A2 mu^2 + A3 mu^3 + (B0 + B1 mu) rho0 e; in expansion f (T1 mu + T2 mu^2 + B0 rho0 e)."""

    type: Literal["polynomial"] = "polynomial"
    a1: units.PositivePressure = key("A1, the bulk modulus at rest [Pa]; K1 in ceramics")
    a2: units.Pressure = key("A2 [Pa]", 0.0)
    a3: units.Pressure = key("A3 [Pa]", 0.0)
    b0: units.NonNegativeNumber = key("B0, Grueneisen coefficient at rest [-]", 0.0)
    b1: units.Number = key("B1 [-]", 0.0)
    t1: units.PositivePressure | None = key("T1 [Pa]; A1 unless given", None)
    t2: units.Pressure = key("T2 [Pa]", 0.0)


class MurnaghanEos(StrictModel):
    """p = K/n ((rho/rho0)^n - 1) + Gamma rho0 (e - e_c), e_c the energy of cold compression; f of it in expansion."""

    type: Literal["murnaghan"] = "murnaghan"
    bulk_modulus: units.PositivePressure = key("Bulk modulus K at rest [Pa]")
    exponent: AdiabaticIndex = key("n = dK/dp [-]; 4 for many rocks, 7 for water")
    gamma: units.NonNegativeNumber = key("Grueneisen coefficient, Gamma rho constant [-]; 0: no effect of energy", 0.0)


class Detonation(StrictModel):
    """Detonation front from given points at the detonation velocity."""

    points: tuple[tuple[units.Length, ...], ...] = key("Points of ignition [m]", min_length=1, max_length=1000)
    speed: units.PositiveVelocity | None = key(
        "Detonation speed D [m/s]; unless given that of Chapman and Jouguet, which a, b, r1, "
        "r2, omega and detonation_energy come to",
        None,
    )
    time: units.NonNegativeTime = key("When it starts [s]", 0.0)


class JwlEos(StrictModel):
    """Detonation products: p = A (1 - w/(R1 V)) exp(-R1 V) + B (1 - w/(R2 V)) exp(-R2 V) + w rho e, V = rho0/rho."""

    type: Literal["jwl"] = "jwl"
    a: units.PositivePressure = key("A [Pa]")
    b: units.PositivePressure = key("B [Pa]")
    r1: units.PositiveNumber = key("R1 [-]")
    r2: units.PositiveNumber = key("R2 [-]")
    omega: units.PositiveNumber = key("w, the Grueneisen coefficient of the products [-]")
    detonation_energy: units.PositivePressure = key("Chemical energy per volume E0 [J/m^3 = Pa], such as 7 GPa")
    detonation: Detonation | None = key("Front of the detonation; unless given, all has burnt at the start", None)


class TableEos(StrictModel):
    """A table of pressure and energy: SESAME's text (its table 301), CSV, HDF5, or as planetary codes write it."""

    type: Literal["table"] = "table"
    file: DataFile = key(
        "SESAME text; CSV with the columns, or HDF5 (.h5, .hdf5) with the datasets, density, temperature, "
        "pressure and energy in SI; beside the case file unless the path is absolute"
    )
    number: int | None = key("SESAME number of the material; the first of the file", None)
    format: Literal["sesame", "aneos", "miluphcuda", "gadget", "woma"] | None = key(
        "Layout of the file, detected unless given: `aneos` the SESAME text of Stewart's ANEOS, "
        "`miluphcuda`, `gadget` over entropy in cgs, `woma` also of SWIFT",
        None,
    )


class IdealGasEos(StrictModel):
    """p = (gamma - 1) rho e; the body's `internal_energy` sets its initial pressure."""

    type: Literal["ideal_gas"] = "ideal_gas"
    gamma: AdiabaticIndex = key("Ratio of specific heats gamma [-]")


_Solid = LinearEos | ElasticEos | StiffenedGasEos | MieGruneisenEos | UsUpTableEos
_Wide = TillotsonEos | PolynomialEos | MurnaghanEos | JwlEos | TableEos | IdealGasEos
Eos = Annotated[_Solid | _Wide, BY_TYPE]
