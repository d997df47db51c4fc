"""Derived properties of a material: wave speeds, impedance, elastic limit, Hugoniot and curves."""

import os
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from hvisph.case.materials.material import Material as MaterialModel
from hvisph.casefile.material_library import Notes
from hvisph.compiler.jit import python_twin
from hvisph.core.errors import HvisphError
from hvisph.exact.hugoniot import last_waves, shock
from hvisph.materials.eos import JonesWilkinsLee
from hvisph.materials.material_table import Material, pack
from hvisph.materials.strength import Orthotropic
from hvisph.materials.thermodynamics import flow_stress
from hvisph.materials.validity_limits import range_of
from hvisph.setup.material_point import PointRecord, drive, flow_at, has_temperature
from hvisph.setup.materials import material_of
from hvisph.visualization.curves import Panel, panels_picture

SHOCKS = (250.0, 500.0, 1000.0, 2000.0, 3000.0, 4000.0)  # particle velocities [m/s]
RATES = (1.0, 1e3, 1e6)  # [1/s]
IN_BIN, LEAST_IN_BIN = 5, 4  # measured points


def derive_properties(model: MaterialModel) -> dict[str, tuple[float, str]]:
    """Return derived properties of a case's material: name to value and SI unit."""
    material = material_of(model)
    rho, c, g = material.density, material.bulk_sound_speed, material.shear_modulus
    bulk, c_l = rho * c * c, material.longitudinal_sound_speed
    numbers = {
        "bulk modulus": (bulk, "Pa"),
        "bulk sound speed": (c, "m/s"),
        "longitudinal sound speed": (c_l, "m/s"),
        "shock impedance rho c": (rho * c, "kg/(m^2 s)"),
    }
    if isinstance(material.eos, JonesWilkinsLee):
        speed, pressure = material.eos.chapman_jouguet()
        numbers |= {"detonation speed": (speed, "m/s"), "detonation pressure": (pressure, "Pa")}
    if isinstance(material.strength, Orthotropic):
        solid = material.strength
        for k, direction in enumerate(np.eye(3)):
            waves = np.sqrt(np.linalg.eigvalsh(solid.christoffel(direction)) / rho)
            numbers[f"longitudinal sound speed along {k + 1}"] = (float(waves[2]), "m/s")
        numbers |= {
            "bulk modulus of Reuss": (solid.reuss, "Pa"),
            "bulk modulus of Voigt": (solid.voigt, "Pa"),
            "bulk modulus of a state, above which it is stable": (solid.stable_limit, "Pa"),
        }
    elif g > 0.0 and not material.has_axes:
        numbers["shear sound speed"] = (float(np.sqrt(g / rho)), "m/s")
        numbers["Young's modulus"] = (material.young_modulus, "Pa")
        numbers["Poisson's ratio"] = ((3.0 * bulk - 2.0 * g) / (2.0 * (3.0 * bulk + g)), "")
    y = next((getattr(model.strength, key) for key in ("yield_stress", "a") if hasattr(model.strength, key)), 0.0)
    if model.strength.type == "johnson_holmquist":
        numbers["Hugoniot elastic limit"] = (model.strength.hugoniot_elastic_limit, "Pa")
    elif y and g > 0.0:
        numbers["Hugoniot elastic limit"] = (y * (bulk / (2.0 * g) + 2.0 / 3.0), "Pa")
    limits = range_of(material)
    if limits.least_density > 0.0:
        numbers["lowest valid density"] = (limits.least_density, "kg/m^3")
    if np.isfinite(limits.greatest_density):
        numbers["highest valid density"] = (limits.greatest_density, "kg/m^3")
    if np.isfinite(limits.tension):
        numbers["highest valid tension"] = (limits.tension, "Pa")
    return numbers


def hugoniot(
    model: MaterialModel, velocities: Sequence[float] = SHOCKS
) -> list[tuple[float, float, float, float, float]]:
    """Return velocity, shock speed, pressure, density, temperature behind shocks; none of detonation products."""
    material = material_of(model)
    if isinstance(material.eos, JonesWilkinsLee):
        return []
    has_heat = has_temperature(material)
    rows = []
    for u in velocities:
        try:
            state = shock(material, u)
        except HvisphError:
            break
        t = material.temperature(state.density, state.energy) if has_heat else float("nan")
        rows.append((u, state.shock_speed, state.pressure, state.density, t))
    return rows


def compare_hugoniot(
    model: MaterialModel, points: Sequence[tuple[float, float]], strength: bool = True
) -> list[tuple[float, float, float]]:
    """Return particle velocity, measured and model's shock speed [m/s] of points [up, Us], as far as the model goes.

    The model's is that of the last wave, behind an elastic precursor and a first wave of a change of phase; with
    `strength` off the pressure alone counts. Of porous material it is that of one shock without strength.
    """
    material = material_of(model)
    if material.porosity is not None:
        shocks = hugoniot(model, [u for u, _ in points])
        return [(u, us, row[1]) for (u, us), row in zip(points, shocks, strict=False)]
    speeds = last_waves(material, [u for u, _ in points], strength)
    return [(u, us, computed) for (u, us), computed in zip(points, speeds, strict=True) if np.isfinite(computed)]


def worst_bin(comparison: Sequence[tuple[float, float, float]]) -> tuple[float, float, float] | None:
    """Return the largest mean difference of a bin of measured points [%], its place [m/s], and the points' scatter.

    Bins hold some five points next to each other. The scatter is the standard deviation of single points
    about the mean of their bin [%]: what no curve can be nearer to. None for less than eight points.
    """
    if len(comparison) < 2 * LEAST_IN_BIN:
        return None
    ordered = np.array(sorted(comparison))
    errors = 100.0 * (ordered[:, 2] / ordered[:, 1] - 1.0)
    count = len(errors) // IN_BIN
    bins = np.array_split(errors, count)
    places = [part.mean() for part in np.array_split(ordered[:, 0], count)]
    worst = max(range(count), key=lambda k: abs(bins[k].mean()))
    scatter = float(np.sqrt(sum(((part - part.mean()) ** 2).sum() for part in bins) / (len(errors) - count)))
    return float(bins[worst].mean()), float(places[worst]), scatter


def picture(models: Sequence[MaterialModel], path: str | os.PathLike[str], notes: Notes | None = None) -> Path:
    """Draw Hugoniot, release, strength against strain, rate, temperature and pressure of materials, and store it.

    `notes`: what the library says of the first: measured points and published fits to them are drawn.
    """
    velocity_label = "particle velocity [km/s]"
    speeds, pressures = Panel(velocity_label, "shock speed [km/s]"), Panel(velocity_label, "pressure [GPa]")
    heats = Panel(velocity_label, "temperature behind a shock [K]")
    releases = Panel("density [kg/m^3]", "pressure [GPa] behind shocks and released")
    strains = Panel("strain, uniaxial stress, adiabatic", "von Mises stress [MPa]")
    warm = Panel("temperature at the start [K]", "yield stress at a strain of 0.05 [MPa]")
    squeezed = Panel("pressure [GPa]", "yield stress at a strain of 0.05 [MPa]")
    for model in models:
        material, label = material_of(model), model.name or "material"
        rows = np.array(hugoniot(model, np.linspace(100.0, SHOCKS[-1], 40).tolist()), dtype=float)
        if len(rows):
            u = rows[:, 0] * 1e-3
            speeds.curves.append((label, u, rows[:, 1] * 1e-3))
            pressures.curves.append((label, u, rows[:, 2] * 1e-9))
            if np.isfinite(rows[:, 4]).all():
                heats.curves.append((label, u, rows[:, 4]))
            releases.curves += _release_curves(label, model, rows)
        if material.strength.name not in ("none", "elastic"):
            for rate in RATES:
                record = drive(material, "uniaxial_stress", rate, 0.2, 60)
                strains.curves.append((f"{label}, {rate:g} 1/s", record.strain, record["von_mises_stress"] * 1e-6))
            if has_temperature(material):
                warm.curves += _thermal_softening_curves(label, material)
            squeezed.curves += [(f"{label}, {words}", p, y) for words, p, y in flow_stress_curves(material)]
    for line in notes.lines if notes else ():
        u, measured = np.array(line.points).T * 1e-3
        speeds.curves.append(("fit to measured points", u, measured))
    if notes and notes.hugoniot:
        speeds.points = np.array(notes.hugoniot) * 1e-3
    panels = [speeds, pressures, heats, releases, strains, warm, squeezed]
    return panels_picture(panels, path, title=", ".join(model.name for model in models))


def flow_stress_curves(material: Material) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Return flow stress [MPa] over pressure [GPa], intact and broken, of a strength that depends on pressure."""
    strength = material.strength.name
    if strength not in ("rock", "johnson_holmquist", "steinberg_guinan", "steinberg_lund"):
        return []
    (table, models), flow, p = pack([material]), python_twin(flow_stress), np.linspace(0.0, 10e9, 60)
    curves = []
    for words, damage in (
        (("intact", 0.0), ("broken", 1.0)) if strength in ("rock", "johnson_holmquist") else (("intact", 0.0),)
    ):
        y = [flow(table, models, 0, material.density, 0.0, pressure, 0.05, damage, 1e3)[0] for pressure in p]
        curves.append((words, p * 1e-9, np.array(y) * 1e-6))
    return curves


def _release_curves(label: str, model: MaterialModel, rows: np.ndarray) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Return the Hugoniot and three release isentropes, pressure [GPa] over density."""
    pressure = material_of(model).pressure_function()
    curves = [(f"{label}, Hugoniot", rows[:, 3], rows[:, 2] * 1e-9)]
    for u, _, _, rho, _ in rows[9::15]:
        e, densities = 0.5 * u * u, np.linspace(rho, 0.5 * model.density, 400)
        curve = []
        for r, after in pairwise(densities):
            p = pressure(r, e)
            if p < 0.0:
                break
            curve.append((r, p * 1e-9))
            half = e + 0.5 * (after - r) * p / r**2
            middle = 0.5 * (r + after)
            e += (after - r) * pressure(middle, half) / middle**2
        points = np.array(curve)
        curves.append((f"{label}, released from {u:.0f} m/s", points[:, 0], points[:, 1]))
    return curves


def _thermal_softening_curves(label: str, material: Any) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Return the flow stress [MPa] over the temperature at two rates."""
    curves = []
    temperatures = np.linspace(200.0, 1600.0, 29)
    for rate in (1.0, 1e4):
        stress = np.array([flow_at(material, float(t), 0.05, rate) for t in temperatures])
        curves.append((f"{label}, {rate:g} 1/s", temperatures, stress * 1e-6))
    return curves


def point_picture(record: PointRecord, path: str | os.PathLike[str], title: str) -> Path:
    """Draw the history of a material point and store it."""
    strain = record.strain
    stresses = Panel("strain", "stress [MPa]")
    for name in ("xx", "yy", "xy", "von_mises_stress"):
        stresses.curves.append((name.replace("_", " "), strain, record[name] * 1e-6))
    pressure = Panel("strain", "pressure [MPa]", [("pressure", strain, record["pressure"] * 1e-6)])
    shares = [(name.replace("_", " "), strain, record[name]) for name in ("plastic_strain", "damage")]
    heat = Panel("strain", "temperature [K]", [("temperature", strain, record["temperature"])])
    return panels_picture([stresses, pressure, Panel("strain", "plastic strain, damage", shares), heat], path, title)
