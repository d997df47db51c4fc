"""Mass fractions that have failed, melted, or left the range of validity of their models."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hvisph.compiler.jit import python_twin
from hvisph.materials.material_table import Material
from hvisph.materials.melting import melt_temperature
from hvisph.materials.slots import MELT_TEMPERATURE
from hvisph.materials.validity_limits import outside_range
from hvisph.output.snapshot import Snapshot

BELOW_ZERO = 1e-9  # share of the mean energy of the start below which a negative energy is round-off


def shares(now: Snapshot, start: Snapshot, materials: Sequence[Material]) -> dict[str, float | None]:
    """Return shares of the mass [-] by name; None for what no material tells.

    Parameters
    ----------
    now, start
        The state, and that at the start.
    materials
        Of every body, in their order.
    """
    mass = now.fields["mass"]
    whole = float(mass.sum())
    if not whole > 0.0:
        return {}
    parts: dict[str, float | None] = {}
    damage = now.fields.get("damage")
    if damage is not None:
        breaks = np.isin(now.body, [k for k, one in enumerate(materials) if one.damage.tag != 0])
        parts["failed"] = float(mass[breaks & (damage >= 1.0)].sum()) / whole if breaks.any() else None
    parts["above_melting"] = _melted_mass(now, materials, mass)
    energy = now.fields.get("internal_energy")
    if energy is not None:
        density, temperature, beyond = now.fields["density"], now.fields.get("temperature"), 0.0
        for body, material in enumerate(materials):
            own = now.body == body
            hot = None if temperature is None else temperature[own]
            borne = [None if one is None else one[own] for one in (now.fields.get("pressure"), damage)]
            beyond += float(mass[own][outside_range(material, density[own], energy[own], hot, *borne)].sum())
        parts["beyond_range"] = beyond / whole
        floor = min(0.0, float(start.fields["internal_energy"].min())) - BELOW_ZERO * _mean_energy(start)
        parts["negative_energy"] = float(mass[energy < floor].sum()) / whole
    return parts


def _mean_energy(start: Snapshot) -> float:
    """Return the energy at the start over the mass [J/kg]."""
    mass = start.fields["mass"]
    squared = (start.fields["velocity"].reshape(start.count, -1) ** 2).sum(axis=1)
    return float((mass * (0.5 * squared + np.abs(start.fields["internal_energy"]))).sum() / mass.sum())


def _melted_mass(now: Snapshot, materials: Sequence[Material], mass: np.ndarray) -> float | None:
    temperature = now.fields.get("temperature")
    if temperature is None:
        return None
    melted, known = 0.0, False
    point = python_twin(melt_temperature)
    for body, material in enumerate(materials):
        row = material.row()
        if not np.isfinite(row[MELT_TEMPERATURE]):
            continue
        known = True
        # most of a target is cold: Lindemann's and Simon's points are not below half of that without pressure
        hot = np.flatnonzero((now.body == body) & (temperature > 0.5 * row[MELT_TEMPERATURE]))
        states = zip(now.fields["density"][hot], now.fields["pressure"][hot], strict=True)
        limits = np.array([point(rho, p, row) for rho, p in states])
        melted += float(mass[hot][temperature[hot] >= limits].sum()) if len(hot) else 0.0
    return melted / float(mass.sum()) if known else None
