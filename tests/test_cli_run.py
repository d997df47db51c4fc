"""`hvisph run` and what follows it: the terminal, the folder, the exit codes, interruption."""

import csv
import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import jsonschema
import pytest
from rich.console import Console
from typer.testing import CliRunner

import hvisph
from hvisph.casefile.loader import load_case
from hvisph.casefile.paths import bundled_cases, data_folder
from hvisph.cli import guard
from hvisph.cli.formatting import duration, quantity, size, table
from hvisph.cli.main import app
from hvisph.cli.options import run_folder
from hvisph.cli.results_table import results_table
from hvisph.cli.run_report import BarListener, status_text, time_left
from hvisph.precheck.estimate import estimate
from hvisph.simulation.listener import Progress

# A 1D impact of 200 particles, just long enough for a plateau behind the shocks; one thread, as there is
# no work for two.
SHORT = ("--resolution", "0.1mm", "--set", "time.end=0.5us", "--set", "output.every=0.1us", "--threads", "1")
QUICK = ("plate_impact_al_al", *SHORT)
SUMMARY = jsonschema.Draft202012Validator(
    json.loads((data_folder("schemas") / "summary.schema.json").read_text(encoding="utf-8"))
)
PROGRESS = Progress(2e-6, 8e-6, 300, 6.5e-9, "signal", "projectile", 1.5, 200.0, -3.1e-15)


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def call(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """A finished run, its folder and what it printed."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    return SimpleNamespace(folder=folder, found=call("run", *QUICK, "--out", folder))


def test_a_run_tells_how_it_went(ran):
    assert ran.found.exit_code == 0, ran.found.stderr
    text = ran.found.stdout
    for words in (
        "Plane impact of aluminium",
        "200 particles",
        "t = 0.5 us",
        "plateau stress",
        "28.65",
        "ok",
    ):
        assert words in text
    assert len(text.splitlines()) <= 25  # one screen
    everything = call("resume", ran.folder, "--all").stdout
    assert "jump conditions" in " ".join(everything.split())  # the source of the expected value, on whichever lines
    assert "Done after" in text
    assert str(ran.folder) in text
    assert "\x1b" not in text  # no colours outside a terminal
    assert ran.found.stderr == ""


def test_a_run_leaves_what_it_promises(ran):
    summary = json.loads((ran.folder / "summary.json").read_text(encoding="utf-8"))
    SUMMARY.validate(summary)
    assert summary["particles"] == 200
    assert summary["status"] == "done"
    assert [entry["name"] for entry in summary["expected"]] == ["plateau_stress", "interface_velocity"]
    assert len(list((ran.folder / "snapshots").glob("*.vtkhdf"))) == 6
    assert load_case(ran.folder / "case.yaml").resolution == 1e-4


def test_the_estimate_of_steps_is_near(ran):
    case = load_case(ran.folder / "case.yaml")
    with (ran.folder / "history.csv").open(encoding="utf-8") as file:
        steps = int(list(csv.DictReader(file))[-1]["step"])
    assert estimate(case).steps == pytest.approx(steps, rel=0.3)  # to tell a minute from a day


def test_an_earlier_run_is_kept_unless_forced(ran):
    before = (ran.folder / "summary.json").read_bytes()
    refused = call("run", *QUICK, "--out", ran.folder, "--set", "title=again")
    assert refused.exit_code == 2
    assert "--force" in refused.stderr
    assert (ran.folder / "summary.json").read_bytes() == before


def test_force_replaces_and_json_is_alone_on_standard_output():
    first = call("run", *QUICK, "--quiet")
    assert (first.exit_code, first.stdout, first.stderr) == (0, "", "")
    assert [path.name for path in Path().iterdir()] == ["runs"]
    second = call("run", *QUICK, "--set", "title=again", "--force", "--json")
    summary = json.loads(second.stdout)
    SUMMARY.validate(summary)
    assert summary["title"] == "again"
    written = Path("runs/plate_impact_al_al/summary.json").read_text(encoding="utf-8")
    assert json.loads(written) == summary


def test_a_missed_expectation_is_code_1():
    expected = "expected.plateau_stress={value: 20 GPa, tolerance: 1 %, source: a test}"
    found = call("run", *QUICK, "--set", expected)
    assert found.exit_code == 1
    assert "MISSED" in found.stdout
    assert "Not as expected: plateau_stress" in found.stdout


def test_a_failed_run_is_code_3_with_a_post_mortem():
    found = call("run", *QUICK, "--set", "time.step=0.05us", "--out", "failed")
    assert found.exit_code == 3
    assert "the run failed" in found.stderr
    assert "particle" in found.stderr
    assert "time.cfl" in found.stderr
    assert "Traceback" not in found.stderr
    summary = json.loads(Path("failed/summary.json").read_text(encoding="utf-8"))
    SUMMARY.validate(summary)
    assert summary["status"] == "failed"
    assert summary["failure"]["body"] in ("projectile", "target")
    assert Path("failed/snapshots/post_mortem.vtkhdf").exists()


def test_a_folder_that_cannot_be_used():
    Path("file").write_text("mine")
    found = call("run", *QUICK, "--out", "file")
    assert found.exit_code == 2
    assert Path("file").read_text() == "mine"
    assert call("run", *QUICK, "--threads", 4096).exit_code == 2


def test_an_interrupt_ends_cleanly_with_code_130(tmp_path):
    arguments = (
        "-m",
        "hvisph",
        "run",
        *QUICK,
        "--set",
        "time.end=1s",
        "--set",
        "output.every=1s",
        "--out",
        "long",
    )
    environment = os.environ | {"PYTHONPATH": str(Path(hvisph.__file__).parents[1]), "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(
        [sys.executable, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    )
    deadline = time.monotonic() + 60.0
    while not (tmp_path / "long/history.csv").exists() and time.monotonic() < deadline:
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.05)
    time.sleep(0.3)  # into the steps
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Interrupted after" in out
    assert "Traceback" not in err
    summary = json.loads((tmp_path / "long/summary.json").read_text(encoding="utf-8"))
    SUMMARY.validate(summary)
    assert summary["status"] == "interrupted"


def test_a_run_goes_on():
    stopped = call("run", *QUICK, "--set", "time.max_steps=20", "--out", "run")
    assert "after 20 steps" in stopped.stdout
    found = call("resume", "run", "--max-steps", 0, "--threads", 1, "--json")
    assert found.exit_code == 0, found.stderr
    SUMMARY.validate(json.loads(found.stdout))
    assert json.loads(found.stdout)["end_time"] == pytest.approx(5e-7, rel=1e-12)


@pytest.mark.parametrize(
    ("case", "folder"),
    [("al_al", "runs/al_al"), ("some/where/mine.yaml", "runs/mine"), ("al_al.yaml", "runs/al_al")],
)
def test_the_folder_of_a_run(case, folder):
    assert run_folder(case) == Path(folder)


def test_bundled_cases_of_one_name_have_folders_of_their_own():
    folders = [run_folder(name) for name in bundled_cases()]
    assert len(set(folders)) == len(folders)


def test_an_interrupt_lost_in_a_callback_is_raised_again():
    with guard.noted_interrupts():
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)  # caught here, as llvmlite's callbacks do
        with pytest.raises(KeyboardInterrupt):
            guard.raise_noted()
        guard.raise_noted()  # once is enough
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_measure_again(ran):
    found = call("measure", ran.folder)
    assert found.exit_code == 0
    assert "t = 0.5 us" in found.stdout
    assert "28.65" in found.stdout  # what the run's case expects
    plain = json.loads(call("measure", ran.folder, "--json").stdout)
    summary = json.loads((ran.folder / "summary.json").read_text(encoding="utf-8"))
    assert plain["measures"]["plateau_stress"] == summary["measures"]["plateau_stress"]


def test_measure_at_a_time_and_at_all(ran):
    assert json.loads(call("measure", ran.folder, "--at", "0.21 us", "--json").stdout)["time"] == 2e-7
    assert json.loads(call("measure", ran.folder, "--at", "2.1e-7", "--json").stdout)["time"] == 2e-7
    assert len(json.loads(call("measure", ran.folder, "--at", "all", "--json").stdout)["series"]) == 6
    text = call("measure", ran.folder, "--at", "all").stdout
    assert "0.3 us" in text
    assert "GPa" in text
    assert call("measure", ran.folder, "--at", "4 mm").exit_code == 2
    assert call("measure", ran.folder / "snapshots/000005.vtkhdf").exit_code == 0


def test_measure_does_not_need_a_case_that_can_be_read(ran, tmp_path):
    (tmp_path / "copy").mkdir()
    (tmp_path / "copy/000005.vtkhdf").write_bytes((ran.folder / "snapshots/000005.vtkhdf").read_bytes())
    (tmp_path / "copy/case.yaml").write_text("from: the future")
    assert call("measure", tmp_path / "copy").exit_code == 0


def test_the_live_display_shows_what_it_must():
    screen = io.StringIO()
    live = BarListener(
        SimpleNamespace(title="An impact", units="si"), Console(file=screen, width=80, color_system=None)
    )
    live.opening()
    live.compiling("sweep_0123")
    live.start(Path("runs/x"), 1234, 8e-6)
    live.progress(PROGRESS)
    live.close()
    assert "An impact" in screen.getvalue()
    assert "1234 particles to t = 8 us" in screen.getvalue()
    drawn = io.StringIO()
    Console(file=drawn, width=80).print(live.drawing(PROGRESS))
    lines = drawn.getvalue().splitlines()
    assert len(lines) == 2
    for words in (
        "25%",
        "t = 2 us of 8 us",
        "1.5 s",
        "4.5 s left",
        "6.5 ns",
        "signal",
        "projectile",
        "200 steps/s",
    ):
        assert words in drawn.getvalue()
    assert "energy drift -3.1e-13 %" in lines[1]


def test_lines_say_where_a_run_is():
    text = status_text(PROGRESS, "s")
    for words in ("t = 2 us", "step 300", "dt = 6.5 ns, limited by signal in projectile", "-3.1e-13 %", "4.5 s left"):
        assert words in text
    assert time_left(PROGRESS) == pytest.approx(4.5)


def test_the_table_of_results():
    measures = {
        "penetration": {"value": 0.02, "unit": "m", "uncertainty": 0.0001},
        "extension": {"value": None, "unit": "m", "uncertainty": None, "reason": "no main body"},
        "void_fraction": {"value": None, "unit": "", "uncertainty": None, "reason": "3D"},
    }
    expected = [
        {
            "name": "penetration",
            "value": 0.02,
            "expected": 0.019,
            "tolerance": 0.001,
            "source": "A",
            "passed": True,
        },
        {
            "name": "extension",
            "value": None,
            "expected": 0.007,
            "tolerance": 0.001,
            "source": "B",
            "passed": False,
        },
    ]
    lines = results_table(measures, expected).splitlines()
    assert len(lines) == 3  # what has no value and is not expected is not shown
    assert "2.00 ± 0.01 cm" in lines[1]
    assert " ok " in lines[1]
    assert "MISSED" in lines[2]
    assert "no main body; B" in lines[2]


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (1e-4, "m", "0.1 mm"),
        (1.4e-4, "m", "0.14 mm"),
        (3100.0, "m/s", "3.1 km/s"),
        (28.56e9, "Pa", "28.56 GPa"),
        (8e-6, "s", "8 us"),
        (0.0, "s", "0 s"),
        (-2e-3, "m", "-2 mm"),
        (5e-7, "s", "0.5 us"),
        (0.05, "", "0.05"),
        (float("nan"), "Pa", "nan Pa"),
    ],
)
def test_quantities(value, unit, text):
    assert quantity(value, unit) == text


def test_words():
    assert [duration(s) for s in (0.04, 9.9, 42.4, 125.0, 7260.0, 2 * 86400 + 3 * 3600)] == [
        *("0.0 s", "9.9 s", "42 s", "2 min 5 s", "2 h 1 min", "2 d 3 h")
    ]
    assert [size(n) for n in (12, 1200, 262e6, 1.25e11)] == ["12 B", "1.2 kB", "262 MB", "125 GB"]
    assert table([("a", "bb", ""), ("ccc", "d", "")], indent=1) == " a    bb\n ccc  d"


def test_fragments_of_a_run(ran, tmp_path):
    found = call("measure", ran.folder, "--fragments")
    assert found.exit_code == 0
    assert "projectile: 1 fragment of 100 particles" in found.stdout
    assert "main body" in found.stdout
    assert "kg/m^2" in found.stdout
    plain = json.loads(call("measure", ran.folder, "--fragments", "--json").stdout)
    assert [body["number"] for body in plain["bodies"]] == [1, 1]
    whole = call("measure", ran.folder, "--fragments", "--at", "all", "--csv", tmp_path / "pieces.csv")
    assert whole.stdout.rstrip().endswith("pieces.csv")
    with (tmp_path / "pieces.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 12
    assert {row["body"] for row in rows} == {"projectile", "target"}
    summed = call("measure", ran.folder, "--fragments", "--smallest", "200").stdout
    assert "1 of fewer than 200 particles: 100 particles" in summed


def test_histories_of_a_run(ran, tmp_path):
    found = call("measure", ran.folder, "--csv", tmp_path / "all.csv", "--plot", tmp_path / "all.png")
    assert found.exit_code == 0
    with (tmp_path / "all.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    series = json.loads(call("measure", ran.folder, "--at", "all", "--json").stdout)["series"]
    assert [float(row["time [s]"]) for row in rows] == [moment["time"] for moment in series]
    for row, moment in zip(rows, series, strict=True):
        value = moment["measures"]["interface_velocity"]["value"]
        assert row["interface_velocity [m/s]"] == ("" if value is None else repr(value))
    assert (tmp_path / "all.png").stat().st_size > 10000


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--smallest", "3"), "--fragments"),
        (("--plot", "a.png", "--fragments"), "picture"),
        (("--plot", "a.png", "--at", "0.2us"), "all moments"),
        (("--csv", "nowhere/a.csv"), "cannot write"),
        (("--plot", "a.txt"), "stored as"),
    ],
)
def test_options_of_measure_that_do_not_go(ran, options, words):
    found = call("measure", ran.folder, *options)
    assert found.exit_code in (2, 3)
    assert words in found.output
