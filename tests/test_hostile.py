"""Whatever the input: a message that says what is wrong, the right exit code, soon, and nothing half done."""

import random
import shutil
import time

import pytest
from hostile import GOOD, MISTAKES, damaged, mutated
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small_runs import METAL, row_of
from typer.testing import CliRunner

from hvisph.cli.main import app
from hvisph.output.reader import list_snapshots
from hvisph.simulation.run import run

LONGEST = 60.0  # seconds: none may hang; each takes 0.2 s on a free machine


def call(*arguments):
    """Exit code, and what a command said, without a traceback and in time."""
    began = time.perf_counter()
    done = CliRunner().invoke(app, [str(argument) for argument in arguments])
    seconds = time.perf_counter() - began
    assert done.exception is None or isinstance(done.exception, SystemExit), repr(done.exception)
    assert "Traceback" not in done.output
    assert "bug in hvisph" not in done.output
    return done.exit_code, done.output, seconds


@pytest.fixture(scope="module", autouse=True)
def _warm(tmp_path_factory):
    """Import what the commands import, so that the clock is on the case alone."""
    path = tmp_path_factory.mktemp("warm") / "case.yaml"
    path.write_text(GOOD)
    assert call("check", path)[0] == 0


@pytest.mark.parametrize("name", MISTAKES)
def test_real_mistakes_are_refused_with_a_message(name, tmp_path):
    path = tmp_path / "case.yaml"
    path.write_bytes(MISTAKES[name])
    for arguments in (("check", path), ("run", path, "--out", tmp_path / "run")):
        code, said, seconds = call(*arguments)
        assert code == 2, said
        assert "error" in said
        assert len(said) < 6000
        assert seconds < LONGEST
    assert sorted(p.name for p in tmp_path.iterdir()) == ["case.yaml"]


def test_no_code_runs_from_a_case():
    import os

    assert not os.path.exists("/tmp/hvisph-was-here")


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.binary(max_size=200) | st.text(max_size=200).map(lambda text: text.encode("utf-8", "surrogatepass")))
def test_anything_at_all_is_refused(tmp_path_factory, content):
    check_refused_or_good(tmp_path_factory.mktemp("any") / "case.yaml", content)


@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.integers(0, 2**32))
def test_slips_of_the_pen_are_refused_or_harmless(tmp_path_factory, seed):
    content = mutated(GOOD, random.Random(seed)).encode("utf-8", "surrogatepass")
    check_refused_or_good(tmp_path_factory.mktemp("slip") / "case.yaml", content)


def check_refused_or_good(path, content):
    path.write_bytes(content)
    code, said, seconds = call("check", path)
    assert code in {0, 2}, said
    assert seconds < LONGEST
    shutil.rmtree(path.parent)


@pytest.mark.parametrize("override", ["", "=", "a", "time", "time.end", "time.end=", "time..end=1", ".=1", "time.end=[", "a" * 9999,
                                      "bodies.projectile=1", "time.end={{{", "time.end=*a", "\0=1", "time.end=nan"])  # fmt: skip
def test_bad_settings_are_refused(override, tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text(GOOD)
    assert call("check", path, f"--set={override}")[0] == 2


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A short run with two formats."""
    folder = tmp_path_factory.mktemp("finished") / "run"
    case = row_of([METAL, METAL], formulation={"type": "eulerian"}, time={"end": 3e-7},
                  output={"every": 1e-7, "formats": ["hdf5", "vtu"]})  # fmt: skip
    run(case, folder, threads=1)
    return folder


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("kind", ["snapshots/*.vtkhdf", "vtu/*.vtu"])
def test_damaged_snapshots_are_named(kind, seed, finished, tmp_path):
    rng = random.Random(seed)
    path = tmp_path / rng.choice(sorted(finished.glob(kind))).name
    original = next(finished.glob(f"*/{path.name}"))
    path.write_bytes(damaged(original.read_bytes(), rng))
    code, said, _ = call("measure", path)
    assert code == 3, said
    assert str(path) in "".join(said.splitlines())


@pytest.mark.parametrize("seed", range(6))
def test_a_run_with_a_damaged_file_is_measured_resumed_or_refused(seed, finished, tmp_path):
    rng = random.Random(seed)
    folder = shutil.copytree(finished, tmp_path / "run")
    path = rng.choice(sorted(p for p in folder.rglob("*") if p.is_file() and p.stat().st_size))
    path.write_bytes(damaged(path.read_bytes(), rng))
    for arguments in (
        ("measure", folder),
        ("resume", folder, "--threads", "1"),
        ("compare", folder, finished),
    ):
        code, said, _ = call(*arguments)
        assert code in {0, 1, 2, 3}
        if code >= 2:
            assert "error" in said


@pytest.mark.parametrize("arguments", [("measure",), ("resume",)])
@pytest.mark.parametrize("what", ["nothing", "empty", "foreign", "folder_of_files"])
def test_what_is_no_run_is_said_to_be_none(what, arguments, tmp_path):
    path = tmp_path / "x"
    if what == "empty":
        path.mkdir()
    elif what == "foreign":
        path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(500))
    elif what == "folder_of_files":
        path.mkdir()
        (path / "case.yaml").write_text(GOOD)
    code, said, _ = call(*arguments, path)
    assert code in {2, 3}
    assert "error" in said
    assert "x" in said


def test_the_readers_of_a_whole_run_find_nothing_wrong(finished):
    assert call("measure", finished)[0] in {0, 1}
    assert len(list_snapshots(finished)) == 4


@pytest.mark.parametrize(("kept", "code", "said"), [
    (slice(0, 1), 0, "report.html"), (slice(1, None), 3, "no column 'time'"),
], ids=["no lines", "no header"])  # fmt: skip
def test_the_report_of_a_history_that_lacks_lines_is_made_or_refused(kept, code, said, finished, tmp_path):
    folder = shutil.copytree(finished, tmp_path / "run")
    lines = (folder / "history.csv").read_text().splitlines(keepends=True)
    (folder / "history.csv").write_text("".join(lines[kept]))
    found, text, _ = call("report", folder)
    assert found == code, text
    assert said in "".join(text.split("\n"))
