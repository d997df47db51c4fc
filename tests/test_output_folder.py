"""The run folder, history, log and their reader."""

import json
import subprocess
import sys
import textwrap

import numpy as np
import pytest

from hvisph.core.errors import CaseError, OutputError
from hvisph.output import file_names
from hvisph.output.atomic_write import replacing, write_text
from hvisph.output.history import HistoryWriter
from hvisph.output.reader import list_snapshots, read_history, read_summary
from hvisph.output.run_folder import RunFolder, RunLog, clear_unfinished

COLUMNS = ["step", "time", "energy", "limited_by"]


def test_a_folder_is_made_once(tmp_path):
    path = tmp_path / "deep" / "run"
    with RunFolder.create(path) as run:
        assert {p.name for p in path.iterdir()} == {file_names.LOCK, *file_names.CREATED_FIRST}
        run.write_json(file_names.SUMMARY, {"particles": 3, "größe": [1.5, None]})
        assert json.loads((path / file_names.SUMMARY).read_text()) == {"particles": 3, "größe": [1.5, None]}
        run.write_text(file_names.CASE, "title: x\n")
        run.log.write("one\ntwo")
    with pytest.raises(CaseError, match="--force"):
        RunFolder.create(path)
    assert (path / file_names.CASE).read_text() == "title: x\n"


def test_force_replaces_a_run_and_spares_what_is_not_its(tmp_path):
    path = tmp_path / "run"
    with RunFolder.create(path) as run:
        run.write_text(file_names.CASE, "old")
        run.snapshot_path(0).write_bytes(b"old")
    (path / "notes.txt").write_text("mine")
    RunFolder.create(path, force=True).close()
    assert {p.name for p in path.iterdir()} == {file_names.LOCK, "notes.txt", *file_names.CREATED_FIRST}
    assert list((path / file_names.SNAPSHOTS).iterdir()) == []


def test_force_spares_files_of_others_inside_its_own_folders(tmp_path):
    path = tmp_path / "run"
    RunFolder.create(path).close()
    own = ["snapshots/000012.h5", "snapshots/post_mortem.h5", "vtu/000003.vtu.partial", "checkpoint/000000000012.h5"]
    others = ["snapshots/best.h5", "snapshots/12.h5", "vtu/state.pvsm", "checkpoint/000012.h5", "checkpoint/a.h5",
              "snapshots/a.partial", "mine/b.partial", "history.csv.bak"]  # fmt: skip
    for name in (*own, *others):
        (path / name).parent.mkdir(exist_ok=True)
        (path / name).write_bytes(b"x")
    clear_unfinished(path)
    assert not (path / "vtu/000003.vtu.partial").exists()
    RunFolder.create(path, force=True).close()
    assert [name for name in own if (path / name).exists()] == []
    assert [name for name in others if not (path / name).exists()] == []


LINKED = [file_names.LOCK, *file_names.FILES, *file_names.FOLDERS, "snapshots/000001.h5", "vtu/000001.vtu.partial",
          "checkpoint/000000000001.h5", "history.csv.partial"]  # fmt: skip


@pytest.mark.parametrize("name", LINKED)
@pytest.mark.parametrize("dangling", [False, True])
def test_nothing_is_written_or_deleted_through_a_link(name, dangling, tmp_path):
    precious = tmp_path / "precious"
    if name in file_names.FOLDERS:
        precious.mkdir()
        (precious / "000001.h5").write_text("keep")
    else:
        precious.write_text("keep")
    path = tmp_path / "run"
    RunFolder.create(path).close()
    if name in file_names.CREATED_FIRST:
        (path / name).rmdir()
    (path / name).parent.mkdir(exist_ok=True)
    (path / name).unlink(missing_ok=True)
    (path / file_names.CASE).write_text(file_names.CASE_HEAD) if name == file_names.LOCK else None
    (path / file_names.HISTORY).touch() if name == file_names.LOCK else None
    (path / name).symlink_to(tmp_path / "nowhere" if dangling else precious)
    before = {p: p.lstat().st_mtime_ns for p in (*tmp_path.rglob("*"), tmp_path)}
    for action in (lambda: RunFolder.create(path, force=True), lambda: RunFolder.open(path)):
        with pytest.raises(CaseError, match="is a link, and hvisph writes and deletes nothing through links"):
            action()
    assert {p: p.lstat().st_mtime_ns for p in (*tmp_path.rglob("*"), tmp_path)} == before


def test_a_link_that_comes_later_is_not_followed_either(tmp_path):
    precious = tmp_path / "precious"
    precious.write_text("keep")
    for name in ("log", "file", "file.partial"):
        (tmp_path / name).unlink(missing_ok=True)
        (tmp_path / name).symlink_to(precious)
        with pytest.raises(OutputError, match="cannot write"):
            RunLog(tmp_path / name).write("x") if name == "log" else write_text(tmp_path / "file", "x")
        assert precious.read_text() == "keep"
        assert (tmp_path / name).is_symlink()
        (tmp_path / name).unlink()


def test_a_log_that_shares_its_file_with_a_backup_leaves_the_backup_alone(tmp_path):
    log = RunLog(tmp_path / file_names.LOG)
    log.write("one")
    (tmp_path / "backup").hardlink_to(log.path)
    log.write("two")
    assert len((tmp_path / "backup").read_text().splitlines()) == 1
    assert len(log.path.read_text().splitlines()) == 2


def test_a_folder_is_a_run_by_its_mark_or_by_the_case_that_hvisph_wrote(tmp_path):
    (tmp_path / file_names.CASE).write_text("title: my own\n")
    (tmp_path / file_names.HISTORY).write_text("year,event\n")
    with pytest.raises(CaseError, match="not a run of hvisph"):
        RunFolder.create(tmp_path, force=True)
    (tmp_path / file_names.CASE).write_text(f"{file_names.CASE_HEAD} 0.1.0; hash 0123456789abcdef\n")
    RunFolder.open(tmp_path).close()


@pytest.mark.parametrize("force", [False, True])
def test_any_other_folder_is_left_alone(tmp_path, force):
    (tmp_path / "thesis.tex").write_text("years of work")
    (tmp_path / file_names.SNAPSHOTS).mkdir()
    with pytest.raises(CaseError, match="not a run of hvisph"):
        RunFolder.create(tmp_path, force=force)
    assert {p.name for p in tmp_path.iterdir()} == {"thesis.tex", file_names.SNAPSHOTS}
    with pytest.raises(CaseError, match="is a file"):
        RunFolder.create(tmp_path / "thesis.tex", force=force)
    with pytest.raises(CaseError, match="not the folder of a run"):
        RunFolder.open(tmp_path)


def test_two_runs_never_write_one_folder(tmp_path):
    path = tmp_path / "run"
    program = "import sys; from hvisph.output.run_folder import RunFolder; RunFolder.{}"
    with RunFolder.create(path):
        for call in (f"create({str(path)!r}, force=True)", f"open({str(path)!r})"):
            done = subprocess.run([sys.executable, "-c", program.format(call)], capture_output=True, text=True)
            assert "another run is writing it" in done.stderr
    RunFolder.open(path).close()


def test_the_lock_of_a_killed_run_is_free(tmp_path):
    path = tmp_path / "run"
    program = f"""
        import os
        from hvisph.output.run_folder import RunFolder, clear_unfinished
        run = RunFolder.create({str(path)!r})
        os.kill(os.getpid(), 9)
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(program)], check=False)
    RunFolder.open(path).close()


def test_a_vanished_folder_is_said(tmp_path):
    path = tmp_path / "run"
    run = RunFolder.create(path)
    history = HistoryWriter(run.history_path, COLUMNS, flush_seconds=0)
    history.append([0, 0.0, 1.0, "cfl"])
    path.rename(tmp_path / "elsewhere")
    for action in (
        lambda: run.write_text(file_names.CASE, "x"),
        lambda: run.log.write("x"),
        lambda: history.append([1, 0.1, 1.0, "cfl"]),
    ):
        with pytest.raises(OutputError, match=str(path)):
            action()
    run.close()


def test_a_folder_that_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="not a directory"):
        RunFolder.create(tmp_path / "file" / "run")


def test_history_ends_with_a_whole_line_when_the_disk_is_full(tmp_path):
    """A limit on the size of files stands for the full disk: the write fails in the midst of a line."""
    program = """
        import resource, sys
        from hvisph.core.errors import OutputError
        from hvisph.output.history import HistoryWriter
        history = HistoryWriter(sys.argv[1], ["step", "time"], flush_seconds=0)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1001, resource.RLIM_INFINITY))
        try:
            for step in range(1000):
                history.append([step, step / 3])
        except OutputError as error:
            print(error)
    """
    path = tmp_path / file_names.HISTORY
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(program), str(path)], capture_output=True, text=True)
    assert "file too large" in done.stdout, done.stderr
    content = path.read_bytes()
    assert content.endswith(b"\n")
    assert 900 < len(content) <= 1001
    steps = read_history(tmp_path)["step"]
    assert steps.tolist() == list(range(len(steps)))


def test_a_log_that_cannot_be_written_is_said(tmp_path):
    with pytest.raises(OutputError, match="is a directory"):
        RunLog(tmp_path).write("x")


def test_replacing_keeps_the_old_when_the_new_fails(tmp_path):
    path = tmp_path / "f"
    write_text(path, "old")

    def interrupted():
        with replacing(path) as file:
            file.write(b"half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["f"]


def test_history_there_and_back_is_exact(tmp_path):
    rows = np.random.default_rng(0).normal(size=(100, 2)) * 1e-300
    rows[5] = [np.nan, np.inf]
    with HistoryWriter(tmp_path / file_names.HISTORY, COLUMNS) as history:
        for step, (time, energy) in enumerate(rows):
            history.append({"energy": energy, "step": np.int64(step), "time": time, "limited_by": "cfl, body 'a'"})
        with pytest.raises(ValueError, match="3 values for 4"):
            history.append([1, 2, 3])
        with pytest.raises(ValueError, match="extra"):
            history.append(dict.fromkeys(COLUMNS, 1) | {"extra": 1})
    got = read_history(tmp_path)
    assert list(got) == COLUMNS
    np.testing.assert_array_equal(got["time"], rows[:, 0])
    np.testing.assert_array_equal(got["energy"], rows[:, 1])
    assert got["limited_by"][0] == "cfl, body 'a'"


def test_history_is_flushed_as_whole_lines(tmp_path):
    history = HistoryWriter(tmp_path / file_names.HISTORY, COLUMNS, flush_seconds=1e9)
    history.append([0, 0.0, 1.0, "cfl"])
    assert len(read_history(tmp_path)["step"]) == 0
    history.flush()
    history.append([1, 0.0, 1.0, "cfl"])
    assert read_history(tmp_path)["step"].tolist() == [0]
    history.close()
    history.close()
    assert read_history(tmp_path)["step"].tolist() == [0, 1]


def test_history_resumes_at_a_step(tmp_path):
    path = tmp_path / file_names.HISTORY
    with HistoryWriter(path, COLUMNS) as history:
        for step in range(10):
            history.append([step, step / 3, 1.0, "cfl"])
    whole = path.read_bytes()
    path.write_bytes(whole + b"10,3.33")  # killed in the midst of a line
    assert len(read_history(tmp_path)["step"]) == 10
    with HistoryWriter.resume(path, COLUMNS, step=6) as history:
        for step in range(7, 10):
            history.append([step, step / 3, 1.0, "cfl"])
    assert path.read_bytes() == whole
    with pytest.raises(OutputError, match="its columns are"):
        HistoryWriter.resume(path, ["step", "time"], step=6)
    with pytest.raises(OutputError, match="no such file"):
        HistoryWriter.resume(tmp_path / "missing", COLUMNS, step=6)


def test_damaged_histories_and_summaries_are_said(tmp_path):
    with pytest.raises(OutputError, match="no such file"):
        read_history(tmp_path)
    for content, message in [
        (b"", "not a history"),
        (b"a,b\n1,2\n3\n", "line 3 has not 2 columns"),
        (b"\xff\xfe\n", "not a history"),
    ]:
        (tmp_path / file_names.HISTORY).write_bytes(content)
        with pytest.raises(OutputError, match=message):
            read_history(tmp_path)
    with pytest.raises(OutputError, match="no such file"):
        read_summary(tmp_path)
    for content, message in [
        (b'{"a": ', "truncated"),
        (b"[]", "not a summary"),
        (b"\xff", "damaged"),
        (b"{}", "title"),
        (b"[" * 100000, "damaged"),
    ]:
        (tmp_path / file_names.SUMMARY).write_bytes(content)
        with pytest.raises(OutputError, match=message):
            read_summary(tmp_path)


def test_snapshots_are_listed_in_order_and_hdf5_first(tmp_path):
    for name in ("vtu/plate_10.vtu", "vtu/plate_9.vtu", "snapshots/000002.h5", "snapshots/000010.h5"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "snapshots" / "000011.h5.partial").write_bytes(b"")
    (tmp_path / "snapshots" / "post_mortem.h5").write_bytes(b"")
    found = [p.name for p in list_snapshots(tmp_path)]
    assert found == ["000002.h5", "000010.h5", "post_mortem.h5"]
    assert [p.name for p in list_snapshots(tmp_path / "vtu")] == ["plate_9.vtu", "plate_10.vtu"]
    with pytest.raises(OutputError, match="no such folder"):
        list_snapshots(tmp_path / "nowhere")


def test_log_lines_carry_the_time(tmp_path):
    log = RunLog(tmp_path / file_names.LOG)
    log.write("started\nwith 3 particles")
    log.write("ended")
    lines = (tmp_path / file_names.LOG).read_text().splitlines()
    assert [line.split("  ", 1)[1] for line in lines] == ["started", "with 3 particles", "ended"]
    assert lines[0][:2] == "20"
