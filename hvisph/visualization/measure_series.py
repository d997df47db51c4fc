"""Measures and fragments over time as a picture: a panel each kind of quantity."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.core.measure_catalogue import format_of
from hvisph.measures.debris.fragments import FEWEST
from hvisph.measures.measure import Measures
from hvisph.measures.series import columns, moments

from .curves import Curve, curves_picture

# Panels of the picture in their order, and their SI units.
KINDS = {"length": "m", "length, plug and lip": "m", "velocity": "m/s", "pressure": "Pa", "temperature": "K",
         "ratio": "", "number": ""}  # fmt: skip
PLUG_AND_LIP = ("plug_width", "plug_thickness", "impact_diameter", "lip_height", "lip_height_max")


def series_picture(measured: Measures, path: str | os.PathLike[str]) -> Path:
    """Draw the measures over time and store the picture: a panel each kind of quantity.

    Of the fragments it shows how many there are, the largest one's share of the mass, and its axial velocity.

    Raises
    ------
    CaseError
        Where there is one moment only.
    """
    shown = moments(measured)
    if len(shown) < 2:
        raise CaseError("one moment makes no history; give the folder of a run with two snapshots or more")
    time = np.array([moment.time for moment in shown])
    panels: dict[str, list[Curve]] = {kind: [] for kind in KINDS}
    for name, column in columns(measured).items():
        if np.isfinite(column.values).any() and _is_drawn(name):
            panels[_kind(name, column.unit)].append(Curve(_legend(name), time, column.values, marked=True))
    panels = {kind: curves for kind, curves in panels.items() if curves}
    return curves_picture(panels, path, title=measured.title, unitless=measured.unitless, units=KINDS, legends="beside")


def _is_drawn(name: str) -> bool:
    """Whether a column is drawn: not what another column shows, or what few look for."""
    if not name.startswith("fragments."):
        return "." not in name  # variants are in the CSV file
    return name.rpartition(".")[2] in ("number", "largest_mass_share", "largest_velocity_x")


def _kind(name: str, unit: str) -> str:
    """Return the panel that a column belongs to."""
    if name == "target_fragments" or name.endswith(".number"):
        return "number"
    if unit == "m" and name in PLUG_AND_LIP:
        return "length, plug and lip"
    return next(kind for kind, own in KINDS.items() if own == unit)


def _legend(name: str) -> str:
    if not name.startswith("fragments."):
        return format_of(name).label
    body, _, what = name.removeprefix("fragments.").rpartition(".")
    words = {
        "number": f"fragments of {FEWEST} particles or more",
        "largest_mass_share": "mass share of the largest",
        "largest_velocity_x": "largest, axial velocity",
    }
    return f"{body}: {words[what]}"
