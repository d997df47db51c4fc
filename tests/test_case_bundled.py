"""Bundled cases and library, the JSON schema, the manual and `explain`."""

import importlib.util
import json

import jsonschema
import pytest

from hvisph.case.consistency import warnings_of
from hvisph.casefile.document import parse
from hvisph.casefile.loader import bundled_cases, dump_case, library, load_case, load_material
from hvisph.casefile.manual import explain
from hvisph.casefile.paths import cases_in, data_folder
from hvisph.core.catalogues import SHAPES, arrangements_of
from hvisph.core.errors import CaseError
from hvisph.setup.shapes import shape_of

ROOT = data_folder("cases").parent
_SPEC = importlib.util.spec_from_file_location("case_schema_pages", ROOT / "tools" / "case_schema.py")
TOOL = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(TOOL)
VALIDATOR = jsonschema.Draft202012Validator(TOOL.case_schema())


def plain(name):
    return parse(bundled_cases()[name].read_text(encoding="utf-8"), name).value


@pytest.mark.parametrize("name", bundled_cases())
def test_bundled_case(name):
    path = bundled_cases()[name]
    first = path.read_text(encoding="utf-8").splitlines()[0]
    prefix = "../" * (name.count("/") + 1)
    assert first == f"# yaml-language-server: $schema={prefix}schemas/case.schema.json"
    case = load_case(name)
    assert case.title
    assert case.source
    assert all(expectation.source for _, expectation in case.expected.items())
    VALIDATOR.validate(plain(name))
    VALIDATOR.validate(parse(dump_case(case), "dumped").value)


def test_the_published_set_ups():
    for name, density in (("al_al", 2785.0), ("steel_al", 7900.0)):
        case = load_case(name)
        assert (case.resolution, case.time.end) == (1e-4, 8e-6)
        assert case.formulation.viscosity.type == "monaghan"
        assert (case.formulation.viscosity.alpha, case.formulation.viscosity.beta) == (1.0, 2.0)
        assert case.formulation.artificial_stress.type == "none"
        assert case.bodies["projectile"].arrangement == "lattice_two_rings"
        assert case.bodies["projectile"].material.density == density
        assert case.bodies["target"].shape.size == (0.002, 0.0501)
    expected = dict(load_case("al_al").expected.items())
    assert expected["centre_pressure_peak"].tolerance == pytest.approx(0.12 * 18.6e9)


@pytest.mark.parametrize(("formulation", "number"), [("eulerian", 0.6), ("riemann", 0.42), ("total_lagrangian", 0.5)])
def test_the_courant_number_goes_with_the_formulation(formulation, number):
    change = [f"formulation={{type: {formulation}}}"]
    assert load_case("al_al_coarse", overrides=change).time.cfl == number
    assert load_case("al_al_coarse", overrides=[*change, "time.cfl=0.2"]).time.cfl == 0.2
    assert load_case("sphere_on_plate_axisymmetric", overrides=change).time.cfl == 0.3  # whose rings bear no more
    if formulation != "riemann":  # what less of a viscosity damps does not bear steps as long
        for viscosity in ("{type: none}", "{type: monaghan, alpha: 0.9}"):
            less = [f"formulation={{type: {formulation}, viscosity: {viscosity}}}"]
            assert load_case("al_al_coarse", overrides=less).time.cfl == 0.3
        more = [f"formulation={{type: {formulation}, viscosity: {{type: monaghan, alpha: 2.5}}}}"]
        assert load_case("al_al_coarse", overrides=more).time.cfl == number
    else:  # what dissipates all that slopes do not explain
        for way in ("variant: original", "reconstruction: none"):
            assert load_case("al_al_coarse", overrides=[f"formulation={{type: riemann, {way}}}"]).time.cfl == 0.35
    fixed = load_case("al_al_coarse", overrides=[*change, "time.step=1 ns"])
    assert not any("cfl" in warning for warning in warnings_of(fixed))


def test_bodies_of_three_layers_have_shorter_steps():
    """Their thickness vibrates undamped, and predicted stresses amplify it (`test_riemann_thin_bodies`)."""

    def courant(*overrides):
        return load_case("al_al_coarse", overrides=["bodies.target.shape.size=[0.75 mm, 50 mm]", *overrides]).time.cfl

    assert courant() == 0.3
    assert courant("time.cfl=0.4") == 0.4
    assert courant("resolution=0.2 mm") == courant("bodies.target.rigid=true") == 0.42
    assert courant("formulation.variant=original") == 0.35
    assert courant("formulation={type: eulerian}") == 0.6


def test_published_rows_say_their_courant_number():
    for folder in (data_folder("cases") / "published").iterdir():
        for name, path in cases_in(folder).items():
            time = load_case(path).time
            assert time.step is not None or time.cfl == 0.3, name


@pytest.mark.parametrize(
    "change",
    [
        {"resolutoin": 1},
        {"kinematics": "2d"},
        {"resolution": [1]},
        {"resolution": -1},
        {"bodies": {}},
        {"time": {}},
        {"formulation": {"viscosity": {"type": "none"}}},
        {"formulation": {"type": "riemann", "viscosity": {"type": "none"}}},
        {"time": {"end": 1, "cfl": 2}},
        {"base": 3},
    ],
)
def test_schema_and_loader_refuse_the_same(change):
    data = plain("al_al") | change
    assert not VALIDATOR.is_valid(data)
    with pytest.raises(CaseError):
        load_case(data)


def test_shorthands_are_in_the_schema():
    data = plain("plate_impact_al_al")
    data["bodies"]["projectile"]["velocity"] = "3.1 km/s"
    VALIDATOR.validate(data)
    assert load_case(data) == load_case("plate_impact_al_al")
    data = plain("al_al")
    data["bodies"]["projectile"]["rotation"] = "30 deg"
    VALIDATOR.validate(data)
    load_case(data)
    VALIDATOR.validate({"base": "al_al.yaml", "formulation": {"h_over_dx": 1.5}})


def test_every_field_is_described():
    schema = TOOL.case_schema()
    for name, definition in schema["$defs"].items():
        assert definition["description"], name
        for key, field in definition.get("properties", {}).items():
            assert key == "type" or field.get("description"), f"{name}.{key}"


@pytest.mark.parametrize("path", TOOL.generated_files(ROOT), ids=lambda path: path.name)
def test_generated_files_are_fresh(path):
    """Run `python tools/case_schema.py --write` after a change of the models."""
    assert path.read_text(encoding="utf-8") == TOOL.generated_files(ROOT)[path]


def test_schema_is_a_schema():
    jsonschema.Draft202012Validator.check_schema(TOOL.case_schema())
    assert json.loads(json.dumps(TOOL.case_schema())) == TOOL.case_schema()


def test_manual_names_every_field():
    manual = "".join(
        [*TOOL.case_manual().values(), *(path.read_text() for path in (ROOT / "docs/models").glob("*.md"))]
    )
    for definition in TOOL.case_schema()["$defs"].values():
        for key in definition.get("properties", {}):
            assert f"`{key}`" in manual or f".{key}`" in manual or key in ("type", "value", "tolerance")


@pytest.mark.parametrize(
    ("path", "parts"),
    [
        ("time.cfl", ["Courant", "0.3", "at most 1"]),
        ("bodies.target.shape", ["disc", "diameter", "required"]),
        ("bodies.x.material.strength.yield_stress", ["Yield stress", "[Pa]"]),
        ("formulation", ["eulerian", "reconstruction"]),
        ("formulation.viscosity.alpha", ["Linear coefficient"]),
        ("", ["kinematics"]),
    ],
)
def test_explain(path, parts):
    text = explain(path)
    for part in parts:
        assert part in text, text


def test_explain_names_the_nearest():
    with pytest.raises(CaseError, match=r"time\.clf: unknown key; did you mean 'cfl'"):
        explain("time.clf")


def test_library():
    materials = library()
    assert len(materials) >= 10
    for name, material in materials.items():
        assert material.name == name
        assert material.source
        # what a slip of units or a swapped pair of constants would leave
        assert 9e2 < material.density < 2.5e4
        if material.strength.type not in ("none", "orthotropic", "fabric"):
            assert 4e8 < material.shear_modulus < 5e11  # ice that a shock has softened bears least


def test_library_numbers_of_the_papers():
    aluminium = load_material("aluminium-howell-ball")
    assert (aluminium.density, aluminium.eos.sound_speed, aluminium.eos.gamma) == (2785.0, 5328.0, 2.0)
    assert (aluminium.shear_modulus, aluminium.strength.yield_stress) == (27.6e9, 0.3e9)
    bulk = aluminium.density * aluminium.eos.sound_speed**2
    assert bulk == pytest.approx(79.06e9, rel=1e-4)  # as Young 2021 gives it, to four digits
    steel = load_material("steel-young-3d")
    assert steel.shear_modulus == pytest.approx(200e9 / 2.6)
    assert steel.eos.bulk_modulus == pytest.approx(200e9 / 1.2)
    plate = load_material("aluminium-young-3d")
    assert plate.shear_modulus == pytest.approx(70e9 / 2.66, rel=1e-5)  # written with six digits
    assert plate.damage.pressure_cutoff == -8e8


BOX = {"type": "box", "size": ["2 mm", "3 mm", "4 mm"]}
DISC = {"type": "disc", "diameter": "2 mm"}
# One of each shape of a case, as a file writes it, in 3D unless it is a plane one.
EXAMPLES = {
    "interval": {"length": "1 mm"},
    "disc": {"diameter": "1 mm"},
    "annulus": {"outer_diameter": "3 mm", "inner_diameter": "1 mm"},
    "polygon": {"points": [[0, 0], ["1 mm", 0], [0, "1 mm"]]},
    "sphere": {"diameter": "1 mm"},
    "hollow_sphere": {"outer_diameter": "3 mm", "inner_diameter": "1 mm"},
    "box": {"size": ["2 mm", "3 mm", "4 mm"]},
    "cylinder": {"diameter": "1 mm", "length": "2 mm", "axis": "y"},
    "tube": {"outer_diameter": "3 mm", "inner_diameter": "1 mm", "length": "4 mm"},
    "cone": {"diameter": "3 mm", "length": "4 mm"},
    "frustum": {"back_diameter": "3 mm", "front_diameter": "1 mm", "length": "4 mm"},
    "ogive": {"diameter": "3 mm", "nose_length": "4 mm"},
    "dome": {"diameter": "3 mm"},
    "rounded_cylinder": {"diameter": "3 mm", "length": "4 mm", "edge_radius": "1 mm"},
    "prism": {"section": DISC, "length": "4 mm"},
    "ring": {"section": DISC, "radius": "4 mm"},
    "honeycomb": {"cell": "5 mm", "foil": "0.5 mm", "size": ["2 mm", "9 mm", "9 mm"]},
    "union": {"parts": [{"shape": BOX}, {"shape": BOX, "position": ["1 mm", 0, 0], "rotation": 30}]},
    "intersection": {"parts": [{"shape": BOX}, {"shape": {"type": "sphere", "diameter": "3 mm"}}]},
    "difference": {"whole": BOX, "removed": [{"shape": {"type": "sphere", "diameter": "1 mm"}}]},
    "repeat": {"shape": BOX, "vectors": [[0, "4 mm", 0]], "counts": [3]},
}


@pytest.mark.parametrize("kind", EXAMPLES)
def test_arrangements_are_those_of_the_geometry(kind):
    dim = 1 if kind == "interval" else 2 if kind in ("disc", "annulus", "polygon") else 3
    kinematics = {1: "uniaxial_strain", 2: "plane_strain", 3: "three_d"}[dim]
    shape = {"type": kind} | EXAMPLES[kind]
    data = {"kinematics": kinematics, "resolution": "0.05 mm", "time": {"end": "1 us"}}
    case = load_case(data | {"bodies": {"a": {"material": "aluminium-howell-ball", "shape": shape}}})
    VALIDATOR.validate(parse(dump_case(case), "dumped").value)
    built = shape_of(case.bodies["a"].shape, dim)
    assert arrangements_of(built.dim, built.kind) == arrangements_of(dim, kind)
    # what the models say of sizes without the geometry is what the geometry says
    extent = case.bodies["a"].shape.extent()
    assert not extent or extent[:dim] == pytest.approx(built.extent())


def test_every_shape_has_an_example():
    assert {name for names in SHAPES.values() for name in names} == {*EXAMPLES, "mesh", "particles"}
