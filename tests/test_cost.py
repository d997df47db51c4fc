"""How many threads a case is worth, and how they wait."""

import os
import subprocess
import sys

import numba
import pytest

from hvisph.casefile.loader import load_case
from hvisph.output.history import HistoryWriter
from hvisph.precheck import estimate as cost
from hvisph.precheck.estimate import estimate
from hvisph.simulation.run import run, set_threads


@pytest.fixture(autouse=True)
def eight_cores(monkeypatch):
    monkeypatch.setenv("NUMBA_NUM_THREADS", "8")


@pytest.fixture
def threads_kept():
    before = numba.get_num_threads()
    yield
    numba.set_num_threads(before)


def test_small_cases_have_one_thread_and_large_ones_all():
    case = load_case("al_al_coarse")
    found = [cost.worthwhile_threads(case, count) for count in (1, 1155, 4000, 10_000, 10**5, 10**7)]
    assert found == sorted(found)
    assert found[:2] == [1, 1]
    assert found[-1] == 8


def test_dearer_steps_are_worth_more_threads():
    flat, solid = load_case("al_al_coarse"), load_case("sphere_on_plate")
    cheap = load_case("al_al_coarse", ["formulation={type: eulerian}"])
    assert cost.worthwhile_threads(cheap, 8000) < cost.worthwhile_threads(flat, 8000)
    assert cost.worthwhile_threads(flat, 4000) < cost.worthwhile_threads(solid, 4000)


def test_more_threads_never_promise_a_slower_step():
    case = load_case("al_al_coarse")
    times = [cost.step_seconds(case, 20_000, threads) for threads in (1, 2, 4, 8)]
    assert times == sorted(times, reverse=True)


def test_no_more_threads_than_the_user_allows(monkeypatch):
    monkeypatch.setenv("NUMBA_NUM_THREADS", "3")
    assert cost.worthwhile_threads(load_case("al_al_coarse"), 10**7) == 3


def test_an_explicit_number_is_obeyed(threads_kept):
    most = numba.config.NUMBA_NUM_THREADS
    set_threads(most, 1)
    assert numba.get_num_threads() == most
    set_threads(None, 1)
    assert numba.get_num_threads() == 1
    set_threads(None, most + 5)
    assert numba.get_num_threads() == most


def test_a_run_takes_no_more_threads_than_a_step_feeds(tmp_path, threads_kept, monkeypatch):
    monkeypatch.setattr(cost, "FEEDS_A_THREAD", 5e-4)
    monkeypatch.setenv("NUMBA_NUM_THREADS", str(numba.config.NUMBA_NUM_THREADS))
    two = min(2, numba.config.NUMBA_NUM_THREADS)
    case = load_case("al_al_coarse", ["resolution=0.5 mm", "time.max_steps=2"])
    run(case, tmp_path / "small", threads=two)
    assert numba.get_num_threads() == 1
    log = (tmp_path / "small" / "run.log").read_text()
    assert ("note: 1 thread of 2 asked for: a step of" in log) == (two > 1)
    assert estimate(case, two).threads == 1
    assert cost.fed_threads(case, 10**6) > 8
    assert not cost.fewer_threads_reason(8, case, 10**6)


def test_words_name_the_cores_left_free():
    assert cost.of_cores(1, 1) == "1 thread"
    assert cost.of_cores(1, 2) == "1 thread of 2"
    assert cost.of_cores(2, 2) == "2 threads"


@pytest.mark.parametrize(("given", "expected"), [({}, "0"), ({"OMP_WAIT_POLICY": "active"}, "None"),
                                                 ({"GOMP_SPINCOUNT": "7"}, "7")])  # fmt: skip
def test_threads_wait_asleep_unless_the_user_says_otherwise(given, expected):
    kept = {name: value for name, value in os.environ.items() if name not in ("GOMP_SPINCOUNT", "OMP_WAIT_POLICY")}
    text = "import os, hvisph.compiler.jit; print(os.environ.get('GOMP_SPINCOUNT'))"
    done = subprocess.run([sys.executable, "-c", text], env=kept | given, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == expected


def test_a_record_kept_as_numbers_is_written_as_when_made(tmp_path):
    # long before it is written, and whole records of other types in between
    with HistoryWriter(tmp_path / "h.csv", ["step", "time", "by"], flush_seconds=1e9) as history:
        for step in range(3):
            history.append([step, step / 3, "cfl, 'a'"])
        assert (tmp_path / "h.csv").read_text().count("\n") == 1
    assert (tmp_path / "h.csv").read_text().splitlines()[2] == f"1,{1 / 3!r},\"cfl, 'a'\""
