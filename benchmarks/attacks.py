"""Attacks that `robustness.py` counts: forged files with a right checksum, foreign files and links in run folders."""

from __future__ import annotations

import os
import random
import resource
import shutil
import signal
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

import h5py  # noqa: E402
import numpy as np  # noqa: E402
from campaign import counts  # noqa: E402
from forging import forge, forge_summary  # noqa: E402
from small_runs import FORMULATIONS, LIQUID, METAL, every_material, row_of  # noqa: E402

import hvisph  # noqa: E402
from hvisph.core.errors import HvisphError  # noqa: E402
from hvisph.measures.compare import row  # noqa: E402
from hvisph.output import file_names  # noqa: E402
from hvisph.output.checkpoint_file import list_checkpoints  # noqa: E402
from hvisph.output.reader import list_snapshots  # noqa: E402
from hvisph.simulation.run import run  # noqa: E402

SECRET = 424242.0  # what a forged file may try to read elsewhere


def in_child(action, seconds=60, memory=None):
    """Do `action` in a process of its own; return its exit status, negative for a signal, and what it said."""
    read, write = os.pipe()
    number = os.fork()
    if number == 0:
        os.close(read)
        code, output = 1, ""
        try:
            quiet = os.open(os.devnull, os.O_WRONLY)
            os.dup2(quiet, 1)
            os.dup2(quiet, 2)
            resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
            if memory:
                resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
            output = str(action() or "")
            code = 0
        except HvisphError as error:
            output, code = f"refused: {error}", 2
        except BaseException as error:  # whatever it is, it is counted
            output = f"{type(error).__name__}: {error}"
        os.write(write, output.encode("utf-8", "replace")[:4000])
        os._exit(code)
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        output = pipe.read().decode("utf-8", "replace")
    return os.waitstatus_to_exitcode(os.waitpid(number, 0)[1]), output


def in_place(action, seconds=60):
    """Do `action` here, where loops are loaded once; return its exit code and what it said, as of `in_child`."""

    def enough(*_):
        raise TimeoutError(f"took more than {seconds} s of processor time")

    before = signal.signal(signal.SIGVTALRM, enough)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        with open(os.devnull, "w") as nothing, redirect_stdout(nothing), redirect_stderr(nothing):
            return 0, str(action() or "")
    except HvisphError as error:
        return 2, f"refused: {error}"
    except Exception as error:  # whatever it is, it is counted
        return 1, f"{type(error).__name__}: {error}"
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)


def forged(work):
    """Let snapshots, checkpoints and summaries lie, each with a right checksum, and measure, compare and resume."""
    elsewhere = work / "elsewhere.h5"
    with h5py.File(elsewhere, "w") as h5:
        h5["secret"] = np.full(10, SECRET)
    before, runs = elsewhere.read_bytes(), []
    for formulation in FORMULATIONS:
        case = every_material(formulation, time={"end": 4e-7}, output={"every": 1e-7})
        folder = work / f"run_{formulation}"
        run(case, folder, threads=1)
        runs.append(folder)

    def trial(number):
        rng, folder = random.Random(number), work / "forged"
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(runs[number % len(runs)], folder)
        target = ("checkpoint", "snapshot", "summary")[number % 3] if number % 7 else "summary"
        if target == "summary":
            path = folder / file_names.SUMMARY
            path.write_text(forge_summary(path.read_text(), rng))
            action = lambda: row("x", folder).as_dict()  # noqa: E731
        elif target == "snapshot":
            path = list_snapshots(folder)[-1]
            forge(path, work / "lie.h5", rng, elsewhere)
            shutil.move(work / "lie.h5", path)
            action = lambda: hvisph.measure(folder).as_dict()  # noqa: E731
        else:
            for path in list_checkpoints(folder / file_names.CHECKPOINT):
                forge(path, work / "lie.h5", rng, elsewhere)
                shutil.move(work / "lie.h5", path)
            action = lambda: hvisph.resume(folder, threads=1).exit_code  # noqa: E731
        code, output = in_place(action)
        if code not in (0, 2) or str(SECRET) in output:
            keep = Path(os.environ.get("TMPDIR", "/tmp")) / f"hvisph_forged_{number}"
            shutil.copytree(folder, keep, dirs_exist_ok=True)
            raise SystemExit(f"forged {target} {number} ended with {code}: {output[:300]}, kept as {keep}")
        assert elsewhere.read_bytes() == before
        return {"of": {target: 1}, "ends": {"refused with a message" if code == 2 else "read, of no consequence": 1}}

    return trial


def forged_told(tally):
    """Return the counts in words."""
    return f"{tally['trials']} ({counts(tally['of'])}): {counts(tally['ends'])}; no crash, nothing read or written elsewhere"


def foreign(work):
    """Put files and links of somebody else's into run folders, then resume, replace and go on; they stay."""
    case = row_of([METAL, LIQUID], formulation={"type": "eulerian"}, time={"end": 3e-7},
                  output={"every": 1e-7, "formats": ["hdf5", "vtu"], "checkpoint_every": 0.01})  # fmt: skip
    whole, folder, precious = work / "whole", work / "run", work / "precious"
    run(case, whole, threads=1)
    own = [path.relative_to(whole) for path in whole.rglob("*")]

    def trial(number):
        rng, refusals = random.Random(number), 0
        for old in (folder, precious):
            shutil.rmtree(old, ignore_errors=True)
        shutil.copytree(whole, folder)
        precious.mkdir()
        for k in range(4):
            (precious / f"{k:06d}.vtkhdf").write_text("keep")
        placed = _placed(folder, rng)
        links = []
        if rng.random() < 0.5:
            path = folder / rng.choice([*own, Path(file_names.SNAPSHOTS), Path("history.csv.partial"), Path("run.log")])
            if path.is_dir():
                shutil.rmtree(path)
                placed = [p for p in placed if path not in p.parents]
            path.unlink(missing_ok=True)
            path.symlink_to(rng.choice([precious, precious / "000001.vtkhdf", precious / "nothing"]))
            links.append((path, os.readlink(path)))
        for action in (
            lambda: hvisph.resume(folder, threads=1),
            lambda: hvisph.resume(folder, end=4e-7, threads=1),
            lambda: run(case, folder, force=True, threads=1),
        ):
            code, output = in_place(action)
            assert code in (0, 2), output
            refusals += code == 2
        assert [path for path in placed if not path.is_file() or path.read_text() != "mine"] == []
        assert [path for path, to in links if not path.is_symlink() or os.readlink(path) != to] == []
        assert sorted(path.name for path in precious.iterdir()) == [f"{k:06d}.vtkhdf" for k in range(4)]
        assert {path.read_text() for path in precious.iterdir()} == {"keep"}
        return {"files": len(placed), "links": len(links), "refused": refusals}

    return trial


def _placed(folder, rng):
    """Put files of somebody else's into a run's folder and return them."""
    placed = []
    for number in range(rng.randint(1, 6)):
        below = rng.choice(["", "snapshots", "vtu", "checkpoint", "mine"])
        name = rng.choice(
            ["notes.txt", "a.partial", "best.h5", "000001.vtkhdf.bak", "7.h5", "run.log.1", "000000000001.txt"]
        )
        path = folder / below / f"{number}_{name}" if rng.random() < 0.5 else folder / below / name
        path.parent.mkdir(exist_ok=True)
        if not path.exists():
            path.write_text("mine")
            placed.append(path)
    return placed


def foreign_told(tally):
    """Return the counts in words."""
    return (
        f"{tally['trials']} folders with {tally['files']} files and {tally['links']} links, three commands each: all "
        f"as they were ({tally['refused']} commands refused for a link)"
    )
