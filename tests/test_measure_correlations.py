"""Empirical correlations: worked examples, ranges, limits of their formulas, and what a case becomes."""

import math
from dataclasses import replace

import pytest
import yaml

from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.measures.correlations import (
    ALLOYS,
    KSI,
    Impact,
    Wall,
    alloy_of,
    correlations,
    crater_depth,
    crater_volume,
    critical_diameter,
    recht_ipson,
    rock_crater_diameter,
)
from hvisph.precheck.correlation_input import correlations_of, impact_of

MM = 1e-3
SIX = ALLOYS["aluminium-6061"]


def wall(thickness, gap=0.0, alloy=SIX, name="wall"):
    return Wall(name, thickness, 2713.0, gap, alloy)


def test_cour_palais_on_thick_aluminium():
    # 6.35 mm of aluminium at 7 km/s, worked by hand from eq. 4-1: 12.9 mm in 6061-T6, 18.4 mm in 1100-O
    shot = Impact(6.35 * MM, 2713.0, 7000.0, 0.0, ())
    assert crater_depth(shot, wall(1.0), SIX) == pytest.approx(12.9 * MM, rel=0.01)
    assert crater_depth(shot, wall(1.0), ALLOYS["aluminium-1100-o"]) == pytest.approx(18.4 * MM, rel=0.01)
    # depth goes with (V cos)^(2/3) and d^(19/18)
    oblique = Impact(6.35 * MM, 2713.0, 7000.0, math.radians(60.0), ())
    assert crater_depth(oblique, wall(1.0), SIX) / crater_depth(shot, wall(1.0), SIX) == pytest.approx(0.5 ** (2 / 3))
    thick = {one: correlations(Impact(6.35 * MM, 2713.0, 7000.0, 0.0, (wall(one * 12.9 * MM),)))[1].text
             for one in (1.5, 2.0, 2.5, 3.5)}  # fmt: skip
    assert list(thick.values()) == ["perforated", "detached spall", "incipient spall", "no incipient spall"]


def test_whipple_curve_is_continuous_and_has_its_branches():
    bumper, rear = wall(1.27 * MM, name="bumper"), wall(3.2 * MM, 101.6 * MM)

    def critical(speed, angle=0.0):
        return critical_diameter(Impact(5 * MM, 2796.0, speed, angle, ()), bumper, rear, 40.0 * KSI)

    for edge in (3000.0, 7000.0):
        assert critical(edge - 1e-6) == pytest.approx(critical(edge + 1e-6), rel=1e-6)
    assert critical(2000.0) > critical(3000.0) < critical(7000.0) > critical(10000.0)
    assert critical(9000.0) / critical(8000.0) == pytest.approx((8 / 9) ** (2 / 3))
    # the low branch by hand: ((0.32 * 1 + 0.127) / (0.6 * 2.796^0.5 * 2.5^(2/3)))^(18/19) cm
    assert critical(2500.0) == pytest.approx(((0.32 + 0.127) / (0.6 * 2.796**0.5 * 2.5 ** (2 / 3))) ** (18 / 19) * 1e-2)
    assert critical(2500.0, math.radians(70.0)) == pytest.approx(critical(2500.0, math.radians(80.0)))


def test_what_is_from_memory_says_so():
    found = {one.name: one for one in correlations(Impact(10 * MM, 2710.0, 6180.0, 0.0, (wall(4 * MM),)))}
    assert {name for name, one in found.items() if "from memory" in one.source} == {"Maiden-McHugh", "Sawle"}


def test_out_of_range_is_silent():
    assert correlations(Impact(10 * MM, 2710.0, 100.0, 0.0, (wall(4 * MM),))) == []
    assert correlations(Impact(10 * MM, 2710.0, 6000.0, 0.0, (wall(4 * MM, alloy=None),))) == []
    steel = correlations(Impact(10 * MM, 7800.0, 6000.0, 0.0, (wall(4 * MM),)))
    assert {one.name for one in steel} == {"Cour-Palais"}
    assert alloy_of("steel-howell-ball") is None
    assert alloy_of("aluminium-2024-t351") is ALLOYS["aluminium-2024"]


def test_recht_ipson():
    assert recht_ipson(303.5, 184.5, 0.87, 0.13) == pytest.approx(209.0, rel=0.01)
    assert recht_ipson(100.0, 184.5, 0.87, 0.13) == 0.0


SHIELD = """
kinematics: three_d
resolution: 0.5 mm
bodies:
  shot: {material: aluminium-2024-t351, shape: {type: sphere, diameter: 6 mm}, velocity: [6 km/s, 0, 0]}
  bumper: {material: aluminium-6061-t6, shape: {type: box, size: [2 mm, 40 mm, 40 mm]}}
  rear: {material: aluminium-6061-t6, shape: {type: box, size: [4 mm, 60 mm, 60 mm]}}
time: {end: 1 us}
"""
GAP = "bodies.rear.gap=100 mm"


def test_impact_of_a_case(tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text(SHIELD)
    impact, _ = impact_of(load_case(path, [GAP]))
    assert [one.thickness for one in impact.walls] == pytest.approx([2 * MM, 4 * MM])
    assert impact.walls[1].gap == pytest.approx(0.1)
    assert (impact.speed, impact.obliquity) == (6000.0, 0.0)
    names = {one.name for one in correlations(impact)}
    assert names == {"Cour-Palais", "Maiden-McHugh", "Sawle", "Christiansen, Whipple"}
    flat, reason = impact_of(load_case("al_al_coarse"))
    assert flat is None
    assert "3D" in reason
    for setting in ("velocity=[-6 km/s, 0, 0]", "position=[-3 mm, 50 mm, 0]"):
        none, reason = impact_of(
            load_case(path, [GAP, f"bodies.shot.{setting}", "bodies.bumper.position=[1 mm, 0, 0]"])
        )
        assert none is None
        assert "flies past" in reason


def shield(speed, angle=0.0, layers=1, diameter=9.5 * MM):
    """6061-T6 of 1.27 mm, 0.43 g/cm^2 of cloth in the middle of 114 mm, 2219-T87 of 3.2 mm, after Christiansen 1995."""
    cloth = [Wall("cloth", 4.3 * MM / layers, 1000.0, 54.85 * MM if k == 0 else 0.0, cloth=True) for k in range(layers)]
    rear = Wall("rear", 3.2 * MM, 2840.0, 54.85 * MM, ALLOYS["aluminium-2219"])
    return Impact(diameter, 2800.0, speed, angle, (wall(1.27 * MM, name="bumper"), *cloth, rear))


def stuffed(impact):
    return next(one for one in correlations(impact) if one.name == "Christiansen, stuffed Whipple")


def test_stuffed_whipple_shield():
    # by hand, in cm and g/cm^2: bumper 0.127 x 2.713 = 0.34455 and cloth 0.43; S = 11.4; sigma = 57 ksi
    areal, sigma = 0.127 * 2.713 + 0.43, 57.0 / 40.0
    slow = 2.35 * 2.0 ** (-2 / 3) * 2.8**-0.5 * (0.32 * sigma**0.5 + 0.37 * areal)
    fast = 0.6 * (0.32 * 2.84 / 2.8) ** (1 / 3) * 8.0 ** (-1 / 3) * 11.4 ** (2 / 3) * sigma ** (1 / 6)
    assert stuffed(shield(2000.0)).value == pytest.approx(slow * 1e-2)
    assert stuffed(shield(8000.0)).value == pytest.approx(fast * 1e-2)
    assert stuffed(shield(8000.0, layers=3)).value == pytest.approx(fast * 1e-2)  # the same cloth in three bodies
    for angle in (0.0, math.radians(45.0)):
        for edge in (2600.0 / math.cos(angle) ** 0.5, 6500.0 / math.cos(angle) ** 0.75):
            below, above = (stuffed(shield(edge + by, angle)).value for by in (-1e-6, 1e-6))
            assert below == pytest.approx(above, rel=1e-6)
    assert stuffed(shield(7240.0)).text == "rear holds"  # as shot B290
    assert stuffed(shield(7240.0, diameter=20 * MM)).text == "rear perforated"


def test_multi_wall_shield_of_cloth():
    bumpers = [Wall("cloth", 1.1 * MM, 909.0, 0.0 if k == 0 else 100 * MM, cloth=True) for k in range(4)]
    rear = Wall("rear", 2 * MM, 2713.0, 100 * MM, SIX)
    (found,) = correlations(Impact(8 * MM, 2800.0, 7000.0, 0.0, (*bumpers, rear)))
    gap = 40.0 + 0.33  # four gaps, and three of the bumpers
    assert found.value == pytest.approx(
        0.358 * (0.2 * 2.713 / 2.8) ** (1 / 3) * 7.0 ** (-1 / 3) * gap ** (2 / 3) * 1e-2
    )
    assert not correlations(Impact(8 * MM, 2800.0, 7000.0, 0.0, (*bumpers[:2], rear)))


def test_cloth_of_a_case(tmp_path):
    text = """
kinematics: three_d
resolution: 1 mm
bodies:
  shot: {material: aluminium-2017-t4, shape: {type: sphere, diameter: 9 mm}, velocity: [7 km/s, 0, 0]}
  bumper: {material: aluminium-6061-t6, shape: {type: box, size: [3 mm, 40 mm, 40 mm]}}
  cloth:
    material: nextel-af62
    shape: {type: box, size: [4.4 mm, 60 mm, 60 mm]}
    gap: 50 mm
    axes: {one: y, two: z}
  rear: {material: aluminium-2219-t87, shape: {type: box, size: [4 mm, 60 mm, 60 mm]}, gap: 50 mm}
time: {end: 1 us}
"""
    path = tmp_path / "case.yaml"
    path.write_text(text)
    impact, _ = impact_of(load_case(path))
    assert impact.walls[1].areal_density == pytest.approx(4.0, rel=0.01)  # four layers of 0.1 g/cm^2
    assert stuffed(impact).source == "Christiansen and Kerr 2001"


def layer(ground, density, thickness=1.0):
    return Wall("ground", thickness, density, ground=ground)


def test_crater_scaling_in_sand_by_hand():
    # 6.35 mm of 2700 kg/m^3 is 3.62e-4 kg; pi_2 = 9.81 * 3.175e-3/1770^2 = 9.94e-9, pi_4^(-1/3) = 1.154 at 1756 kg/m^3,
    # pi_V = 0.24 * (1.147e-8)^(-1.23/2.41) = 2710; 2710 * 3.62e-4/1756 = 0.56 litre; (3 V/pi)^(1/3) = 8.1 cm
    shot = Impact(6.35 * MM, 2700.0, 1770.0, 0.0, (layer("sand", 1756.0),), 9.81)
    assert crater_volume(shot, shot.walls[0]) == pytest.approx(0.56e-3, rel=0.01)  # two figures by hand
    radius, depth = correlations(shot)
    assert radius.value == pytest.approx(81 * MM, rel=0.01)
    assert depth.value == pytest.approx(54 * MM, rel=0.01)
    assert radius.text == "0.558 litre; taken as sand, Y 0 MPa; 9.81 m/s^2"
    heavy = replace(shot, gravity=98.1)
    assert crater_volume(heavy, shot.walls[0]) / crater_volume(shot, shot.walls[0]) == pytest.approx(
        10 ** (-1.23 / 2.41)
    )
    assert crater_volume(replace(shot, gravity=0.0), shot.walls[0]) == math.inf
    for beyond in (
        replace(shot, gravity=0.0),
        replace(shot, speed=900.0),
        replace(shot, walls=(layer("sand", 1756.0, 0.1),)),
    ):
        assert correlations(beyond) == []


def test_crater_scaling_in_rock_by_hand():
    # without gravity V = K1 (m/rho) (rho U^2/Y)^(3 mu/2): 1 cm of 2700 kg/m^3 at 5 km/s: 0.2 * 5.236e-7 * 3750^0.825
    shot = Impact(10 * MM, 2700.0, 5000.0, 0.0, (layer("hard rock", 2700.0),))
    wall = shot.walls[0]
    assert crater_volume(shot, wall) == pytest.approx(0.2 * 5.236e-7 * 3750.0**0.825, rel=1e-3)  # four figures
    twice = replace(shot, speed=10000.0)
    assert crater_volume(twice, wall) / crater_volume(shot, wall) == pytest.approx(2**1.65)
    # Gault: 1.414e-3 kg, 17.67 kJ; 0.015 * 2700^(1/6 - 1/2) * 17671^0.37 = 0.0402 m
    assert rock_crater_diameter(shot, wall) == pytest.approx(0.0402, rel=5e-3)  # three figures by hand
    turned = replace(shot, obliquity=math.radians(37.0))
    assert rock_crater_diameter(turned, wall) / rock_crater_diameter(shot, wall) == pytest.approx(
        math.cos(math.radians(37.0)) ** (2 / 3)
    )
    found = correlations(shot)
    assert [one.name for one in found] == ["Holsapple", "Holsapple", "Gault"]
    assert "no gravity" in found[0].text
    assert "from memory" in found[2].source


def test_ground_of_a_case(tmp_path):
    text = """
kinematics: axisymmetric
resolution: 2 mm
bodies:
  shot: {material: aluminium-6061-t6, shape: {type: sphere, diameter: 10 mm}, velocity: [5 km/s, 0]}
  ground: {material: %s, shape: {type: cylinder, length: 300 mm, diameter: 600 mm}}
time: {end: 1 us}
%s"""

    def impact(material, further=""):
        path = tmp_path / "case.yaml"
        path.write_text(text % (material, further))
        return impact_of(load_case(path))

    soil = "{base: basalt, strength: {cohesion: %s}}"
    grounds = {"basalt": "hard rock", "ice": "ice", "water": "water", "copper-ofhc": ""}
    grounds |= {soil % "0 Pa": "sand", soil % "100 kPa": "dry soil", soil % "1 MPa": "wet soil"}
    for material, ground in grounds.items():
        assert impact(material)[0].walls[0].ground == ground
    shot, reason = impact(soil % "0 Pa")
    assert correlations(shot) == []
    assert "gravity" in reason
    shot, reason = impact(soil % "0 Pa", "gravity: [-3 m/s^2, 0]\n")
    assert (shot.gravity, reason) == (3.0, "")


PANEL = """
kinematics: three_d
resolution: 0.2 mm
bodies:
  shot: {material: aluminium-2017-t4, shape: {type: sphere, diameter: 2.2 mm}, velocity: [6 km/s, 0, 0]}
  front: {material: aluminium-6061-t6, shape: {type: box, size: [0.8 mm, 20 mm, 20 mm]}}
  core:
    material: {base: aluminium-5056-foil, porosity: {distension: %s, elastic_pressure: 10 MPa, solid_pressure: 1 GPa}}
    shape: {type: honeycomb, cell: 4.76 mm, foil: 0.0254 mm, thickened: %s, size: [12.7 mm, 20 mm, 20 mm]}
  rear: {material: aluminium-6061-t6, shape: {type: box, size: [0.8 mm, 20 mm, 20 mm]}}
time: {end: 1 us}
"""


def test_a_honeycomb_counts_as_a_gap_of_two_cells(tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text(PANEL % (16, 16))
    shot, _ = impact_of(load_case(path))
    front, rear = shot.walls
    assert (rear.gap, rear.cell) == pytest.approx((12.7 * MM, 4.76 * MM))
    found = next(one for one in correlations(shot) if one.quantity.startswith("critical"))
    assert found.name == "Christiansen, honeycomb"
    empty = replace(rear, gap=2 * rear.cell, cell=0.0)
    assert found.value == critical_diameter(replace(shot, walls=(front, empty)), front, empty, rear.alloy.strength)
    shallow = replace(rear, gap=5 * MM)  # a core of less than two cells counts with its depth
    of_shallow = next(
        one for one in correlations(replace(shot, walls=(front, shallow))) if one.quantity.startswith("critical")
    )
    assert of_shallow.value < found.value


@pytest.mark.parametrize(("pores", "times", "words"), [
    (8, 16, "distension 16"), (8, 8, "give 16 or more"), (64, 64, "no foil in cells"),
])  # fmt: skip
def test_foil_keeps_its_mass_and_is_resolved(pores, times, words, tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text(PANEL % (pores, times))
    with pytest.raises(CaseError, match=words):
        load_case(path)


@pytest.mark.parametrize("stated", [("rear",), ("bumper", "rear"), ("shot",)])
def test_the_gap_before_a_wall_does_not_depend_on_how_it_is_placed(stated, tmp_path):
    """A wall with a `position` behind one without had no gap: the limit of the shield was left out silently."""
    (tmp_path / "case.yaml").write_text(SHIELD)
    centres = {"shot": -3.0, "bumper": 1.0, "rear": 104.0}  # [mm]
    settings = [f"bodies.{name}.position=[{centres[name]} mm, 0, 0]" for name in stated]
    if stated == ("shot",):  # the second wall in the row begins at x = 0
        settings += [GAP]
    impact, _ = impact_of(load_case(tmp_path / "case.yaml", settings))
    assert [one.gap for one in impact.walls] == pytest.approx([0.0, 0.1])
    assert "Christiansen, Whipple" in {one.name for one in correlations(impact)}


def _driven(bodies, kinematics="axisymmetric", **further):
    case = {"kinematics": kinematics, "resolution": "0.5 mm", "bodies": bodies, "time": {"end": "1 us"}, **further}
    return {one.quantity: one.value for one in correlations_of(load_case(case))[0]}


def test_driven_plates_and_tubes_by_gurney():
    """By hand from the masses: 3 mm of copper on 20 mm of TNT, a tube, both faces covered, a rigid wall behind."""
    interval = "{type: interval, length: %s}"

    def slab(**further):
        charge = {"material": "tnt", "shape": yaml.safe_load(interval % "20 mm"), "position": ["-10 mm"]}
        plate = {"material": "copper-ofhc", "shape": yaml.safe_load(interval % "3 mm"), "position": ["1.5 mm"]}
        return {"charge": charge, "plate": plate, **further}

    metal = 3 * 8930 / (20 * 1630)
    ratio = 1 + 2 * metal
    expected = 2370 / math.sqrt((1 + ratio**3) / (6 * (1 + metal)) + metal)
    found = _driven(slab(), "uniaxial_strain")
    assert found == {"final velocity of plate": pytest.approx(expected, rel=2e-3)}
    behind = {"material": "copper-ofhc", "shape": yaml.safe_load(interval % "3 mm"), "position": ["-21.5 mm"]}
    both = _driven(slab(behind=behind), "uniaxial_strain")
    symmetric = 2370 / math.sqrt(2 * metal + 1 / 3)
    assert both == {f"final velocity of {name}": pytest.approx(symmetric, rel=2e-3) for name in ("plate", "behind")}
    held = _driven(slab(), "uniaxial_strain", symmetry=[{"axis": "x", "at": "-20 mm"}])
    assert held["final velocity of plate"] == pytest.approx(2370 / math.sqrt(metal + 1 / 3), rel=2e-3)
    tube = {
        "charge": {"material": "composition-b", "shape": {"type": "cylinder", "diameter": "20 mm", "length": "60 mm"},
                   "position": ["30 mm", 0]},
        "wall": {"material": "copper-ofhc", "shape": {"type": "tube", "outer_diameter": "25 mm",
                 "inner_diameter": "20 mm", "length": "60 mm"}, "position": ["30 mm", 0]},
    }  # fmt: skip
    shell = 2700 / math.sqrt((25**2 - 20**2) * 8930 / (20**2 * 1717) + 0.5)
    assert _driven(tube) == {"final velocity of wall": pytest.approx(shell, rel=2e-3)}
    tube["wall"]["shape"]["inner_diameter"] = "21 mm"  # a gap
    assert _driven(tube) == {}
