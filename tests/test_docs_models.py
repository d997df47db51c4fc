"""The pages on models are made from the models, and their cases run."""

import importlib.util
import sys

import pytest
from test_docs import DOCS, ROOT

from hvisph.casefile.loader import load_case
from hvisph.casefile.material_library import library_of, material_names
from hvisph.schemes import derived_fields, stepper
from hvisph.setup.materials import material_of
from hvisph.simulation.run import run

TOOLS = ROOT / "tools"


def page_script(name):
    """Return a script of tools/ as a module."""
    spec = importlib.util.spec_from_file_location(f"{name}_pages", TOOLS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[f"{name}_pages"] = module
    spec.loader.exec_module(module)
    return module


models = page_script("models")
MODELS = {model[0]: model for model in models.models()}


@pytest.mark.parametrize("page", models.PAGES)
def test_a_page_is_up_to_date(page):
    text = (DOCS / "models" / f"{page}.md").read_text(encoding="utf-8")
    assert text == models.pages()[page], "run: python tools/models.py --write --pictures"


def test_every_model_has_its_picture():
    assert {path.stem for path in (DOCS / "models").glob("*.png") if path.stat().st_size > 5000} == set(MODELS)


def test_the_pictures_of_the_pages_are_drawn(tmp_path):
    sys.path.insert(0, str(TOOLS))
    try:
        from model_pictures import draw
    finally:
        sys.path.remove(str(TOOLS))
    for name, (_, kind, *_) in MODELS.items():
        draw(models.material_of_page(name, kind), kind, tmp_path / f"{name}.png")
        assert (tmp_path / f"{name}.png").stat().st_size > 5000, name


def cases(tmp_path, remembering):
    (tmp_path / models.TABLE).write_text((DOCS / "models" / models.TABLE).read_text())
    for name, (_, kind, *_) in MODELS.items():
        path = tmp_path / f"{name}.yaml"
        path.write_text(models.case_text(name, kind))
        # the default, but that lengths of a gas do not follow its density: that would be another loop
        settings = ["time.max_steps=10", "formulation={type: riemann, smoothing_length: {type: fixed}}"]
        case = load_case(path, settings, "0.4 mm")
        material = next(iter(case.bodies.values())).material
        burns = getattr(material.eos, "detonation", None) is not None
        if (burns or material_of(material, 1e5).has_history) == remembering:
            yield name, case


def check(found, tmp_path):
    for name, case in found:
        summary = run(case, tmp_path / f"run {name}", threads=1).summary
        assert summary["status"] == "done", name
        assert abs(summary["conservation"]["energy_drift"] or 0.0) < 1e-9, name


def test_the_cases_of_the_pages_run(tmp_path, monkeypatch):
    for module in (stepper, derived_fields):  # one loop for all models; test_materials_fitted has those of one case
        monkeypatch.setattr(module, "bind_models", lambda function, *_: function)
    check(cases(tmp_path, False), tmp_path)


@pytest.mark.slow
def test_the_cases_of_models_with_a_memory_run(tmp_path):
    check(cases(tmp_path, True), tmp_path)


def test_the_table_of_measured_shocks_has_every_material_that_has_some():
    """All rows by name, and two of them number by number: whole it takes ten seconds."""
    hugoniots = page_script("hugoniots")
    page = (DOCS / "materials.md").read_text(encoding="utf-8")
    table = page.split(hugoniots.BEGIN)[1].split(hugoniots.END)[0].strip()
    agree = table.split("|")[0].split("`")[1::2]
    differ = [line.split("`")[1] for line in table.splitlines() if line.startswith("| `")]
    measured = [name for name in material_names() for _ in library_of().notes(name).hugoniot_points]
    assert set(agree) | set(differ) == set(measured), "run: python tools/hugoniots.py --write"
    assert differ == [name for name in measured if name not in agree]
    for row in hugoniots.rows(["pmma-steinberg"]):
        assert row in table
    assert all(row.endswith("| yes |") for row in hugoniots.rows(["teflon"]))
