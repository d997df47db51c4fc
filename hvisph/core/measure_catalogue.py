"""Catalogue of measures: name, unit, dimensions, meaning and format in tables.

A new measure is a row of `measures.csv` and a function in `hvisph.measures` that is registered under its name by
`hvisph.measures.result.measures`: the case file, its schema and manual, summaries and tables follow.
"""

import csv
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

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

    def scale_to(self, size: float, limit: float = _SMALL) -> "NumberFormat":
        """Return the format in the unit that suits a number of `size` [SI]; this one from `limit` of its unit on."""
        unit, slash, depth = self.unit.partition("/m")
        ladder, low, high = _SIZED.get(unit, ({}, math.inf, math.inf))
        if not low <= abs(size) < math.inf or limit <= abs(size) * self.factor < high:
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
    variants: dict[str, str]

    def unit_in(self, space: int) -> str:
        """Return the SI unit in `space` dimensions: extensive quantities are per depth in 2D and per area in 1D."""
        if self.unit == "m^3":
            return {2: "m^2", 3: "m^3"}.get(space, "m")
        return self.unit + PER_DEPTH[space] if self.unit in ("kg", "N s", "J") else self.unit


PER_DEPTH = {1: "/m^2", 2: "/m", 3: ""}


def _read_catalogue() -> dict[str, dict[str, Measure]]:
    """Return the rows of `measures.csv` by section and name, variants within their measure."""
    sections: dict[str, dict[str, Measure]] = {}
    with Path(__file__).with_name("measures.csv").open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            section, name, unit = row["section"], row["name"], row["unit"]
            if row["variant"]:
                sections[section][name].variants[row["variant"]] = row["meaning"]
                continue
            short = row["short"] or name.replace("_", " ")
            display = NumberFormat(row["label"], short, row["table_unit"], int(row["decimals"]))
            dims, meaning = tuple(map(int, row["dimensions"].split())), f"{row['meaning']} [{unit or '-'}]"
            sections.setdefault(section, {})[name] = Measure(section, name, unit, dims, meaning, display, {})
    return sections


SECTIONS = _read_catalogue()
CATALOGUE = SECTIONS["run"]
# The main measures, and the number of measures in a table of several runs.
_OF_TARGET = ("perforated", "crater_diameter", "penetration", "residual_velocity")
MAIN = (*_OF_TARGET, "final_length", "foot_diameter", "centre_pressure_peak")
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
    """Return an axis' unit and its number in the SI one: `unit`, unless finite `values` are very small or large."""
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
    """Return the names of a section's results in `dim` dimensions; those of plate impacts in 1D only."""
    return tuple(name for name, measure in SECTIONS[section].items() if dim in measure.dims or measure.dims != (1,))


def main_measures(names: Sequence[str]) -> list[str]:
    """Return those of `names` that matter most, as many as a table of several runs has columns for."""
    return [*(name for name in MAIN if name in names), *(name for name in names if name not in MAIN)][:MOST_COLUMNS]


def format_of(name: str, unit: str = "", unitless: bool = False) -> NumberFormat:
    """Return the format of a number whose SI `unit` is kept in tables; `unitless`, all but shares have none."""
    measure, _, variant = name.partition(".")
    row = next((section[measure] for section in SECTIONS.values() if measure in section), None)
    if row is not None:
        display = row.display
        if variant:
            display = replace(display, label=f"  {variant.replace('_', ' ')}")
    else:
        words = name.replace("_", " ")
        display = DRIFTS.get(name) or NumberFormat(words, words, unit, -1)
    if unitless and display.unit != "%":
        return NumberFormat(display.label, display.short, "", -1)
    if display.unit in ("g", "N s", "J") and "/m" in unit:  # per metre in 2D
        return replace(display, unit=f"{display.unit}/m{unit.partition('/m')[2]}")
    return replace(display, unit=unit) if display.unit == "m^3" and unit else display  # an area in plane 2D
