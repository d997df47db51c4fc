"""What is installed, and what the front door says: the wheel's content, README's commands and links."""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
import yaml

import hvisph
from hvisph.casefile.paths import data_folder
from hvisph.core.errors import HvisphError
from hvisph.geometry.shapes.mesh import load_mesh
from hvisph.output.foreign import read_vtk
from hvisph.sweeps.cluster import connect

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")] + sorted(ROOT.glob("docs/*.md"))
IGNORED = shutil.ignore_patterns(".*", "__pycache__", "runs", "build", "dist", "tests", "benchmarks")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel of this source tree, built from a copy: the tree itself is left alone."""
    folder = tmp_path_factory.mktemp("wheel")
    shutil.copytree(ROOT, folder / "source", ignore=IGNORED)
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=folder / "source", check=True, capture_output=True)
    (built,) = folder.glob("*.whl")
    return built


def test_an_sdist_builds_the_same_wheel(wheel, tmp_path):
    """An archive of the sources, unpacked elsewhere, installs what the repository installs, and can be cited."""
    build = [sys.executable, "-m", "hatchling", "build", "-d", str(tmp_path), "-t"]
    subprocess.run([*build, "sdist"], cwd=wheel.parent / "source", check=True, capture_output=True)
    shutil.unpack_archive(next(tmp_path.glob("*.tar.gz")), tmp_path / "unpacked", filter="data")
    (unpacked,) = (tmp_path / "unpacked").iterdir()
    subprocess.run([*build, "wheel"], cwd=unpacked, check=True, capture_output=True)
    with zipfile.ZipFile(wheel) as one, zipfile.ZipFile(next(tmp_path.glob("*.whl"))) as other:
        sums = [{file.filename: file.CRC for file in archive.infolist()} for archive in (one, other)]
    assert sums[0] == sums[1]
    assert (unpacked / "CITATION.cff").is_file()


def test_files_of_citation_agree_with_the_package():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (author,) = (author["name"] for author in project["authors"])
    cff = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    found = (cff["version"], cff["license"], [each["name"] for each in cff["authors"]])
    assert found == (hvisph.__version__, project["license"], [author])
    meta = json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))
    assert (meta["name"], meta["version"]) == (project["name"], hvisph.__version__)
    assert meta["license"].endswith("/" + project["license"])
    assert [each["name"] for each in meta["author"]] == [author]
    zenodo = json.loads((ROOT / ".zenodo.json").read_text(encoding="utf-8"))
    assert (zenodo["version"], zenodo["license"]) == (hvisph.__version__, project["license"])
    assert [each["name"] for each in zenodo["creators"]] == [author]


def test_the_conda_recipe_requires_what_the_package_requires():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    recipe = yaml.safe_load((ROOT / "packaging/conda/recipe.yaml").read_text(encoding="utf-8"))
    run = [line.replace(" ", "", 1) for line in recipe["requirements"]["run"]]
    plain = [line.replace("matplotlib-base", "matplotlib") for line in run if not line.startswith("python")]
    assert sorted(plain) == sorted(project["dependencies"])
    assert recipe["context"]["version"] == hvisph.__version__


@pytest.mark.parametrize(
    ("module", "extra", "call"),
    [
        ("trimesh", "mesh", lambda path: load_mesh(path)),
        ("pyvista", "foreign", lambda path: read_vtk(path)),
        ("distributed", "dask", lambda _: connect("tcp://127.0.0.1:1")),
    ],
)
def test_a_missing_extra_is_named_with_its_command(module, extra, call, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, module, None)
    (tmp_path / "file.vtk").write_text("# vtk DataFile Version 3.0\n", encoding="ascii")
    with pytest.raises(HvisphError, match=rf"pip install 'hvisph\[{extra}\]'"):
        call(tmp_path / "file.vtk")


def test_the_wheel_holds_cases_schemas_and_library(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    for kind, pattern in (("cases", "**/*.yaml"), ("schemas", "*.json")):
        files = {path.relative_to(ROOT).as_posix() for path in (ROOT / kind).glob(pattern)}
        assert files
        assert {f"hvisph/_data/{file}" for file in files} <= names
    modules = {path.relative_to(ROOT).as_posix() for path in (ROOT / "hvisph").rglob("*.py")}
    library = {path.relative_to(ROOT).as_posix() for path in (ROOT / "hvisph/case/library").glob("*.yaml")}
    assert library
    assert modules | library <= names
    assert not [name for name in names if name.startswith(("tests/", "benchmarks/"))]


def test_an_installed_package_runs_the_quickstart(wheel, tmp_path):
    """Without the repository: the first command of the README ends in a report on one screen, without a warning."""
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "installed")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "installed")}

    def python(*arguments):
        command = [sys.executable, *arguments]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True, env=environment)

    assert str(tmp_path) in python("-c", "import hvisph; print(hvisph.__file__)").stdout
    found = python("-m", "hvisph", "run", "quickstart")
    assert found.stderr == ""
    lines = found.stdout.splitlines()
    end = [line for line in lines if line.strip() and not line.lstrip()[:1].isdigit()]  # progress begins with a share
    assert len(end) <= 25
    assert "warning" not in found.stdout
    assert (tmp_path / "runs/quickstart/report.html").is_file()


def test_bundled_data_is_found_in_the_source_tree():
    assert (data_folder("cases") / "al_al.yaml").is_file()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", text):
        if not target.startswith(("http://", "https://")):
            assert (page.parent / target).exists(), target


@pytest.mark.parametrize("name", ["quickstart", "tests"])
def test_commands_of_the_readme_stand_alone(name):
    """`.ci/run` takes them from there by these markers."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (command,) = re.findall(rf"^<!-- command: {name} -->\n```sh\n(.+)\n```$", text, re.MULTILINE)
    assert command.startswith("python3 -m venv .venv && .venv/bin/pip install ")


def test_readme_speaks_of_what_there_is():
    """Every bundled case and every command is named."""
    from hvisph.casefile.paths import bundled_cases
    from hvisph.cli.main import COMMANDS

    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert not [name for name in bundled_cases() if "/" not in name and f"`{name}`" not in text]
    assert not [name for name in COMMANDS if name not in text]
