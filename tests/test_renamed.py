"""Old spellings: each key, value, field, command and option that was renamed is answered with its present name."""

import pytest
from typer.testing import CliRunner

from hvisph.casefile.loader import load_case, load_sweep
from hvisph.casefile.spellings import spellings
from hvisph.cli.main import app
from hvisph.core.errors import CaseError

TARGET = "bodies.target.material"
# By the block that holds a key: where it stands in a case.
PLACES = {
    "eos": f"{TARGET}.eos",
    "damage": f"{TARGET}.damage",
    "formulation": "formulation",
    "contact": "formulation.contact",
    "correction": "formulation.correction",
    "spatial_correction": "formulation.spatial_correction",
    "conversion": "formulation.conversion",
    "output": "output",
    "regions": "output.regions.front",
}
# By the old key: the `type` of the block that has it, or that of the formulation around it.
TYPES = {
    "reading": "linear",
    "complete_energy": "tillotson",
    "cold_tension": "tillotson",
    "energy_density": "jwl",
    "failed": "pressure_cutoff",
    "fails": "pressure_cutoff",
    "form": "riemann",
    "tension": "riemann",
    "angular_momentum": "eulerian",
    "guard": "projection",
    "renew_reference": "total_lagrangian",
    "own_faces": "frictional",
    "folds": "frictional",
    "tested": "mixed",
}
AROUND = {"contact": "riemann", "correction": "eulerian", "spatial_correction": "adaptive", "conversion": "adaptive"}
KEYS, VALUES = ({(block, old): now for block, names in spellings(table).items() for old, now in names.items()}
                for table in ("keys", "values"))  # fmt: skip
COMMANDS, FIELDS, OPTIONS = (spellings(table) for table in ("commands", "fields", "options"))
OLD_VALUES = {
    "arrangement": "bodies.target.arrangement",
    "expansion": f"{TARGET}.eos.expansion",
    "failed_strength": f"{TARGET}.damage.failed_strength",
    "high_triaxiality": f"{TARGET}.damage.high_triaxiality",
    "variant": "formulation.variant",
    "pressure_gradient": "formulation.pressure_gradient",
    "viscosity_in_shear": "formulation.viscosity_in_shear",
    "failed_particles": "formulation.failed_particles",
    "type": "formulation.contact.type",
}
VALUE_TYPES = {
    "expansion": "tillotson",
    "failed_strength": "pressure_cutoff",
    "high_triaxiality": "johnson_cook",
    "variant": "riemann",
    "pressure_gradient": "projection",
    "viscosity_in_shear": "eulerian",
    "failed_particles": "total_lagrangian",
}


def refused(overrides):
    with pytest.raises(CaseError) as caught:
        load_case("al_al_coarse", overrides)
    return str(caught.value)


@pytest.mark.parametrize(("block", "key"), [one for one in KEYS if one[0] in PLACES])
def test_renamed_keys_of_a_case(block, key):
    place = PLACES[block]
    kind = AROUND.get(block) or (TYPES.get(key) if block == "formulation" else None)
    settings = [f"formulation={{type: {kind}}}"] if kind else []
    if block in ("eos", "damage", "contact", "correction", "spatial_correction"):
        settings.append(f"{place}={{type: {TYPES[key]}}}")
    settings.append(f"{place}.{key}=1")
    assert f"{place}.{key}: is now `{KEYS[block, key]}`" in refused(settings)


def test_renamed_keys_have_their_place_and_line(tmp_path):
    case = tmp_path / "case.yaml"
    case.write_text("base: al_al_coarse\nformulation:\n  form: printed\nwatch: {density: false}\n", encoding="utf-8")
    with pytest.raises(CaseError) as caught:
        load_case(case)
    assert f"formulation.form: is now `variant` ({case}, line 3)" in str(caught.value)
    assert f"watch: is now `limits` ({case}, line 4)" in str(caught.value)


@pytest.mark.parametrize(("key", "value"), VALUES)
def test_renamed_values(key, value):
    place, kind = OLD_VALUES[key], VALUE_TYPES.get(key)
    block = place.rpartition(".")[0]
    settings = [f"{block}={{type: {kind}}}"] if kind else []
    assert f"{place}: '{value}' is now `{VALUES[key, value]}`" in refused([*settings, f"{place}={value}"])


def test_renamed_keys_of_sweeps_and_experiments(tmp_path):
    bisect = {"type": "bisect", "path": "time.end", "between": [1, 2], "until": 1, "for": {}, "event": {"above": 0.5}}
    with pytest.raises(CaseError) as caught:
        load_sweep({"case": "al_al_coarse", "vary": bisect, "limit": "1 h"})
    text = str(caught.value)
    for path in ("limit", "vary.between", "vary.until", "vary.for", "vary.event.above"):
        block, _, key = path.rpartition(".")
        assert f"{path}: is now `{KEYS[block.rpartition('.')[2], key]}`" in text
    from hvisph_validation.experiment_set import load_set

    (tmp_path / "set.yaml").write_text("limits: {shot: {between: [1, 2], until: 1}}\n", encoding="utf-8")
    with pytest.raises(CaseError) as caught:
        load_set(tmp_path)
    assert "limits.shot.between: is now `bracket`" in str(caught.value)
    assert "limits.shot.until: is now `tolerance`" in str(caught.value)


@pytest.mark.parametrize("name", FIELDS)
def test_renamed_fields(name):
    said = refused([f"gauges={{A: {{type: material, at: [0, 0], fields: [{name}]}}}}"])
    assert f"gauges.A.fields.0: '{name}' is now `{FIELDS[name]}`" in said


def answer(*words):
    result = CliRunner().invoke(app, list(words))
    assert result.exit_code == 2
    return result.stderr


@pytest.mark.parametrize("name", COMMANDS)
def test_renamed_commands(name):
    assert f"`hvisph {name}` is now `hvisph {COMMANDS[name]}`" in answer(name, "al_al_coarse")


@pytest.mark.parametrize("name", OPTIONS)
def test_renamed_options(name):
    command = {"--dry": "sweep", "--work": "sweep", "--second": "validate", "--across": "validate"}
    assert f"`{name}` is now `{OPTIONS[name]}`" in answer(
        command.get(name, "ballistic-limit"), "al_al_coarse", name, "1"
    )


def test_help_of_an_old_key_names_the_present_one():
    assert "formulation.form: is now `variant`" in answer("help", "formulation.form")
