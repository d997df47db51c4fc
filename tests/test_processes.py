"""Several processes by MPI: the same bits as one, on any number of them; what goes wrong ends all of them in words."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from small_runs import (
    DAMAGED,
    GAS,
    HARDENING,
    LIQUID,
    METAL,
    assert_same_results,
    cracked_bar,
    document_of,
    row_of,
    struck_laminate,
)

import hvisph
from hvisph.casefile.loader import dump_case, load_case
from hvisph.core.errors import CaseError
from hvisph.output.reader import read_snapshot
from hvisph.parallel import launched_rank
from hvisph.parallel.subdomain import Parts
from hvisph.simulation.run import run

HERE = Path(sys.executable).parent
MPIEXEC = shutil.which("mpiexec", path=str(HERE))
needs_mpi = pytest.mark.skipif(MPIEXEC is None, reason="no mpiexec beside Python: pip install 'hvisph[mpi]'")

GAUGES = {"inside": {"type": "material", "at": [1e-3, 0.0], "fields": ["pressure", "velocity"]},
          "there": {"type": "fixed", "at": [0.1e-3, 0.0], "fields": ["velocity", "stress"]},
          "back": {"type": "free_surface", "at": [5.7e-3, 0.0], "direction": "+x", "fields": ["position"],
                   "every": 3}}  # fmt: skip
CASES = {
    # debris leaves the domain, bodies part and slide, particles change processes
    "eulerian": lambda: row_of(
        [METAL, HARDENING, LIQUID],
        formulation={"type": "eulerian"},
        gauges=GAUGES,
        time={"end": 1e-6, "integrator": "predictor_corrector"},
        output={"every": 3e-7},
        domain={"max": [None, 3.2e-3]},
    ),
    "riemann": lambda: row_of(
        [METAL, HARDENING],
        dim=3,
        formulation={"type": "riemann"},
        time={"end": 2e-7},
        output={"every": 1e-7},
        symmetry=[{"axis": "y"}, {"axis": "z"}],
        clamped=[{"box": {"min": [1.9e-3, None, None]}}],
    ),
    # planes that move, edges and matter that settles before the start
    "moving_plane": lambda: load_case(
        {
            "kinematics": "plane_strain",
            "resolution": 0.25e-3,
            "gravity": [-1e6, 0.0],
            "settle": 5e-7,
            "bodies": {
                "bed": {"material": LIQUID, "shape": {"type": "box", "size": [3e-3, 4e-3]}, "position": [1.5e-3, 0]}
            },
            "symmetry": [{"axis": "x", "velocity": [[0.0, 0.0], [5e-7, 300.0]]}],
            "edges": [{"axis": "y", "at": 1.5e-3, "keep": "below"}],
            "time": {"end": 8e-7},
            "output": {"every": 3e-7},
        }
    ),
    # gradients of the evaluation before go with particles that change processes or pass a plane
    "elastic": lambda: row_of(
        [METAL, HARDENING],
        formulation={"type": "riemann", "variant": "elastic"},
        time={"end": 8e-7},
        output={"every": 3e-7},
        symmetry=[{"axis": "y"}],
    ),
    # failed particles leave lists, bodies touch from the first step on, references are renewed
    "total_lagrangian": lambda: row_of(
        [METAL, DAMAGED, HARDENING],
        formulation={"type": "total_lagrangian", "reference_update_strain": 0.2},
        gauges=GAUGES,
        time={"end": 8e-7},
        output={"every": 3e-7},
        symmetry=[{"axis": "y"}],
        clamped=[{"box": {"min": [2.9e-3, None]}}],
    ),
    # particles turn Eulerian, and their corrected kernels meet those of others
    "adaptive": lambda: row_of(
        [METAL, DAMAGED],
        formulation={
            "type": "adaptive",
            "conversion": {"strain": 0.05, "damage": True},
            "spatial_correction": {"type": "mixed"},
        },
        gauges={"inside": GAUGES["inside"]},
        time={"end": 8e-7},
        output={"every": 3e-7},
    ),
    "projection": lambda: row_of(
        [METAL, METAL],
        formulation={"type": "projection", "pressure_average": 1e-8},
        gauges={"inside": GAUGES["inside"]},
        time={"end": 3e-8},
        output={"every": 1.1e-8},
        symmetry=[{"axis": "y"}],
    ),
    # parts of one body that fly at each other are told to be two, by the first process
    "pieces": lambda: load_case(
        {
            "kinematics": "plane_strain",
            "resolution": 0.25e-3,
            "bodies": {
                "pair": {
                    "material": METAL,
                    "position": [0.0, 0.0],
                    "shape": {
                        "type": "union",
                        "parts": [
                            {"shape": {"type": "box", "size": [3e-3, 3e-3]}, "position": [x, 0.0]}
                            for x in (-2.2e-3, 2.2e-3)
                        ],
                    },
                    "initial_velocity": [{"type": "linear", "gradient": [[-4e5, 0.0], [0.0, 0.0]]}],
                }
            },
            "formulation": {"type": "riemann"},
            "time": {"end": 2e-6},
            "output": {"every": 1e-6},
        }
    ),
    # the forces on a piston are summed over all processes
    "piston": lambda: row_of(
        [METAL, METAL],
        clamped=[{"box": {"max": [-1e-3, None]}, "velocity_table": [[0.0, 900.0], [3e-7, 400.0], [3e-7, -100.0]]}],
        time={"end": 6e-7},
        output={"every": 3e-7},
    ),
    "rigid": lambda: load_case(
        document_of([METAL, METAL], time={"end": 6e-7}, output={"every": 3e-7})
        | {
            "bodies": document_of([METAL, METAL])["bodies"]
            | {"body_0": document_of([METAL, METAL])["bodies"]["body_0"] | {"rigid": True}}
        }
    ),
    # cracks about the axis: softened particles are neighbours over the cuts
    "cracks": cracked_bar,
    # axes and open modes go with particles that change processes
    "laminate": struck_laminate,
    "gas": lambda: row_of(
        [GAS, GAS],
        dim=1,
        dx=0.1e-3,
        time={"end": 4e-7},
        output={"every": 3e-7},
        formulation={"type": "eulerian", "smoothing_length": {"type": "variable"}, "contact": {"type": "bonded"}},
    ),
}


PROGRAM = ["-m", "hvisph"]


def command(processes, *arguments):
    """The command line of `hvisph` on so many processes."""
    start = [MPIEXEC, "-n", str(processes)] if processes > 1 else []
    return [*map(str, start), sys.executable, *PROGRAM, *map(str, arguments)]


def launch(processes, *arguments, **environment):
    """Run `hvisph` on so many processes; return what it said and its exit code."""
    lent = {name: value for name, value in os.environ.items() if not name.startswith(("PMI", "OMPI"))}
    return subprocess.run(command(processes, *arguments), env=lent | environment, capture_output=True, text=True,
                          timeout=300, check=False)  # fmt: skip


def written(case, folder):
    """Write a case to a file; return its path."""
    path = folder / "case.yaml"
    path.write_text(dump_case(case))
    return path


def summary_of(folder):
    """What of a summary hangs on the physics alone."""
    found = json.loads((folder / "summary.json").read_text())
    own = {"wall_seconds", "threads", "microseconds_per_particle_step", "processes"}
    return {name: value for name, value in found.items() if name not in own}


@needs_mpi
def test_a_run_that_starts_from_another_is_the_same(tmp_path):
    """Added bodies and those of the other run, on two processes."""
    parent = document_of([METAL, METAL], time={"end": 2e-7}, output={"every": 2e-7})
    run(load_case(parent), tmp_path / "parent")
    third = parent["bodies"]["body_1"] | {"position": [8e-3, 0.0], "velocity": [-1e3, 0.0]}
    further = {"start": {"run": str(tmp_path / "parent"), "at": 2e-7}, "time": {"end": 4e-7}}
    case = load_case(parent | further | {"bodies": parent["bodies"] | {"third": third}})
    run(case, tmp_path / "one")
    outcome = launch(2, "run", written(case, tmp_path), "--out", tmp_path / "two")
    assert outcome.returncode == 0, outcome.stderr
    assert_same_results(tmp_path / "one", tmp_path / "two")


@needs_mpi
@pytest.mark.parametrize(
    ("name", "processes", "threads"),
    [
        ("eulerian", 2, 2),
        ("gas", 4, 1),
        ("pieces", 3, 1),
        ("elastic", 3, 1),
        ("piston", 3, 1),
        ("rigid", 2, 1),
        ("cracks", 3, 1),
        ("laminate", 2, 1),
        ("moving_plane", 3, 1),
    ],
)
def test_any_number_of_processes_gives_the_same_bits(name, processes, threads, tmp_path):
    case = CASES[name]()
    run(case, tmp_path / "one", threads=1)
    given = "--out", tmp_path / "several", "--threads", threads, "--quiet"
    said = launch(processes, "run", written(case, tmp_path), *given, NUMBA_NUM_THREADS=str(threads))
    assert said.returncode == 0, said.stderr
    assert_same_results(tmp_path / "one", tmp_path / "several")
    assert summary_of(tmp_path / "one") == summary_of(tmp_path / "several")
    assert f"{processes} processes" in (tmp_path / "several" / "run.log").read_text()


@needs_mpi
@pytest.mark.parametrize("name", ["riemann", "total_lagrangian", "adaptive", "projection", "moving_plane",
                                  pytest.param("eulerian", marks=pytest.mark.slow)])  # fmt: skip
def test_a_run_goes_on_with_other_numbers_of_processes(name, tmp_path):
    case = CASES[name]()
    run(case, tmp_path / "one", threads=1)
    steps = json.loads((tmp_path / "one" / "summary.json").read_text())["steps"]
    third, half = steps // 3, steps // 3 + 17
    stopped = case.model_copy(update={"time": case.time.model_copy(update={"max_steps": third})})
    said = launch(2, "run", written(stopped, tmp_path), "--out", tmp_path / "parts", "--threads", 1, "--quiet")
    assert said.returncode == 0, said.stderr
    said = launch(3, "resume", tmp_path / "parts", "--max-steps", half, "--threads", 1, "--quiet")
    assert said.returncode == 0, said.stderr
    hvisph.resume(tmp_path / "parts", max_steps=0, threads=1)
    assert_same_results(tmp_path / "one", tmp_path / "parts")


# Space is cut anew, and all is built anew for it, every 16 steps.
RESTLESS = """
from hvisph.parallel import subdomain as share
share.CUT_EVERY, share.SELDOM, share.BALANCED, share.SETTLED = 16, 1, 0.0, 0.0
from hvisph.cli.main import app
app(prog_name="hvisph")
"""


@needs_mpi
@pytest.mark.parametrize("name", ["adaptive"])
def test_where_space_is_cut_does_not_matter(name, tmp_path, monkeypatch):
    case = CASES[name]()
    run(case, tmp_path / "one", threads=1)
    monkeypatch.setattr(sys.modules[__name__], "PROGRAM", ["-c", RESTLESS])
    said = launch(3, "run", written(case, tmp_path), "--out", tmp_path / "several", "--threads", 1, "--quiet")
    assert said.returncode == 0, said.stderr
    assert_same_results(tmp_path / "one", tmp_path / "several")


# The whole is gathered nowhere: files are written slab by slab.
SLABBED = """
from hvisph.parallel import parallel_output as slabs
slabs.MOST_GATHERED, slabs.SLAB = 0, 150
from hvisph.cli.main import app
app(prog_name="hvisph")
"""


@needs_mpi
def test_a_whole_that_is_never_gathered_gives_the_same_files(tmp_path, monkeypatch):
    case = CASES["eulerian"]()
    regions = {"front": {"box": {"min": [1e-3, None]}, "bodies": ["body_1"]}}
    output = case.output.model_validate({"every": case.time.end, "regions": regions})
    case = case.model_copy(update={"output": output})
    run(case, tmp_path / "one", threads=1)
    monkeypatch.setattr(sys.modules[__name__], "PROGRAM", ["-c", SLABBED])
    out = "--out", tmp_path / "several", "--threads", 1, "--quiet"
    said = launch(2, "run", written(case, tmp_path), *out, "--set", "time.max_steps=20")
    assert said.returncode == 0, said.stderr
    said = launch(2, "resume", tmp_path / "several", "--max-steps", 0, "--threads", 1, "--quiet")
    assert said.returncode == 0, said.stderr
    assert_same_results(tmp_path / "one", tmp_path / "several")
    assert summary_of(tmp_path / "one") == summary_of(tmp_path / "several")
    paths = sorted((tmp_path / "one" / "regions").iterdir())
    assert len(paths) == 2
    for path in paths:
        whole, slabbed = map(read_snapshot, (path, tmp_path / "several" / "regions" / path.name))
        np.testing.assert_array_equal(slabbed.id, whole.id)
        for field, values in whole.fields.items():
            np.testing.assert_array_equal(slabbed.fields[field], values, err_msg=field)


@needs_mpi
def test_a_failure_ends_all_processes_with_one_message(tmp_path):
    case = row_of([METAL, METAL], formulation={"type": "eulerian"}, limits={"energy_drift": 1e-30})
    said = launch(2, "run", written(case, tmp_path), "--out", tmp_path / "run", "--quiet")
    assert said.returncode == 3
    assert said.stderr.count("error: the run failed: total energy has changed") == 1
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["status"] == "failed"
    said = launch(2, "run", written(case, tmp_path), "--out", tmp_path / "run", "--quiet")
    assert said.returncode == 2
    assert said.stderr.count("--force replaces it") == 1


def long_run(folder, processes):
    """Start a run that takes minutes; return its process once it takes steps."""
    case = row_of([METAL, METAL], dx=0.1e-3, formulation={"type": "eulerian"}, time={"end": 1e-4},
                  output={"every": 5e-8, "checkpoint_every": 0.1})  # fmt: skip
    given = command(processes, "run", written(case, folder), "--out", folder / "run", "--threads", 1)
    started = subprocess.Popen(given, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + 240.0
    while not list((folder / "run").glob("checkpoint/*.h5")):
        assert started.poll() is None, started.communicate()
        assert time.monotonic() < until
        time.sleep(0.1)
    return started


def of_hvisph(started):
    """The numbers of the processes below a launcher that compute."""
    import psutil

    below = psutil.Process(started.pid).children(recursive=True)
    return [
        one for one in below if "hvisph" in one.cmdline() and "mpiexec" not in one.name() and "proxy" not in one.name()
    ]


@needs_mpi
def test_a_process_that_is_killed_ends_the_others_and_the_run_can_go_on(tmp_path):
    started = long_run(tmp_path, 2)
    own = of_hvisph(started)
    assert len(own) == 2
    own[1].kill()
    killed = time.monotonic()
    said = "".join(started.communicate(timeout=60))
    assert time.monotonic() - killed < 10.0
    assert started.returncode != 0
    # the launcher names the signal, unless the other process loses its connection first and says so
    assert any(words in said for words in ("KILLED", "Killed", "signal 9", "it may have been killed")), said
    hvisph.resume(tmp_path / "run", max_steps=json.loads(said_steps(tmp_path)) + 3, threads=1)


def said_steps(folder):
    """The step of the newest checkpoint."""
    return max(path.stem for path in (folder / "run" / "checkpoint").glob("*.h5")).lstrip("0") or "0"


@needs_mpi
def test_a_signal_stops_all_after_the_same_step(tmp_path):
    started = long_run(tmp_path, 2)
    of_hvisph(started)[1].send_signal(signal.SIGTERM)
    _, errors = started.communicate(timeout=60)
    assert "stopped by SIGTERM; continue with: hvisph resume" in errors
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["status"] == "interrupted"


def test_launchers_are_noticed_by_the_environment(monkeypatch):
    for name in ("PMI_RANK", "PMI_SIZE", "OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "SLURM_NTASKS"):
        monkeypatch.delenv(name, raising=False)
    assert launched_rank() == (0, 1)
    monkeypatch.setenv("SLURM_NTASKS", "4")  # of an allocation, outside srun
    assert launched_rank() == (0, 1)
    monkeypatch.setenv("PMIX_RANK", "2")
    assert launched_rank() == (2, 4)
    monkeypatch.setenv("PMI_RANK", "1")
    monkeypatch.setenv("PMI_SIZE", "3")
    assert launched_rank() == (1, 3)


def test_several_processes_without_mpi_do_not_fight_for_one_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("PMI_RANK", "1")
    monkeypatch.setenv("PMI_SIZE", "4")
    monkeypatch.setitem(sys.modules, "mpi4py", None)
    with pytest.raises(CaseError, match=r"one of 4 processes, .*pip install 'hvisph\[mpi\]'.*run the whole case"):
        run(CASES["gas"](), tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("count", [1, 2, 3, 7])
def test_parts_weigh_alike_and_any_order_gives_the_same(count):
    x = np.stack(np.meshgrid(np.arange(10.0), np.arange(12.0), indexing="ij"), -1).reshape(-1, 2)  # planes of ties
    numbers, weights = np.arange(len(x)), np.ones(len(x))
    parts = Parts(count, x, numbers, weights)
    owner = parts.owner(x, numbers)
    sizes = np.bincount(owner, minlength=count)
    assert np.ptp(sizes) <= count.bit_length()  # one particle a cut
    order = np.random.default_rng(0).permutation(len(x))
    assert np.array_equal(Parts(count, x[order], numbers[order], weights).owner(x, numbers), owner)
    far = parts.owner(np.array([[1e9, -1e9], [-1e9, 1e9]]), np.array([0, 1]))
    assert ((far >= 0) & (far < count)).all()


def test_weights_move_the_cuts():
    x, numbers = np.linspace(0.0, 1.0, 1001)[:, None], np.arange(1001)
    weights = np.where(x[:, 0] < 0.5, 3.0, 1.0)
    owner = Parts(2, x, numbers, weights).owner(x, numbers)
    assert weights[owner == 0].sum() == pytest.approx(weights[owner == 1].sum(), abs=6.0)
