"""Untrusted input: foreign caches, forged files, control characters, forked processes."""

import json
import multiprocessing
import os
import random
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from forging import forge, forge_summary, resealed
from small_runs import LIQUID, METAL, assert_same_results, row_of
from typer.testing import CliRunner

import hvisph
from hvisph.case.consistency import warnings_of
from hvisph.casefile.loader import dump_case, load_case
from hvisph.cli.main import app
from hvisph.core import memory
from hvisph.core.errors import CaseError, HvisphError, OutputError
from hvisph.core.text import sanitize
from hvisph.output.checkpoint_file import list_checkpoints, read_checkpoint, write_checkpoint
from hvisph.output.reader import list_snapshots, read_snapshot, read_summary
from hvisph.precheck.estimate import estimate
from hvisph.simulation.run import run

posix = pytest.mark.skipif(sys.platform == "win32", reason="POSIX owners, links and forks")
SECRET = 424242.0


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A short run of the default formulation."""
    folder = tmp_path_factory.mktemp("finished") / "run"
    run(row_of([METAL, LIQUID], time={"end": 3e-7}, output={"every": 1e-7}), folder, threads=1)
    return folder


@pytest.fixture
def elsewhere(tmp_path):
    """A file outside the run that a forged one may point to."""
    import h5py

    path = tmp_path / "elsewhere.h5"
    with h5py.File(path, "w") as h5:
        h5["secret"] = np.full(10, SECRET)
    return path


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # measures of forged numbers
@pytest.mark.parametrize("seed", range(25))
def test_a_forged_snapshot_is_measured_or_refused(seed, finished, elsewhere, tmp_path):
    before = elsewhere.read_bytes()
    path = tmp_path / "000003.h5"
    lie = forge(list_snapshots(finished)[-1], path, random.Random(seed), elsewhere)
    try:
        found = json.dumps(hvisph.measure(path).as_dict())
    except HvisphError as error:
        found = str(error)
        assert str(path) in found
    else:
        assert (
            lie not in {"link", "external", "virtual", "huge", "more", "missing"}
            or "fields" in found
            or lie == "missing"
        )
    assert str(SECRET) not in found
    assert elsewhere.read_bytes() == before


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # measures of forged numbers
@pytest.mark.parametrize("seed", range(12))
def test_a_forged_checkpoint_is_gone_on_from_or_refused(seed, finished, elsewhere, tmp_path):
    folder = shutil.copytree(finished, tmp_path / "run")
    rng = random.Random(100 + seed)
    for path in list_checkpoints(folder / "checkpoint"):
        forge(path, tmp_path / "lie", rng, elsewhere)
        shutil.move(tmp_path / "lie", path)
    with suppress(HvisphError):
        assert hvisph.resume(folder, threads=1).exit_code in {0, 1, 3}


@pytest.mark.parametrize("spoil", ["zeros", "ids", "material", "flags", "mass", "order", "shape", "clock", "case"])
def test_what_compiled_loops_go_by_is_held_against_the_run(spoil, finished, tmp_path):
    folder = shutil.copytree(finished, tmp_path / "run")
    for path in list_checkpoints(folder / "checkpoint"):
        found = read_checkpoint(path)
        arrays, header = found.arrays, found.header
        if spoil == "zeros":
            arrays |= {name: np.zeros_like(values) for name, values in arrays.items()}
        elif spoil in {"ids", "material", "flags"}:
            arrays["tags"][:, {"ids": 0, "material": 2, "flags": 3}[spoil]] = 1 if spoil == "flags" else 77
        elif spoil == "mass":
            arrays["state"][3] *= 2.0
        elif spoil == "order":
            arrays["tags"][:2, 0] = arrays["tags"][1::-1, 0]
        elif spoil == "shape":
            arrays["carried/rows"] = arrays["carried/rows"][:1]
        elif spoil == "clock":
            header["clock"]["steps"] = "many"
        else:
            del header["case"]
        write_checkpoint(folder / "checkpoint", found)
    with pytest.raises(OutputError, match="does not fit this run"):
        hvisph.resume(folder, threads=1)


@pytest.mark.parametrize("seed", range(30))
def test_a_forged_summary_is_compared_or_refused(seed, finished, tmp_path):
    folder = shutil.copytree(finished, tmp_path / "run")
    path = folder / "summary.json"
    path.write_text(forge_summary(path.read_text(), random.Random(seed)))
    said = CliRunner().invoke(app, ["compare", str(folder), str(finished)])
    assert said.exit_code in {0, 1, 3}, said.output
    assert "bug in hvisph" not in said.output
    assert "\x1b[31m" not in said.output


def test_names_in_a_snapshot_steer_no_terminal(finished, tmp_path):
    from hvisph.output.hdf5 import write_hdf5

    snapshot = read_snapshot(list_snapshots(finished)[-1])
    snapshot.bodies = ["\x1b]0;owned\x07body", "\x9b31mother"]
    snapshot.metadata["title"] = "nice\x1b[2Jtitle\u202e"
    write_hdf5(tmp_path / "a.h5", snapshot)
    for options in ([], ["--fragments"], ["--json"]):
        said = CliRunner().invoke(app, ["measure", str(tmp_path / "a.h5"), *options]).output
        assert not {"\x1b", "\x9b", "\x07", "\u202e"} & set(said), said
        if "--json" in options:
            json.loads(said)
    assert sanitize("a\x1b[31mb\n\tc é \U0001f4a5 \u202e") == "a\\x1b[31mb\n\tc é \U0001f4a5 \\u202e"


def test_a_title_steers_no_terminal(tmp_path):
    case = row_of([METAL], title="a\x1b[31m title", formulation={"type": "eulerian"}, time={"end": 1e-8})
    path = tmp_path / "case.yaml"
    path.write_text(dump_case(case))
    for arguments in (["check", path], ["run", path, "--out", tmp_path / "run", "--threads", "1"]):
        said = CliRunner().invoke(app, [str(argument) for argument in arguments])
        assert said.exit_code == 0
        assert "\x1b" not in said.output
        assert "a\\x1b[31m title" in said.output
    assert "\x1b" not in (tmp_path / "run" / "run.log").read_text()


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("secrets", "password: 12345\n", "a case file ends in"),
        ("secrets.yaml", "password: 12345\n", "it has other keys"),
        ("secrets.yaml", "password 12345 'x\n", "no"),
        ("secrets.yaml", "!12345 password\n", "tag"),
        ("base.yaml", "tiem: {end: 1 us}\n", "did you mean 'time'"),
    ],
)
def test_a_base_gives_nothing_of_another_file_away(name, content, message, tmp_path):
    (tmp_path / name).write_text(content)
    path = tmp_path / "case.yaml"
    path.write_text(f"base: {name}\n")
    with pytest.raises(CaseError, match=message) as caught:
        load_case(path)
    assert "12345" not in str(caught.value)
    assert "password" not in str(caught.value)


@posix
@pytest.mark.skipif(not os.path.exists("/proc/kmsg"), reason="Linux")
def test_a_file_that_waits_is_not_waited_for(tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text("base: /proc/kmsg\n")
    (tmp_path / "link.yaml").symlink_to("/proc/kmsg")
    for text in ("base: /proc/kmsg\n", "base: link.yaml\n"):
        path.write_text(text)
        done = subprocess.run(
            [sys.executable, "-m", "hvisph", "check", path], capture_output=True, timeout=60, check=False
        )
        assert done.returncode == 2


def test_a_name_that_makes_no_folder_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("...yaml").write_text(dump_case(row_of([METAL])))
    said = CliRunner().invoke(app, ["run", "...yaml"])
    assert said.exit_code == 2
    assert "name one with --out" in said.output
    assert [path.name for path in tmp_path.iterdir()] == ["...yaml"]


@posix
def test_a_child_forked_after_a_run_is_told_so(tmp_path):
    """Without that GNU OpenMP ends the child, and a pool of them waits for ever."""
    program = f"""
import multiprocessing, sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
from small_runs import METAL, row_of
from hvisph.core.errors import RunError
from hvisph.simulation.run import run
case = row_of([METAL], formulation={{"type": "eulerian"}}, time={{"end": 1e-8}})
def work(k):
    return run(case, {str(tmp_path)!r} + f"/{{k}}", threads=1).summary["status"]
work(0)
import os
from numba import threading_layer
if threading_layer() != "omp":
    print("RunError forked")
    raise SystemExit
with multiprocessing.get_context("fork").Pool(1) as pool:
    try:
        print(pool.map(work, [1]))
    except RunError as error:
        print("RunError", error)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=200, check=False)
    assert done.returncode == 0, done.stderr
    assert "RunError" in done.stdout
    assert "forked" in done.stdout
    assert not (tmp_path / "1").exists()
    assert multiprocessing.get_start_method(allow_none=True) in {None, "fork", "spawn", "forkserver"}


def groups(root, version, limits):
    """A tree of control groups a/b/c with these limits from the top down, 100 MB used in each."""
    place = root / "memory" if version == 1 else root
    limit, used = (
        ("memory.limit_in_bytes", "memory.usage_in_bytes") if version == 1 else ("memory.max", "memory.current")
    )
    for depth, most in enumerate(limits):
        folder = place.joinpath(*"abc"[:depth])
        folder.mkdir(parents=True, exist_ok=True)
        (folder / limit).write_text(f"{most}\n")
        (folder / used).write_text("100000000\n")
    membership = root / "membership"
    membership.write_text("4:memory:/a/b/c\n3:cpuset:/\n" if version == 1 else "0::/a/b/c\n")
    return membership


@pytest.mark.parametrize(
    ("version", "limits", "left"),
    [
        (1, ["9223372036854771712", "500000000", "9223372036854771712", "300000000"], 200e6),
        (2, ["max", "500000000", "max", "max"], 400e6),
        (2, ["max", "max", "max", "max"], float("inf")),
        (2, ["50000000"], 0.0),  # a container shows its own group as the root
    ],
)
def test_limits_of_all_control_groups_count(version, limits, left, tmp_path):
    assert memory.group_memory(tmp_path, groups(tmp_path, version, limits)) == left
    if version == 1:
        (tmp_path / "memory/a/b/c/memory.stat").write_text("cache 5\ntotal_inactive_file 1000000\n")
        assert memory.group_memory(tmp_path, tmp_path / "membership") == left + 1e6
    assert memory.group_memory(tmp_path / "none", tmp_path / "none") == float("inf")


@posix
def test_a_case_beyond_the_process_own_limit_is_refused_before_anything_is_written(tmp_path):
    import resource

    line = [sys.executable, "-m", "hvisph", "run", "al_al", "--resolution", "0.01 mm", "--out", str(tmp_path / "run")]
    limit = 1_200_000_000
    done = subprocess.run(line, capture_output=True, text=True, check=False, env=os.environ | {"NUMBA_NUM_THREADS": "1"},
                          preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert "the finest resolution that fits" in done.stderr
    assert not (tmp_path / "run").exists()


def test_check_refuses_a_domain_that_cuts_a_body_as_run_does():
    case = row_of([METAL], domain={"max": [None, 1e-3]})
    with pytest.raises(CaseError, match="particles start outside"):
        estimate(case)


def test_what_has_no_effect_is_said():
    case = row_of([LIQUID], formulation={"type": "eulerian"})
    assert warnings_of(case) == []
    bodies = {name: body.model_dump() | {"internal_energy": 5.0} for name, body in case.bodies.items()}
    plain = case.model_dump() | {"bodies": bodies}
    plain["time"] = plain["time"] | {"step": 1e-9, "cfl": 0.2}
    plain["symmetry"] = [{"axis": "x", "at": 1e-4}]
    energy, cfl, mirror = warnings_of(load_case(json.loads(json.dumps(plain))))
    assert "internal_energy" in energy
    assert "time.cfl: 0.2 is not used" in cfl
    assert "across the symmetry plane x = 0.0001" in mirror


def test_a_bar_that_flies_at_its_wall_is_as_it_should_be():
    bar = {"material": METAL, "shape": {"type": "box", "size": [4e-3, 2e-3]}, "velocity": [-100.0, 0.0]}
    for at, warned in ((2e-3, False), (1e-3, True)):
        case = load_case({"kinematics": "plane_strain", "resolution": "0.4 mm", "time": {"end": 1e-6},
                          "bodies": {"bar": bar | {"position": [at, 0]}}, "symmetry": [{"axis": "x"}]})  # fmt: skip
        assert any("across the symmetry plane" in text for text in warnings_of(case)) == warned


@pytest.mark.parametrize(("at", "warned"), [(4e-3, False), (-1e-3, True)])
def test_a_floor_under_the_target_is_no_plane_of_the_projectile(at, warned):
    """Bodies in a row touch at x = 0; the plane lies behind both, or through the projectile."""
    plain = {"material": METAL, "shape": {"type": "box", "size": [4e-3, 4e-3]}}
    case = load_case({"kinematics": "plane_strain", "resolution": "0.4 mm", "time": {"end": 1e-6},
                      "bodies": {"shot": plain | {"velocity": [1000.0, 0.0]}, "target": plain},
                      "symmetry": [{"axis": "x", "at": at, "keep": "below"}]})  # fmt: skip
    assert any("across the symmetry plane" in text for text in warnings_of(case)) == warned


def test_a_rounded_size_is_said_by_a_run(tmp_path):
    case = load_case({"kinematics": "plane_strain", "resolution": "0.5 mm", "time": {"end": 1e-8},
                      "formulation": {"type": "eulerian"},
                      "bodies": {"a": {"material": METAL, "shape": {"type": "box", "size": [3.2e-3, 3e-3]}}}})  # fmt: skip
    run(case, tmp_path / "run", threads=1)
    note = estimate(case).bodies[0].note
    assert note
    assert note in (tmp_path / "run" / "run.log").read_text()


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # plain numbers on their way to infinity
@pytest.mark.parametrize("field", ["density", "sound_speed", "gamma"])
@pytest.mark.parametrize("value", ["1e-300", "1e-29", "1e29", "1e300"])
def test_extreme_numbers_are_no_bug(field, value, tmp_path):
    text = dump_case(row_of([METAL, METAL]))
    lines = [
        f"{line.split(':')[0]}: {value}" if line.strip().startswith(f"{field}:") else line for line in text.splitlines()
    ]
    path = tmp_path / "case.yaml"
    path.write_text("\n".join(lines))
    said = CliRunner().invoke(app, ["check", str(path)])
    assert said.exit_code in {0, 2}, said.output
    assert "bug in hvisph" not in said.output


@posix
@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root can give files away")
@pytest.mark.parametrize("place", ["home", "temporary"])
def test_a_cache_of_somebody_else_is_not_run(place, tmp_path):
    home, temporary = tmp_path / "home", tmp_path / "tmp"
    planted = home / ".cache/hvisph/loops" if place == "home" else temporary / f"hvisph-cache-{os.getuid()}"
    for folder in (home, temporary, planted):
        folder.mkdir(parents=True, exist_ok=True)
    if place == "temporary":  # the home takes no files
        (home / ".cache").write_text("")
    os.chown(planted, 12345, 12345)
    program = "from hvisph.compiler.cache_folder import cache_folder; print(cache_folder())"
    clean = {k: v for k, v in os.environ.items() if k not in {"HVISPH_CACHE_DIR", "XDG_CACHE_HOME"}}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False,
                          env=clean | {"HOME": str(home), "TMPDIR": str(temporary)})  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() != str(planted)


def test_a_resealed_file_is_as_good_as_new(finished, tmp_path):
    path = tmp_path / "a.h5"
    shutil.copyfile(list_snapshots(finished)[0], path)
    resealed(path)
    assert read_snapshot(path).count == read_snapshot(list_snapshots(finished)[0]).count
    assert read_summary(finished)["status"] == "done"
    assert_same_results(finished, finished)
