"""A sweep on a Dask cluster whose workers are killed: nothing is lost, nothing is computed twice.

The cluster is one of this machine, which is all that differs from one of many: its workers are processes of their own.
"""

import json
import os
import signal
import sys
import threading
import time
from contextlib import suppress

import psutil
import pytest
from test_sweeps import SMALL, SPEED, alone, same

import hvisph.sweeps.cluster as crews
from hvisph.core.errors import OutputError
from hvisph.sweeps.cluster import DaskCrew
from hvisph.sweeps.driver import begin, driver

distributed = pytest.importorskip("distributed")
SETTINGS = SMALL | {"time.end": "1.2 us", "output.every": "0.6 us", "output.checkpoint_every": 0.02}


@pytest.fixture(scope="module")
def cluster():
    """A scheduler with two worker processes, which a nanny starts again when they die."""
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
        ) as there,
        suppress(TimeoutError),
    ):
        yield there


def begun(path, count):
    """The folder of a sweep of so many small cases."""
    vary = {"type": "grid", "values": {SPEED: {"from": "2 km/s", "to": "4 km/s", "count": count}}}
    return begin({"case": "al_al_coarse", "set": SETTINGS, "vary": vary}, path)


def events(folder):
    """What happened to each case, in order."""
    files = sorted((folder.path / "claims").glob("*.jsonl"))
    return [[json.loads(line) for line in file.read_text().splitlines()] for file in files]


def computing():
    """The processes that compute: workers of the sweep, below those of the cluster."""
    below = psutil.Process().children(recursive=True)
    return [process for process in below if "--worker" in _command(process)]


def _command(process):
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def starts(folder):
    """How often a case has been begun or gone on with."""
    return sum(event["event"] == "start" for case in events(folder) for event in case)


def strike(folder, client, killed):
    """Kill a process that computes, and then one of Dask's own, each as soon as cases are under way."""
    wait_for(lambda: starts(folder) >= 1 and computing())
    seen = starts(folder)
    victim = computing()[0]
    victim.kill()
    killed.append(victim.pid)
    wait_for(lambda: starts(folder) > seen)
    pid = next(iter(client.run(os.getpid).values()))
    os.kill(pid, signal.SIGKILL)
    killed.append(pid)


def test_killed_workers_of_a_cluster_lose_nothing(cluster, tmp_path):
    folder, killed = begun(tmp_path / "sweep", 4), []
    crew = DaskCrew(folder, distributed.Client(cluster), 1)
    under_way = driver(folder, 2, 1, None, lambda *_: crew)
    with distributed.Client(cluster) as client:
        thread = threading.Thread(target=strike, args=(folder, client, killed))
        thread.start()
        rows = list(under_way.go())
        thread.join()
    assert len(killed) == 2
    assert [row["status"] for row in rows] == ["done"] * 4
    told = events(folder)
    assert [sum(event["event"] == "end" and not event["reason"] for event in case) for case in told] == [1] * 4
    assert starts(folder) > 4
    members = folder.members()
    for member in members[::3]:
        assert same(folder.run_folder(member), alone(folder, member, tmp_path))
    assert not list((folder.path / "claims").glob("crew-*"))


def test_a_cluster_stops_with_checkpoints_when_it_is_told_to(cluster, tmp_path):
    folder = begun(tmp_path / "sweep", 3)
    crew = DaskCrew(folder, distributed.Client(cluster), 1)
    crew.keep(1)
    wait_for(lambda: any(event["event"] == "start" for case in events(folder) for event in case))
    crew.stop()
    wait_for(lambda: not computing())
    last = [case[-1] for case in events(folder)]
    assert all(event["event"] == "end" for event in last)
    assert len(last) < 3 or any(event["reason"] == "signal" for event in last)


def wait_for(happened, seconds=60.0):
    """Wait until something has happened."""
    end = time.monotonic() + seconds
    while not happened():
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.fixture
def empty(monkeypatch):
    """A scheduler that no worker has joined yet."""
    monkeypatch.setattr(crews, "LOOK", 0.0)
    monkeypatch.setattr(crews, "SILENCE", 0.3)
    with distributed.LocalCluster(
        n_workers=0, threads_per_worker=1, processes=False, dashboard_address=None, silence_logs=50
    ) as there:
        yield there


def test_a_cluster_without_workers_is_told_once_and_when_it_has_some_again(empty, tmp_path, monkeypatch):
    monkeypatch.setattr(crews, "_work", lambda command: (0, ""))
    said = []
    crew = DaskCrew(begun(tmp_path / "sweep", 2), distributed.Client(empty), 1, tell=said.append)
    for _ in range(8):
        crew.keep(1)
        time.sleep(0.1)
    assert len(said) == 1
    assert empty.scheduler_address in said[0]
    assert "dask worker" in said[0]
    empty.scale(1)
    wait_for(lambda: crew.keep(1) and len(said) == 2)
    assert said[1] == "the Dask cluster has 1 worker again"
    crew.stop()


def test_a_cluster_without_workers_ends_at_once_when_it_is_told_to(empty, tmp_path):
    crew = DaskCrew(begun(tmp_path / "sweep", 2), distributed.Client(empty), 1)
    crew.keep(1)
    began = time.monotonic()
    crew.stop()
    assert time.monotonic() - began < 10.0
    assert not list((tmp_path / "sweep" / "claims").glob("crew-*"))


def test_workers_that_cannot_work_end_the_sweep_with_what_they_said(empty, tmp_path):
    empty.scale(1)
    crew = DaskCrew(begun(tmp_path / "sweep", 2), distributed.Client(empty), 1)
    crew.command = [sys.executable, "-c", "raise SystemExit('no disk here')"]
    with pytest.raises(OutputError, match=r"5 workers in a row could not work.*exit code 1: no disk here"):
        wait_for(lambda: crew.keep(1) and False)
    crew.stop()


def test_a_scheduler_that_has_gone_ends_the_sweep(tmp_path):
    class Gone:
        status = "closed"
        scheduler = type("", (), {"address": "tcp://nowhere:8786"})

    crew = DaskCrew(begun(tmp_path / "sweep", 2), Gone(), 1)
    with pytest.raises(OutputError, match="scheduler at tcp://nowhere:8786 has gone"):
        crew.keep(1)
