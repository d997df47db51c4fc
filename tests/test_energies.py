"""Energies by kind: plastic work and heat of shocks, against the structure of a steady shock."""

import json

import numpy as np
import pytest
from small_runs import METAL, final

from hvisph.casefile.loader import load_case
from hvisph.exact.plate_impact import impact
from hvisph.output.reader import read_history
from hvisph.setup.materials import material_of
from hvisph.simulation.run import run

CASE = """
title: plates
kinematics: uniaxial_strain
resolution: 0.02 mm
bodies:
  projectile: {material: aluminium-howell-ball, shape: {type: interval, length: 5 mm}, velocity: [3.1 km/s]}
  target: {material: aluminium-howell-ball, shape: {type: interval, length: 5 mm}}
formulation: {type: eulerian, viscosity: {type: monaghan, alpha: 1, beta: 2}}
time: {end: 0.5 us}
output: {every: 0.5 us, formats: [hdf5]}
"""


def heat_of_a_front(front, points=400):
    """Return what a steady front dissipates per mass beside its plastic work, and that work [J/kg].

    Within it stress follows the Rayleigh line; what the material's own pressure and deviator do not bear is
    viscous, and its work is the heat.
    """
    a, b = front.ahead, front.behind
    v = np.linspace(a.volume, b.volume, points + 1)
    stress = a.stress + (b.stress - a.stress) * (a.volume - v) / (a.volume - b.volume)
    energy = a.energy + np.concatenate([[0.0], np.cumsum(0.5 * (stress[1:] + stress[:-1]) * -np.diff(v))])
    pressure = a.law.material.pressure_function()
    p = np.array([pressure(1.0 / volume, e) for volume, e in zip(v, energy, strict=True)])
    deviator = np.array([a.law._deviator(a, volume) for volume in v])
    viscous = stress - p + deviator
    flow = 1.5 * a.law.limit  # Y
    yielded = a.volume * np.exp(-flow / (2.0 * a.law.shear))  # from here on the strain is plastic, 2/3 d ln v
    return float((0.5 * (viscous[1:] + viscous[:-1]) * -np.diff(v)).sum()), flow * 2.0 / 3.0 * (yielded - b.volume)


def test_heat_of_a_shock_and_plastic_work_behind_it(tmp_path):
    path = tmp_path / "plates.yaml"
    path.write_text(CASE)
    case = load_case(path)
    outcome = run(case, tmp_path / "run")
    material = material_of(case.bodies["target"].material, 0.0)
    (front,) = impact(material, material, 3100.0).target_fronts
    heat, plastic = heat_of_a_front(front)
    history = read_history(outcome.folder)
    late = history["time"] > 0.25e-6  # the front has its shape by then
    time = history["time"][late]
    flux = 2.0 * front.ahead.density * front.velocity  # both plates [kg/(m^2 s)]
    found = {name: np.polyfit(time, history[name][late], 1)[0] / flux for name in ("shock_heating", "plastic_work")}
    # 7 % too much where the front has run 1.5 mm: it is still growing to its own width, steeper than it will be
    assert found["shock_heating"] == pytest.approx(heat, rel=0.1)  # that growth
    assert found["plastic_work"] == pytest.approx(plastic, rel=0.05)  # the same growth of the front
    energies = json.loads((outcome.folder / "summary.json").read_text())["energies"]
    assert energies["kinetic"] + energies["internal"] == pytest.approx(energies["initial"], rel=1e-12)
    assert energies["shock_heating"] == pytest.approx(history["shock_heating"][-1])
    assert 0.0 < energies["plastic_work"] < energies["shock_heating"] < energies["internal"]


def test_a_struck_plate_of_three_layers_comes_to_rest(tmp_path):
    """With a Courant number of 0.38 and more its thickness vibrates until the run stops, after 75 us at 0.42."""
    bodies = {"ball": {"material": METAL, "shape": {"type": "disc", "diameter": 5e-3}, "velocity": [40.0, 0.0]},
              "plate": {"material": METAL, "shape": {"type": "box", "size": [2.5e-3, 16e-3]}}}  # fmt: skip
    document = {"kinematics": "plane_strain", "resolution": 0.83e-3, "bodies": bodies, "time": {"end": 1e-4},
                "output": {"every": 5e-5, "formats": ["hdf5"]}}  # fmt: skip
    folder = run(load_case(document), tmp_path / "run").folder
    last = final(folder)
    mass, velocity, energy = (last.fields[name][last.body == 1] for name in ("mass", "velocity", "internal_energy"))
    motion = velocity - mass @ velocity / mass.sum()
    kinetic = 0.5 * float(mass @ (motion**2).sum(axis=1))
    assert kinetic < 0.01 * float(mass @ energy)  # 0.001; vibrating plates have 1 and more
    assert -float(mass @ np.minimum(energy, 0.0)) < 0.01 * float(mass @ energy)
