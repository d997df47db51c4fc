"""Measures as rows of text for people: centimetres or millimetres, gigapascals, per cent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hvisph.measures.result import Result

# name: (label, unit for people, factor from SI, decimals)
SHOWN: dict[str, tuple[str, str, float, int]] = {
    "crater_diameter": ("crater diameter", "cm", 1e2, 2),
    "crater_diameter_minimum": ("crater diameter, narrowest", "cm", 1e2, 2),
    "crater_lip_to_lip": ("crater, lip to lip", "cm", 1e2, 2),
    "extension": ("extension of the projectile", "cm", 1e2, 2),
    "penetration": ("penetration", "cm", 1e2, 2),
    "void_fraction": ("voids in the projectile", "%", 1e2, 1),
    "centre_pressure_peak": ("peak centre pressure", "GPa", 1e-9, 2),
    "centre_tension_peak": ("peak tension on the axis", "GPa", 1e-9, 2),
    "residual_velocity": ("residual velocity", "m/s", 1.0, 1),
    "momentum_transfer": ("momentum transfer beta", "", 1.0, 3),
    "plug_velocity": ("plug velocity", "m/s", 1.0, 1),
    "plug_width": ("plug width", "mm", 1e3, 2),
    "plug_thickness": ("plug thickness", "mm", 1e3, 2),
    "impact_diameter": ("impact diameter", "mm", 1e3, 2),
    "lip_height": ("lip height", "mm", 1e3, 2),
    "lip_height_maximum": ("lip height, largest", "mm", 1e3, 2),
    "target_fragments": ("fragments off the target", "", 1.0, 0),
    "plateau_stress": ("plateau stress", "GPa", 1e-9, 3),
    "interface_velocity": ("interface velocity", "m/s", 1.0, 1),
    "energy_drift": ("energy drift", "%", 1e2, 5),
    "momentum_drift": ("momentum drift", "", 1.0, -1),
}


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Parameters
    ----------
    name, label
        The measure's name in files, and in words.
    value, expected
        Texts with uncertainty or tolerance and unit; `value` is a dash where there is none,
        `expected` is empty where nothing is expected.
    passed
        None where nothing is expected.
    note
        When a peak was reached, where the expected value comes from, or why there is no value.
    """

    name: str
    label: str
    value: str
    expected: str = ""
    passed: bool | None = None
    note: str = ""


def label(name: str) -> str:
    """Return a measure's name in words."""
    return SHOWN[name][0] if name in SHOWN else name.replace("_", " ")


def rows(
    results: Mapping[str, Result | float | None],
    expected: Sequence[Mapping[str, Any]] = (),
    unitless: bool = False,
) -> list[Row]:
    """Return the table's rows in the order of `results`.

    Parameters
    ----------
    results
        Results by name, plain numbers among them.
    expected
        What `hvisph.measures.expected.compare` returned.
    unitless
        True for cases without units: numbers are shown as they are.
    """
    by_name = {entry["name"]: entry for entry in expected}
    table = []
    for name, found in results.items():
        result = found if isinstance(found, Result) else Result(found, "")
        _, unit, factor, decimals = SHOWN.get(name, ("", result.unit, 1.0, -1))
        if unitless and unit != "%":
            unit, factor, decimals = "", 1.0, -1
        entry = by_name.get(name)
        notes = [result.reason] if result.value is None else []
        if result.time is not None:
            notes.append(f"at t = {result.time:.4g}" if unitless else f"at {result.time * 1e6:.2f} us")
        target = ""
        if entry is not None:
            target = _text(entry["expected"], entry["tolerance"], unit, factor, decimals)
            notes.append(entry["source"])
        table.append(
            Row(
                name=name,
                label=label(name),
                value=_text(result.value, result.uncertainty, unit, factor, decimals),
                expected=target,
                passed=entry["passed"] if entry is not None else None,
                note="; ".join(note for note in notes if note),
            )
        )
    return table


def _text(value: float | None, spread: float | None, unit: str, factor: float, decimals: int) -> str:
    if value is None:
        return "-"

    def number(figure: float) -> str:
        text = f"{figure * factor:.{decimals}f}" if decimals >= 0 else f"{figure * factor:.3g}"
        return text if float(text) else text.lstrip("-")  # what rounds to nothing has no sign

    # a spread that rounds to nothing says nothing
    shown = f" ± {number(spread)}" if spread and float(number(spread)) > 0.0 else ""
    return f"{number(value)}{shown} {unit}".rstrip()
