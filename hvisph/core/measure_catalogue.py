"""Catalogue of measures: name, unit, dimensions, meaning and format in tables.

A new measure is a row here and a function in `hvisph.measures` that is registered under its name by
`hvisph.measures.result.measures`: the case file, its schema and manual, summaries and tables follow.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

# Number of each unit of tables in the SI unit.
PER_SI = {"cm": 1e2, "mm": 1e3, "GPa": 1e-9, "%": 1e2, "us": 1e6, "g": 1e3, "mm^2": 1e6, "deg": math.degrees(1.0)}
# Units by quantity, the largest first, from grains of dust to asteroids; the least size in SI that is no round-off, and
# the number from which on the unit of tables has too many digits.
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
class NumberFormat:
    """Format of a number in tables."""

    # its name in words, and a short one for narrow columns: the symbol of the papers, if there is one
    label: str
    short: str
    unit: str  # unit of tables
    decimals: int  # digits after the point; -1 for significant figures

    @property
    def factor(self) -> float:
        """Number of `unit` in the SI unit."""
        unit = self.unit.split("/m")[0]
        return PER_SI.get(unit, _OTHERS.get(unit, 1.0))

    def scale_to(self, size: float, few: float = _SMALL) -> NumberFormat:
        """Return the format in the unit that suits a number of `size` [SI]; this one from `few` of its unit on."""
        unit, slash, depth = self.unit.partition("/m")
        ladder, least, many = _SIZED.get(unit, ({}, math.inf, math.inf))
        if not least <= abs(size) < math.inf or few <= abs(size) * self.factor < many:
            return self
        best = next((u for u, factor in ladder.items() if abs(size) * factor >= 1.0), list(ladder)[-1])
        return NumberFormat(self.label, self.short, f"{best}{slash}{depth}", -1)


@dataclass(frozen=True)
class Measure:
    """A measured quantity: one row of the catalogue."""

    section: str  # part of a summary that holds it: ``run``, ``layer`` (each layer), ``projectile`` or ``cloud``
    name: str  # name at every interface: case file, summary, Python
    unit: str  # SI unit in three dimensions; empty for plain numbers
    dims: tuple[int, ...]  # numbers of dimensions in which it has a meaning
    meaning: str  # one line for the manual
    display: NumberFormat  # format in tables
    # further definitions of the same quantity by name, with their meanings; the first one is its value
    variants: Mapping[str, str]

    def unit_in(self, space: int) -> str:
        """Return the SI unit in `space` dimensions: extensive quantities are per depth in 2D and per area in 1D."""
        if self.unit == "m^3":
            return {2: "m^2", 3: "m^3"}.get(space, "m")
        return self.unit + PER_DEPTH[space] if self.unit in ("kg", "N s", "J") else self.unit


PER_DEPTH = {1: "/m^2", 2: "/m", 3: ""}
_ANY, _SOLID, _PLANE, _LINE = (1, 2, 3), (2, 3), (2,), (1,)
_TRANSIENT = "at the face, at the moment of the greatest volume"
_OF = {"all": "of projectile and layers", "projectile": "of the projectile", "target": "of all layers"}


def _section(section: str, *rows: tuple[Any, ...]) -> dict[str, Measure]:
    """Return the measures of a section by name.

    Columns: name, SI unit, dimensions, meaning; label, unit in tables, decimals, short label; variants.
    """
    measures = {}
    for name, unit, dims, meaning, label, shown, decimals, *rest in rows:
        variants = next((column for column in rest if isinstance(column, dict)), {})
        short = next((column for column in rest if isinstance(column, str)), name.replace("_", " "))
        display = NumberFormat(label, short, shown, decimals)
        measures[name] = Measure(section, name, unit, dims, f"{meaning} [{unit or '-'}]", display, variants)
    return measures


# The measures of every section, in the order of tables.
SECTIONS: dict[str, dict[str, Measure]] = {
    "run": _section(
        "run",
        ("perforated", "", _SOLID, "Whether all layers are perforated: 1 or 0", "perforated", "", 0),
        ("crater_diameter", "m", _SOLID, "Mean diameter of the hole within the target's original thickness",
         "crater diameter", "cm", 2, "d_cra"),
        ("crater_diameter_min", "m", _SOLID, "Smallest diameter of that hole", "crater diameter, minimum", "cm", 2,
         "d_cra min"),
        ("crater_lip_diameter", "m", _SOLID, "Diameter between the crests of the crater's lips",
         "crater diameter, lip to lip", "cm", 2, "lip to lip"),
        ("extension", "m", _SOLID, "Extent of the projectile's main body along the shot line",
         "extension of the projectile", "cm", 2, "L_ext"),
        ("penetration", "m", _SOLID, "Depth of the projectile's tip behind the struck face",
         "penetration", "cm", 2, "L_proj"),
        ("void_fraction", "", _PLANE, "Area fraction of voids within the projectile's main body",
         "voids in the projectile", "%", 1, "voids"),
        ("centre_pressure_peak", "Pa", _ANY, "Highest mean pressure at the projectile's centre",
         "peak centre pressure", "GPa", 2, "P peak"),
        ("centre_tension_peak", "Pa", _ANY, "Highest tension of the projectile on the shot line, positive",
         "peak tension on the axis", "GPa", 2, "T peak"),
        ("residual_velocity", "m/s", _SOLID, "Axial velocity of the projectile behind all layers",
         "residual velocity", "m/s", 1, "v_r",
         {"main_body": "largest fragment by number of particles",
          "heaviest": "heaviest fragment",
          "large_fragments": "all fragments of 1 % of the projectile's mass or more",
          "all": "all of the projectile's mass"}),
        ("momentum_transfer", "", _ANY, "Momentum gained by the target over the projectile's momentum at impact",
         "momentum transfer, target / projectile", "", 3, "p_t/p_p"),
        ("beta", "", _SOLID, "One plus the momentum of rising ejecta over the projectile's, along the normal",
         "momentum enhancement beta", "", 3, "beta",
         {"all": "ejecta of target and projectile", "target": "ejecta of the target alone",
          "escaping": "ejecta of both faster than the `escape` speed"}),
        ("ejecta_mass", "kg", _SOLID, "Mass of the first layer above its struck face that rises",
         "mass of the ejecta", "g", 3),
        ("ejecta_momentum", "N s", _SOLID, "Momentum of that mass along the outward normal",
         "momentum of the ejecta", "N s", 4),
        ("plug_velocity", "m/s", _SOLID, "Axial velocity of the plug, the largest fragment punched out",
         "plug velocity", "m/s", 1, "v_p"),
        ("plug_width", "m", _SOLID, "Extent of the plug across the shot line, between particles",
         "plug width", "mm", 2),
        ("plug_thickness", "m", _SOLID, "Extent of the plug along the shot line, between particles",
         "plug thickness", "mm", 2),
        ("impact_diameter", "m", _SOLID, "Twice the mean radius of the hole's lip", "impact diameter", "mm", 2),
        ("lip_height", "m", _SOLID, "Mean height of the lip over the plate's rear face", "lip height", "mm", 2),
        ("lip_height_max", "m", _SOLID, "Largest height of the lip over the plate's rear face",
         "lip height, maximum", "mm", 2),
        ("target_fragments", "", _SOLID, "Number of detached fragments of the target of 5 particles or more",
         "detached fragments of the target", "", 0),
        ("projectile_temperature", "K", _ANY, "Mean temperature of the projectile",
         "temperature of the projectile", "K", 0),
        ("target_temperature", "K", _ANY, "Mean temperature of all layers", "temperature of the layers", "K", 0),
        ("temperature_max", "K", _ANY, "Temperature that 99.9 % of the mass of both do not exceed",
         "maximum temperature", "K", 0),
        ("melt", "kg", _ANY, "Mass that is molten after release, vapour included, by its entropy", "melt", "g", 3, _OF),
        ("vapour", "kg", _ANY, "Mass of vapour after release, by its entropy", "vapour", "g", 3, _OF),
        ("penetration_ratio", "", _SOLID, "Crater depth over the initial length of the projectile, P/L",
         "penetration P/L", "", 3, "P/L"),
        ("final_length", "m", _SOLID, "Length of a bar after the impact on a rigid wall or an equal bar",
         "length of the bar", "mm", 2),
        ("length_ratio", "", _SOLID, "Length of the bar over its initial length, L/L0",
         "length of the bar L/L0", "", 4, "L/L0"),
        ("foot_diameter", "m", _SOLID, "Diameter of a bar's foot", "foot of the bar", "mm", 2),
        ("diameter_at_fifth", "m", _SOLID, "Diameter of a bar at a fifth of its initial length from the foot",
         "bar at L0/5 from the foot", "mm", 2),
        ("undeformed_length", "m", _SOLID, "Length of a bar's rear part that is wider by less than 1 %",
         "undeformed length of the bar", "mm", 2),
        ("inner_radius", "m", _SOLID, "Inner radius of a hollow body", "inner radius", "mm", 3),
        ("outer_radius", "m", _SOLID, "Outer radius of a hollow body", "outer radius", "mm", 3),
        ("pull_back_velocity", "m/s", _ANY, "Decrease of a free surface's velocity before the spall signal",
         "pull-back velocity", "m/s", 1),
        ("spall_strength", "Pa", _ANY, "Spall strength by the pull-back velocity, rho0 c_b du/2",
         "spall strength", "GPa", 3),
        ("plateau_stress", "Pa", _LINE, "Axial stress behind the shocks of a plate impact",
         "plateau stress", "GPa", 3),
        ("interface_velocity", "m/s", _LINE, "Velocity of the interface of a plate impact",
         "interface velocity", "m/s", 1),
    ),
    "layer": _section(
        "layer",
        ("perforated", "", _SOLID, "Whether the layer is perforated: 1 or 0", "perforated", "", 0),
        ("perforation_time", "s", _SOLID, "Time at which the layer was perforated", "perforation time", "us", 2),
        ("impulse", "N s", _SOLID, "Momentum along its normal that the layer has gained", "impulse", "N s", 4),
        ("loaded_diameter", "m", _SOLID, "Diameter that holds 90 % of the mass that has reached the layer",
         "loaded diameter", "mm", 2),
        ("mean_pressure", "Pa", _SOLID, "Impulse over the loaded area and the time since the first arrival",
         "mean pressure", "GPa", 4),
        ("exit_time", "s", _SOLID, "Time at which half of the projectile's mass was behind the layer",
         "exit time of the projectile", "us", 2),
        ("exit_velocity", "m/s", _SOLID, "Axial velocity of all of the projectile's mass at its exit",
         "exit velocity", "m/s", 1),
        ("exit_mass_fraction", "", _SOLID, "Mass fraction of the projectile's heaviest fragment at its exit",
         "heaviest fragment at exit", "%", 1),
        ("exit_length", "m", _SOLID, "Length of that fragment at its exit", "its length at exit", "mm", 2),
        ("hole_diameter", "m", _SOLID, "Diameter of the hole", "hole diameter", "mm", 2,
         {"mean": "mean over directions and the layer's thickness",
          "min": "smallest in any direction and depth",
          "max": "largest in any direction and depth",
          "front": "at the struck face",
          "rear": "at the rear face",
          "clear": "clear width along the layer's normal",
          "mass_loss": "cylindrical hole of the mass lost"}),
        ("hole_area", "m^2", (3,), "Mean area of the hole over the layer's thickness", "hole area", "mm^2", 1),
        ("crater_depth", "m", _SOLID, "Depth of the crater", "crater depth", "mm", 2,
         {"face": "below the struck face", "rim": "below the crest of the rim", "transient": _TRANSIENT}),
        ("crater_outer_diameter", "m", _SOLID, "Mean diameter of the crater", "crater diameter at the face", "mm", 2,
         {"face": "at the level of the struck face", "rim": "from crest to crest of the rim",
          "transient": _TRANSIENT}),
        ("crater_volume", "m^3", _SOLID, "Volume of the crater", "crater volume", "m^3", -1,
         {"face": "below the struck face", "transient": _TRANSIENT}),
        ("bulge_height", "m", _SOLID, "Height of the bulge of the rear face", "bulge", "mm", 2),
        ("ejecta_angle", "rad", _SOLID, "Mass-mean launch angle of its ejecta from the struck face",
         "angle of the ejecta", "deg", 1),
        ("ejecta_radius", "m", _SOLID, "Mass-mean launch radius of its ejecta about the shot line",
         "launch radius of the ejecta", "mm", 2),
        ("spall_mass", "kg", _SOLID, "Mass detached from the rear face", "spall mass", "g", 3),
        ("spall_thickness", "m", _SOLID, "Thickness of the largest spall fragment", "spall thickness", "mm", 2),
        ("spall_velocity", "m/s", _SOLID, "Mean velocity of the spall along the normal", "spall velocity", "m/s", 1),
        ("front_lip_height", "m", _SOLID, "Height of the lip on the struck face", "lip height, front", "mm", 2),
        ("rear_lip_height", "m", _SOLID, "Height of the lip on the rear face of a perforated layer",
         "lip height, rear", "mm", 2),
        ("mass_loss", "kg", _SOLID, "Mass no longer attached to the layer's rim", "mass loss", "g", 3),
    ),
    "projectile": _section(
        "projectile",
        ("residual_mass", "kg", _SOLID, "Mass of all fragments of 1 % of the projectile's mass or more",
         "residual mass", "g", 3),
        ("residual_length", "m", _SOLID, "Length of the heaviest fragment behind all layers",
         "residual length", "mm", 2),
        ("residual_angle", "rad", _SOLID, "Angle between the heaviest fragment's velocity and the shot line",
         "deflection", "deg", 2),
        ("fragment_mass_fraction", "", _ANY, "Mass fraction of fragments of the projectile",
         "heaviest fragment", "%", 1,
         {"heaviest": "heaviest fragment", "large_fragments": "all fragments of 1 % of the mass or more"}),
        ("projectile_length", "m", _SOLID, "Length of the heaviest fragment along the shot line", "length", "mm", 2),
        ("eroded_length", "m", _SOLID, "Initial less present length of the projectile", "eroded length", "mm", 2),
        ("penetration_depth", "m", _SOLID, "Depth of its tip below the first layer's struck face, along the normal",
         "penetration depth", "mm", 2),
    ),
    "cloud": _section(
        "cloud",
        ("cloud_velocity", "m/s", _SOLID, "Velocity of the debris cloud", "front velocity", "m/s", 0,
         {"front": "axial velocity that 99.9 % of the mass do not exceed",
          "front_99": "axial velocity that 99 % do not exceed",
          "front_90": "axial velocity that 90 % do not exceed",
          "rear": "axial velocity that 99 % exceed",
          "radial": "radial velocity that 99.9 % do not exceed",
          "radial_99": "radial velocity that 99 % do not exceed",
          "radial_90": "radial velocity that 90 % do not exceed"}),
        ("cloud_length", "m", _SOLID, "Length of the cloud, of 99 % of its mass", "length", "mm", 1),
        ("cloud_width", "m", _SOLID, "Width of the cloud, of 99 % of its mass", "width", "mm", 1),
        ("cloud_half_angle", "rad", _SOLID, "Half angle of the cone about the shot line with 90 % of the mass",
         "half angle", "deg", 1),
        ("cloud_mass", "kg", _SOLID, "Mass of the cloud", "mass", "g", 3),
        ("cloud_momentum", "N s", _SOLID, "Axial momentum of the cloud", "momentum", "N s", 3),
        ("cloud_energy", "J", _SOLID, "Kinetic energy of the cloud", "kinetic energy", "J", 1),
    ),
}  # fmt: skip
CATALOGUE = SECTIONS["run"]

# Names of earlier versions; a name that has become a variant is `measure.variant`.
RENAMED = {
    "crater_diameter_minimum": "crater_diameter_min", "crater_lip_to_lip": "crater_lip_diameter",
    "lip_height_maximum": "lip_height_max", "highest_temperature": "temperature_max",
    "struck_diameter": "loaded_diameter", "passage_time": "exit_time", "passage_velocity": "exit_velocity",
    "passage_largest_share": "exit_mass_fraction", "passage_length": "exit_length",
    "hole_diameter_least": "hole_diameter.min", "hole_diameter_greatest": "hole_diameter.max",
    "hole_diameter_front": "hole_diameter.front", "hole_diameter_rear": "hole_diameter.rear",
    "hole_diameter_clear": "hole_diameter.clear", "hole_diameter_by_mass": "hole_diameter.mass_loss",
    "bulge": "bulge_height", "front_lip": "front_lip_height", "rear_lip": "rear_lip_height", "mass_lost": "mass_loss",
    "residual_velocity_largest": "residual_velocity.heaviest",
    "residual_velocity_pieces": "residual_velocity.large_fragments", "residual_velocity_all": "residual_velocity.all",
    "largest_share": "fragment_mass_fraction", "pieces_share": "fragment_mass_fraction.large_fragments",
    "length": "projectile_length", "erosion": "eroded_length", "depth": "penetration_depth",
    "front_velocity": "cloud_velocity", "front_velocity_99": "cloud_velocity.front_99",
    "front_velocity_90": "cloud_velocity.front_90", "rear_velocity": "cloud_velocity.rear",
    "radial_velocity": "cloud_velocity.radial", "radial_velocity_99": "cloud_velocity.radial_99",
    "radial_velocity_90": "cloud_velocity.radial_90", "half_angle": "cloud_half_angle",
}  # fmt: skip

# The main measures, and the number of measures in a table of several runs.
MAIN = ("perforated", "crater_diameter", "penetration", "residual_velocity", "final_length", "foot_diameter",
        "centre_pressure_peak")  # fmt: skip
MOST_COLUMNS = 5

# Measures that end a run, by the kind of its case; those of a layer are of the last one that was struck.
HEADLINES = {
    "bar": ("final_length", "length_ratio", "foot_diameter", "undeformed_length", "temperature_max"),
    "plate impact": ("plateau_stress", "interface_velocity", "pull_back_velocity", "spall_strength",
                     "centre_pressure_peak"),
    "shell": ("inner_radius", "outer_radius"),
    "perforation": ("projectile.residual_mass", "residual_velocity", "layer.hole_diameter", "layer.perforation_time",
                    "cloud.cloud_half_angle", "momentum_transfer"),
    "crater": ("layer.crater_depth", "layer.crater_outer_diameter", "layer.bulge_height", "layer.spall_mass",
               "layer.impulse", "momentum_transfer"),
}  # fmt: skip

# What a run has conserved stands in tables beside its measures.
DRIFTS = {
    "energy_drift": NumberFormat("energy drift", "energy drift", "%", 5),
    "momentum_drift": NumberFormat("momentum drift", "momentum drift", "", -1),
    "angular_momentum_drift": NumberFormat("angular momentum drift", "angular momentum drift", "", -1),
}


def axis_unit(unit: str, values: Iterable[float]) -> tuple[str, float]:
    """Return the unit of an axis that shows `values` [SI], and how many of it the SI unit has.

    It is `unit`, that of people, unless they are very small or large; what is not finite does not count.
    """
    finite = [abs(float(value)) for value in values if math.isfinite(value)]
    display = NumberFormat("", "", unit, -1).scale_to(max(finite, default=0.0), _SHORT)
    return display.unit, display.factor


def format_share(share: float) -> str:
    """Return a share in per cent, in two figures."""
    return "100 %" if round(100.0 * share, 0) == 100.0 else f"{100.0 * share:.2g} %"


def format_time(time: float, digits: str = ".4g", end: float | None = None) -> str:
    """Return a time [s] in the unit that suits it, or a run's `end`; `digits` is a format for microseconds."""
    unit, factor = axis_unit("us", [time if end is None else end])
    return f"{time * factor:{digits if unit == 'us' else '.4g'}} {unit}"


def measures_of(dim: int) -> tuple[str, ...]:
    """Return the names of the measures of a run that have a meaning in `dim` dimensions."""
    return tuple(name for name, measure in CATALOGUE.items() if dim in measure.dims)


def reported_measures(dim: int, section: str = "run") -> tuple[str, ...]:
    """Return the names that a section's results in `dim` dimensions hold: those undefined there have a reason.

    Measures of plate impacts are left out beyond 1D.
    """
    return tuple(name for name, measure in SECTIONS[section].items() if dim in measure.dims or measure.dims != _LINE)


def main_measures(names: Sequence[str]) -> list[str]:
    """Return those of `names` that matter most, as many as a table of several runs has columns for."""
    return [*(name for name in MAIN if name in names), *(name for name in names if name not in MAIN)][:MOST_COLUMNS]


def format_of(name: str, unit: str = "", unitless: bool = False) -> NumberFormat:
    """Return the format of a number in tables.

    Parameters
    ----------
    name
        A measure, a drift, or any other number.
    unit
        SI unit of a number that is in no catalogue: it is shown in that.
    unitless
        Whether the case has no units: all but shares are shown as they are.
    """
    measure, _, variant = name.partition(".")
    known = next((section[measure] for section in SECTIONS.values() if measure in section), None)
    if known is not None:
        display = known.display
        if variant:
            display = replace(display, label=f"  {variant.replace('_', ' ')}")
    else:
        words = name.replace("_", " ")
        display = DRIFTS.get(name) or NumberFormat(words, words, unit, -1)
    if unitless and display.unit != "%":
        return NumberFormat(display.label, display.short, "", -1)
    if display.unit in ("g", "N s", "J") and "/m" in unit:  # per metre in 2D
        return NumberFormat(
            display.label, display.short, f"{display.unit}/m{unit.partition('/m')[2]}", display.decimals
        )
    return display
