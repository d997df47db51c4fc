"""What a run survives: kills, resumption, hostile input, damaged files, wild collisions; writes docs/robustness.md.

    python benchmarks/robustness.py [--kills 300] [--fuzz 20000] [--shorts 2000] [--forged 500] [--only NAME]

Takes some hours on two cores with the default counts; rows that are not asked for stay as they are.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

import numpy as np  # noqa: E402
from attacks import foreign, forged  # noqa: E402
from endurance import caches, long, memory, shorts, texts  # noqa: E402
from hostile import GOOD, MISTAKES, damaged, extreme, mutated  # noqa: E402
from small_runs import (  # noqa: E402
    DAMAGED,
    FORMULATIONS,
    HARDENING,
    METAL,
    assert_same_results,
    every_material,
    row_of,
)

import hvisph  # noqa: E402
from hvisph.casefile.loader import load_case  # noqa: E402
from hvisph.core.errors import HvisphError  # noqa: E402
from hvisph.output.checkpoint import Checkpoint, list_checkpoints, read_checkpoint, write_checkpoint  # noqa: E402
from hvisph.output.reader import list_snapshots, read_history, read_snapshot  # noqa: E402
from hvisph.simulation.run import run  # noqa: E402

HEAD = """\
# Robustness

What runs survive, and what is never silent. Each row is made by one function of `benchmarks/robustness.py`;
`python benchmarks/robustness.py` makes them all, `--only NAME` one.

| what | to reach | found |
| --- | --- | --- |"""

LONGEST = 5.0  # [s] of processor time until a fuzzed case must be refused or accepted: waiting is not counted


def long_case(formulation):
    """A case of some seconds with snapshots and checkpoints all the time."""
    end = 3e-7 if formulation == "projection" else 8e-6
    output = {"every": end / 6, "formats": ("hdf5", "vtu"), "checkpoint_every": 0.02}
    case = every_material(formulation)
    return case.model_copy(
        update={
            "time": case.time.model_copy(update={"end": end}),
            "output": case.output.model_copy(update=output),
            "watch": case.watch.model_copy(update={"density": False, "speed_over_initial": None, "energy_drift": None}),
        }
    )


def child(action):
    """Do `action` in a process of its own; return its number."""
    number = os.fork()
    if number == 0:
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        code = 1
        try:
            action()
            code = 0
        finally:
            os._exit(code)
    return number


def check_whole(folder):
    """Read every file that has its final name."""
    if not folder.is_dir():  # killed before it began
        return
    for path in [*list_snapshots(folder), *(folder / "vtu").glob("*.vtu")]:
        read_snapshot(path)
    for path in list_checkpoints(folder / "checkpoint"):
        read_checkpoint(path)
    if (folder / "history.csv").is_file():
        read_history(folder)
    if (folder / "summary.json").is_file():
        json.loads((folder / "summary.json").read_text())


def go_on(case, folder):
    """Resume a run, or begin it where it was killed before its case was written."""
    if (folder / "case.yaml").is_file():
        hvisph.resume(folder, threads=1)
    else:
        run(case, folder, force=True, threads=1)


def kills(count, work):
    """Kill runs of every formulation at random times, go on, and compare with the run that was not killed."""
    rng, survived, done = random.Random(1), 0, []
    for formulation in FORMULATIONS:
        case, share = long_case(formulation), count // len(FORMULATIONS)
        whole = work / f"{formulation}_whole"
        for _ in range(2):  # the first time loops are compiled
            os.waitpid(child(lambda case=case, whole=whole: run(case, whole, force=True, threads=1)), 0)
        seconds = json.loads((whole / "summary.json").read_text())["wall_seconds"]
        left, runs = share, 0
        while left > 0:
            folder, runs = work / f"{formulation}_{runs}", runs + 1
            number = child(lambda case=case, folder=folder: run(case, folder, threads=1))
            while True:
                time.sleep(rng.uniform(0.0, 0.5 * seconds + 0.3))
                os.kill(number, signal.SIGKILL)
                killed = os.WIFSIGNALED(os.waitpid(number, 0)[1])
                check_whole(folder)
                if not killed:  # it had ended before
                    break
                left -= 1
                survived += 1
                if left <= 0:
                    break
                number = child(lambda case=case, folder=folder: go_on(case, folder))
            assert os.waitpid(child(lambda case=case, folder=folder: go_on(case, folder)), 0)[1] == 0
            assert_same_results(folder, whole)
            assert not list(folder.glob("**/*.partial"))
            shutil.rmtree(folder)
        done.append(f"{formulation} {share}")
    return f"{survived} of {survived}: {', '.join(done)}"


def resumes(work):
    """Run every formulation, integrator and material in one go and in two parts."""
    same = []
    for formulation in FORMULATIONS:
        for integrator in ("leapfrog",) if formulation == "projection" else ("leapfrog", "predictor_corrector"):
            case = every_material(formulation, time={"end": 6e-7, "integrator": integrator})
            folder = work / f"{formulation}_{integrator}"
            run(case, folder / "whole", threads=1)
            short = case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 13})})
            run(short, folder / "parts", threads=1)
            hvisph.resume(folder / "parts", max_steps=0, threads=1)
            assert_same_results(folder / "whole", folder / "parts")
            same.append(f"{formulation} ({integrator})")
    return (
        f"{len(same)} of {len(same)}: {', '.join(same)}; five materials in each case where the formulation takes them"
    )


def fuzz(count, work):
    """Send mutated and damaged case files, and random bytes, through `hvisph check`."""
    from typer.testing import CliRunner

    from hvisph.cli.main import app

    bundled = [path.read_text() for path in sorted((ROOT / "cases").glob("*.yaml"))]
    rng, path, runner, small = random.Random(2), work / "case.yaml", CliRunner(), texts()
    codes, slowest = {0: 0, 2: 0}, 0.0
    path.write_text(GOOD)
    runner.invoke(app, ["check", str(path)])  # imports are no part of the time
    for k in range(count):
        if k % 20 == 0:
            content = rng.randbytes(rng.randrange(400))
        elif k % 20 == 1:
            content = damaged(rng.choice(list(MISTAKES.values()))[:5000] or b"x", rng)
        elif k % 20 == 2:
            content = mutated(rng.choice(bundled), rng).encode("utf-8", "surrogatepass")
        elif k % 2:
            content = extreme(rng.choice(small), rng).encode("utf-8", "surrogatepass")
        else:
            content = mutated(rng.choice([GOOD, *small]), rng).encode("utf-8", "surrogatepass")
        path.write_bytes(content)
        began = time.process_time()
        done = runner.invoke(app, ["check", str(path)])
        seconds = time.process_time() - began
        fine = done.exit_code in codes and "Traceback" not in done.output and "bug in hvisph" not in done.output
        if not fine or seconds > LONGEST:
            keep = Path(tempfile.gettempdir()) / f"hvisph_fuzz_{k}.yaml"
            keep.write_bytes(content)
            raise SystemExit(
                f"fuzzed case {k} ended with {done.exit_code} after {seconds:.2f} s, kept as {keep}\n{done.output}"
            )
        codes[done.exit_code] += 1
        slowest = max(slowest, seconds)
    return f"{count}: {codes[2]} refused with a message, {codes[0]} still good; no traceback, slowest {slowest:.2f} s of processor time"


def damage(count, work):
    """Truncate, or turn one bit of, snapshots and checkpoints, and read them."""
    output = {"every": 1e-7, "formats": ["hdf5", "vtu"]}
    run(
        row_of([METAL, HARDENING], formulation={"type": "eulerian"}, time={"end": 2e-7}, output=output),
        work / "run",
        threads=1,
    )
    kinds = [(list_snapshots(work / "run")[-1], read_snapshot), (next((work / "run/vtu").glob("*1.vtu")), read_snapshot),
             (list_checkpoints(work / "run/checkpoint")[0], read_checkpoint)]  # fmt: skip
    rng, detected = random.Random(3), 0
    for k in range(count):
        original, read = kinds[k % len(kinds)]
        path = work / original.name
        path.write_bytes(damaged(original.read_bytes(), rng))
        try:
            read(path)
        except HvisphError as error:
            detected += str(path) in str(error)
    assert detected == count
    return f"{detected} of {count} detected and named: HDF5 and VTU snapshots, checkpoints"


def cost(work):
    """Time the checkpoints of a 2D case, and of a million particles in 3D."""
    case = load_case("al_al", ["time.max_steps=150", "output.formats=[hdf5]", "output.checkpoint_every=1"])
    seconds = []
    import hvisph.simulation.run_files as files

    def timed(folder, checkpoint):
        began = time.perf_counter()
        write_checkpoint(folder, checkpoint)
        seconds.append(time.perf_counter() - began)

    files.write_checkpoint = timed
    summary = run(case, work / "cost", threads=1).summary
    files.write_checkpoint = write_checkpoint
    small = float(np.median(seconds))
    arrays = {
        "state": np.random.default_rng(0).normal(size=(1_000_000, 24)),
        "rows": np.zeros((1_000_000, 32)),
    }
    began = time.perf_counter()
    write_checkpoint(work, Checkpoint(1, {}, arrays))
    large = time.perf_counter() - began
    return (
        f"{100 * small / 60:.2f} % at one a minute for {summary['particles']} particles ({1e3 * small:.0f} ms each); "
        f"a million particles in 3D take {large:.1f} s each ({sum(a.nbytes for a in arrays.values()) / 1e6:.0f} MB), "
        "and the cadence is stretched to keep them below 2 % of the run"
    )


def collisions(count, work):
    """Let bodies of random shape, place, spin of axes and material meet, with damage and spall."""
    ends, momentum, energy = {"done": 0, "failed": 0}, 0.0, 0.0
    for seed in range(count):
        rng = np.random.default_rng(seed)
        bodies = {}
        for k in range(int(rng.integers(2, 5))):
            size = rng.uniform(2.5e-3, 4.5e-3, 3)
            shape = {"type": "box", "size": size.tolist()}
            if rng.random() < 0.5:
                shape = {"type": "sphere", "diameter": float(size[0])}
            place = [7e-3 * k, *rng.uniform(-1.2e-3, 1.2e-3, 2).tolist()]
            speed = rng.uniform(500.0, 4000.0)
            bodies[f"body_{k}"] = {
                "material": [DAMAGED, HARDENING, METAL][int(rng.integers(3))],
                "shape": shape,
                "position": place,
                "velocity": [float(speed * (1 if k == 0 else -0.5)), *rng.normal(0.0, 200.0, 2).tolist()],
            }
            if shape["type"] == "box":
                bodies[f"body_{k}"]["rotation"] = {
                    "angle": float(rng.uniform(0, 3)),
                    "axis": rng.normal(size=3).tolist(),
                }
        case = load_case(
            {"kinematics": "three_d", "resolution": 0.4e-3, "bodies": bodies, "time": {"end": 4e-6},
             "formulation": {"type": ["eulerian", "riemann"][seed % 2]}, "output": {"checkpoint_every": None}}
        )  # fmt: skip
        summary = run(case, work / "collision", force=True, threads=1).summary
        ends[summary["status"]] += 1
        if summary["status"] == "done":
            momentum = max(momentum, summary["conservation"]["momentum_drift"])
            energy = max(energy, abs(summary["conservation"]["energy_drift"]))
        else:
            print("  seed", seed, summary["failure"]["message"])
    return (
        f"{count} seeds: {ends['done']} ended, {ends['failed']} stopped cleanly by a watcher; "
        f"momentum within {momentum:.1e}, energy within {energy:.1e}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    for name, count in (
        ("kills", 300),
        ("fuzz", 20_000),
        ("damage", 500),
        ("seeds", 200),
        ("shorts", 2000),
        ("forged", 500),
        ("foreign", 100),
        ("long", 100_000),
        ("caches", 20),
        ("memory", 3_000_000),
    ):
        parser.add_argument(f"--{name}", type=int, default=count)
    parser.add_argument("--only", default="")
    parser.add_argument("--out", type=Path, default=ROOT / "docs/robustness.md")
    asked = parser.parse_args()
    programs = [
        ("kills", "random kills survived, nothing lost but the steps since the last checkpoint", "300, all resumed bit for bit",
         lambda work: kills(asked.kills, work)),
        ("resumes", "resumed run equal to the unbroken one, bit for bit", "every formulation, every material", resumes),
        ("fuzz", "fuzzed case files through `hvisph check`", "20,000, no traceback, none over 5 s",
         lambda work: fuzz(asked.fuzz, work)),
        ("damage", "damaged files", "500, none undetected or crashing", lambda work: damage(asked.damage, work)),
        ("shorts", "fuzzed cases through runs of five steps", "2,000, no traceback, documented exit codes",
         lambda work: shorts(asked.shorts, work)),
        ("forged", "forged snapshots, checkpoints and summaries with a right seal",
         "500, a message, nothing read or written outside", lambda work: forged(asked.forged, work)),
        ("foreign", "foreign files and links in run folders", "100 untouched", lambda work: foreign(asked.foreign, work)),
        ("caches", "five processes at once on a cold cache, on garbage, two versions sharing it", "20 rounds, right results",
         lambda work: caches(asked.caches, work)),
        ("long", "long runs, all formulations", "1e5 steps, energy and momentum to 1e-12, no growth of memory",
         lambda work: long(asked.long, work)),
        ("memory", "memory promised by `check`", "within 20 %; a case just beyond is refused", lambda work: memory(asked.memory, work)),
        ("cost", "cost of checkpoints", "below 2 % of the run time", cost),
        ("collisions", "collisions of random bodies in 3D with damage and spall",
         "100 seeds end or stop cleanly; momentum 1e-12, energy 0.5 %", lambda work: collisions(asked.seeds, work)),
    ]  # fmt: skip
    for name, what, reach, program in programs:
        if asked.only and name not in asked.only.split(","):
            continue
        with tempfile.TemporaryDirectory() as folder:
            began = time.perf_counter()
            found = program(Path(folder))
        print(f"{name}: {found} [{time.perf_counter() - began:.0f} s]", flush=True)
        keep_row(asked.out, [entry[1] for entry in programs], (what, reach, found))


def keep_row(path, order, row):
    """Put a row into the table of `path`, in place of its former one."""
    known = {}
    if path.is_file():
        cells = [
            line.strip("| ").split(" | ") for line in path.read_text(encoding="utf-8").splitlines() if line[:1] == "|"
        ]
        known = {one[0]: one for one in cells if len(one) == 3 and one[0] in order}
    known[row[0]] = list(row)
    lines = [HEAD, *(f"| {' | '.join(known[what])} |" for what in order if what in known)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
