"""Campaigns of numbered trials: run in pieces, counted in a file, told in a table.

A trial is reproducible by its number alone. What trials found is added up in a JSON file, so that a campaign can be
run in many short pieces, and a trial that fails is the first one of the next piece.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Tally = dict[str, Any]


@dataclass(frozen=True)
class Campaign:
    """What is tried, how often, and how it is told.

    `start` takes a folder and returns the trial, which takes its number and returns what is to be added up;
    `told` makes the sentence of the whole count. `many` is the number of trials that the table asks for.
    """

    name: str
    what: str
    reach: str
    many: int
    start: Callable[[Path], Callable[[int], Tally]]
    told: Callable[[Tally], str]

    def go_on(self, tallies: Path, seconds: float, count: int) -> Tally:
        """Run up to `count` trials for at most `seconds`, beginning after those that are counted already."""
        began = time.perf_counter()
        tally = _known(tallies).get(self.name, {"trials": 0})
        with tempfile.TemporaryDirectory() as folder:
            trial = self.start(Path(folder))
            while tally["trials"] < self.many and count > 0 and time.perf_counter() - began < seconds:
                tally = added(tally, trial(tally["trials"]) | {"trials": 1})
                tallies.write_text(json.dumps(_known(tallies) | {self.name: tally}, indent=1), encoding="utf-8")
                count -= 1
        return tally


def _known(tallies: Path) -> Tally:
    return json.loads(tallies.read_text(encoding="utf-8")) if tallies.is_file() else {}


def added(one: Any, other: Any, name: str = "") -> Any:
    """Return two tallies as one: numbers added, of `most_...` the larger, of `least_...` the smaller."""
    if isinstance(other, dict):
        return one | {key: added(one[key], value, key) if key in one else value for key, value in other.items()}
    if name.startswith(("most_", "least_")):
        return max(one, other) if name.startswith("most_") else min(one, other)
    return one + other


def counts(tally: dict[str, int]) -> str:
    """Return counts by name in words."""
    return ", ".join(f"{number} {name}" for name, number in sorted(tally.items()))


def keep_row(path: Path, head: str, order: list[str], row: tuple[str, str, str]) -> None:
    """Put a row into the table of `path`, in place of its former one."""
    known = {}
    if path.is_file():
        lines = path.read_text(encoding="utf-8").splitlines()
        cells = [line.strip("| ").split(" | ") for line in lines if line[:1] == "|"]
        known = {one[0]: one for one in cells if len(one) == 3 and one[0] in order}
    known[row[0]] = list(row)
    rows = [head, *(f"| {' | '.join(known[what])} |" for what in order if what in known)]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
