"""Runs that are killed at random times and go on, for `robustness.py`."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

from attacks import in_child  # noqa: E402
from campaign import Tally  # noqa: E402
from small_runs import (  # noqa: E402
    DAMAGED,
    FORMULATIONS,
    GAS,
    HARDENING,
    LIQUID,
    METAL,
    OPTIONS,
    assert_same_results,
    every_material,
    row_of,
)

import hvisph  # noqa: E402
from hvisph.core.errors import CaseError  # noqa: E402
from hvisph.output.checkpoint import list_checkpoints, read_checkpoint  # noqa: E402
from hvisph.output.reader import list_snapshots, read_history, read_snapshot  # noqa: E402
from hvisph.simulation.run import run  # noqa: E402

KILLS = 6  # at most, of one run
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
        "riemann printed": (2, _formulation("riemann", form="printed")),
        "riemann welded": (2, _formulation("riemann", contact={"type": "welded"})),
        "riemann mirrored": (2, {"symmetry": [{"axis": "y", "at": 0.0}]}),
        "riemann in a domain": (2, {"domain": {"min": [-2.5e-3, None]}}),
        "riemann with gauges": (2, {"gauges": {"here": {"type": "point", "position": [1e-3, 0.0]}}}),
        "eulerian corrected": (2, _formulation("eulerian", correction={"type": "mixed"})),
        "eulerian variable h": (3, _formulation("eulerian", **variable)),
        "eulerian balsara": (2, _formulation("eulerian", viscosity={"type": "balsara"})),
        "eulerian switched": (2, _formulation("eulerian", viscosity={"type": "morris_monaghan"})),
        "eulerian mass form": (2, _formulation("eulerian", density_form="mass")),
        "eulerian predictor-corrector": (2, _formulation("eulerian") | {"time": {"integrator": "predictor_corrector"}}),
        "plane stress": (2, _formulation("eulerian") | {"kinematics": "plane_stress"}),
        "axisymmetric": (2, {"kinematics": "axisymmetric"}),
        "axisymmetric eulerian": (2, _formulation("eulerian") | {"kinematics": "axisymmetric"}),
        "total_lagrangian renewed": (2, _formulation("total_lagrangian", renew_reference=0.05)),
        "total_lagrangian repulsive": (
            2,
            _formulation("total_lagrangian", contact={"type": "repulsive", "stiffness": 1.0}),
        ),
        "total_lagrangian hourglass": (3, _formulation("total_lagrangian", hourglass=0.1)),
        "adaptive predictor-corrector": (2, _formulation("adaptive") | {"time": {"integrator": "predictor_corrector"}}),
        "adaptive printed": (2, _formulation("adaptive", contact={"type": "welded"}, viscosity_gradient="reference")),
    }
    return made


def long_case(dim, options):
    """A case of about a second with snapshots and checkpoints all the time."""
    end = 4e-8 if options.get("formulation", {}).get("type") == "projection" else 3e-6 / dim
    time_ = {"end": end} | options.get("time", {})
    output = {"every": end / 6, "formats": ["hdf5", "vtu"], "checkpoint_every": 0.02}
    further = options | {"time": time_, "output": output, "watch": LOOSE}
    taken = []
    for material in (METAL, HARDENING, DAMAGED, LIQUID, GAS):
        try:
            row_of([METAL, material], dim=dim, **further)
        except CaseError:
            continue
        taken.append(material)
    return row_of(taken[: 5 if dim < 3 else 2] or [METAL, METAL], dim=dim, dx=0.5e-3, **further)


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


def kills(work):
    """Kill runs of every kind at random times, go on, and compare with the run that was not killed."""
    made, every = kinds(), {}
    for name in FORMULATIONS:
        every[f"{name} with every material"] = every_material(name)
    names = [*made, *every]

    def trial(number) -> Tally:
        name, rng = names[number % len(names)], random.Random(number)
        folder, whole = work / "killed", work / "whole"
        for old in (folder, whole):
            shutil.rmtree(old, ignore_errors=True)
        try:
            case = every[name] if name in every else long_case(*made[name])
        except CaseError as error:
            return {"not taken": {f"{name}: {str(error)[:90]}": 1}}
        code, said = in_child(lambda: run(case, whole, threads=1), seconds=300)
        assert code == 0, f"{name}: {said}"
        seconds, count = json.loads((whole / "summary.json").read_text())["wall_seconds"], 0
        process = child(lambda: run(case, folder, threads=1))
        while count < KILLS:
            time.sleep(rng.uniform(0.0, 0.6 * seconds + 0.4))
            os.kill(process, signal.SIGKILL)
            killed = os.WIFSIGNALED(os.waitpid(process, 0)[1])
            check_whole(folder)
            if not killed:  # it had ended before
                break
            count += 1
            process = child(lambda: go_on(case, folder))
        else:
            os.waitpid(process, 0)
        assert os.waitpid(child(lambda: go_on(case, folder)), 0)[1] == 0, name
        assert_same_results(folder, whole)
        assert not list(folder.glob("**/*.partial")), name
        return {"kills": {name: count}}

    return trial


def told(tally):
    """Return the counts in words."""
    by = tally.get("kills", {})
    text = f"{sum(by.values())} of {sum(by.values())} in {tally['trials']} runs of {len(by)} kinds: {', '.join(f'{name} {count}' for name, count in by.items())}"
    return text + "".join(f"; not a case: {name}" for name in tally.get("not taken", {}))
