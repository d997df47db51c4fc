"""Campaigns of numbered trials: run in pieces, counted in a file, told in a table.

A trial is reproducible by its number alone. What trials found is added up in a JSON file, so that a campaign can be
run in many short pieces, and trials that failed are the first ones of the next piece.
"""

from __future__ import annotations

import itertools
import json
import sys
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
        """Run up to `count` trials for at most `seconds`: those that failed, then those that are not counted yet.

        A trial that fails is told of and kept under `failed`; the campaign goes on.
        """
        began = time.perf_counter()
        tally = {"trials": 0} | _known(tallies).get(self.name, {})
        again, failed = list(tally.pop("failed", [])), []
        with tempfile.TemporaryDirectory() as folder:
            trial = self.start(Path(folder))
            while count > 0 and time.perf_counter() - began < seconds:
                following = tally["trials"] + len(again) + len(failed)
                if not again and following >= self.many:
                    break
                number = again.pop(0) if again else following
                try:
                    tally = added(tally, trial(number) | {"trials": 1})
                except (SystemExit, AssertionError) as error:
                    print(f"{self.name} {number}: {type(error).__name__}: {error}", file=sys.stderr, flush=True)
                    failed.append(number)
                content = tally | ({"failed": [*failed, *again]} if failed or again else {})
                tallies.write_text(json.dumps(_known(tallies) | {self.name: content}, indent=1), encoding="utf-8")
                count -= 1
        return tally | ({"failed": [*failed, *again]} if failed or again else {})


def _known(tallies: Path) -> Tally:
    return json.loads(tallies.read_text(encoding="utf-8")) if tallies.is_file() else {}


def added(first: Any, second: Any, name: str = "") -> Any:
    """Return two tallies as one: numbers added, of `most_...` the larger, of `least_...` the smaller."""
    if isinstance(second, dict):
        return first | {key: added(first[key], value, key) if key in first else value for key, value in second.items()}
    if name.startswith(("most_", "least_")):
        return max(first, second) if name.startswith("most_") else min(first, second)
    return first + second


def counts(tally: dict[str, int]) -> str:
    """Return counts by name in words."""
    return ", ".join(f"{number} {name}" for name, number in sorted(tally.items()))


def keep_row(path: Path, head: str, order: list[str], row: tuple[str, str, str]) -> None:
    """Put a row into the table of `path`, in place of its former one; what follows the table stays."""

    def is_row(line: str) -> bool:
        return line.startswith("|")

    by_name, after = {}, []
    if path.is_file():
        lines = path.read_text(encoding="utf-8").splitlines()
        table = [*itertools.takewhile(is_row, itertools.dropwhile(lambda line: not is_row(line), lines))]
        after = lines[lines.index(table[-1]) + 1 :] if table else []
        cells = [line.strip("| ").split(" | ") for line in table]
        by_name = {one[0]: one for one in cells if len(one) == 3 and one[0] in order}
    by_name[row[0]] = list(row)
    rows = [head, *(f"| {' | '.join(by_name[name])} |" for name in order if name in by_name)]
    path.write_text("\n".join([*rows, *after]) + "\n", encoding="utf-8")
