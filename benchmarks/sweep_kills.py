"""Kill driver and workers of a sweep at random, again and again, and hold every case against the same one alone.

    python benchmarks/sweep_kills.py [--dask] [--kills 50] [--cases 60] [--seed 0] [--out DIR] [--seconds 300]

Without `--dask` the workers are processes of the driver; with it they are tasks of a cluster of two processes, started
here, and Dask's own processes are killed as well. Each case must be computed to its end once, and its last state be
that of the same case run alone, bit for bit. Killed is with SIGKILL, a moment after a worker has begun a case.
After `--seconds` everything is killed; the same command with `--out` goes on with the same sweep.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import psutil

from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.simulation.run import run
from hvisph.sweeps.driver import begin
from hvisph.sweeps.folder import SweepFolder

SPEED = "bodies.projectile.velocity.0"
SETTINGS = {"resolution": "0.6 mm", "time.end": "3 us", "output.every": "3 us", "output.formats": ["hdf5"],
            "output.checkpoint_every": 0.05}  # fmt: skip


class Sweep:
    """A sweep that is driven by a command, which is started again when it dies."""

    def __init__(self, folder, options):
        self.folder = folder
        self.command = [sys.executable, "-m", "hvisph", "sweep", str(folder.path), "--workers", "2", "--threads", "1",
                        "--quiet", *options]  # fmt: skip
        self.driver = None

    def keep(self):
        """Start the driver where it is not running; what was killed too often without coming further is asked for."""
        if self.driver is None or self.driver.poll() is not None:
            marked = {self.folder.standing(member).status for member in self.folder.members()} & {"killed"}
            selection = ["--only", "failed"] if marked else []
            self.driver = subprocess.Popen(
                [*self.command, *selection], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )

    def workers(self):
        """Return the processes that compute."""
        mine = str(self.folder.path)
        processes = []
        for process in psutil.process_iter(["cmdline"]):
            command = process.info["cmdline"] or []
            if mine in command and (self.driver is None or process.pid != self.driver.pid):
                processes.append(process)
        return processes

    def events(self):
        """Return what happened to each case, in order."""
        files = sorted((self.folder.path / "claims").glob("*.jsonl"))
        return [[json.loads(line) for line in file.read_text().splitlines() if line.endswith("}")] for file in files]

    def starts(self):
        """Return how often a case has been begun or gone on with."""
        return sum(event["event"] == "start" for case in self.events() for event in case)

    def left(self):
        """Return how many cases have not ended."""
        self.folder = SweepFolder(self.folder.path)  # what has ended is kept in mind, and may be begun again
        return sum(self.folder.standing(member).status != "done" for member in self.folder.members())


def command_of(process):
    """Return the words of a process's command; none of one that has gone."""
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def strike(sweep, rng, cluster):
    """Kill one process; return what it was."""
    victims = [("worker", process.pid) for process in sweep.workers()]
    victims += [("driver", sweep.driver.pid)] if rng.random() < 0.3 else []
    victims += [("dask", pid) for pid in cluster()] if rng.random() < 0.2 else []
    if not victims:
        return None
    victim_type, pid = rng.choice(victims)
    try:
        os.kill(pid, signal.SIGKILL)
    except ProcessLookupError:
        return None
    return victim_type


def harass(sweep, kills, rng, cluster, counts, end_time):
    """Kill until it is enough, or all cases have ended, or time is up; count how often each kind was killed."""
    while sum(counts.values()) < kills and sweep.left() and time.monotonic() < end_time:
        sweep.keep()
        starts, end = sweep.starts(), time.monotonic() + 20.0
        while sweep.starts() == starts and time.monotonic() < end and sweep.left():
            sweep.keep()
            cluster()
            time.sleep(0.3)
        time.sleep(rng.uniform(0.0, 2.0))
        victim_type = strike(sweep, rng, cluster)
        if victim_type:
            counts[victim_type] = counts.get(victim_type, 0) + 1


def judge(sweep, place):
    """Return cases that were not computed once, and cases that differ from the same one alone."""
    events, folder = sweep.events(), sweep.folder
    ends = [sum(event["event"] == "end" and not event["reason"] for event in case) for case in events]
    differences = []
    for member in folder.members():
        reference = run(folder.plan().case(member.values), place / str(member.number), threads=1).folder
        a, b = (read_snapshot(list_snapshots(path)[-1]) for path in (folder.run_folder(member), reference))
        if not all(np.array_equal(a.fields[name], b.fields[name], equal_nan=True) for name in a.fields):
            differences.append(member.number)
    return [number for number, count in enumerate(ends) if count != 1], differences


def main() -> None:
    """Harass a sweep and print what came of it; exit code 1 where a case was lost, done twice or differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dask", action="store_true")
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--seconds", type=float, default=float("inf"))
    asked = parser.parse_args()
    until = time.monotonic() + asked.seconds
    place = asked.out or Path(tempfile.mkdtemp(prefix="sweep_kills"))
    vary = {"type": "grid", "values": {SPEED: {"from": "2 km/s", "to": "4 km/s", "count": asked.cases}}}
    folder = begin({"case": "al_al_coarse", "set": SETTINGS, "vary": vary}, place / "sweep")
    tally = place / "kills.json"
    counts = json.loads(tally.read_text()) if tally.is_file() else {}
    rng, options, place_of_cluster = random.Random(asked.seed + 1000 * sum(counts.values())), [], None
    if asked.dask:
        from distributed import LocalCluster

        place_of_cluster = LocalCluster(2, threads_per_worker=1, dashboard_address=None, silence_logs=50)
        options = ["--dask", place_of_cluster.scheduler_address]

    def cluster():
        if place_of_cluster is None:
            return []
        place_of_cluster.scale(2)  # what a nanny gave up is started anew
        children = psutil.Process().children(recursive=True)
        return [process.pid for process in children if any("spawn_main" in word for word in command_of(process))]

    sweep = Sweep(folder, options)
    harass(sweep, asked.kills, rng, cluster, counts, until)
    while sweep.left() and time.monotonic() < until:
        sweep.keep()
        cluster()
        time.sleep(0.5)
    if sweep.left():  # time is up: the end of this piece is one more blow
        counts["all at once"] = counts.get("all at once", 0) + 1
        tally.write_text(json.dumps(counts))
        for process in [*psutil.Process().children(recursive=True), *sweep.workers()]:
            process.kill()
        print(f"so far {counts}, {sweep.left()} cases left", flush=True)
        os._exit(0)
    tally.write_text(json.dumps(counts))
    if sweep.driver:
        sweep.driver.wait()
    starts = sweep.starts()
    wrong, differences = judge(sweep, place / "alone")
    statuses = sorted({folder.standing(member).status for member in folder.members()})
    print(f"{asked.cases} cases, {'a Dask cluster' if asked.dask else 'local workers'}; killed: {counts}")
    print(f"begun or gone on with {starts} times; statuses: {statuses}")
    print(f"not computed to the end exactly once: {wrong or 'none'}; other bits than alone: {differences or 'none'}")
    raise SystemExit(bool(wrong or differences or statuses != ["done"]))


if __name__ == "__main__":
    main()
