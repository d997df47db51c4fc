"""Bad cases: each message says where, what is wrong, what is allowed or nearest, and the line."""

import textwrap

import pytest

from hvisph.casefile.errors import CaseErrors
from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError

GOOD = textwrap.dedent("""\
    title: test
    kinematics: plane_strain
    resolution: 0.1 mm
    bodies:
      projectile:
        material: aluminium-howell-ball
        shape: {type: disc, diameter: 10 mm}
        velocity: [3.1 km/s, 0]
      target:
        material: aluminium-howell-ball
        shape: {type: box, size: [2 mm, 50 mm]}
    formulation:
      type: eulerian
      viscosity: {type: monaghan, alpha: 1}
    time:
      end: 8 us
    output: {every: 1 us}
    expected:
      crater_diameter: {value: 2 cm, tolerance: 1 mm}
    """)


def failure(tmp_path, old, new):
    assert old in GOOD
    path = tmp_path / "case.yaml"
    path.write_text(GOOD.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(CaseError) as caught:
        load_case(path)
    assert caught.value.exit_code == 2
    return str(caught.value)


def test_the_good_case_loads(tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text(GOOD, encoding="utf-8")
    assert load_case(path).dim == 2


# old text, new text, parts of the message, line
BAD = [
    ("resolution:", "resolutoin:", ["resolutoin: unknown key", "did you mean 'resolution'?"], 3),
    ("diameter: 10 mm", "diametre: 10 mm", ["bodies.projectile.shape.diametre", "'diameter'"], 7),
    ("resolution: 0.1 mm", "resolution: 0.1 mm\ncfl: 0.2", ["cfl: unknown key here; it stands at time.cfl"], 4),
    ("    velocity", "    damage: {type: none}\n    velocity", ["it stands at bodies.NAME.material.damage"], 8),
    (
        "type: disc",
        "type: box, size: [1 mm, 1 mm]",
        ["diameter: unknown key of box, which has size; it is one of disc"],
        7,
    ),
    ("output: {every: 1 us}", "output: 1 us", ["output: expected a mapping", "write it like {every: 1 us}"], 17),
    ("plane_strain", "3D", ["kinematics: unknown '3D'; write three_d"], 2),
    ("material: aluminium-howell-ball", "material: {name: steel-4340}", ["missing", "or {base: NAME}"], 6),
    ("type: disc", "type: circle", ["bodies.projectile.shape.type: unknown 'circle'; here it is 'disc'"], 7),
    ("diameter: 10 mm", "radius: 5 mm", ["bodies.projectile.shape.radius", "give 'diameter', twice the radius"], 7),
    (
        "aluminium-howell-ball",
        "alumnium-howel-ball",
        ["bodies.projectile.material: unknown", "'aluminium-howell-ball'"],
        6,
    ),
    ("0.1 mm", "0.1 us", ["resolution:", "is a time, expected a length", "0.1 mm"], 3),
    ("0.1 mm", "-0.1 mm", ["resolution:", "must be above 0"], 3),
    ("0.1 mm", ".inf", ["resolution:", "finite"], 3),
    ("0.1 mm", ".nan", ["resolution:", "finite"], 3),
    ("0.1 mm", "yes", ["resolution:", "not a length"], 3),
    ("0.1 mm", "true", ["resolution:", "true/false"], 3),
    ("0.1 mm", "1e-12", ["resolution:", "particles", "coarser"], 3),
    ("    material", "\tmaterial", ["the line is indented by a tab; YAML wants spaces"], 6),
    ("0.1 mm", "1 mm", ["bodies.target.shape", "0.002 m thick", "2h = 0.0028 m", "h = 0.0014 m"], 11),
    ("plane_strain", "plain_strain", ["kinematics: unknown 'plain_strain'", "'plane_strain'"], 2),
    ("plane_strain", "three_d", ["bodies.projectile.shape.type", "disc has no meaning in 3D", "sphere"], 7),
    ("type: disc", "type: disk", ["bodies.projectile.shape.type: unknown 'disk'", "'disc'"], 7),
    ("{type: disc, diameter: 10 mm}", "disc", ["bodies.projectile.shape", "write {type: disc}"], 7),
    ("{type: disc, diameter: 10 mm}", "{diameter: 10 mm}", ["`type` is missing", "box"], 7),
    (
        "[2 mm, 50 mm]",
        "[2 mm, 50 mm, 1 mm]",
        ["bodies.target.shape.size", "has 3 sizes, needs 2 in 2D: [x, y]"],
        11,
    ),
    ("[2 mm, 50 mm]", "[2 mm, -50 mm]", ["bodies.target.shape.size.1", "above 0"], 11),
    ("[3.1 km/s, 0]", "3.1 km/s", ["bodies.projectile.velocity", "is a speed alone; write {speed: ...}"], 8),
    ("[3.1 km/s, 0]", "[1, 2, 3]", ["bodies.projectile.velocity", "has 3 components, needs 2"], 8),
    ("[3.1 km/s, 0]", "[3100 km/s, 0]", ["bodies.projectile.velocity", "check its unit"], 8),
    (
        "velocity:",
        "arrangement: hcp\n    velocity:",
        ["arrangement", "'hcp' has no meaning for a disc in 2D", "rings"],
        8,
    ),
    ("velocity:", "gap: 1 mm\n    velocity:", ["bodies.projectile.gap", "no body before the first"], 8),
    (
        "velocity:",
        "position: [0, 0, 0]\n    velocity:",
        ["bodies.projectile.position", "has 3 components"],
        8,
    ),
    (
        "velocity:",
        "rotation: {angle: 3, axis: [1, 0, 0]}\n    velocity:",
        ["rotation.axis", "always z in 2D"],
        8,
    ),
    ("alpha: 1", "alhpa: 1", ["formulation.viscosity.alhpa", "'alpha'"], 14),
    ("type: monaghan", "type: monahgan", ["formulation.viscosity.type", "'monaghan'"], 14),
    (
        "type: eulerian",
        "type: eulerian\n  h_over_dx: 0.8",
        ["formulation.h_over_dx", "at least 1 and at most 2.5"],
        14,
    ),
    ("type: eulerian", "type: eulerain", ["formulation.type: unknown 'eulerain'", "'eulerian'"], 13),
    ("end: 8 us", "cfl: 0.3", ["time.end: missing", "Time at which the run ends"], 15),
    ("end: 8 us", "{end: 8 us", ["is not valid YAML"], 17),
    ("end: 8 us", "end: 8 us\n  cfl: 1.5", ["time.cfl", "at most 1"], 17),
    ("end: 8 us", "end: 8 us\n  step: 0", ["time.step", "above 0"], 17),
    ("end: 8 us", "end: 8 us\n  end: 9 us", ["the key 'end' appears twice"], 17),
    ("end: 8 us", "end: 8 us\n  max_steps: 1.5", ["time.max_steps", "whole number"], 17),
    ("every: 1 us", "formats: [hdf6]", ["output.formats.0: unknown 'hdf6'", "'hdf5'"], 17),
    ("every: 1 us", "formats: []", ["output.formats", "at least 1"], 17),
    ("every: 1 us", "formats: [vtu, vtu]", ["output.formats", "twice"], 17),
    ("{every: 1 us}", "[1]", ["output: expected a mapping", "a list"], 17),
    ("crater_diameter:", "crater_lip_to_lip:", ["'crater_lip_to_lip' is now `crater_lip_diameter`"], 19),
    (
        "crater_diameter:",
        "crater_diamter:",
        ["expected.crater_diamter: unknown key", "'crater_diameter'"],
        19,
    ),
    (
        "value: 2 cm",
        "value: 2 GPa",
        ["expected.crater_diameter.value", "is a pressure, expected a length"],
        19,
    ),
    ("tolerance: 1 mm", "tolerance: ten %", ["expected.crater_diameter.tolerance", "percentage"], 19),
    (
        "crater_diameter: {value: 2 cm",
        "plateau_stress: {value: 2 GPa, source: x",
        ["expected.plateau_stress"],
        19,
    ),
    ("title: test", "title: 12", ["title: expected text, found a number"], 1),
    (
        "title: test",
        "clamped: [{bodies: [targt], box: {}}]",
        ["clamped.0.bodies.0: unknown body 'targt'", "'target'"],
        1,
    ),
    (
        "title: test",
        "clamped: [{box: {min: [0, 1], max: [1, 0]}}]",
        ["clamped.0.box", "min 1 must be below max 0"],
        1,
    ),
    ("title: test", "symmetry: [{axis: z}]", ["symmetry.0.axis", "no axis z in 2D"], 1),
    ("title: test", "symmetry: [{axis: y}, {axis: y}]", ["symmetry.1.keep", "what lies between"], 1),
    ("title: test", "units: none", ["library is in SI"], 6),
    ("title: test", "title: !!python/object/apply:os.system [ls]", ["tag", "not allowed"], 1),
    ("title: test", "title: &a [*a]", ["alias '*a' refers to itself"], 1),
    ("title: test", "<<: {title: x}", ["merge keys", "base"], 1),
    ("title: test", "? [a]\n: b", ["a key must be plain text"], 1),
    ("  target:", "  2target:", ["bodies.2target", "a name starts with a letter"], 9),
    ("every: 1 us", "formats: [csv]", ["output.formats.0: unknown 'csv'"], 17),
    ("0.1 mm", "0,1 mm", ["resolution: '0,1 mm': unknown unit ',1 mm'; decimals follow a point"], 3),
    ("8 us", "8", ["output.every: 1e-06 s asks for 8e+06 snapshots", "time.end = 8 s"], 17),
    ("velocity:", "temperature: 400 K\n    internal_energy: 1e5\n    velocity:", ["given beside `temperature`"], 9),
    (
        "type: disc, diameter: 10 mm",
        "type: annulus, outer_diameter: 10 mm, inner_diameter: 12 mm",
        ["shape.inner_diameter: 0.012 must be below the outer_diameter, 0.01"],
        7,
    ),
    (
        "time:\n",
        "  contact: {type: bonded, friction: 0.3}\ntime:\n",
        ["friction: unknown key of bonded, which has no other; it is one of frictional"],
        15,
    ),
]


@pytest.mark.parametrize(("old", "new", "parts", "line"), BAD, ids=[f"{n}-{b[1][:30]}" for n, b in enumerate(BAD)])
def test_message_has_path_reason_and_line(tmp_path, old, new, parts, line):
    message = failure(tmp_path, old, new)
    for part in parts:
        assert part in message, message
    assert f"case.yaml, line {line})" in message, message


def test_a_bad_entry_does_not_leave_its_list_too_short(tmp_path):
    assert "needs at least" not in failure(tmp_path, "every: 1 us", "formats: [csv]")


def test_all_errors_come_at_once(tmp_path):
    path = tmp_path / "case.yaml"
    text = GOOD.replace("cfl", "clf").replace("alpha: 1", "alpha: -1").replace("title", "tilte").replace("8 us", "8 m")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(CaseErrors) as caught:
        load_case(path)
    assert {error.where for error in caught.value.errors} == {
        "tilte",
        "formulation.viscosity.alpha",
        "time.end",
    }
    assert str(caught.value).startswith("3 errors in the case:\n")


def test_checks_across_fields_come_at_once(tmp_path):
    message = failure(tmp_path, "bodies:", "symmetry: [{axis: z}]\nbodies:")
    assert "symmetry.0.axis" in message
    path = tmp_path / "case.yaml"
    path.write_text(
        GOOD.replace("every: 1 us", "formats: [vtu, vtu]").replace("[3.1 km/s, 0]", "[1 m/s]"), encoding="utf-8"
    )
    with pytest.raises(CaseErrors) as caught:
        load_case(path)
    assert [error.line for error in caught.value.errors] == [8, 17]


LINEAR = "density: 2785, eos: {type: linear, bulk_modulus: 79 GPa}"
ELASTIC = "density: 1, eos: {type: elastic, youngs_modulus: 1, poisson_ratio: 0.3}"
JC = (
    "strength: {type: johnson_cook, shear_modulus: 26 GPa, a: 1e8, b: 1e8, n: 1, c: 0, m: 1, "
    "melt_temperature: 200 K, heat_capacity: 900}"
)


@pytest.mark.parametrize(
    ("material", "parts"),
    [
        (
            f"{{{LINEAR}, strength: {{type: von_mises, yield_stress: 1 GPa}}}}",
            ["strength.shear_modulus: missing", "27.6 GPa"],
        ),
        (
            f"{{{ELASTIC}, strength: {{type: elastic, shear_modulus: 1}}}}",
            ["strength.shear_modulus: given twice", "leave it out"],
        ),
        (
            "{density: 1, eos: {type: elastic, youngs_modulus: 1, poisson_ratio: 0.5}}",
            ["poisson_ratio", "below 0.5"],
        ),
        (
            "{density: 1, eos: {type: ideal_gas, gamma: 1.4}, strength: {type: elastic, shear_modulus: 1}}",
            ["ideal gas"],
        ),
        ("{density: 1, eos: {type: ideal_gas, gamma: 1}}", ["eos.gamma", "above 1"]),
        (
            f"{{{LINEAR}, {JC}}}",
            ["strength.melt_temperature", "above the room"],
        ),
        (
            f"{{{LINEAR}, damage: {{type: johnson_cook, d1: 1}}}}",
            ["damage.type", "grows with plastic strain"],
        ),
        (
            f"{{{LINEAR}, damage: {{type: pressure_cutoff, pressure: 1}}}}",
            ["below 0"],
        ),
        (
            f"{{{LINEAR}, damage: {{type: pressure_cutoff, pressure: -1e9, spall_exponent: 0.2}}}}",
            ["damage", "permanent: true"],
        ),
        (
            f"{{{LINEAR}, damage: {{type: cockcroft_latham, critical_work: 1e8, spall_exponent: 0.2}}}}",
            ["damage", "give spall_strength"],
        ),
        (
            f"{{{LINEAR}, damage: {{type: pressure_cutoff, pressure: -1e9, permanent: true, spall_rate: 10}}}}",
            ["damage.spall_rate", "at least"],
        ),
        ("{eos: {type: linear, bulk_modulus: 1}}", ["density: missing"]),
        ("[]", ["expected a mapping of keys, found a list"]),
    ],
)
def test_bad_material(tmp_path, material, parts):
    message = failure(tmp_path, "aluminium-howell-ball", material)
    assert "bodies.projectile.material" in message
    assert "line 6)" in message
    for part in parts:
        assert part in message, message


@pytest.mark.parametrize("name", ["[key]", "a.b", "", "ü", "x" * 65])
def test_bad_name_of_a_body(name):
    body = {"material": "tungsten", "shape": {"type": "disc", "diameter": 1}}
    data = {"kinematics": "plane_strain", "resolution": 0.1, "time": {"end": 1}, "bodies": {name: body}}
    with pytest.raises(CaseError, match="a name starts with a letter") as caught:
        load_case(data)
    assert caught.value.where.startswith(f"bodies.{name[:64]}")
    with pytest.raises(CaseError, match="unknown key"):
        load_case(data | {"bodies": {"a": body}, name: 1})
