"""The catalogue of measures: name, unit, dimensions, meaning, and how tables show each number of a run's result.

A new measure is a function in `hvisph.measures`, called in its `measure`, and a row here: the case file's
`measures` and `expected`, its schema and manual, summaries and tables follow.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

# How many of a unit for people are in the SI unit that it stands for; what is not named here is shown as it is.
PER_SI = {"cm": 1e2, "mm": 1e3, "GPa": 1e-9, "%": 1e2, "us": 1e6, "g": 1e3, "mm^2": 1e6, "deg": math.degrees(1.0)}
# Units of what is as large as the bodies, the largest first, for grains of dust and for asteroids; the least size of
# each in SI that is no rounding, and the number from which on the unit that people use has too many digits.
_LENGTHS = {"km": 1e-3, "m": 1.0, "mm": 1e3, "um": 1e6, "nm": 1e9}
_TIMES = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9, "ps": 1e12, "fs": 1e15}
_SIZED: dict[str, tuple[dict[str, float], float, float]] = {
    "cm": (_LENGTHS, 1e-10, 1e3),
    "mm": (_LENGTHS, 1e-10, 1e4),
    "us": (_TIMES, 1e-14, 1e4),
    "ns": (_TIMES, 1e-18, 1e5),
    "g": ({"kg": 1.0, "g": 1e3, "mg": 1e6, "ug": 1e9, "ng": 1e12, "pg": 1e15}, 1e-18, 1e7),
    "N s": ({"MN s": 1e-6, "N s": 1.0, "mN s": 1e3, "uN s": 1e6, "nN s": 1e9, "pN s": 1e12}, 1e-13, 1e8),
    "J": ({"TJ": 1e-12, "MJ": 1e-6, "J": 1.0, "mJ": 1e3, "uJ": 1e6, "nJ": 1e9, "pJ": 1e12}, 1e-13, 1e8),
    "kJ": ({"TJ": 1e-12, "GJ": 1e-9, "MJ": 1e-6, "kJ": 1e-3, "J": 1.0, "mJ": 1e3, "uJ": 1e6, "nJ": 1e9}, 1e-13, 1e5),
}
_OTHERS = {unit: factor for ladder, *_ in _SIZED.values() for unit, factor in ladder.items()}
# Number below which that unit has too few.
_SMALL = 1e-2
_SHORT = 0.1  # and below which the end of an axis has


@dataclass(frozen=True)
class Look:
    """How a table shows a number.

    Parameters
    ----------
    label, short
        What people call it; and where many columns leave little room: the papers' symbol, if they have one.
    unit
        Unit for people.
    decimals
        Digits after the point; -1 for significant figures.
    """

    label: str
    short: str
    unit: str
    decimals: int

    @property
    def factor(self) -> float:
        """How many of `unit` are in the SI unit."""
        unit = self.unit.split("/m")[0]
        return PER_SI.get(unit, _OTHERS.get(unit, 1.0))

    def fitting(self, size: float, few: float = _SMALL) -> Look:
        """Return this look, or that in the unit which suits a number of `size` [SI] where it has too many digits.

        Below `few` of this unit it has too few of them.
        """
        unit, slash, depth = self.unit.partition("/m")
        ladder, least, many = _SIZED.get(unit, ({}, math.inf, math.inf))
        if not least <= abs(size) < math.inf or few <= abs(size) * self.factor < many:
            return self
        best = next((u for u, factor in ladder.items() if abs(size) * factor >= 1.0), list(ladder)[-1])
        return Look(self.label, self.short, f"{best}{slash}{depth}", -1)


@dataclass(frozen=True)
class Measure:
    """A number that `hvisph measure` reports.

    Parameters
    ----------
    name
        Name at every interface: case file, summary, Python.
    unit
        SI unit; empty for plain numbers.
    dims
        Numbers of dimensions in which it has a meaning.
    meaning
        One line for the manual.
    look
        How tables show it.
    """

    name: str
    unit: str
    dims: tuple[int, ...]
    meaning: str
    look: Look


def _measure(name: str, unit: str, dims: tuple[int, ...], meaning: str, label: str, shown: str, decimals: int,
             short: str = "") -> Measure:  # fmt: skip
    look = Look(label, short or name.replace("_", " "), shown, decimals)
    return Measure(name, unit, dims, f"{meaning} [{unit or '-'}]", look)


_ANY, _SOLID, _PLANE, _LINE = (1, 2, 3), (2, 3), (2,), (1,)

# In the order of tables. Columns: name, SI unit, dimensions, meaning; label, unit for people, decimals, short label.
CATALOGUE: dict[str, Measure] = {
    measure.name: measure
    for measure in (
        _measure("perforated", "", _SOLID, "Whether all layers are perforated: 1 or 0",
                 "perforated", "", 0),
        _measure("crater_diameter", "m", _SOLID, "Mean diameter of the hole in the target",
                 "crater diameter", "cm", 2, "d_cra"),
        _measure("crater_diameter_minimum", "m", _SOLID, "Smallest diameter of the hole in the target",
                 "crater diameter, narrowest", "cm", 2, "d_cra min"),
        _measure("crater_lip_to_lip", "m", _SOLID, "Diameter of the crater between its lips",
                 "crater, lip to lip", "cm", 2, "lip to lip"),
        _measure("extension", "m", _SOLID, "Extent of the projectile's main body along the shot line",
                 "extension of the projectile", "cm", 2, "L_ext"),
        _measure("penetration", "m", _SOLID, "Depth of the projectile's tip behind the struck face",
                 "penetration", "cm", 2, "L_proj"),
        _measure("void_fraction", "", _PLANE, "Share of voids within the projectile's main body",
                 "voids in the projectile", "%", 1, "voids"),
        _measure("centre_pressure_peak", "Pa", _ANY, "Highest mean pressure at the projectile's centre",
                 "peak centre pressure", "GPa", 2, "P peak"),
        _measure("centre_tension_peak", "Pa", _ANY, "Highest tension of the projectile on the shot line, positive",
                 "peak tension on the axis", "GPa", 2, "T peak"),
        _measure("residual_velocity", "m/s", _SOLID, "Axial velocity of the projectile's main body behind all layers",
                 "residual velocity", "m/s", 1, "v_d"),
        _measure("momentum_transfer", "", _ANY, "Momentum of the target over that of the shot",
                 "momentum transfer beta", "", 3, "beta"),
        _measure("plug_velocity", "m/s", _SOLID, "Axial velocity of the plug, the largest piece punched out",
                 "plug velocity", "m/s", 1),
        _measure("plug_width", "m", _SOLID, "Extent of the plug across the shot line, between particles",
                 "plug width", "mm", 2),
        _measure("plug_thickness", "m", _SOLID, "Extent of the plug along the shot line, between particles",
                 "plug thickness", "mm", 2),
        _measure("impact_diameter", "m", _SOLID, "Twice the mean radius of the hole's lip",
                 "impact diameter", "mm", 2),
        _measure("lip_height", "m", _SOLID, "Mean height of the lip over the plate's rear face",
                 "lip height", "mm", 2),
        _measure("lip_height_maximum", "m", _SOLID, "Largest height of the lip over the plate's rear face",
                 "lip height, largest", "mm", 2),
        _measure("target_fragments", "", _SOLID, "Number of the target's detached pieces of 5 particles or more",
                 "fragments off the target", "", 0),
        _measure("projectile_temperature", "K", _ANY, "Mean temperature of the projectile",
                 "temperature of the projectile", "K", 0),
        _measure("target_temperature", "K", _ANY, "Mean temperature of all layers",
                 "temperature of the layers", "K", 0),
        _measure("highest_temperature", "K", _ANY, "Temperature that 99.9 % of the mass of both stay below",
                 "highest temperature", "K", 0),
        _measure("penetration_ratio", "", _SOLID, "Depth of the crater over the projectile's first length, P/L",
                 "penetration P/L", "", 3, "P/L"),
        _measure("final_length", "m", _SOLID, "Length of a bar that has struck a rigid wall or its like",
                 "length of the bar", "mm", 2),
        _measure("length_ratio", "", _SOLID, "That over its length at the start, L/L0",
                 "length of the bar L/L0", "", 4, "L/L0"),
        _measure("foot_diameter", "m", _SOLID, "Diameter of a bar's foot", "foot of the bar", "mm", 2),
        _measure("diameter_at_fifth", "m", _SOLID, "Diameter of a bar at a fifth of its first length from the foot",
                 "bar at L0/5 from the foot", "mm", 2),
        _measure("undeformed_length", "m", _SOLID, "Length of a bar's rear that is wider by less than 1 %",
                 "undeformed rear of the bar", "mm", 2),
        _measure("inner_radius", "m", _SOLID, "Inner radius of a hollow body", "inner radius", "mm", 3),
        _measure("outer_radius", "m", _SOLID, "Outer radius of a hollow body", "outer radius", "mm", 3),
        _measure("pull_back_velocity", "m/s", _ANY, "Fall of a free surface's velocity before spall raises it again",
                 "pull-back velocity", "m/s", 1),
        _measure("spall_strength", "Pa", _ANY, "Spall strength that follows from it, rho0 c_b du/2",
                 "spall strength", "GPa", 3),
        _measure("plateau_stress", "Pa", _LINE, "Axial stress behind the shocks of a plate impact",
                 "plateau stress", "GPa", 3),
        _measure("interface_velocity", "m/s", _LINE, "Velocity of the interface of a plate impact",
                 "interface velocity", "m/s", 1),
    )
}  # fmt: skip

# Measures of every layer, likewise.
LAYER_CATALOGUE: dict[str, Measure] = {
    measure.name: measure
    for measure in (
        _measure("perforated", "", _SOLID, "Whether the layer is perforated: 1 or 0", "perforated", "", 0),
        _measure("perforation_time", "s", _SOLID, "When a way first led through it", "perforated at", "us", 2),
        _measure("impulse", "N s", _SOLID, "Momentum along its normal that it has taken up", "impulse", "N s", 4),
        _measure("struck_diameter", "m", _SOLID, "Width within which 90 % of what has arrived there is",
                 "struck over", "mm", 2),
        _measure("mean_pressure", "Pa", _SOLID, "Impulse over that width and the time since the first arrival",
                 "mean pressure", "GPa", 4),
        _measure("passage_time", "s", _SOLID, "When the projectile's centre of mass was behind it",
                 "centre of projectile behind it at", "us", 2),
        _measure("passage_velocity", "m/s", _SOLID, "Axial velocity of all of the projectile's matter then",
                 "projectile's velocity then", "m/s", 1),
        _measure("passage_largest_share", "", _SOLID, "Share of the projectile's mass in its largest piece then",
                 "largest piece then", "%", 1),
        _measure("passage_length", "m", _SOLID, "Length of that piece then", "its length then", "mm", 2),
        _measure("hole_diameter", "m", _SOLID, "Mean diameter of the hole over the layer's thickness",
                 "hole diameter", "mm", 2),
        _measure("hole_diameter_least", "m", _SOLID, "Least diameter in any direction and depth",
                 "hole diameter, least", "mm", 2),
        _measure("hole_diameter_greatest", "m", _SOLID, "Greatest diameter in any direction and depth",
                 "hole diameter, greatest", "mm", 2),
        _measure("hole_diameter_front", "m", _SOLID, "Mean diameter at the struck face", "hole at the front", "mm", 2),
        _measure("hole_diameter_rear", "m", _SOLID, "Mean diameter at the rear face", "hole at the rear", "mm", 2),
        _measure("hole_diameter_clear", "m", _SOLID, "Mean diameter of what is clear along the layer's normal",
                 "hole, clear", "mm", 2),
        _measure("hole_area", "m^2", (3,), "Mean area of the hole over the layer's thickness", "hole area", "mm^2", 1),
        _measure("crater_depth", "m", _SOLID, "Deepest point of the struck face", "crater depth", "mm", 2),
        _measure("crater_diameter", "m", _SOLID, "Mean diameter of the crater at the level of the struck face",
                 "crater diameter", "mm", 2),
        _measure("bulge", "m", _SOLID, "How far the rear face stands out", "bulge", "mm", 2),
        _measure("spall_mass", "kg", _SOLID, "Mass of what has come off the rear", "spall", "g", 3),
        _measure("spall_thickness", "m", _SOLID, "Thickness of its largest piece", "spall thickness", "mm", 2),
        _measure("spall_velocity", "m/s", _SOLID, "Mean velocity of it along the normal", "spall velocity", "m/s", 1),
        _measure("front_lip", "m", _SOLID, "Height of the lip on the struck face", "lip, front", "mm", 2),
        _measure("rear_lip", "m", _SOLID, "Height of the lip on the rear face of a perforated layer",
                 "lip, rear", "mm", 2),
        _measure("mass_lost", "kg", _SOLID, "Mass that is not attached to the layer's rim any more",
                 "mass lost", "g", 3),
        _measure("hole_diameter_by_mass", "m", _SOLID, "Diameter of the hole that the mass lost would fill",
                 "hole, by mass lost", "mm", 2),
    )
}  # fmt: skip

# Measures of what is left of the projectile.
PROJECTILE_CATALOGUE: dict[str, Measure] = {
    measure.name: measure
    for measure in (
        _measure("residual_mass", "kg", _SOLID, "Mass of all pieces of 1 % of the projectile's mass or more",
                 "residual mass", "g", 3),
        _measure("residual_length", "m", _SOLID, "Length of the largest piece behind all layers",
                 "residual length", "mm", 2),
        _measure("residual_velocity_largest", "m/s", _SOLID, "Axial velocity of the largest piece",
                 "residual velocity, largest piece", "m/s", 1),
        _measure("residual_angle", "rad", _SOLID, "Angle between its velocity and the shot line",
                 "residual direction", "deg", 2),
        _measure("residual_velocity_pieces", "m/s", _SOLID, "Axial velocity of all pieces of 1 % of the mass or more",
                 "residual velocity, pieces", "m/s", 1),
        _measure("residual_velocity_all", "m/s", _SOLID, "Axial velocity of all of the projectile's matter",
                 "residual velocity, all", "m/s", 1),
        _measure("largest_share", "", _ANY, "Share of the projectile's mass in its largest piece",
                 "largest piece", "%", 1),
        _measure("pieces_share", "", _ANY, "Share of it in pieces of 1 % or more", "pieces", "%", 1),
        _measure("length", "m", _SOLID, "Length of the largest piece along the shot line", "length", "mm", 2),
        _measure("erosion", "m", _SOLID, "Length that the projectile has lost", "length lost", "mm", 2),
        _measure("depth", "m", _SOLID, "Its front behind the first layer's struck face, along the normal",
                 "depth", "mm", 2),
    )
}  # fmt: skip

# Measures of the debris cloud.
CLOUD_CATALOGUE: dict[str, Measure] = {
    measure.name: measure
    for measure in (
        _measure("front_velocity", "m/s", _SOLID, "Axial velocity that 99.9 % of the cloud's mass stay below",
                 "front velocity, 99.9 %", "m/s", 0),
        _measure("front_velocity_99", "m/s", _SOLID, "That 99 % stay below", "front velocity, 99 %", "m/s", 0),
        _measure("front_velocity_90", "m/s", _SOLID, "That 90 % stay below", "front velocity, 90 %", "m/s", 0),
        _measure("rear_velocity", "m/s", _SOLID, "Axial velocity that 99 % of the cloud's mass exceed",
                 "rear velocity", "m/s", 0),
        _measure("radial_velocity", "m/s", _SOLID, "Radial velocity that 99.9 % of the cloud's mass stay below",
                 "radial velocity, 99.9 %", "m/s", 0),
        _measure("radial_velocity_99", "m/s", _SOLID, "That 99 % stay below", "radial velocity, 99 %", "m/s", 0),
        _measure("radial_velocity_90", "m/s", _SOLID, "That 90 % stay below", "radial velocity, 90 %", "m/s", 0),
        _measure("cloud_length", "m", _SOLID, "Length of the cloud, of 99 % of its mass", "length", "mm", 1),
        _measure("cloud_width", "m", _SOLID, "Width of the cloud, of 99 % of its mass", "width", "mm", 1),
        _measure("half_angle", "rad", _SOLID, "Angle from the shot line that 90 % of the mass fly within",
                 "half angle", "deg", 1),
        _measure("cloud_mass", "kg", _SOLID, "Mass of the cloud", "mass", "g", 3),
        _measure("cloud_momentum", "N s", _SOLID, "Axial momentum of the cloud", "momentum", "N s", 3),
        _measure("cloud_energy", "J", _SOLID, "Kinetic energy of the cloud", "kinetic energy", "J", 1),
    )
}  # fmt: skip

# What is asked first of a shot, and how many measures a table of several runs shows.
MAIN = ("perforated", "crater_diameter", "penetration", "residual_velocity", "final_length", "foot_diameter",
        "centre_pressure_peak")  # fmt: skip
MOST_COLUMNS = 5

# What a run has conserved stands in tables beside its measures.
DRIFTS = {
    "energy_drift": Look("energy drift", "energy drift", "%", 5),
    "momentum_drift": Look("momentum drift", "momentum drift", "", -1),
    "angular_momentum_drift": Look("angular momentum drift", "angular momentum drift", "", -1),
}


def axis_unit(unit: str, values: Any) -> tuple[str, float]:
    """Return the unit of an axis that shows `values` [SI], and how many of it the SI unit has.

    It is `unit`, that of people, unless they are very small or large; what is not finite does not count.
    """
    finite = [abs(float(value)) for value in values if math.isfinite(value)]
    look = Look("", "", unit, -1).fitting(max(finite, default=0.0), _SHORT)
    return look.unit, look.factor


def told_share(share: float) -> str:
    """Return a share in per cent, in two figures."""
    return "100 %" if round(100.0 * share, 0) == 100.0 else f"{100.0 * share:.2g} %"


def told_time(time: float, digits: str = ".4g", end: float | None = None) -> str:
    """Return a time [s] in the unit that suits it, or a run's `end`; `digits` is a format for microseconds."""
    unit, factor = axis_unit("us", [time if end is None else end])
    return f"{time * factor:{digits if unit == 'us' else '.4g'}} {unit}"


def measures_of(dim: int) -> tuple[str, ...]:
    """Return the names of the measures that have a meaning in `dim` dimensions."""
    return tuple(name for name, measure in CATALOGUE.items() if dim in measure.dims)


def reported(dim: int) -> tuple[str, ...]:
    """Return the names that a result in `dim` dimensions holds: those without a meaning there say why.

    Only measures of plate impacts, which nobody misses elsewhere, are left out beyond 1D.
    """
    return tuple(name for name, measure in CATALOGUE.items() if dim in measure.dims or measure.dims != _LINE)


def main_measures(names: Sequence[str]) -> list[str]:
    """Return those of `names` that matter most, as many as a table of several runs has columns for."""
    return [*(name for name in MAIN if name in names), *(name for name in names if name not in MAIN)][:MOST_COLUMNS]


def look_of(name: str, unit: str = "", unitless: bool = False) -> Look:
    """Return how a table shows a number.

    Parameters
    ----------
    name
        A measure, a drift, or any other number.
    unit
        SI unit of a number that is in no catalogue: it is shown in that.
    unitless
        Whether the case has no units: all but shares are shown as they are.
    """
    every = (CATALOGUE, LAYER_CATALOGUE, PROJECTILE_CATALOGUE, CLOUD_CATALOGUE)
    known = next((catalogue[name] for catalogue in every if name in catalogue), None)
    if known is not None:
        look = known.look
    else:
        words = name.replace("_", " ")
        look = DRIFTS.get(name) or Look(words, words, unit, -1)
    if unitless and look.unit != "%":
        return Look(look.label, look.short, "", -1)
    if look.unit in ("g", "N s", "J") and "/m" in unit:  # per metre in 2D
        return Look(look.label, look.short, f"{look.unit}/m{unit.partition('/m')[2]}", look.decimals)
    return look
