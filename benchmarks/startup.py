"""Start-up: `--help`, `check`, and the time from the command to the first step, warm and cold.

python benchmarks/startup.py
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time


def seconds(arguments: list[str], environment: dict[str, str] | None = None, repeats: int = 5) -> float:
    """Return the median wall time of a command [s]."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        subprocess.run([sys.executable, "-m", "hvisph", *arguments], env=environment, capture_output=True)
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        first = ["run", "al_al", "--out", f"{folder}/run", "--force", "--quiet", "--set", "time.max_steps=1",
                 "--set", "output.formats=[hdf5]"]  # fmt: skip
        seconds(first, repeats=1)
        print(f"hvisph --help             {seconds(['--help']):6.2f} s")
        print(f"hvisph check al_al        {seconds(['check', 'al_al']):6.2f} s")
        print(
            f"one step of al_al, warm   {seconds(first):6.2f} s, first and last snapshot, measures and summary included"
        )
        cold = dict(os.environ, HVISPH_CACHE_DIR=f"{folder}/cache")
        print(f"one step of al_al, cold   {seconds(first, cold, repeats=1):6.2f} s")


if __name__ == "__main__":
    main()
