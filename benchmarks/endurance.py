"""What runs bear over time and in numbers, for `robustness.py`: short fuzzed runs, long runs, shared caches, memory."""

from __future__ import annotations

import json
import os
import random
import resource
import shutil
import subprocess
import sys
import time
import traceback
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

from attacks import in_child  # noqa: E402
from campaign import counts  # noqa: E402
from hostile import GOOD, extreme, mutated, shifted  # noqa: E402
from numba.core import event  # noqa: E402
from small_runs import FORMULATIONS, METAL, OPTIONS, row_of  # noqa: E402

from hvisph.casefile.loader import dump_case, load_case  # noqa: E402
from hvisph.core.errors import CaseError, HvisphError  # noqa: E402
from hvisph.simulation.estimate import estimate, refuse_impossible  # noqa: E402
from hvisph.simulation.run import run  # noqa: E402

DIMENSIONS = (1, 2, 3)
ENDS = {0: "ended", 1: "ended", 3: "stopped by a watcher"}
LONGEST = 5.0  # [s] of processor time of a short run, compiling not counted


def texts():
    """Return small cases of every formulation and dimension as text."""
    made = [GOOD]
    for formulation in FORMULATIONS:
        for dim in DIMENSIONS:
            options = {"type": formulation} | OPTIONS.get(formulation, {})
            try:
                made.append(dump_case(row_of([METAL, METAL], dim=dim, formulation=options)))
            except CaseError:
                continue
    return made


class Compiling(event.Listener):
    """Adds up the processor time that numba spends on compiling [s]."""

    def __init__(self):
        self.depth, self.began, self.seconds = 0, 0.0, 0.0

    def on_start(self, event_):
        """Hear that something begins to be compiled."""
        self.depth += 1
        if self.depth == 1:
            self.began = time.process_time()

    def on_end(self, event_):
        """Hear that it is compiled."""
        self.depth -= 1
        if self.depth == 0:
            self.seconds += time.process_time() - self.began


def shorts(work):
    """Run fuzzed cases for five steps; each ends with a documented code, soon, and without a traceback.

    All in one process, which loads each loop once; a crash of it ends the campaign.
    """
    cases, folder, path = texts(), work / "short", work / "case.yaml"
    compiling = Compiling()
    event.register("numba:compile", compiling)

    def trial(number):
        content = _short(number, cases)
        path.write_text(content, encoding="utf-8", errors="surrogatepass")
        shutil.rmtree(folder, ignore_errors=True)
        began, before = time.process_time(), compiling.seconds
        try:
            case = load_case(path, ["time.max_steps=5", "output.every=null"])
            if estimate(case).particles > 20_000:
                raise CaseError("too large for a short run")
            end = ENDS[run(case, folder, threads=1).exit_code]
        except HvisphError:
            end = "refused with a message"
        except Exception as error:
            raise SystemExit(f"short run {number}: {traceback.format_exc()}\n{content}") from error
        seconds = time.process_time() - began - (compiling.seconds - before)
        if seconds > LONGEST:
            raise SystemExit(f"short run {number} took {seconds:.1f} s of processor time\n{content}")
        return {"ends": {end: 1}, "most_seconds": seconds}

    return trial


def _short(number, cases):
    """Return the case of a short run."""
    rng = random.Random(number)
    text = (extreme if rng.random() < 0.3 else shifted)(rng.choice(cases), rng)
    return mutated(text, rng) if rng.random() < 0.2 else text


def shorts_told(tally):
    """Return the counts in words."""
    slowest = f"slowest {tally['most_seconds']:.1f} s of processor time without compiling"
    return f"{tally['trials']}: {counts(tally['ends'])}; no traceback, {slowest}"


def long(steps):
    """Return the campaign of one run a formulation for many steps: energy, momentum and memory are watched."""

    def start(work):
        def trial(number):
            formulation = FORMULATIONS[number]
            options = {"type": formulation} | OPTIONS.get(formulation, {})
            loose = {"speed_over_initial": None, "energy_drift": None, "density": False}
            case = row_of([METAL], speed=10.0, formulation=options, watch=loose, time={"end": 1.0, "max_steps": steps},
                          output={"history_every": 1000, "checkpoint_every": 5.0})  # fmt: skip

            def action():
                early = case.time.model_copy(update={"max_steps": steps // 10})
                run(case.model_copy(update={"time": early}), work / f"{formulation}_short", threads=1)
                before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
                summary = run(case, work / formulation, threads=1).summary
                grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
                return json.dumps([summary["status"], summary["steps"], summary["conservation"], grown])

            code, said = in_child(action, seconds=3600)
            assert code == 0, said
            status, done, kept, grown = json.loads(said)
            assert (status, done) == ("done", steps), said
            energy = "no energy" if kept["energy_drift"] is None else f"energy {abs(kept['energy_drift']):.0e}"
            memory_ = f"memory +{grown / 1e3:.1f} MB"
            return {"runs": [f"{formulation} {energy}, momentum {kept['momentum_drift']:.0e}, {memory_}"]}

        return trial

    return start


def long_told(tally):
    """Return the runs in words."""
    return f"1e5 steps each: {'; '.join(tally['runs'])}"


PROGRAM = """
import sys, json
sys.path[:0] = [{root!r}, {tests!r}]
from small_runs import METAL, row_of
from hvisph.core.self_test import self_test
from hvisph.simulation.run import run
import tempfile
with tempfile.TemporaryDirectory() as work:
    case = row_of([METAL], dim=1, formulation={{"type": "eulerian"}}, time={{"end": 1e-7}})
    summary = run(case, work + "/run", threads=1).summary
print(json.dumps([self_test()["passed"], summary["steps"], summary["conservation"]["energy_drift"]]))
"""


def caches(work):
    """Let five processes, of two versions of the code, meet on one cold cache that is then filled with garbage."""
    other = work / "other"
    shutil.copytree(ROOT / "hvisph", other / "hvisph", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "tests", other / "tests", ignore=shutil.ignore_patterns("__pycache__"))
    file = other / "hvisph/integrators/criteria.py"  # the other version takes half the step
    text = file.read_text(encoding="utf-8")
    assert "self.cfl * float(" in text
    file.write_text(text.replace("self.cfl * float(", "0.5 * self.cfl * float("), encoding="utf-8")
    steps = {}

    def trial(number):
        cache, rng = work / f"cache_{number}", random.Random(number)
        for stage in ("cold", "garbage"):
            for version, said in _together(cache, other, f"{stage} {number}"):
                passed, done, drift = said
                assert passed
                assert abs(drift) < 1e-13
                assert steps.setdefault(version, done) == done
            assert len(set(steps.values())) == 2
            for path in cache.rglob("*.loop"):
                content = bytearray(path.read_bytes())
                kind = rng.randrange(4)
                path.write_bytes(b"" if kind == 0 else content[: len(content) // 2] if kind == 1
                                 else rng.randbytes(3000) if kind == 2 else content)  # fmt: skip
        shutil.rmtree(cache)
        return {"processes": 10}

    return trial


def _together(cache, other, what):
    """Start five processes of two versions on one cache; yield the version of each and what it said."""
    started = []
    for k in range(5):
        root = other if k % 2 else ROOT
        program = PROGRAM.format(root=str(root), tests=str(root / "tests"))
        environment = os.environ | {"HVISPH_CACHE_DIR": str(cache), "PYTHONPATH": str(root)}
        started.append((k % 2, subprocess.Popen([sys.executable, "-c", program], env=environment,
                                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)))  # fmt: skip
    for version, process in started:
        said, wrong = process.communicate()
        assert process.returncode == 0, f"{what}: {wrong}"
        yield version, json.loads(said.strip().splitlines()[-1])


def caches_told(tally):
    """Return the counts in words."""
    return (
        f"{tally['trials']} rounds, cold and full of garbage, two versions of the code: right results in all "
        f"{tally['processes']} processes"
    )


def memory(count):
    """Return the campaign that compares what `check` promises with what runs of so many particles take."""

    def start(work):
        def trial(number):
            formulation = FORMULATIONS[number]
            options = {"type": formulation} | OPTIONS.get(formulation, {})
            size = (count / 2.0) ** 0.5 * 0.5e-3
            bodies = {name: {"material": METAL, "shape": {"type": "box", "size": [size, size]},
                             "velocity": [1500.0 * (name == "a"), 0.0]} for name in "ab"}  # fmt: skip
            case = load_case({"kinematics": "plane_strain", "resolution": 0.5e-3, "bodies": bodies,
                              "formulation": options, "time": {"end": 1e-3, "max_steps": 3}})  # fmt: skip

            def action():
                run(case, work / formulation, threads=1)
                return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024

            coarse = case.model_copy(update={"resolution": case.resolution * 20})
            in_child(lambda: run(coarse, work / "small", threads=1, force=True))  # compiles
            code, said = in_child(action, seconds=3600)
            assert code == 0, said
            shutil.rmtree(work / formulation)
            promised, taken = estimate(case).memory, float(said)
            try:
                refuse_impossible(case, free=promised * 0.99)
            except CaseError:
                refused = 1
            else:
                raise SystemExit(f"{formulation}: a case beyond memory is not refused")
            text = (
                f"{formulation} {promised / 1e9:.2f} GB promised, {taken / 1e9:.2f} taken ({promised / taken - 1:+.0%})"
            )
            return {"runs": [text], "refused": refused, "most_off": abs(promised / taken - 1.0)}

        return trial

    return start


def memory_told(tally):
    """Return the runs in words."""
    return (
        f"3e6 particles in 2D: {'; '.join(tally['runs'])}; with a hundredth less memory than promised each is refused"
    )
