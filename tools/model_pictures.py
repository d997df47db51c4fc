"""Pictures of the pages on models: what a model does, in two panels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hvisph.compiler.jit import python_twin
from hvisph.materials.melting import melt_temperature
from hvisph.materials.slots import values
from hvisph.postprocessing.material_sheet import flow_stress_curves, hugoniot
from hvisph.setup.material_point import drive, flow_at, has_temperature
from hvisph.setup.materials import material_of
from hvisph.visualization.curves import Panel, panels_picture

RATES = (1.0, 1e3, 1e5)


def draw(model: Any, family: str, path: Path) -> None:
    """Draw the picture of one page."""
    panels = {"eos": _state, "strength": _strength, "damage": _damage, "porosity": _pores, "melting": _melting,
              "temperature": _temperature}[family](model)  # fmt: skip
    panels_picture(panels, path)


def _state(model: Any) -> list[Panel]:
    material = material_of(model, 0.2e6)
    shocks = Panel("particle velocity [km/s]", "shock speed [km/s]")
    rows = (
        np.array(hugoniot(model, np.linspace(50.0, 3000.0, 40).tolist()), dtype=float)
        if model.eos.type != "ideal_gas"
        else []
    )
    if len(rows):
        shocks.curves.append(("Hugoniot", rows[:, 0] * 1e-3, rows[:, 1] * 1e-3))
    pressures = Panel("density over density at rest", "pressure [GPa]")
    rho0, pressure = material.density, material.pressure_function()
    ambient = material.eos.ambient_energy
    for label, energy in (("", 0.0), (" + 1 MJ/kg", 1e6), (" + 5 MJ/kg", 5e6)):
        eta = np.linspace(0.6, 1.3, 141)
        p = np.array([pressure(rho0 * x, ambient + energy) for x in eta])
        pressures.curves.append((f"energy at rest{label}", eta, p * 1e-9))
    return [shocks, pressures]


def _strength(model: Any) -> list[Panel]:
    material = material_of(model)
    if material.has_axes:
        return _directions(material)
    strains = Panel("strain, uniaxial stress, adiabatic", "von Mises stress [MPa]")
    for rate in RATES:
        record = drive(material, "uniaxial_stress", rate, -0.2, 80)
        strains.curves.append((f"{rate:g} 1/s", -record.strain, record["von_mises_stress"] * 1e-6))
    if model.strength.type == "elastic":
        return [strains]
    if curves := flow_stress_curves(material):
        return [strains, Panel("pressure [GPa]", "yield stress [MPa]", curves)]
    if has_temperature(material):
        warm = Panel("temperature [K]", "yield stress at a strain of 0.05 [MPa]")
        t = np.linspace(250.0, 1400.0, 60)
        for rate in RATES:
            warm.curves.append(
                (f"{rate:g} 1/s", t, np.array([flow_at(material, float(kelvin), 0.05, rate) for kelvin in t]) * 1e-6)
            )
        return [strains, warm]
    return [strains]


def _directions(material: Any) -> list[Panel]:
    """Return stresses along the axes, each pulled at strains across of zero."""
    pulled = Panel("strain along the axis, none across it", "stress along the axis [MPa]")
    for axis in range(3):
        record = drive(material, "uniaxial_strain", 1e4, 0.03, 200, axis=axis)
        pulled.curves.append((f"axis {axis + 1}", record.strain, record["xx"] * 1e-6))
    return [pulled]


def _damage(model: Any) -> list[Panel]:
    material = material_of(model)
    if material.has_axes:
        return _directions(material)
    by_flow = model.damage.type in ("johnson_cook", "cockcroft_latham")
    crushed = model.damage.type == "johnson_holmquist"
    path, largest, rates = ("uniaxial_stress", 1.0, (1.0, 1e4)) if by_flow else ("uniaxial_strain", 0.05, (1e4, 1e5))
    if crushed:
        path, largest, rates = "uniaxial_strain", -0.15, (1e4, 1e5)
    if model.damage.type == "grady_kipp":
        largest, rates = 0.006, (1e2, 1e4)
    stress = Panel("strain" + (", compression" if crushed else ", tension"), "axial stress [MPa]")
    harm = Panel(stress.across, "damage")
    for rate in rates:
        record = drive(material, path, rate, largest, 400)
        stress.curves.append((f"{path.replace('_', ' ')}, {rate:g} 1/s", abs(record.strain), record["xx"] * 1e-6))
        harm.curves.append((f"{rate:g} 1/s", abs(record.strain), record["damage"]))
    return [stress, harm]


def _pores(model: Any) -> list[Panel]:
    material = material_of(model)
    porous, solid = (
        drive(material, "uniaxial_strain", 1e4, -0.45, 300),
        material_of(model.model_copy(update={"porosity": None})),
    )
    dense = drive(solid, "uniaxial_strain", 1e4, -0.2, 300)
    crush = Panel("density [kg/m^3]", "pressure [GPa]")
    crush.curves += [("porous, crushed", porous["density"], porous["pressure"] * 1e-9),
                     ("solid", dense["density"], dense["pressure"] * 1e-9)]  # fmt: skip
    heat = Panel("pressure [GPa]", "temperature [K]")
    heat.curves += [("porous, crushed", porous["pressure"] * 1e-9, porous["temperature"]),
                    ("solid", dense["pressure"] * 1e-9, dense["temperature"])]  # fmt: skip
    return [crush, heat]


def _melting(model: Any) -> list[Panel]:
    from hvisph.case.materials.material import SimonMelting

    heat = Panel("pressure behind a shock [GPa]", "temperature [K]")
    laws = {"melting, Lindemann": model, "melting, Simon, a 12 GPa, c 1.8": model.model_copy(
        update={"melting": SimonMelting(temperature=model.melting.temperature, a=12e9, c=1.8)})}  # fmt: skip
    rows = np.array(hugoniot(model, np.linspace(50.0, 3500.0, 60).tolist()))
    heat.curves.append(("behind shocks", rows[:, 2] * 1e-9, rows[:, 4]))
    for label, law in laws.items():
        row = values(material_of(law).whole_row)
        melts = [python_twin(melt_temperature)(rho, p, row) for p, rho in rows[:, 2:4]]
        heat.curves.append((label, rows[:, 2] * 1e-9, np.array(melts)))
    return [heat]


def _temperature(model: Any) -> list[Panel]:
    from hvisph.case.materials.material import TotalEnergyTemperature

    panel = Panel("particle velocity [km/s]", "temperature behind a shock [K]")
    heat = model.temperature
    total = TotalEnergyTemperature(heat_capacity=heat.heat_capacity, room_temperature=heat.room_temperature)
    for label, case_model in (("isentrope", model), ("total_energy", model.model_copy(update={"temperature": total}))):
        rows = np.array(hugoniot(case_model, np.linspace(50.0, 3000.0, 50).tolist()))
        panel.curves.append((label, rows[:, 0] * 1e-3, rows[:, 4]))
    return [panel]
