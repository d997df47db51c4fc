"""Runs that are killed at random times and go on, for `robustness.py`."""

from __future__ import annotations

import itertools
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

import psutil  # noqa: E402
from attacks import in_child  # noqa: E402
from campaign import Tally  # noqa: E402
from small_runs import DAMAGED, FORMULATIONS, METAL, OPTIONS, assert_same_results, every_material, row_of  # noqa: E402

import hvisph  # noqa: E402
from hvisph.casefile.loader import dump_case  # noqa: E402
from hvisph.output.checkpoint_file import list_checkpoints, read_checkpoint  # noqa: E402
from hvisph.output.reader import list_snapshots, read_history, read_snapshot  # noqa: E402
from hvisph.simulation.run import run  # noqa: E402

KILLS = 6  # at most, of one run
SPACING = {1: 0.02e-3, 2: 0.125e-3, 3: 0.25e-3}  # [m], by dimensions: a run takes about a second
MPIEXEC = shutil.which("mpiexec", path=str(Path(sys.executable).parent)) or shutil.which("mpiexec")
LOOSE = {"density": False, "speed_over_initial": None, "energy_drift": None, "negative_energy": None}


def _formulation(name, **options):
    return {"formulation": {"type": name} | OPTIONS.get(name, {}) | options}


def kinds():
    """Return cases by name: every formulation in every dimension, and options beside the defaults."""
    made = {f"{name} {dim}D": (dim, _formulation(name)) for name in FORMULATIONS for dim in (1, 2, 3)}
    variable = {"smoothing_length": {"type": "variable"}}
    made |= {
        "riemann predictor-corrector": (2, {"time": {"integrator": "predictor_corrector"}}),
        "riemann variable h": (2, _formulation("riemann", **variable)),
        "riemann printed": (2, _formulation("riemann", variant="original")),
        "riemann welded": (2, _formulation("riemann", contact={"type": "bonded"})),
        "riemann mirrored": (2, {"symmetry": [{"axis": "y", "at": 0.0}]}),
        "riemann in a domain": (2, {"domain": {"max": [3.5e-3, None]}}),  # the rear of the second body leaves
        "riemann with gauges": (2, {"gauges": {"here": {"type": "fixed", "at": [1e-3, 0.0], "fields": ["pressure"]}}}),
        "eulerian corrected": (2, _formulation("eulerian", correction={"type": "mixed"})),
        "eulerian variable h": (3, _formulation("eulerian", **variable)),
        "eulerian balsara": (2, _formulation("eulerian", viscosity={"type": "balsara"})),
        "eulerian switched": (2, _formulation("eulerian", viscosity={"type": "morris_monaghan"})),
        "eulerian mass form": (2, _formulation("eulerian", density_form="mass")),
        "eulerian predictor-corrector": (2, _formulation("eulerian") | {"time": {"integrator": "predictor_corrector"}}),
        "plane stress": (2, _formulation("eulerian") | {"kinematics": "plane_stress"}),
        "axisymmetric": (2, {"kinematics": "axisymmetric"}),
        "axisymmetric eulerian": (2, _formulation("eulerian") | {"kinematics": "axisymmetric"}),
        "total_lagrangian renewed": (2, _formulation("total_lagrangian", reference_update_strain=0.05)),
        "total_lagrangian repulsive": (
            2,
            _formulation("total_lagrangian", contact={"type": "penalty", "stiffness": 1.0}),
        ),
        "total_lagrangian hourglass": (3, _formulation("total_lagrangian", hourglass=0.1)),
        "adaptive predictor-corrector": (2, _formulation("adaptive") | {"time": {"integrator": "predictor_corrector"}}),
        "adaptive printed": (2, _formulation("adaptive", contact={"type": "bonded"}, viscosity_gradient="reference")),
    }
    return made


def long_case(dim, options):
    """A case of about a second with snapshots and checkpoints all the time."""
    end = 4e-8 if options.get("formulation", {}).get("type") == "projection" else 3e-6 / dim
    time_ = {"end": end} | options.get("time", {})
    output = {"every": end / 6, "formats": ["hdf5", "vtu"], "checkpoint_every": 0.02}
    material = DAMAGED if "conversion" in options.get("formulation", {}) else METAL
    return row_of(
        [METAL, material], dim=dim, dx=SPACING[dim], **options | {"time": time_, "output": output, "watch": LOOSE}
    )


class Forked:
    """A run, or what is left of it, in a process forked from this one."""

    def __init__(self, case, folder):
        self.number = os.fork()
        if self.number == 0:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            code = 1
            try:
                self.compute(case, folder)
                code = 0
            finally:
                os._exit(code)

    @staticmethod
    def compute(case, folder):
        """Resume a run, or begin it where it was killed before its case was written."""
        if (folder / "case.yaml").is_file():
            hvisph.resume(folder, threads=1)
        else:
            run(case, folder, force=True, threads=1)

    def kill(self, rng):
        """Kill it; return whether it was still there."""
        os.kill(self.number, signal.SIGKILL)
        return os.WIFSIGNALED(os.waitpid(self.number, 0)[1])

    def wait(self):
        """Wait for its end; return its exit code."""
        return os.waitstatus_to_exitcode(os.waitpid(self.number, 0)[1])


class Launched:
    """A run, or what is left of it, on two processes started by mpiexec; any of the three may be killed."""

    slowest = 0.0  # [s] from a kill until all processes have gone

    def __init__(self, case, folder):
        file = folder.parent / "case.yaml"
        file.write_text(dump_case(case), encoding="utf-8")
        verb = ["resume", folder] if (folder / "case.yaml").is_file() else ["run", file, "--out", folder, "--force"]
        command = [MPIEXEC, "-n", 2, sys.executable, "-m", "hvisph", *verb, "--threads", 1, "--quiet"]
        self.process = subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def kill(self, rng):
        """Kill one of its processes and wait until all have gone; return whether there was one to kill."""
        try:
            all_ = psutil.Process(self.process.pid).children(recursive=True)
            computing = [process for process in all_ if "hvisph" in process.cmdline() and "-n" not in process.cmdline()]
            victims = [*computing, psutil.Process(self.process.pid)]
            rng.choice(victims).kill()
        except psutil.NoSuchProcess:
            pass
        began = time.monotonic()
        code = self.process.wait(60)
        _, left = psutil.wait_procs(all_, timeout=30)
        Launched.slowest = max(Launched.slowest, time.monotonic() - began)
        assert not left, f"processes go on after one was killed: {left}"
        return code != 0

    def wait(self):
        """Wait for its end; return its exit code."""
        return self.process.wait()


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


def kills(work):
    """Kill runs of every kind at random times, go on, and compare with the run that was not killed."""
    made = {name: partial(long_case, *kind) for name, kind in kinds().items()}
    made |= {f"{name} with every material": partial(every_material, name) for name in FORMULATIONS}
    return _trials(work, Forked, made)


def distributed(work):
    """Kill runs on two processes at random times, launcher and processes, and go on; as of `kills`."""
    if MPIEXEC is None:
        raise SystemExit("no mpiexec: pip install 'hvisph[mpi]'")
    both = [*itertools.product((2, 3), ("eulerian", "riemann")), *((2, name) for name in FORMULATIONS[2:])]
    made = {f"{name} {dim}D": partial(long_case, dim, _formulation(name)) for dim, name in both}
    return _trials(work, Launched, made)


def _trials(work, kind, made):
    names, wholes = [*made], {}

    def trial(number) -> Tally:
        name, rng = names[number % len(names)], random.Random(number)
        case = made[name]()
        folder, whole = work / "killed", work / f"whole {name}"
        shutil.rmtree(folder, ignore_errors=True)
        if name not in wholes:
            code, said = in_child(lambda: run(case, whole, threads=1), seconds=300)
            assert code == 0, f"{name}: {said}"
            wholes[name] = json.loads((whole / "summary.json").read_text())["wall_seconds"]
        start = 8.0 if kind is Launched else 1.0  # [s] until the first step, about
        process, count = kind(case, folder), 0
        while count < KILLS:
            time.sleep(rng.uniform(0.0, 0.6 * wholes[name] + start))
            killed = process.kill(rng)
            check_whole(folder)
            if not killed:  # it had ended before
                break
            count += 1
            process = kind(case, folder)
        else:
            process.wait()
        assert kind(case, folder).wait() == 0, name
        assert_same_results(folder, whole)
        assert not list(folder.glob("**/*.partial")), name
        return {"kills": {name: count}} | ({"most_seconds": Launched.slowest} if kind is Launched else {})

    return trial


def told(tally):
    """Return the counts in words."""
    by = tally.get("kills", {})
    many = ", ".join(f"{name} {count}" for name, count in by.items())
    ended = f"; after a kill all ended within {tally['most_seconds']:.1f} s" if "most_seconds" in tally else ""
    return f"{sum(by.values())} of {sum(by.values())} in {tally['trials']} runs of {len(by)} kinds: {many}{ended}"
