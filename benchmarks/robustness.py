"""Robustness campaigns: kills, resumption, hostile input, damaged files, collisions; writes docs/robustness.md.

    python benchmarks/robustness.py [--only NAME] [--seconds 400] [--trials N] [--tally FILE] [--out PAGE]

Whole, it takes some hours on two cores. It goes on where it was: trials that the tally counts are not repeated.
"""

from __future__ import annotations

import argparse
import functools
import os
import random
import sys
import tempfile
import time
import traceback
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

import attacks  # noqa: E402
import collisions  # noqa: E402
import endurance  # noqa: E402
import kills  # noqa: E402
import numpy as np  # noqa: E402
import several  # noqa: E402
from campaign import Campaign, counts, keep_row  # noqa: E402
from hostile import GOOD, MISTAKES, damaged, extreme, mutated, shifted  # noqa: E402
from small_runs import FORMULATIONS, HARDENING, METAL, assert_same_results, every_material, row_of  # noqa: E402

import hvisph  # noqa: E402
from hvisph.casefile.loader import load_case  # noqa: E402
from hvisph.core.errors import HvisphError  # noqa: E402
from hvisph.output.checkpoint_file import Checkpoint, list_checkpoints, read_checkpoint, write_checkpoint  # noqa: E402
from hvisph.output.reader import list_snapshots, read_snapshot  # noqa: E402
from hvisph.simulation.run import run  # noqa: E402

HEAD = """\
# Robustness

Each row is a campaign of numbered, reproducible trials in `benchmarks/robustness.py`; `--only NAME`
runs one, `--seconds 400` a part of it.

| what | required | found |
| --- | --- | --- |"""

LONGEST = 5.0  # [s] of processor time until a fuzzed case must be refused or accepted: waiting is not counted


def resumes(work):
    """Run every formulation, integrator and material in one go and in two parts."""
    kinds = [(name, "leapfrog") for name in FORMULATIONS]
    kinds += [(name, "predictor_corrector") for name in FORMULATIONS if name != "projection"]

    def trial(number):
        formulation, integrator = kinds[number]
        case = every_material(formulation, time={"end": 6e-7, "integrator": integrator})
        folder = work / f"{formulation}_{integrator}"
        run(case, folder / "whole", threads=1)
        short = case.model_copy(update={"time": case.time.model_copy(update={"max_steps": 13})})
        run(short, folder / "parts", threads=1)
        hvisph.resume(folder / "parts", max_steps=0, threads=1)
        assert_same_results(folder / "whole", folder / "parts")
        return {"same": [f"{formulation} ({integrator})"]}

    return trial


def resumes_told(tally):
    """Return what was the same in words."""
    same = tally["same"]
    return (
        f"{len(same)} of {len(same)}: {', '.join(same)}; five materials in each case where the formulation takes them"
    )


def fuzz(work):
    """Send mutated and damaged case files, and random bytes, through `hvisph check`."""
    from typer import testing
    from typer.main import get_command

    from hvisph.cli.main import app

    testing._get_command = functools.cache(get_command)  # is made once in a process that lives for one command
    bundled = [path.read_text() for path in sorted((ROOT / "cases").rglob("*.yaml")) if path.name != "set.yaml"]
    path, runner, small = work / "case.yaml", testing.CliRunner(), endurance.texts()
    path.write_text(GOOD)
    runner.invoke(app, ["check", str(path)])  # imports are no part of the time

    def trial(number):
        content = _fuzzed(number, bundled, small)
        path.write_bytes(content)
        began = time.process_time()
        result = runner.invoke(app, ["check", str(path)])
        seconds = time.process_time() - began
        fine = result.exit_code in (0, 2) and "Traceback" not in result.output and "bug in hvisph" not in result.output
        if not fine or seconds > LONGEST:
            keep = Path(tempfile.gettempdir()) / f"hvisph_fuzz_{number}.yaml"
            keep.write_bytes(content)
            raise SystemExit(
                f"fuzzed case {number} ended with {result.exit_code} after {seconds:.2f} s, kept as {keep}\n{result.output}"
            )
        return {"ends": {"refused with a message" if result.exit_code else "still good": 1}, "most_seconds": seconds}

    return trial


def _fuzzed(number, bundled, small):
    """Return the case file of a trial."""
    rng = random.Random(number)
    if number % 20 == 0:
        return rng.randbytes(rng.randrange(400))
    if number % 20 == 1:
        return damaged(rng.choice(list(MISTAKES.values()))[:5000] or b"x", rng)
    text = rng.choice(bundled if number % 4 == 2 else [GOOD, *small])
    change = mutated if number % 2 == 0 else extreme if number % 4 == 1 else shifted
    return change(text, rng).encode("utf-8", "surrogatepass")


def fuzz_told(tally):
    """Return the counts in words."""
    slowest = f"slowest {tally['most_seconds']:.2f} s of processor time"
    return f"{tally['trials']}: {counts(tally['ends'])}; no traceback, {slowest}"


def damage(work):
    """Truncate, or turn one bit of, snapshots and checkpoints, and read them."""
    output = {"every": 1e-7, "formats": ["hdf5", "vtu"]}
    case = row_of([METAL, HARDENING], formulation={"type": "eulerian"}, time={"end": 2e-7}, output=output)
    run(case, work / "run", threads=1)
    kinds = [(list_snapshots(work / "run")[-1], read_snapshot), (next((work / "run/vtu").glob("*1.vtu")), read_snapshot),
             (list_checkpoints(work / "run/checkpoint")[0], read_checkpoint)]  # fmt: skip

    def trial(number):
        original, reader = kinds[number % len(kinds)]
        path = work / original.name
        path.write_bytes(damaged(original.read_bytes(), random.Random(number)))
        try:
            reader(path)
        except HvisphError as error:
            if str(path) in str(error):
                return {}
        raise SystemExit(f"damage {number} of {original.name} is not detected and named")

    return trial


def damage_told(tally):
    """Return the count in words."""
    return f"{tally['trials']} of {tally['trials']} detected and named: HDF5 and VTU snapshots, checkpoints"


def cost(work):
    """Time the checkpoints of a 2D case, and of a million particles in 3D."""

    def trial(number):
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
        return {
            "text": [
                f"{100 * small / 60:.2f} % at one a minute for {summary['particles']} particles ({1e3 * small:.0f} ms each); "
                f"a million particles in 3D take {large:.1f} s each ({sum(a.nbytes for a in arrays.values()) / 1e6:.0f} MB), "
                "and the cadence is stretched to keep them below 2 % of the run"
            ]
        }

    return trial


CAMPAIGNS = [
    Campaign("kills", "random kills survived, nothing lost but the steps since the last checkpoint",
             "300, all resumed bit for bit", 123, kills.kills, kills.told),
    Campaign("distributed", "random kills of runs on two processes by MPI, launcher or process",
             "all resumed bit for bit", 20, kills.distributed, kills.told),
    Campaign("processes", "1 to 4 processes by MPI x 1 and 2 threads, and runs in parts on different numbers of them",
             "every case, bit for bit", len(several.cases()) * len([*several.SETTINGS, *several.PARTS]),
             several.processes, several.told),
    Campaign("resumes", "resumed run equal to the unbroken one, bit for bit", "every formulation, every material",
             2 * len(FORMULATIONS) - 1, resumes, resumes_told),
    Campaign("fuzz", "fuzzed case files through `hvisph check`", "20,000, no traceback, none over 5 s",
             20_000, fuzz, fuzz_told),
    Campaign("damage", "damaged files", "500, none undetected or crashing", 500, damage, damage_told),
    Campaign("shorts", "fuzzed cases through runs of five steps", "2,000, no traceback, documented exit codes",
             2000, endurance.shorts, endurance.shorts_told),
    Campaign("forged", "forged snapshots, checkpoints and summaries with a valid checksum",
             "500, a message, nothing read or written outside", 500, attacks.forged, attacks.forged_told),
    Campaign("foreign", "foreign files and links in run folders", "100 untouched", 100,
             attacks.foreign, attacks.foreign_told),
    Campaign("caches", "five processes at once on an empty or damaged cache, two versions sharing it",
             "20 rounds, right results", 20, endurance.caches, endurance.caches_told),
    Campaign("long", "long runs, all formulations", "1e5 steps, energy and momentum to 1e-12, no growth of memory",
             len(FORMULATIONS), endurance.long(100_000), endurance.long_told),
    Campaign("memory", "memory estimated by `check`", "within 20 %; a larger case is refused",
             len(endurance.MEASURED), endurance.memory(3_000_000), endurance.memory_told),
    Campaign("cost", "cost of checkpoints", "below 2 % of the run time", 1, cost, lambda tally: "".join(tally["text"])),
    Campaign("collisions", "collisions of random bodies in 3D, all formulations, damage and spall, symmetry planes, domain",
             "200 seeds end or stop cleanly; momentum 1e-12, angular momentum 1e-3, energy 1e-12, no internal energy "
             "below -1e-3 of the mean kinetic", 200, collisions.collisions(0.6e-3), collisions.told),
    Campaign("finer", "the same collisions at half the spacing", "the same", 200, collisions.collisions(0.3e-3),
             collisions.told),
]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="campaigns by name, with commas")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="of each campaign, about")
    parser.add_argument("--trials", type=int, default=10**9, help="of each campaign, at most")
    parser.add_argument("--tally", type=Path, default=Path("robustness.json"))
    parser.add_argument("--out", type=Path, default=ROOT / "docs/robustness.md")
    options = parser.parse_args()
    for campaign in CAMPAIGNS:
        if options.only and campaign.name not in options.only.split(","):
            continue
        if (number := os.fork()) == 0:  # some campaigns fork, which no process may that has run something
            made(campaign, options)
        if status := os.waitpid(number, 0)[1]:
            raise SystemExit(os.waitstatus_to_exitcode(status))


def made(campaign: Campaign, asked: argparse.Namespace) -> None:
    """Go on with a campaign, and tell of it."""
    began, code = time.perf_counter(), 1
    try:
        tally = campaign.go_on(asked.tally, asked.seconds, asked.trials)
        failed = tally.pop("failed", [])
        text = campaign.told(tally) + (f"; **failed**: trials {', '.join(map(str, failed))}" if failed else "")
        print(f"{campaign.name}: {text} [{time.perf_counter() - began:.0f} s]", flush=True)
        keep_row(asked.out, HEAD, [one.what for one in CAMPAIGNS], (campaign.what, campaign.reach, text))
        code = int(bool(failed))
    except SystemExit as error:
        print(error, file=sys.stderr)
    except BaseException:
        traceback.print_exc()
    os._exit(code)


if __name__ == "__main__":
    main()
