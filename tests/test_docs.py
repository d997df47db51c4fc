"""The documentation: pages made from the code are up to date, examples load and run, links lead somewhere."""

import importlib
import importlib.util
import re
from pathlib import Path

import pytest
import yaml
from test_architecture import REPLACED

from hvisph.case.case import Case
from hvisph.case.formulations.eulerian import EulerianFormulation
from hvisph.case.materials.material import Material
from hvisph.case.sweep import Sweep
from hvisph.casefile.loader import load_case
from hvisph.casefile.material_library import library_of, material_names
from hvisph.casefile.model_fields import spot_of
from hvisph.core.catalogues import REACH
from hvisph.sweeps.plan import load_plan

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
MOST_LINES = 3780  # of the prose documentation: all pages but those made from code and results
MOST_LINES_OF_ALL = 5470  # of all pages of docs/
GENERATED = ("case-file/", "models/", "commands.md", "verification.md", "validation.md")
PAGES = sorted(path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md"))
PROSE = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(DOCS / page for page in PAGES)]
LINK = re.compile(r"\]\((?!https?:|#)([^)#\s]+)")
BLOCK = re.compile(r"```(\w+)\n(.*?)```", re.DOTALL)


def count_lines(page):
    return len(page.read_text(encoding="utf-8").splitlines())


def blocks(page, language):
    """The code blocks of a page in a language."""
    return [text for kind, text in BLOCK.findall((DOCS / page).read_text(encoding="utf-8")) if kind == language]


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page):
    text = (DOCS / page).read_text(encoding="utf-8")
    assert not [link for link in LINK.findall(text) if not (DOCS / page).parent.joinpath(link).exists()]


def test_every_page_is_in_the_site():
    site = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    assert not [page for page in PAGES if page not in site]


def test_the_page_of_commands_is_up_to_date():
    spec = importlib.util.spec_from_file_location("commands", ROOT / "tools" / "commands.py")
    commands = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(commands)
    assert commands.PAGE.read_text(encoding="utf-8") == commands.text(), "run: python tools/commands.py --write"
    assert commands.INDEX.read_text(encoding="utf-8") == commands.index(), "run: python tools/commands.py --write"
    assert commands.HELP.read_text(encoding="utf-8") == commands.help_texts(), "run: python tools/commands.py --write"


def test_commands_of_the_pages_exist():
    known = set(
        re.findall(r"^\| \*\*`hvisph ([\w-]+)", (DOCS / "commands.md").read_text(encoding="utf-8"), re.MULTILINE)
    )
    named = {
        word
        for page in PAGES
        if page.startswith(("start/", "howto/"))
        for text in blocks(page, "sh")
        for word in re.findall(r"^hvisph ([\w-]+)", text, re.MULTILINE)
    }
    assert named
    assert named <= known


@pytest.mark.parametrize("page", ["gallery.md", "layered/README.md", "start/tutorial.md"])
def test_folders_of_runs_are_those_that_the_commands_write(page):
    text = (DOCS / page).read_text(encoding="utf-8")
    ran = {name.removesuffix(".yaml") for name in re.findall(r"hvisph\s+run\s+([\w./]+)", text)}
    assert ran >= set(re.findall(r"(?:plot|gauges|report)\s+runs/([\w/]+)", text)) > set()


def tags(annotation):
    """The values of `type` that may stand somewhere."""
    return set(spot_of(annotation).models)


def test_theory_has_a_word_on_every_model():
    text = "".join(
        (DOCS / page).read_text(encoding="utf-8")
        for page in PAGES
        if page.startswith(("theory/", "formulations/", "models/"))
    )
    of_case, of_material = Case.model_fields, Material.model_fields
    wanted = tags(of_case["formulation"].annotation) | set(REACH) | {"leapfrog", "predictor_corrector", "staggered"}
    for part in ("eos", "strength", "damage"):
        wanted |= tags(of_material[part].annotation)
    for part in ("contact", "correction", "viscosity"):
        wanted |= tags(EulerianFormulation.model_fields[part].annotation)
    unsaid = {
        tag
        for tag in wanted - {"none", "monaghan", "elastic"}
        if not any(form in text for form in (f"`{tag}`", f"type: {tag}", f"## {tag}\n"))
    }
    assert not unsaid


def test_constants_of_the_default_scheme_are_those_of_the_code():
    page = (DOCS / "theory" / "default-scheme.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`[A-Z_`,; ]+`) \| `([a-z_.]+)` \| ([^|]+) \|", page, re.MULTILINE)
    assert len(rows) > 20
    for names, module, values in rows:
        found = [getattr(importlib.import_module(f"hvisph.{module}"), name) for name in re.findall(r"\w+", names)]
        assert found == [float(value) for value in re.split(r"[,;] ", values)], names


@pytest.mark.parametrize("page", PROSE, ids=lambda page: page.name)
def test_pages_use_the_terms_of_the_glossary(page):
    assert not REPLACED.findall(" ".join(page.read_text(encoding="utf-8").lower().split()))


@pytest.mark.parametrize("page", PROSE, ids=lambda page: page.name)
def test_rows_of_a_table_have_as_many_cells(page):
    """A bar within a cell, in code too, begins another one."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    for table in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
        assert len({len(re.findall(r"(?<!\\)\|", row)) for row in table.splitlines()}) == 1, table.splitlines()[0]


@pytest.mark.parametrize("page", PROSE, ids=lambda page: page.name)
def test_lines_of_prose_are_short(page):
    """100 characters at most, apart from tables, pictures, formulas, code and links that cannot be broken."""
    text = re.sub(r"```.*?```|\$\$.*?\$\$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    lines = [line for line in text.splitlines() if len(line) > 100 and not line.lstrip().startswith(("|", "!"))]
    assert not [line for line in lines if " " in line[2:].strip()]


def test_the_documentation_stays_short():
    """A budget of lines: what is added has to say something that no other page does."""
    written = [
        page for page in PROSE if not page.relative_to(ROOT).as_posix().removeprefix("docs/").startswith(GENERATED)
    ]
    assert sum(map(count_lines, written)) <= MOST_LINES
    assert sum(count_lines(DOCS / page) for page in PAGES) <= MOST_LINES_OF_ALL


def test_messages_of_the_page_on_errors_are_in_the_code():
    source = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "hvisph").rglob("*.py"))
    source = re.sub(r'"\s*\n\s*f?"', "", source)  # texts of several lines
    source += (ROOT / "hvisph" / "precheck" / "advice.toml").read_text(encoding="utf-8").replace(" \\\n  ", " ")
    page = (DOCS / "troubleshooting.md").read_text(encoding="utf-8")
    quoted = re.findall(r'^\|.*?"([^"|]+)"', page, re.MULTILINE)
    assert len(quoted) > 20
    assert not [text for text in quoted if text not in source]


def examples():
    """Page and number of every YAML example of the pages for users."""
    return [(page, k) for page in PAGES if page.startswith("howto/") for k in range(len(blocks(page, "yaml")))]


@pytest.mark.parametrize(("page", "number"), examples())
def test_examples_load(page, number, tmp_path):
    content = yaml.safe_load(blocks(page, "yaml")[number])
    if content.get("vary", {}).get("type") == "grid":  # of the case above it
        (tmp_path / content["case"]).write_text(blocks(page, "yaml")[0], encoding="utf-8")
        assert len(load_plan(content | {"case": str(tmp_path / content["case"])}).first()) > 1
        return
    if "base" in content:  # the case above it
        (tmp_path / content["base"]).write_text(blocks(page, "yaml")[0], encoding="utf-8")
        load_case(content | {"base": str(tmp_path / content["base"])})
        return
    if content.get("vary", {}).get("type") == "fit":  # its tables are the reader's own
        Sweep.model_validate(content)
        return
    if "vary" in content:
        content["case"] = "al_al_coarse"
        load_plan(content | {"vary": content["vary"] | {"parameters": {"bodies.target.shape.size.0": ["2 mm"]}}})
        return
    if not {"bodies", "resolution", "time"} <= content.keys():  # a part of a case: laid over al_al_coarse
        content = {"base": "al_al_coarse", **content}
    load_case(content)


def test_the_case_of_the_readme_loads():
    (text,) = re.findall(r"```yaml\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    assert set(load_case(yaml.safe_load(text)).bodies) == {"projectile", "bumper"}


def test_the_python_of_the_interface_page_runs(tmp_path, monkeypatch):
    pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    space = {}
    for text in blocks("api.md", "python"):
        exec(text, space)
    assert space["figure"].axes


def test_the_notebook_runs(tmp_path):
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    notebook = nbformat.read(DOCS / "notebooks" / "first_look.ipynb", as_version=4)
    nbformat.validate(notebook)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert any("measure" in output.get("data", {}).get("text/html", "") for output in outputs)
    assert (tmp_path / "sweeps" / "first_look" / "table.csv").is_file()


def test_numbers_whose_source_was_not_opened_are_all_on_the_page():
    page = (DOCS / "materials.md").read_text(encoding="utf-8")
    numbers = {}
    for name in material_names():
        for source in library_of().notes(name).sources:
            if source.confidence.startswith("memory"):
                numbers.setdefault(name, []).extend(source.of)
    table = page.split("## Numbers not checked")[1]
    parts = {name: dict.fromkeys(one.split(".")[0] for one in of) for name, of in numbers.items()}
    listed = "; ".join(f"`{name}` ({', '.join(of)})" for name, of in parts.items())
    assert f"{listed}." in " ".join(table.split())
