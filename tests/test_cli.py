"""The commands as a user meets them: what they print, what they write, how they end."""

import json
import os
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest
from typer.testing import CliRunner

import hvisph
from hvisph.casefile.loader import load_case
from hvisph.casefile.paths import bundled_cases, data_folder
from hvisph.cli.commands.doctor import common_cases
from hvisph.cli.main import app
from hvisph.compiler.jit import report_compilation
from hvisph.precheck.estimate import INTERPRETER
from hvisph.setup.build import build

COMMANDS = ("run", "resume", "check", "measure", "cases", "materials", "help", "schema", "doctor")


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    """Work in an empty folder, so that anything written shows."""
    monkeypatch.chdir(tmp_path)


def call(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def in_new_process(code):
    environment = os.environ | {"PYTHONPATH": str(Path(hvisph.__file__).parents[1])}
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)


def test_help_names_every_command():
    found = call("--help")
    assert found.exit_code == 0
    for command in COMMANDS:
        assert f"\n  {command} " in found.stdout
        assert call(command, "--help").exit_code == 0


def test_help_is_light():
    heavy = ("numba", "numpy", "pydantic", "yaml", "rich", "h5py", "scipy", "psutil")
    code = (
        "import sys\nfrom typer.testing import CliRunner\nbefore = set(sys.modules)\n"
        "from hvisph.cli.main import app\nassert CliRunner().invoke(app, ['--help']).exit_code == 0\n"
        f"print([name for name in {heavy!r} if name in set(sys.modules) - before])"
    )
    assert in_new_process(code).stdout.strip() == "[]"


@pytest.mark.parametrize("case", ["al_al", "sphere_on_plate", "al_al_coarse"])
def test_check_loads_no_compiler(case):
    code = (
        "import sys\nfrom typer.testing import CliRunner\nfrom hvisph.cli.main import app\n"
        f"assert CliRunner().invoke(app, ['check', {case!r}]).exit_code == 0\n"
        "print(sorted({'numba', 'pint', 'matplotlib', 'scipy.spatial', 'rich', 'meshio'} & set(sys.modules)))"
    )
    assert in_new_process(code).stdout.strip() == "[]"


AS_MODULE = "import runpy; runpy.run_module('hvisph', run_name='__main__')"


def test_version_and_module():
    assert call("--version").stdout == f"hvisph {hvisph.__version__}\n"
    found = in_new_process(f"import sys; sys.argv = ['hvisph', '--version']; {AS_MODULE}")
    assert found.stdout == f"hvisph {hvisph.__version__}\n"


def test_an_interrupt_while_the_command_is_loaded_shows_no_traceback(tmp_path):
    (tmp_path / "typer.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGINT)\n")
    found = in_new_process(f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {AS_MODULE}")
    assert (found.returncode, found.stdout, found.stderr) == (130, "", "interrupted\n")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["rnu"], ["rnu", "run"]),
        (["run"], ["CASE"]),
        (["run", "al_al", "--reslution", "1"], ["--reslution", "--resolution"]),
        (["run", "al_al", "--threads", "0"], ["--threads", "1"]),
        (["run", "no_such_case"], ["no_such_case"]),
        (["run", "quickstrat"], ["quickstart"]),
        (["run", "al_al", "--resolution", "1 kg"], ["--resolution", "1 kg", "length"]),
        (["run", "al_al", "--set", "time.ned=1us"], ["time.ned", "end"]),
        (
            ["run", "al_al", "--set", "bodies.target.material=alumnium"],
            ["bodies.target.material", "aluminium"],
        ),
        (["check", "al_al", "--resolution", "-1 mm"], ["resolution", "above 0"]),
        (["measure", "nothing_here"], ["nothing_here"]),
        (["resume", "nothing_here"], ["nothing_here"]),
        (["cases", "al_all"], ["al_al"]),
        (["materials", "coper-ofhc"], ["copper-ofhc"]),
        (["schema", "cases"], ["case"]),
        (["help", "time.clf"], ["cfl"]),
    ],
)
def test_bad_input_is_one_message_and_code_2(arguments, words):
    found = call(*arguments)
    assert found.exit_code == 2
    assert found.stdout == ""
    for word in words:
        assert word in found.stderr
    assert "Traceback" not in found.stderr
    assert list(Path().iterdir()) == []


def test_an_unexpected_error_is_a_bug_and_no_traceback(monkeypatch):
    def broken(path):
        raise ZeroDivisionError("by nothing\nin detail")

    monkeypatch.setattr("hvisph.cli.commands.library.explain", broken)
    monkeypatch.delenv("HVISPH_DEBUG", raising=False)
    found = call("help", "time")
    assert found.exit_code == 3
    assert "ZeroDivisionError: by nothing" in found.stderr
    assert "report" in found.stderr
    assert "in detail" not in found.stderr
    monkeypatch.setenv("HVISPH_DEBUG", "1")
    assert isinstance(call("help", "time").exception, ZeroDivisionError)


def test_cases_lists_prints_and_copies():
    listed = call("cases").stdout
    assert [line.split()[0] for line in listed.splitlines() if line[0] != " "] == list(bundled_cases())
    assert "SAV1 with mixed correction and artificial stress" in " ".join(listed.split())  # on two lines
    assert {entry["name"] for entry in json.loads(call("cases", "--json").stdout)} == set(bundled_cases())
    assert call("cases", "al_al").stdout == bundled_cases()["al_al"].read_text(encoding="utf-8")
    assert call("cases", "al_al", "--copy", "mine").exit_code == 0
    copied = Path("mine/al_al.yaml")
    assert copied.read_bytes() == bundled_cases()["al_al"].read_bytes()
    copied.write_text("changed")
    again = call("cases", "--copy", "mine")
    assert again.exit_code == 2
    assert copied.read_text() == "changed"
    assert list(Path("mine").iterdir()) == [copied]


def test_materials():
    assert "copper-ofhc" in call("materials").stdout
    found = json.loads(call("materials", "aluminium-howell-ball", "--json").stdout)
    assert found["density"] == 2785.0
    assert found["eos"]["type"] == "stiffened_gas"
    assert "source:" in call("materials", "aluminium-howell-ball").stdout
    assert len(json.loads(call("materials", "--json").stdout)) == len(call("materials").stdout.splitlines()) - 1


def test_schemas_are_those_of_the_package():
    for name in ("case", "summary"):
        text = (data_folder("schemas") / f"{name}.schema.json").read_text(encoding="utf-8")
        assert call("schema", name).stdout == text
    assert call("schema").stdout == call("schema", "case").stdout
    assert call("schema", "--write", "here").exit_code == 0
    assert sorted(path.name for path in Path("here").iterdir()) == [
        "case.schema.json",
        "summary.schema.json",
        "sweep.schema.json",
    ]
    jsonschema.Draft202012Validator.check_schema(json.loads(call("schema", "summary").stdout))


def test_help_describes_a_key():
    found = call("help", "time.cfl").stdout
    assert "0.3" in found
    assert "Courant" in found
    assert "bodies" in call("help", "case").stdout
    assert "diameter: " in call("help", "bodies.b.shape.disc").stdout  # a type by its name
    assert call("help", "formulation.riemann.variant").stdout == call("help", "formulation.variant").stdout


def test_doctor_compiles_cases_that_can_be_built():
    for title, case in common_cases():
        assert build(load_case(case)).particles.count > 0, title


def test_doctor_tries_a_compiled_loop():
    found = json.loads(call("doctor", "--json").stdout)
    assert found["self_test"]["passed"]
    assert found["cache_writable"]
    assert found["threads"] >= 1
    assert "self test" in call("doctor").stdout


def test_doctor_tells_a_broken_machine(monkeypatch):
    broken = {"passed": False, "reason": "wrong", "cached": False, "seconds": 0.0, "threads": 1}
    monkeypatch.setattr("hvisph.cli.commands.doctor.self_test", lambda: broken)
    found = call("doctor")
    assert found.exit_code == 3
    assert "FAILED: wrong" in found.stdout


def test_check_says_what_a_case_is():
    heard = []
    with report_compilation(heard.append):
        found = call("check", "al_al")
    assert found.exit_code == 0
    assert heard == []
    assert list(Path().iterdir()) == []
    text = " ".join(found.stdout.split())
    # counts of the published arrangements; p = rho0 U u of the stiffened gas at u = 1550 m/s
    for words in (
        "7830, 100 across",
        "10020",
        "28.56 GPa",
        "1.55 km/s",
        "17850",
        "9 snapshots",
        "crater_diameter",
    ):
        assert words in text


def test_check_for_programs():
    found = json.loads(call("check", "steel_al", "--threads", 1, "--json").stdout)
    assert found["particles"] == 17850
    assert [body["across"] for body in found["bodies"]] == [100, 501]
    assert found["threads"] == 1
    shock = found["plane_shock"]
    # both sides of the interface: one pressure, velocities that add up to the impact's
    assert shock["projectile"]["pressure"] == pytest.approx(shock["target"]["pressure"], rel=1e-9)
    both = shock["projectile"]["particle_velocity"] + shock["target"]["particle_velocity"]
    assert both == pytest.approx(3100.0, rel=1e-12)


def test_check_without_an_impact_says_why():
    found = json.loads(call("check", "al_al", "--set", "bodies.projectile.velocity=[0, 0]", "--json").stdout)
    assert "approach" in found["plane_shock"]["reason"]


@pytest.mark.parametrize("command", ["check", "run"])
def test_overlapping_bodies_are_refused_by_file_and_line(command):
    text = bundled_cases()["al_al_coarse"].read_text(encoding="utf-8")
    text = text.replace("    arrangement:", "    position: [0, 0]\n    arrangement:")
    text = text.replace("  target:\n", "  target:\n    position: [3 mm, 0]\n")
    Path("mine.yaml").write_text(text, encoding="utf-8")
    line = text.splitlines().index("  projectile:") + 1
    found = call(command, "mine.yaml")
    assert found.exit_code == 2
    assert "overlaps 'target'" in found.stderr
    assert f"(mine.yaml, line {line})" in found.stderr
    assert [path.name for path in Path().iterdir()] == ["mine.yaml"]


@pytest.mark.parametrize("command", ["check", "run"])
def test_more_memory_than_there_is(command, monkeypatch):
    monkeypatch.setattr("hvisph.precheck.estimate.free_memory", lambda: 1.02 * INTERPRETER)
    found = call(command, "al_al")
    assert found.exit_code == 2
    assert "GB of memory" in found.stderr
    assert "resolution" in found.stderr
    assert list(Path().iterdir()) == []


def test_a_hundred_million_particles_are_not_made_to_be_counted(monkeypatch):
    monkeypatch.setattr("hvisph.precheck.estimate.free_memory", lambda: 1e12)
    monkeypatch.delattr("hvisph.setup.bodies.fill")  # what would make them
    found = json.loads(call("check", "al_al", "--resolution", "1.2 um", "--json").stdout)
    assert not found["counted"]
    # the estimate by volume against the disc and the plate themselves
    assert found["particles"] == pytest.approx((78.54 + 100.2) / 1.2e-3**2, rel=1e-3)


def test_output_that_nobody_reads_is_no_error():
    script = f"{sys.executable} -m hvisph materials | head -1; exit ${{PIPESTATUS[0]}}"
    environment = os.environ | {"PYTHONPATH": str(Path(hvisph.__file__).parents[1])}
    found = subprocess.run(["bash", "-c", script], capture_output=True, text=True, env=environment, check=False)
    assert found.returncode == 0
    assert found.stderr == ""
