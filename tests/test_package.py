"""What is installed, and what the front door says: the wheel's content, README's commands and links."""

import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from hvisph.casefile.paths import data_folder

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")] + sorted(ROOT.glob("docs/*.md"))
IGNORED = shutil.ignore_patterns(".*", "__pycache__", "runs", "build", "dist", "tests", "benchmarks")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel of this source tree, built from a copy: the tree itself is left alone."""
    folder = tmp_path_factory.mktemp("wheel")
    shutil.copytree(ROOT, folder / "source", ignore=IGNORED)
    try:
        import hatchling  # noqa: F401 - at hand, it saves pip's fetching it

        command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    except ImportError:
        command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", str(folder), "."]
    subprocess.run(command, cwd=folder / "source", check=True, capture_output=True)
    (built,) = folder.glob("*.whl")
    return built


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


def test_an_installed_package_finds_its_cases(wheel, tmp_path):
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "installed")
    code = (
        "import sys; sys.path.insert(0, 'installed'); import hvisph; assert 'installed' in hvisph.__file__; "
        "print(hvisph.load_case('al_al').title)"
    )
    found = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True, env={}
    )
    assert "Aluminium cylinder" in found.stdout


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
    from hvisph.cli.main import app

    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert not [name for name in bundled_cases() if "/" not in name and f"`{name}`" not in text]
    commands = [command.callback.__name__.replace("_", "-") for command in app.registered_commands]
    assert not [name for name in commands if f"{name}" not in text]
