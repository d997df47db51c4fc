"""Weak matter: crush curves by points, matter without tension, cohesion of a few pascals."""

import numpy as np
import pytest
from small_runs import METAL, row_of

from hvisph.case.materials.material import Material as MaterialModel
from hvisph.compiler.jit import python_twin
from hvisph.exact.hugoniot import shock
from hvisph.materials import porosity, slots, stress_update
from hvisph.materials.eos import Linear, Tillotson
from hvisph.materials.material_table import Material, pack
from hvisph.materials.porosity import Porosity
from hvisph.materials.strength import Rock
from hvisph.precheck.advice import advice
from hvisph.setup.materials import material_of

POINTS = ((1e6, 1.6), (1e8, 1.1), (4e8, 1.0))
PORES = Porosity(1.6, 1e6, 4e8, POINTS)
BASALT = Tillotson(26.7e9, 26.7e9, 0.5, 1.5, 487e6, 5.0, 5.0, 4.72e6, 18.2e6)
ROCK = {"density": 2700.0, "eos": {"type": "linear", "bulk_modulus": 26.7e9},
        "strength": {"type": "rock", "shear_modulus": 10e9, "cohesion": 1.0, "friction": 0.6}}  # fmt: skip


def curve(p):
    return np.interp(p, [one for one, _ in POINTS], [alpha for _, alpha in POINTS])


@pytest.mark.parametrize("compiled", [False, True])
def test_a_crush_curve_of_points_is_followed(compiled):
    """At any density the distension is that of the curve at the pressure that it gives; 40 halvings leave 1e-12.

    Beyond the last point the solid is left, before the first one the pores.
    """
    material = Material("sand", 2700.0, BASALT, porosity=PORES)
    row = slots.values(material.whole_row)
    load = porosity.load_pores if compiled else python_twin(porosity.load_pores)
    for share in (0.6, 0.63, 0.7, 0.8, 0.9, 0.98, 1.02):
        p, _, alpha = load(BASALT.tag, 2700.0 * share, 0.0, 1.6, row)
        assert alpha == pytest.approx(curve(p), abs=1e-9)
    assert load(BASALT.tag, 2700.0 * 1.02, 0.0, 1.6, row)[2] == 1.0
    assert load(BASALT.tag, 1687.6, 0.0, 1.6, row)[2] == 1.6
    # pores do not reopen
    assert load(BASALT.tag, 2700.0 * 0.7, 0.0, 1.2, row)[2] == 1.2


def test_shocks_end_on_the_curve():
    material = Material("sand", 2700.0, BASALT, porosity=PORES)
    for u in (50.0, 200.0, 1000.0):
        behind = shock(material, u)
        alpha = curve(behind.pressure)
        p = material.pressure(alpha * behind.density, behind.energy) / alpha
        assert p == pytest.approx(behind.pressure, rel=1e-6)


@pytest.mark.parametrize(("crush", "words"), [
    ([["1 MPa", 1.6], ["100 MPa", 1.6], ["400 MPa", 1]], "does not fall"),
    ([["1 MPa", 1.6], ["1 MPa", 1.1], ["400 MPa", 1]], "does not fall"),
    ([["1 MPa", 1.5], ["400 MPa", 1]], "must begin at the distension, 1.6"),
    ([["1 MPa", 1.6], ["400 MPa", 1.1]], "must end at 1"),
])  # fmt: skip
def test_curves_that_are_none_are_refused(crush, words):
    with pytest.raises(ValueError, match=words):
        MaterialModel.model_validate(ROCK | {"porosity": {"distension": 1.6, "crush": crush}})


@pytest.mark.parametrize(("keys", "words"), [
    ({"elastic_pressure": "1 MPa"}, "solid_pressure: missing; or give the curve as points"),
    ({"elastic_pressure": "1 MPa", "solid_pressure": "1 MPa"}, "must be above the elastic_pressure"),
    ({"crush": [["1 MPa", 1.6], ["4 MPa", 1]], "solid_pressure": "4 MPa"}, "given beside `crush`"),
])  # fmt: skip
def test_one_curve_is_given(keys, words):
    with pytest.raises(ValueError, match=words):
        MaterialModel.model_validate(ROCK | {"porosity": {"distension": 1.6} | keys})


def test_points_of_a_case_are_those_of_the_material():
    crush = [["1 MPa", 1.6], ["100 MPa", 1.1], ["400 MPa", 1]]
    made = material_of(MaterialModel.model_validate(ROCK | {"porosity": {"distension": 1.6, "crush": crush}}))
    assert made.porosity == PORES


def strained(material, rho, shear=0.0):
    """Pressure and von Mises stress after a step of shear at a density; nothing is stressed before."""
    table, models = pack([material])
    update = python_twin(stress_update.update_stress)
    l = (0.0, shear, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    s, _, _, p, _, _ = update(table, models, 0, 1.0, rho, 0.0, (0.0,) * 6, 0.0, 0.0, stress_update.NO_HISTORY, l)
    return p, float(np.sqrt(1.5 * (sum(x * x for x in s[:3]) + 2.0 * sum(x * x for x in s[3:]))))


@pytest.mark.parametrize(("tension", "cohesion", "least"), [
    (0.0, 1e4, 0.0), (1e9, 6e3, -1e4), (2e3, 6e3, -2e3), (None, 6e3, None),
])  # fmt: skip
def test_tension_ends_at_the_apex_of_the_cone_or_before(tension, cohesion, least):
    """The apex is Y0/mu, 10 kPa for 6 kPa and 0.6. Recompressed, it is as it was."""
    strength = Rock(1e9, cohesion, 0.6) if tension is None else Rock(1e9, cohesion, 0.6, tension=tension)
    material = Material("soil", 2000.0, Linear(1e10), strength)
    p, _ = strained(material, 1990.0)
    assert p == pytest.approx(-5e7 if least is None else least)
    assert strained(material, 2010.0)[0] == pytest.approx(5e7)


@pytest.mark.parametrize("cohesion", [0.0, 1.0, 1e3, 1e5])
@pytest.mark.parametrize("p", [0.0, 1.0, 1e3, 1e7])
def test_weak_rock_yields_on_its_line(cohesion, p):
    """Y = c + mu p from 0 to 100 kPa of cohesion; round-off is 1e-16 of K and of the elastic trial, 1e9 Pa."""
    material = Material("soil", 2000.0, Linear(1e10), Rock(1e9, cohesion, 0.6, tension=0.0))
    found, stress = strained(material, 2000.0 * (1.0 + p / 1e10), shear=1.0)
    assert found == pytest.approx(p, abs=1e-5)
    assert stress == pytest.approx(cohesion + 0.6 * found, rel=1e-9, abs=1e-6)


def test_sand_shears_at_the_friction_of_its_slopes():
    """Y is a von Mises stress: in simple shear, as on a slope, sqrt(3) 0.6 bears 0.6 of the pressure."""
    material = Material("sand", 2000.0, Linear(1e10), Rock(1e9, 0.0, 3.0**0.5 * 0.6, tension=0.0))
    p, stress = strained(material, 2000.0 * (1.0 + 1e4 / 1e10), shear=0.01)
    assert stress / 3.0**0.5 == pytest.approx(0.6 * p, rel=1e-9)


def test_the_smallest_cohesion_that_counts_is_told():
    """1e-6 of the bulk modulus of 26.7 GPa."""

    def told(cohesion):
        weak = ROCK | {"strength": ROCK["strength"] | {"cohesion": cohesion}}
        return [text for text in advice(row_of([METAL, weak], speed=3000.0)) if "cohesion" in text]

    assert "2.67e+04 Pa" in told(10.0)[0]
    assert not told(0.0)
    assert not told(1e5)
