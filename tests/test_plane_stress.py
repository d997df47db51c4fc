"""Plane stress: no stress through the thickness, whatever the material does in the plane."""

import numpy as np
import pytest

from hvisph.casefile.loader import load_case
from hvisph.materials.eos import Elastic, StiffenedGas
from hvisph.materials.material_table import Material, pack
from hvisph.materials.plane_stress import thinning
from hvisph.materials.strength import ElasticStrength, VonMises
from hvisph.materials.stress_update import respond
from hvisph.simulation.run import run

E, NU = 70e9, 0.3
ELASTIC = Material("elastic", 2700.0, Elastic(E, NU), ElasticStrength(E / (2 * (1 + NU))))
PLASTIC = Material("plastic", 2785.0, StiffenedGas(5328.0, 2.0), VonMises(27.6e9, 0.3e9))


def stretched(material, rate, steps, dt, transverse=0.0):
    """Stretch a sheet along x, and along y at `transverse`; return stress, density, plastic strain, thickness."""
    table, models = pack([material])
    m = np.uint64(0)
    rho, thickness, plastic = material.density, 1.0, 0.0
    s, p = (0.0,) * 6, 0.0
    for _ in range(steps):
        swelling = rate + transverse
        gradient = (rate, 0.0, 0.0, 0.0, transverse, 0.0, 0.0, 0.0)
        zz = thinning(table, models, m, dt, rho, swelling, 0.0, s, plastic, 0.0, (*gradient, 0.0))
        half = 0.5 * dt * (swelling + zz)
        rho *= (1 - half) / (1 + half)
        thickness *= (1 + 0.5 * dt * zz) / (1 - 0.5 * dt * zz)
        s, plastic, _, p, _ = respond(table, models, m, dt, rho, 0.0, s, plastic, 0.0, (*gradient, zz))
    return np.array(s) - p * np.array([1, 1, 1, 0, 0, 0]), rho, plastic, thickness


def test_elastic_sheet_follows_hooke():
    strain = 1e-5
    stress, _, _, thickness = stretched(ELASTIC, strain / 1e-6, 10, 1e-7)
    # small strains: finite ones add terms of the strain itself
    assert stress[0] == pytest.approx(E / (1 - NU**2) * strain, rel=1e-4)
    assert stress[1] == pytest.approx(NU * E / (1 - NU**2) * strain, rel=1e-4)
    assert abs(stress[2]) < 1e-7 * stress[0]
    assert thickness - 1 == pytest.approx(-NU / (1 - NU) * strain, rel=1e-4)


@pytest.mark.parametrize("transverse", [-0.5, 0.0, 1.0])
def test_plastic_sheet_has_no_stress_through_it(transverse):
    rate = 1e5
    stress, _, plastic, _ = stretched(PLASTIC, rate, 200, 5e-9, transverse * rate)
    # the secant stops at 1e-10 of the modulus, 12 Pa
    assert abs(stress[2]) < 100.0
    assert plastic > 0.01
    xx, yy, xy = stress[0], stress[1], stress[3]
    assert np.sqrt(xx**2 + yy**2 - xx * yy + 3 * xy**2) == pytest.approx(0.3e9, rel=1e-6)


def test_impact_in_plane_stress_keeps_its_budgets(tmp_path):
    settings = ["kinematics=plane_stress", "time.end=1us", "expected=null", "output.every=null"]
    case = load_case("al_al", overrides=settings, resolution="0.5 mm")
    outcome = run(case, tmp_path / "run", threads=1)
    # every pair balances: round-off of some 300 steps
    assert abs(outcome.summary["conservation"]["energy_drift"]) < 1e-12
    assert outcome.summary["conservation"]["momentum_drift"] < 1e-12
    # a sheet that can thicken carries in-plane stresses of the yield stress, not the pressure of a plane shock
    assert outcome.summary["measures"]["centre_pressure_peak"]["value"] < 0.5e9
