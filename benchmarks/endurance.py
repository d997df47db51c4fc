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
from hvisph.precheck.estimate import estimate, refuse_impossible  # noqa: E402
from hvisph.simulation.run import run  # noqa: E402

DIMENSIONS = (1, 2, 3)
MEASURED = ("riemann", "total_lagrangian")  # without and with lists of neighbours
ENDS = {0: "ended", 1: "ended", 3: "stopped by a watcher"}
LONGEST = 5.0  # [s] of processor time of a short run, compiling not counted
# A fifth of the particles turn Eulerian in a long run at 10 m/s, and stay beside the others.
LONG = {"adaptive": {"conversion": {"strain": 1e-3}}}


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
            options = {"type": formulation} | LONG.get(formulation, {})
            limits = {"speed_over_initial": None, "energy_drift": None, "density": False}
            case = row_of([METAL, METAL], speed=10.0, formulation=options, watch=limits, time={"end": 1.0, "max_steps": steps},
                          output={"history_every": 1000, "checkpoint_every": 5.0})  # fmt: skip

            def action():
                early = case.time.model_copy(update={"max_steps": steps // 10})
                run(case.model_copy(update={"time": early}), work / f"{formulation}_short", threads=1)
                before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
                summary = run(case, work / formulation, threads=1).summary
                grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
                return json.dumps([summary["status"], summary["steps"], summary["conservation"], grown])

            code, output = in_child(action, seconds=3600)
            assert code == 0, output
            status, done, kept, grown = json.loads(output)
            assert (status, done) == ("done", steps), output
            energy = "no energy" if kept["energy_drift"] is None else f"energy {abs(kept['energy_drift']):.0e}"
            memory_ = f"memory +{grown / 1e3:.1f} MB"
            return {"runs": [f"{formulation} {energy}, momentum {kept['momentum_drift']:.0e}, {memory_}"]}

        return trial

    return start


def long_told(tally):
    """Return the runs in words."""
    return f"1e5 steps each: {'; '.join(tally['runs'])}"


# Imports once; then, for each line "FOLDER COUNT", lets so many children meet on the cache in a folder.
SERVER = """
import hashlib, json, os, sys, tempfile
sys.path[:0] = [{root!r}, {tests!r}]
from small_runs import METAL, final, row_of
import numpy as np
from hvisph.compiler.cache_folder import cache_folder
from hvisph.compiler.self_test import self_test
from hvisph.simulation.run import run
case = row_of([METAL], dim=1, formulation={{"type": "eulerian"}}, time={{"end": 1e-7}})

def work(folder):
    os.environ["HVISPH_CACHE_DIR"] = folder
    cache_folder.cache_clear()
    passed = self_test()["passed"]
    with tempfile.TemporaryDirectory() as place:
        summary = run(case, place + "/run", threads=1).summary
        fields = final(__import__("pathlib").Path(place) / "run").fields
    text = b"".join(name.encode() + np.ascontiguousarray(fields[name]).tobytes() for name in sorted(fields))
    return [passed, summary["steps"], hashlib.sha256(text).hexdigest()]

for line in sys.stdin:
    folder, count = line.rsplit(" ", 1)
    pipes = []
    for _ in range(int(count)):
        read, write = os.pipe()
        if os.fork() == 0:
            said = "null"
            try:
                said = json.dumps(work(folder))
            finally:
                os.write(write, said.encode())
                os._exit(0)
        os.close(write)
        pipes.append(read)
    said = []
    for read in pipes:
        with os.fdopen(read) as pipe:
            said.append(json.loads(pipe.read() or "null"))
        os.wait()
    print(json.dumps(said), flush=True)
"""
SMALL_LOOP = 60_000  # [bytes] of a loop that is compiled in about a second


def caches(work):
    """Let five processes, of two versions of the code, meet on a cache of which a part is missing, or is garbage.

    The part is of loops that are soon compiled; each round has other ones.
    """
    second = work / "other"
    for name in ("hvisph", "tests"):
        shutil.copytree(ROOT / name, second / name, ignore=shutil.ignore_patterns("__pycache__"))
    _changed(
        second / "hvisph/integrators/time_step.py", "self.cfl * times[kind]", "0.5 * self.cfl * times[kind]"
    )  # half the step
    _changed(second / "hvisph/compiler/self_test.py", "np.sqrt(x[k]) * x[k]", "x[k] * np.sqrt(x[k])")  # another loop
    servers, cache_full = [_server(root) for root in (ROOT, second)], work / "full"
    right = [_together([server], cache_full, [1])[0] for server in servers]  # a cold cache, compiled by one of each
    assert all(one and one[0] for one in right)
    assert right[0][1:] != right[1][1:]

    def trial(number):
        cache, rng, spoilt = work / f"cache_{number}", random.Random(number), {}
        shutil.copytree(cache_full, cache)
        small = sorted(path for path in cache.rglob("*.loop") if path.stat().st_size < SMALL_LOOP)
        for path in rng.sample(small, min(4, len(small))):
            kind = rng.choice(["missing", "empty", "cut off", "noise", "one bit turned"])
            spoilt[kind] = spoilt.get(kind, 0) + 1
            _spoil(path, kind, rng)
        answers = _together(servers, cache, [3, 2])
        assert answers == [right[0]] * 3 + [right[1]] * 2, f"{number}, {spoilt}: {answers}"
        second_answers = _together(servers, cache, [1, 1])  # what they have left behind is whole
        assert second_answers == right, f"{number}, afterwards: {second_answers}"
        shutil.rmtree(cache)
        return {"processes": 7, "loops": spoilt}

    return trial


def _changed(file, old, new):
    """Change a version of the code."""
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")


def _server(root):
    """Start a version of the code that waits for rounds."""
    program = SERVER.format(root=str(root), tests=str(root / "tests"))
    environment = os.environ | {"PYTHONPATH": str(root), "NUMBA_NUM_THREADS": "1"}
    return subprocess.Popen([sys.executable, "-c", program], env=environment, text=True,
                            stdin=subprocess.PIPE, stdout=subprocess.PIPE)  # fmt: skip


def _together(servers, cache, counts_):
    """Let so many processes of each version begin at once on a cache; return what each says."""
    for server, count in zip(servers, counts_, strict=True):
        server.stdin.write(f"{cache} {count}\n")
        server.stdin.flush()
    return [one for server in servers for one in json.loads(server.stdout.readline())]


def _spoil(path, damage, rng):
    """Take a loop out of the cache, or make it garbage."""
    content = bytearray(path.read_bytes())
    if damage == "missing":
        path.unlink()
        return
    if damage == "one bit turned":
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    contents = {"empty": b"", "cut off": content[: len(content) // 2], "noise": rng.randbytes(3000)}
    path.write_bytes(contents.get(damage, content))


def caches_told(tally):
    """Return the counts in words."""
    return (
        f"{tally['trials']} rounds of five processes of two versions, beginning at once on a cache of which four loops were "
        f"spoilt ({counts(tally['loops'])}), after a cold one: right results, bit for bit, in all {tally['processes']}"
    )


def memory(count):
    """Return the campaign that compares what `check` promises with what runs of so many particles take."""

    def start(work):
        def trial(number):
            formulation = MEASURED[number]
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
            code, output = in_child(action, seconds=3600)
            assert code == 0, output
            shutil.rmtree(work / formulation)
            promised, used = estimate(case).memory, float(output)
            try:
                refuse_impossible(case, free=promised * 0.99)
            except CaseError:
                refusals = 1
            else:
                raise SystemExit(f"{formulation}: a case beyond memory is not refused")
            text = (
                f"{formulation} {promised / 1e9:.2f} GB promised, {used / 1e9:.2f} taken ({promised / used - 1:+.0%})"
            )
            return {"runs": [text], "refused": refusals, "most_off": abs(promised / used - 1.0)}

        return trial

    return start


def memory_told(tally):
    """Return the runs in words."""
    return (
        f"3e6 particles in 2D: {'; '.join(tally['runs'])}; with a hundredth less memory than promised each is refused"
    )
