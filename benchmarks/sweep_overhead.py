"""What a sweep costs beyond its cases: against the same cases in series in one process, with one worker and with two.

    python benchmarks/sweep_overhead.py [--cases 24] [--end "4 us"] [--rounds 3] [--workers 1,2]

Each round measures all three, one after the other, in processes of their own, and prints wall and processor time; the
last line has the medians of the ratios. On a machine that does other things only those of processor time mean much.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SERIES = """
import json, sys
from hvisph.sweeps.plan import load_plan
from hvisph.simulation.run import run
plan = load_plan(json.loads(sys.argv[1]))
for member in plan.first():
    run(plan.case(member.values), f"{sys.argv[2]}/{member.number}", threads=1)
"""


def measured(command):
    """Run a command; return its wall and its processor time, those of its children included [s]."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    wall, after = time.monotonic() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Print the times of each round and the medians of their ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=24)
    parser.add_argument("--end", default="4 us")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--workers", default="1,2")
    asked = parser.parse_args()
    values = {"bodies.projectile.velocity.0": {"from": "2 km/s", "to": "4 km/s", "count": asked.cases}}
    settings = {"resolution": "0.4 mm", "time.end": asked.end, "output.every": asked.end, "output.formats": ["hdf5"]}
    sweep = {"case": "al_al_coarse", "set": settings, "vary": {"type": "grid", "values": values}}
    place = Path(tempfile.mkdtemp(prefix="sweep_overhead"))
    file = place / "sweep.yaml"
    file.write_text(json.dumps(sweep))
    counts = [int(count) for count in asked.workers.split(",")]
    ratios: dict[str, list[float]] = {f"{count}, {kind}": [] for count in counts for kind in ("wall", "processor")}
    for number in range(asked.rounds):
        series = measured([sys.executable, "-c", SERIES, json.dumps(sweep), str(place / f"series{number}")])
        print(f"in series: {series[0]:.1f} s, {series[1]:.1f} s of processor time", flush=True)
        for count in counts:
            out = str(place / f"{count}-{number}")
            command = [sys.executable, "-m", "hvisph", "sweep", str(file), "--workers", str(count), "--threads", "1"]
            wall, processor = measured([*command, "--out", out, "--quiet"])
            print(f"{count} workers: {wall:.1f} s, {processor:.1f} s of processor time", flush=True)
            ratios[f"{count}, wall"].append(wall / series[0])
            ratios[f"{count}, processor"].append(processor / series[1])
    print({name: round(statistics.median(values), 3) for name, values in ratios.items()})


if __name__ == "__main__":
    main()
