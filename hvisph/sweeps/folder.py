"""Folder of a sweep: cases, claims, states and table. The folder is the queue.

A case of a sweep is an ordinary run's folder, whose files show whether it waits, was interrupted or has ended.
A claim beside it shows which process took the case: a lock that is released when its holder ends, and a line
for each start and end, so that a case which kills its worker repeatedly is left alone.
"""

import csv
import json
import os
import re
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from hvisph.case.sweep import Sweep
from hvisph.casefile.document import dump
from hvisph.core.errors import CaseError, OutputError
from hvisph.core.text import Plain, format_value
from hvisph.output import atomic_write, file_names
from hvisph.output.run_folder import FileLock

from .parameters import plain
from .plan import Member, Plan, load_plan

SWEEP, BASE, CASES, TABLE, RESULTS = "sweep.yaml", "base.yaml", "cases.csv", "table.csv", "results.json"
RUNS, CLAIMS = "runs", "claims"
STEPPING = f"{CLAIMS}/stepping"  # made when the loops of the first case are compiled
ENDED = ("done", "failed", "killed", "error")
MOST_STARTS = 5  # of a case whose worker ends without a report and without a new checkpoint


@dataclass(frozen=True)
class Standing:
    """State of a case."""

    status: str  # waiting, running, interrupted, done, failed (the run), error (it cannot be run) or killed
    message: str = ""  # error, empty if there was none
    summary: Plain = field(default_factory=dict)  # part of the run's summary that a sweep needs; empty without one


class SweepFolder:
    """Folder of a sweep."""

    def __init__(self, path: str | os.PathLike[str]):
        self.path = Path(path)
        self._ended: dict[int, Standing] = {}

    @property
    def exists(self) -> bool:
        """Whether a sweep was begun here."""
        return (self.path / SWEEP).is_file() and (self.path / CASES).is_file()

    def begin(self, plan: Plan, members: Sequence[Member]) -> list[Member]:
        """Write the sweep, or find it as it was; cases may have been added to it.

        Returns all its cases, those of earlier rounds included. Raises `CaseError` when the folder holds something
        else, or a sweep whose cases are others; `OutputError` when it cannot be written.
        """
        if self.exists:
            existing = self.members()
            if any(old.digest != new.digest for old, new in zip(existing, members, strict=False)):
                raise CaseError(
                    f"{self.path} holds a sweep of other cases, unchanged: give another folder", where="--out"
                )
            if len(existing) >= len(members):
                return existing
        elif self.path.exists() and (not self.path.is_dir() or any(self.path.iterdir())):
            raise CaseError(f"{self.path} is not empty and not a sweep; nothing was changed", where="--out")
        with atomic_write.write_errors(self.path):
            for name in (RUNS, CLAIMS):
                (self.path / name).mkdir(parents=True, exist_ok=True)
        atomic_write.write_text(self.path / BASE, dump(plan.base.value))
        effective = plan.sweep.model_dump(mode="json", exclude_unset=True, by_alias=True) | {"case": BASE, "set": {}}
        if effective["vary"].get("file"):
            effective["vary"] = {"type": "list", "cases": [member.values for member in members]}
        atomic_write.write_text(self.path / SWEEP, dump({k: v for k, v in effective.items() if v != {}}))
        self.write_members(members)
        return list(members)

    def plan(self) -> Plan:
        """Return the plan of the sweep as it was begun."""
        return load_plan(self.path / SWEEP)

    @property
    def sweep(self) -> Sweep:
        """The sweep's model."""
        return self.plan().sweep

    def members(self) -> list[Member]:
        """Return the cases; raises `OutputError` when their list is damaged."""
        try:
            with (self.path / CASES).open(newline="", encoding="utf-8") as file:
                rows = list(csv.DictReader(file))
            return [
                Member(
                    int(row.pop("number")),
                    row.pop("hash"),
                    cost=float(row.pop("cost")),
                    values={path: plain_or_json(cell) for path, cell in row.items() if cell},
                )
                for row in rows
            ]
        except (OSError, ValueError, KeyError, UnicodeDecodeError, csv.Error) as error:
            raise OutputError(f"{self.path / CASES} cannot be read: {error}") from error

    def write_members(self, members: Sequence[Member]) -> None:
        """Write the list of cases."""
        paths = list(dict.fromkeys(path for member in members for path in member.values))
        rows: list[list[object]] = [["number", "hash", "cost", *paths]]
        for member in members:
            values = [member.values.get(path, "") for path in paths]
            cells = [json.dumps(value) if isinstance(value, bool | list | dict | None) else value for value in values]
            rows.append([member.number, member.digest, f"{member.cost:.3g}", *cells])
        atomic_write.write_csv(self.path / CASES, rows)

    def run_folder(self, member: Member) -> Path:
        """Return the folder of a case's run."""
        return self.path / RUNS / member.name

    def has_failed(self, member: Member) -> bool:
        """Whether the run of a case has failed."""
        return _summary(self.run_folder(member)).get("status") == "failed"

    @contextmanager
    def claim(self, member: Member) -> Iterator[bool]:
        """Claim a case for this process; False where another process holds it."""
        try:
            lock = FileLock(self.path / CLAIMS / f"{member.number:05d}.lock")
        except BlockingIOError:
            yield False
            return
        except OSError as error:
            raise OutputError(f"cannot write {self.path / CLAIMS}: {atomic_write.reason(error)}") from error
        try:
            yield True
        finally:
            lock.release()

    def note(self, member: Member, event: str, **details: object) -> None:
        """Add a line to a case's claim: event, time and process."""
        line = {"event": event, "pid": os.getpid(), "time": time.time(), **details}
        path = self.path / CLAIMS / f"{member.number:05d}.jsonl"
        with atomic_write.write_errors(path), path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")

    def standing(self, member: Member, *, held: bool = False) -> Standing:
        """Return the state of a case; `held` where this process holds its claim."""
        if member.number in self._ended:
            return self._ended[member.number]
        standing = self._standing(member, held)
        if standing.status in ENDED:
            self._ended[member.number] = standing
        return standing

    def _standing(self, member: Member, held: bool) -> Standing:
        events = self._events(member)
        last = events[-1] if events else {}
        starts = _fruitless_starts(events)
        summary = _summary(self.run_folder(member))
        if last.get("event") == "again":
            return Standing("waiting")
        if last.get("event") == "error":
            return Standing("error", str(last.get("message", "")))
        if summary.get("status") in ("done", "failed") and not starts:
            return Standing(summary["status"], str((summary.get("failure") or {}).get("message", "")), summary)
        if starts and not held:
            with self.claim(member) as claimed:
                if not claimed:
                    return Standing("running")
        if starts >= MOST_STARTS:
            return Standing("killed", f"the process that computed it ended {starts} times without a report")
        if events:
            return Standing("interrupted", str(last.get("reason", "")), summary)
        return Standing("waiting")

    def begin_again(self, member: Member, end: float | None = None) -> None:
        """Mark a case as waiting, to be computed again or continued to a later `end` [s]."""
        self._ended.pop(member.number, None)
        self.note(member, "again", **({} if end is None else {"end": end}))

    def extended_end(self, member: Member) -> float | None:
        """Return the later end that a case was given [s]; None for its own."""
        return next((event["end"] for event in reversed(self._events(member)) if "end" in event), None)

    def _events(self, member: Member) -> list[Plain]:
        try:
            text = (self.path / CLAIMS / f"{member.number:05d}.jsonl").read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError):
            return []
        events = []
        for line in text.splitlines():
            try:
                event = json.loads(line)
            except ValueError:  # a line that a kill cut off
                continue
            if isinstance(event, dict) and "event" in event:
                events.append(event)
        return events


def _fruitless_starts(events: Sequence[Plain]) -> int:
    """Return the number of consecutive starts from the same checkpoint up to the last event."""
    starts, checkpoint = 0, None
    for event in events:
        if event["event"] != "start":
            starts = 0
            continue
        starts = starts + 1 if event.get("checkpoint") == checkpoint else 1
        checkpoint = event.get("checkpoint")
    return starts


def _summary(folder: Path) -> Plain:
    """Return the row of a run's summary for a sweep; empty without a summary."""
    try:
        summary = json.loads((folder / file_names.SUMMARY).read_text(encoding="utf-8"))
        measures = {
            name: {key: measure.get(key) for key in ("value", "uncertainty", "uncertainty_by", "unit")}
            for name, measure in summary["measures"].items()
        }
        keys = ("status", "failure", "conservation", "wall_seconds", "steps", "particles", "end_time")
        return {key: summary.get(key) for key in keys} | {
            "measures": measures,
            "missed": [row["name"] for row in summary["expected"] if not row["passed"]],
        }
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def plain_or_json(cell: str) -> object:
    """Return a cell of the list of cases as the value that was written."""
    if cell[:1] in "[{":
        try:
            return json.loads(cell)
        except ValueError:
            pass
    return plain(cell)


AGAIN = ("failed", "error", "killed", "interrupted")


@dataclass(frozen=True)
class Selection:
    """Cases to take."""

    statuses: tuple[str, ...] = ()  # runs with these statuses are repeated or resumed first
    # only these numbers
    first: int = 0
    last: int = 10**9

    @classmethod
    def parse(cls, text: str | None) -> "Selection":
        """Return the selection that `--only` asks for: a status, or N..M; raises `CaseError`."""
        if text is None:
            return cls()
        numbers = re.fullmatch(r"(\d+)(?:\.\.(\d+))?", text)
        if numbers:
            first, last = int(numbers[1]), int(numbers[2] or numbers[1])
            if last < first:
                raise CaseError(f"'{text}' holds no number; the smaller one comes first", where="--only")
            return cls(first=first, last=last)
        if text not in AGAIN:
            raise CaseError(f"'{text}' is neither {', '.join(AGAIN)} nor numbers such as 3..7", where="--only")
        return cls(statuses=("failed", "error", "killed") if text == "failed" else (text,))

    def takes(self, member: Member, standing: Standing) -> bool:
        """Return whether a case is to be computed."""
        inside = self.first <= member.number <= self.last
        cut_off = standing.status == "interrupted" and standing.message == "limit"
        return inside and standing.status not in ENDED and not cut_off

    def require(self, members: Sequence[Member]) -> None:
        """Raise `CaseError` where the sweep has no case of these numbers."""
        last = max((member.number for member in members), default=-1)
        if self.first > last:
            raise CaseError(f"there is no case {self.first}: numbers go from 0 to {last}", where="--only")

    @staticmethod
    def by_cost(members: Sequence[Member]) -> list[Member]:
        """Return the members, the costliest first, so that no long one is left for the end."""
        return sorted(members, key=lambda member: (-member.cost, member.number))


Row = Plain


def row(folder: SweepFolder, member: Member, standing: Standing) -> Row:
    """Return a case as a plain mapping: number, values, status, measures, cost, folder."""
    summary = standing.summary
    return {
        "number": member.number,
        "values": member.values,
        "status": standing.status,
        "message": standing.message,
        "measures": summary.get("measures", {}),
        "missed": summary.get("missed", []),
        "energy_drift": (summary.get("conservation") or {}).get("energy_drift"),
        "wall_seconds": summary.get("wall_seconds"),
        "folder": str(folder.run_folder(member)),
    }


def rows(folder: SweepFolder, members: Sequence[Member]) -> list[Row]:
    """Return the state of all cases."""
    return [row(folder, member, folder.standing(member)) for member in members]


def table_rows(cases: Sequence[Row], record: Sequence[str] | None) -> list[list[object]]:
    """Return heads and rows of a table; measures in SI, with the unit in the head and the uncertainty beside each."""
    paths = list(dict.fromkeys(path for row in cases for path in row["values"]))
    units: dict[str, str] = {}
    for row in cases:
        for name, measure in row["measures"].items():
            units.setdefault(name, measure["unit"] or "")
    names = [name for name in (record if record is not None else units) if name in units]
    heads = [f"{name} [{units[name]}]" if units[name] else name for name in names]
    last = ("energy_drift", "wall_seconds", "folder", "message")
    columns = (column for head in heads for column in (head, f"± {head}"))
    table: list[list[object]] = [["number", *paths, "status", *columns, *last]]
    for row in cases:
        measures = [row["measures"].get(name, {}) for name in names]
        cells = [measure.get(key) for measure in measures for key in ("value", "uncertainty")]
        values = (format_value(row["values"][path]) if path in row["values"] else "" for path in paths)
        table.append([row["number"], *values, row["status"], *cells, *(row[key] for key in last)])
    return table


class TableKeeper:
    """Writes the table when a case ends, at most once a second and never two processes at once."""

    def __init__(self, folder: SweepFolder, record: Sequence[str] | None):
        self.folder, self.record = folder, record
        self._next = 0.0

    def write(self, members: Sequence[Member], *, last: bool = False) -> None:
        """Write the table if it is time, or in any case when it is the last."""
        start = time.monotonic()
        if start < self._next and not last:
            return
        try:
            lock = FileLock(self.folder.path / CLAIMS / "table.lock")
        except BlockingIOError:  # another process writes the same
            return
        try:
            atomic_write.write_csv(self.folder.path / TABLE, table_rows(rows(self.folder, members), self.record))
        finally:
            lock.release()
        took = time.monotonic() - start
        self._next = start + max(1.0, 20.0 * took)
