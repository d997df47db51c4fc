"""Physical dimensions of a case file, with the units that need no registry."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal


@dataclass(frozen=True)
class Dimension:
    """A kind of quantity.

    Parameters
    ----------
    name
        Its name in messages, with its article: ``a length``.
    unit
        Unit of plain numbers, as pint reads it; empty for pure numbers.
    example
        What a user would write.
    units
        Usual units and their decimal factors, read without pint, whose import takes 0.3 s; `_` is a blank.
    """

    name: str
    unit: str
    example: str
    units: str = ""


LENGTH = Dimension("a length", "m", "0.1 mm", "m=1 cm=1e-2 mm=1e-3 um=1e-6 µm=1e-6 nm=1e-9 km=1e3")
TIME = Dimension("a time", "s", "8 us", "s=1 ms=1e-3 us=1e-6 µs=1e-6 ns=1e-9 ps=1e-12")
MASS = Dimension("a mass", "kg", "1 g", "kg=1 g=1e-3 mg=1e-6 ug=1e-9")
VELOCITY = Dimension("a velocity", "m/s", "3.1 km/s", "m/s=1 km/s=1e3 mm/us=1e3 mm/µs=1e3 mm/ms=1 cm/us=1e4 mm/s=1e-3")
ACCELERATION = Dimension("an acceleration", "m/s^2", "9.81 m/s^2", "m/s^2=1 m/s**2=1 km/s^2=1e3 mm/s^2=1e-3")
PRESSURE = Dimension("a pressure", "Pa", "27.6 GPa", "Pa=1 kPa=1e3 MPa=1e6 GPa=1e9 TPa=1e12 bar=1e5 kbar=1e8 Mbar=1e11")
DENSITY = Dimension(
    "a density", "kg/m^3", "2785 kg/m^3",
    "kg/m^3=1 kg/m**3=1 g/cm^3=1e3 g/cm**3=1e3 g/cc=1e3 kg/m3=1 g/cm3=1e3",
)  # fmt: skip
SPECIFIC_ENERGY = Dimension("a specific energy", "J/kg", "1.2 MJ/kg", "J/kg=1 kJ/kg=1e3 MJ/kg=1e6 J/g=1e3 kJ/g=1e6")
HEAT_CAPACITY = Dimension(
    "a specific heat capacity", "J/(kg K)", "875 J/(kg K)", "J/(kg_K)=1 J/(kg*K)=1 J/kg/K=1 kJ/(kg_K)=1e3"
)
TEMPERATURE = Dimension("a temperature", "K", "300 K", "K=1")
RATE = Dimension("a rate", "1/s", "1 1/s", "1/s=1 1/us=1e6 1/ms=1e3")
ANGLE = Dimension("an angle", "deg", "30 deg", "deg=1 degree=1 degrees=1")
TOUGHNESS = Dimension("a fracture toughness", "Pa m^0.5", "29e6 Pa m^0.5", "Pa_m^0.5=1 MPa_m^0.5=1e6")
INVERSE_PRESSURE = Dimension("an inverse pressure", "1/Pa", "65.2e-12 1/Pa", "1/Pa=1 1/GPa=1e-9 1/Mbar=1e-11")
INVERSE_TEMPERATURE = Dimension("an inverse temperature", "1/K", "0.616e-3 1/K", "1/K=1")
VISCOSITY = Dimension("a viscosity", "Pa s", "0.012 MPa s", "Pa_s=1 MPa_s=1e6")
NUMBER = Dimension("a number", "", "0.3")

DIMENSIONS = tuple(value for value in list(globals().values()) if isinstance(value, Dimension))
# Decimal factors make "27.6 GPa" the float nearest to 27.6e9. A test compares every entry with pint.
COMMON_UNITS = {
    unit.replace("_", " "): (dimension, Decimal(factor))
    for dimension in DIMENSIONS
    for unit, _, factor in (entry.partition("=") for entry in dimension.units.split())
}


def spellings(dimension: Dimension) -> list[str]:
    """Return the usual units of `dimension`, for "did you mean"."""
    return [unit for unit, (kind, _) in COMMON_UNITS.items() if kind is dimension]


def dimension_of(unit: str) -> Dimension:
    """Return the dimension whose plain numbers are in `unit`.

    Raises
    ------
    KeyError
        If the case file has none.
    """
    return {dimension.unit: dimension for dimension in DIMENSIONS}[unit]
