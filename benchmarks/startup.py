"""Start-up: `--help`, `check`, and the time from the command to the first step, warm and cold.

python benchmarks/startup.py

Python may keep its compiled files, whatever the environment says: without them every start compiles all sources anew.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path


def seconds(arguments: list[str], repeats: int = 5, **environment: str) -> tuple[float, float]:
    """Return the median wall and processor time of a command [s]."""
    times, kept = [], {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    for _ in range(repeats):
        begin, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-m", "hvisph", *arguments], env=kept | environment, capture_output=True)
        wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
        times.append((wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime))
    wall, processor = (statistics.median(column) for column in zip(*times, strict=True))
    return wall, processor


def told(what: str, times: tuple[float, float]) -> None:
    """Print a line of the table."""
    print(f"{what:<26}{times[0]:6.2f} s, {times[1]:6.2f} s of processor time", flush=True)


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        first = ["run", "al_al", "--out", f"{folder}/run", "--force", "--quiet", "--set", "time.max_steps=1",
                 "--set", "output.formats=[hdf5]"]  # fmt: skip
        seconds(first, repeats=1)
        told("hvisph --help", seconds(["--help"]))
        told("hvisph check al_al", seconds(["check", "al_al"]))
        told("one step of al_al, warm", seconds(first))
        log = Path(folder, "run", "run.log").read_text()
        told("one step of al_al, cold", seconds(first, repeats=1, HVISPH_CACHE_DIR=f"{folder}/cache"))
        print(f"one step: first and last snapshot, measures and summary included; warm {log.splitlines()[0]}")


if __name__ == "__main__":
    main()
