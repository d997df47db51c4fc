"""Slips of units and digits are noticed, and nothing that is meant is."""

import pytest

from hvisph.case.consistency import warnings_of
from hvisph.case.materials.material import Material
from hvisph.case.plausible import of_material
from hvisph.casefile.loader import bundled_cases, library, load_case

ALUMINIUM = {
    "density": "2703 kg/m^3",
    "eos": {"type": "mie_gruneisen", "sound_speed": "5.24 km/s", "s1": 1.4, "gamma": 1.97},
    "strength": {"type": "von_mises", "shear_modulus": "26 GPa", "yield_stress": "0.3 GPa"},
}


def case(key="", value=None):
    material = {name: dict(part) if isinstance(part, dict) else part for name, part in ALUMINIUM.items()}
    found = {
        "kinematics": "plane_strain",
        "resolution": "0.1 mm",
        "bodies": {
            "ball": {"material": material, "shape": {"type": "disc", "diameter": "10 mm"}, "velocity": ["3.1 km/s", 0]},
            "plate": {"material": material, "shape": {"type": "box", "size": ["2 mm", "50 mm"]}},
        },
        "time": {"end": "20 us"},
    }
    if key.startswith("time."):
        found["time"][key.removeprefix("time.")] = value
    elif key:
        block, _, last = key.rpartition(".")
        (material[block] if block else material)[last] = value
    return load_case(found)


@pytest.mark.parametrize(
    ("key", "value", "meant"),
    [
        ("density", "2.71 g/mm^3", "2710 kg/m^3"),
        ("density", 2.71e-3, "2710 kg/m^3"),
        ("eos.sound_speed", "5.24 m/s", "5240 m/s"),
        ("eos.sound_speed", "5.24 km/us", "5240 m/s"),
        ("eos.s1", 14, "1.4"),
        ("strength.shear_modulus", "26 TPa", "26 GPa"),
        ("strength.yield_stress", "300 kPa", "300 MPa"),
        ("time.end", "20 s", "20 us"),
    ],
)
def test_a_slip_is_named_with_what_was_meant(key, value, meant):
    found = [text for text in warnings_of(case(key, value)) if key in text]
    assert found
    assert meant in found[0]


@pytest.mark.parametrize(("speed", "flagged"), [("6.9 km/s", False), ("6.9 m/s", True), ("69 km/s", True)])
def test_detonations_have_usual_speeds(speed, flagged):
    material = {"base": "tnt", "eos": {"detonation": {"points": [[0, 0]], "speed": speed}}}
    charge = {"material": material, "shape": {"type": "disc", "diameter": "10 mm"}}
    found = warnings_of(load_case({**case("time.end", "20 us").model_dump(include={"kinematics", "resolution", "time"}),
                                   "bodies": {"charge": charge}}))  # fmt: skip
    assert any("eos.detonation.speed" in text for text in found) == flagged


def test_a_fixed_step_beyond_the_transit_of_sound_is_unstable():
    """1.2 dx over c0 of 5.24 km/s is 23 ns."""
    for step, flagged in ((1e-8, False), (1e-6, True)):
        assert any("time.step" in text for text in warnings_of(case("time.step", step))) == flagged


def test_what_is_meant_is_not_flagged():
    assert warnings_of(case()) == []


def test_no_material_of_the_library_is_flagged():
    for name, material in library().items():
        found = list(of_material(material))
        if name == "silicon-carbide":  # its published set fails its own check, and the library says so
            assert len(found) == 1
            assert "6.76" in found[0] or "6.75" in found[0]
        else:
            assert found == [], name


def test_no_bundled_case_is_flagged():
    for path in bundled_cases().values():
        if path.stem == "base":
            continue
        loaded = load_case(path)
        assert [text for text in warnings_of(loaded) if "usual" in text or "meant" in text] == [], path


def test_energies_in_erg_per_gram_are_named():
    eos = {"type": "tillotson", "bulk_modulus": 26.7e9, "b_modulus": 26.7e9, "a": 0.5, "b": 1.5, "alpha": 5, "beta": 5,
           "reference_energy": 4.87e12, "incipient_energy": 4.72e10, "vaporization_energy": 1.82e11}  # fmt: skip
    doubts = list(of_material(Material.model_validate({"density": 2700.0, "eos": eos})))
    assert [text.partition(";")[2] for text in doubts] == [
        f" was {meant} J/kg meant?" for meant in ("4.87e+08", "4.72e+06", "1.82e+07")
    ]


def test_a_gas_is_as_thin_as_it_is():
    case = load_case("al_al_coarse", ["bodies.target.material={density: 1.2, eos: {type: ideal_gas, gamma: 1.4}}",
                                    "bodies.target.internal_energy=0.2 MJ/kg"])  # fmt: skip
    assert not [text for text in warnings_of(case) if "density" in text]


def test_an_equation_of_state_beyond_its_range_is_named():
    linear = case()
    material = {"density": 2703, "eos": {"type": "linear", "bulk_modulus": "74 GPa"}}
    loaded = load_case({"base": "al_al", "bodies": {name: {"material": material} for name in ("projectile", "target")}})
    assert any("linear" in text and "0.1" in text for text in warnings_of(loaded))
    assert not any("linear" in text for text in warnings_of(linear))


def test_files_of_tables_stand_beside_the_case(tmp_path):
    (tmp_path / "steel.csv").write_text("density,temperature,pressure,energy\n")
    eos = "{type: table, file: steel.csv}"
    (tmp_path / "case.yaml").write_text(
        "kinematics: uniaxial_strain\nresolution: 1 mm\ntime: {end: 1 us}\nbodies:\n"
        f"  bar: {{material: {{density: 7850, eos: {eos}}}, shape: {{type: interval, length: 9 mm}}}}\n"
    )
    assert load_case(tmp_path / "case.yaml").bodies["bar"].material.eos.file == str(tmp_path / "steel.csv")


def test_a_point_of_a_hugoniot_far_from_the_others_is_named():
    def of(*points):
        material = {"density": 1400, "eos": {"type": "mie_gruneisen", "us_up": list(points), "gamma": 1.0}}
        texts = warnings_of(load_case("al_al_coarse", [f"bodies.target.material={material}"]))
        return [text for text in texts if "us_up" in text]

    points = [[500, 2600], [1000, 3400], [2000, 5000], [3000, 6500]]
    assert of(*points) == []
    (text,) = of(*points[:2], [2, 5.0], points[3])
    assert "[2, 5] m/s" in text
    assert "unit" in text


def varied(**changes):
    return case_of({"base": "aluminium-6061-t6", **changes})


def case_of(material, **body):
    return load_case({"kinematics": "uniaxial_strain", "resolution": "0.1 mm", "time": {"end": "1 us"}, "bodies": {
        "bar": {"material": material, "shape": {"type": "interval", "length": "4 mm"}, **body}}})  # fmt: skip


def test_a_heat_capacity_that_is_not_used_is_told():
    unused = [text for text in warnings_of(varied(strength={"heat_capacity": 500})) if "heat_capacity" in text]
    assert len(unused) == 1
    assert "897" in unused[0]
    used = varied(temperature={"heat_capacity": 500})
    assert [text for text in warnings_of(used) if "heat_capacity" in text] == []


def test_a_body_that_starts_above_its_melting_point_is_told():
    cold, molten = (warnings_of(case_of("aluminium-6061-t6", temperature=t)) for t in (900.0, 930.0))
    assert len(molten) == len(cold) + 1
    assert "925 K" in molten[0]


def test_a_variant_leaves_out_what_it_stands_for():
    """Points in place of the base's coefficients, one heat capacity in place of a curve; and by --set."""
    points = [[500.0, 6100.0], [1000.0, 6800.0]]
    made = varied(eos={"us_up": points}, temperature={"heat_capacity": 900.0}).bodies["bar"].material
    assert made.eos.hugoniot[:2] == pytest.approx((5400.0, 1.4))
    assert (made.eos.gamma, made.temperature.heat_capacity, made.temperature.heat_capacities) == (1.97, 900.0, ())
    back = load_case({"base": "al_al_coarse"}, ["bodies.target.material=al6061", "bodies.target.material.eos.us_up=[[500, 6100], [1000, 6800]]",
                                    "bodies.target.material.eos.s1=1.5", "bodies.target.material.eos.sound_speed=5300"])  # fmt: skip
    assert back.bodies["target"].material.eos.hugoniot[:2] == (5300.0, 1.5)


def test_output_beyond_the_end_is_named():
    (text,) = warnings_of(load_case("al_al_coarse", ["output.every=10"]))
    assert text.startswith("output.every: 10 s")
