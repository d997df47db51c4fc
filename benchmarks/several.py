"""Runs on every number of processes and threads, and parts of runs on different ones, for `robustness.py`."""

from __future__ import annotations

import itertools
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

from campaign import Tally  # noqa: E402
from kills import MPIEXEC  # noqa: E402
from small_runs import DAMAGED, GAS, HARDENING, METAL, assert_same_results, row_of  # noqa: E402
from test_processes import CASES, summary_of  # noqa: E402

from hvisph.casefile.loader import dump_case  # noqa: E402

SETTINGS = [(p, t) for p in (1, 2, 3, 4) for t in (1, 2) if (p, t) != (1, 1)]
# One part of a run after the other, on so many processes.
PARTS = ((1, 3, 2), (4, 1, 3), (2, 4, 1))
SHORT = {"time": {"end": 6e-7}, "output": {"every": 2.5e-7}}


def _row(materials, name, further=None, **options):
    return lambda: row_of(materials, formulation={"type": name} | options, **SHORT | (further or {}))


def cases():
    """Return cases by name: those of the tests, and options beside theirs."""
    rings, plane = {"kinematics": "axisymmetric"}, {"symmetry": [{"axis": "y"}]}
    loaded = {"limits": {"negative_energy": None}}  # bodies that touch start so, and their repulsion takes it from heat
    predicted = {"time": {"end": 5e-7, "integrator": "predictor_corrector"}}
    return CASES | {
        "eulerian corrected": _row([METAL, DAMAGED], "eulerian", plane, correction={"type": "mixed"}),
        "eulerian friction": _row([METAL, HARDENING], "eulerian", contact={"type": "frictional", "friction": 0.2}),
        "eulerian rings": _row([METAL, DAMAGED], "eulerian", rings),
        "riemann rings": _row([METAL, HARDENING], "riemann", rings),
        "riemann variable h": _row([GAS, GAS], "riemann", smoothing_length={"type": "variable"}),
        "riemann predicted": _row([METAL, HARDENING], "riemann", predicted),
        "total_lagrangian rings": _row([METAL, DAMAGED], "total_lagrangian", rings),
        "total_lagrangian repulsive": _row(
            [METAL, HARDENING], "total_lagrangian", loaded, contact={"type": "penalty", "stiffness": 1.0}
        ),
        "total_lagrangian hourglass": _row([METAL, DAMAGED], "total_lagrangian", predicted, hourglass=0.1),
        "adaptive rings": _row([METAL, DAMAGED], "adaptive", rings, conversion={"strain": 0.05, "damage": True}),
        "adaptive welded": _row(
            [METAL, DAMAGED], "adaptive", contact={"type": "bonded"}, conversion={"strain": 0.05, "damage": True}
        ),
    }


def hvisph(processes, threads, *arguments):
    """Run `hvisph` on so many processes of so many threads."""
    start = [MPIEXEC, "-n", processes] if processes > 1 else []
    command = [*start, sys.executable, "-m", "hvisph", *arguments, "--threads", threads, "--quiet"]
    process = subprocess.run(list(map(str, command)), env=os.environ | {"NUMBA_NUM_THREADS": "2"}, capture_output=True,
                          text=True, timeout=900, check=False)  # fmt: skip
    assert process.returncode in (0, 1), process.stderr[-2000:]


def processes(work):
    """Compare every case on every number of processes and threads, and in parts, with one process and thread."""
    if MPIEXEC is None:
        raise SystemExit("no mpiexec: pip install 'hvisph[mpi]'")
    trials = [*itertools.product(cases(), [*SETTINGS, *PARTS])]

    def trial(number) -> Tally:
        name, setting = trials[number]
        whole, folder, file = work / f"whole {name}", work / "several", work / "case.yaml"
        file.write_text(dump_case(cases()[name]()), encoding="utf-8")
        shutil.rmtree(folder, ignore_errors=True)
        if not whole.is_dir():
            hvisph(1, 1, "run", file, "--out", whole)
        if len(setting) == 2:
            hvisph(*setting, "run", file, "--out", folder)
        else:
            steps = json.loads((whole / "summary.json").read_text())["steps"]
            first, second, third = setting
            hvisph(first, 1, "run", file, "--out", folder, "--set", f"time.max_steps={steps // 3}")
            hvisph(second, 1, "resume", folder, "--max-steps", steps // 3 + 17)
            hvisph(third, 1, "resume", folder, "--max-steps", 0)
        assert_same_results(whole, folder), name
        if len(setting) == 2:
            assert summary_of(whole) == summary_of(folder), name
        return {"several": {name: 1}}

    return trial


def told(tally):
    """Return the counts in words."""
    by = tally.get("several", {})
    return (
        f"{sum(by.values())} of {tally['trials']} comparisons of {len(by)} cases: every snapshot, history, summary the "
        "same bits"
    )
