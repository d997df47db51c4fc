"""Stopped, killed, out of space: nothing earlier is lost, and the run says how to go on."""

import ctypes
import os
import resource
import shutil
import signal
import subprocess
import sys
import time

import pytest
from small_runs import LIQUID, METAL, assert_same_results, row_of

from hvisph.casefile.loader import dump_case
from hvisph.cli.run_report import interrupt_notice
from hvisph.output.checkpoint_file import list_checkpoints, read_checkpoint
from hvisph.output.reader import list_snapshots, read_history, read_snapshot

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals and limits")


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """The file of a case of some seconds that writes on all schedules."""
    loaded = row_of(
        [METAL, LIQUID], formulation={"type": "eulerian"}, time={"end": 1.5e-5},
        output={"every": 3e-6, "formats": ["hdf5", "vtu"], "checkpoint_every": 0.05},
    )  # fmt: skip
    path = tmp_path_factory.mktemp("case") / "case.yaml"
    path.write_text(dump_case(loaded))
    return path


@pytest.fixture(scope="module")
def whole(case, tmp_path_factory):
    """The folder of the same run without a break."""
    folder = tmp_path_factory.mktemp("whole") / "run"
    assert command("run", case, "--out", folder).wait() == 0
    return folder


def command(*arguments, **further):
    """A process of the command `hvisph`."""
    line = [sys.executable, "-m", "hvisph", *map(str, arguments), "--threads", "1", "--quiet"]
    further = {"preexec_fn": heeding} | further
    return subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **further)


def heeding():
    """Heed a hang-up as usual, also where the tests themselves run under nohup."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def wait_for(process, condition, seconds=60.0):
    """Wait until `condition` holds."""
    until = time.monotonic() + seconds
    while not condition():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < until
        time.sleep(0.005)


def stepping(folder):
    """Whether a run has begun to step."""
    log = folder / "run.log"
    return lambda: log.is_file() and "ready after" in log.read_text()


def assert_all_whole(folder):
    """Every file that has its final name can be read."""
    for path in list_snapshots(folder):
        read_snapshot(path)
    for path in (folder / "vtu").glob("*.vtu"):
        read_snapshot(path)
    for path in list_checkpoints(folder / "checkpoint"):
        read_checkpoint(path)
    if (folder / "history.csv").is_file():
        read_history(folder)


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_a_signal_finishes_the_step_and_says_how_to_go_on(number, code, case, whole, tmp_path):
    folder = tmp_path / "run"
    process = command("run", case, "--out", folder)
    wait_for(process, stepping(folder))
    time.sleep(0.1)
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == code
    assert f"stopped by {number.name}; continue with: hvisph resume {folder}" in said
    assert_all_whole(folder)
    last = int(read_history(folder)["step"][-1])
    assert read_checkpoint(list_checkpoints(folder / "checkpoint")[0]).step == last
    assert command("resume", folder).wait() == 0
    assert_same_results(folder, whole)


@pytest.mark.parametrize("held", [(), ("checkpoint",), ("checkpoint", "summary")])
def test_a_run_that_is_interrupted_while_it_is_summed_up_says_how_to_go_on(held, tmp_path, capsys):
    (tmp_path / "checkpoint").mkdir()
    names = {"checkpoint": "checkpoint/000000000007.h5", "summary": "summary.json"}  # the latter of a run before it
    for one in held:
        (tmp_path / names[one]).touch()
    with pytest.raises(KeyboardInterrupt), interrupt_notice(tmp_path):
        raise KeyboardInterrupt
    said = capsys.readouterr().err
    assert (f"continue with: hvisph resume {tmp_path}" in said.replace("\n", "")) == (held == ("checkpoint",))


def test_killed_again_and_again_it_loses_nothing_but_steps(case, whole, tmp_path):
    folder = tmp_path / "run"
    process = command("run", case, "--out", folder)
    wait_for(process, stepping(folder))
    for pause in (0.0, 0.13, 0.31):
        time.sleep(pause)
        process.kill()
        process.communicate()
        assert_all_whole(folder)
        lines = (folder / "run.log").read_text().count("ready after")
        process = command("resume", folder)
        log = folder / "run.log"
        wait_for(process, lambda n=lines, log=log: log.read_text().count("ready after") > n)
    assert process.wait() == 0
    assert_same_results(folder, whole)
    assert not list(folder.glob("**/*.partial"))


def limited(size):
    """Limit the size of files, as a full disk does."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_full_disk_ends_the_run_with_a_message(share, case, whole, tmp_path):
    folder = tmp_path / "run"
    largest = max(path.stat().st_size for path in whole.rglob("*") if path.is_file())
    process = command("run", case, "--out", folder, preexec_fn=limited(int(share * largest)))
    _, said = process.communicate(timeout=60)
    assert process.returncode == 3
    assert said.startswith("error: cannot write ")
    assert "file too large" in said
    assert len(said.splitlines()) == 1
    assert_all_whole(folder)
    assert command("resume", folder).wait() == 0
    assert_same_results(folder, whole)


def test_a_vanished_folder_ends_the_run_with_a_message(case, tmp_path):
    folder = tmp_path / "run"
    process = command("run", case, "--out", folder)
    wait_for(process, stepping(folder))
    os.rename(folder, tmp_path / "elsewhere")
    _, said = process.communicate(timeout=60)
    assert process.returncode == 3
    assert said.startswith("error: cannot write ")
    assert "Traceback" not in said
    assert_all_whole(tmp_path / "elsewhere")


def without_override():
    """Give up root's right to write where nobody may, for the program that is executed next."""
    if os.getuid() == 0:
        drop_from_bounding_set, override_permissions = 24, 1
        ctypes.CDLL(None).prctl(drop_from_bounding_set, override_permissions, 0, 0, 0)


def test_a_read_only_folder_is_said_so(case, whole, tmp_path):
    closed = tmp_path / "closed"
    closed.mkdir()
    shutil.copytree(whole, closed / "run")
    for path in [*closed.rglob("*"), closed]:
        path.chmod(0o555 if path.is_dir() else 0o444)
    before = {path: path.stat().st_mtime_ns for path in closed.rglob("*")}
    for arguments in (("run", case, "--out", closed / "new"), ("resume", closed / "run")):
        process = command(*arguments, preexec_fn=without_override)
        _, said = process.communicate(timeout=60)
        assert process.returncode == 3, said
        assert "permission denied" in said
        assert "Traceback" not in said
    assert {path: path.stat().st_mtime_ns for path in closed.rglob("*")} == before


def test_two_runs_never_write_one_folder(case, tmp_path):
    folder = tmp_path / "run"
    first = command("run", case, "--out", folder, "--set", "time.end=1")
    wait_for(first, stepping(folder))
    for arguments in (("run", case, "--out", folder, "--force"), ("resume", folder)):
        second = command(*arguments)
        _, said = second.communicate(timeout=60)
        assert second.returncode == 3
        assert "another run is writing it" in said
    first.kill()
    first.communicate()
