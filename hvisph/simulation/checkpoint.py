"""Checkpoints of a run: content, restoration and schedule.

A resumed run is built from its case first; a checkpoint stores the changing data only.
"""

import time as wall
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hvisph.case.case import Case
from hvisph.core.errors import CaseError, OutputError
from hvisph.core.particles import BODY, FLAGS, ID, MATERIAL, RETIRED, Ordered, Particles
from hvisph.core.text import Plain, is_number, shorten
from hvisph.diagnostics.budgets import Budget, Peaks
from hvisph.diagnostics.sanity_checks import SanityChecks
from hvisph.output.checkpoint_file import Checkpoint
from hvisph.parallel.parallel_output import Slabs
from hvisph.setup.build import Setup
from hvisph.simulation.clock import Clock, TimeStep

# Prefixes of arrays with one row per particle, ordered by number, and of global data.
CARRIED, HISTORY = "carried/", "history/"
STATE, TAGS, PEAKS = "state", "tags", "peaks"
# Parts of the budget.
BUDGET_ARRAYS = ("momentum", "impulse", "retired", "taken", "pending", "edge_momentum", "weight")
_WORK = ("slip_work", "plastic_work", "shock_heating", "external_work", "rigid_rotation", "gravity_energy")
BUDGET_NUMBERS = ("energy", "size", "edge_energy", "potential", "scale", *_WORK)
TIME_SHARE = 0.02  # largest share of a run's wall time for checkpoints, for any `checkpoint_every`
# Keys that may differ between the case of a checkpoint and the resumed case; they do not change steps.
_TEXTS = ("title", "source", "expected", "witness")
MAY_CHANGE = ("time.end", "time.max_steps", "output.checkpoint_every", "limits", *_TEXTS)


@dataclass
class Files:
    """Progress of a run's files: step of the last record, time of the last snapshot [s], wall time [s]."""

    recorded: int = 0
    written: float = 0.0
    wall_seconds: float = 0.0


@dataclass
class CheckpointContent:
    """All parts of a run that a checkpoint contains."""

    case: Case
    setup: Setup
    clock: Clock
    budget: Budget
    checks: SanityChecks
    files: Files
    series: list[tuple[float, str]]
    peaks: Peaks

    @contextmanager
    def capture(self, time_step: TimeStep) -> Iterator[Checkpoint | None]:
        """Yield the state between two steps, with the next step `time_step`; None but on the first process."""
        share, rows, header = self.setup.subdomain, self._rows(), self._header(time_step)
        history = {f"{HISTORY}{name}": values for name, values in self.setup.stepper.history().items()}
        arrays: Plain
        if share.uses_slabs:
            with Slabs(share.world, rows, self.setup.particles.id.astype(np.int64), share.count).open() as slabs:
                arrays = {name: slabs.get_array(name) for name in rows} if slabs else {}
                yield Checkpoint(self.clock.steps, header, arrays | history) if slabs else None
            return
        gathered = {name: share.gather_rows(values) for name, values in rows.items()}
        if not share.world.first:
            yield None
            return
        order = np.argsort(gathered[TAGS][:, ID])
        arrays = {name: Ordered(values, order) for name, values in gathered.items()}
        yield Checkpoint(self.clock.steps, header, arrays | history)

    def _rows(self) -> dict[str, np.ndarray]:
        """Return the particle arrays of a checkpoint by name."""
        particles, state_of_stepper = self.setup.particles, self.setup.stepper.get_carried()
        rows: dict[str, np.ndarray] = {STATE: particles.data, TAGS: particles.tags, PEAKS: self.peaks.rows}
        return rows | {f"{CARRIED}{name}": values for name, values in state_of_stepper.items()}

    def _header(self, time_step: TimeStep) -> Plain:
        clock, budget = self.clock, self.budget
        return {
            "case": self.case.model_dump(mode="json"),
            "fields": list(self.setup.particles.names),
            "clock": {name: getattr(clock, name) for name in ("time", "steps", "outputs", "allowed", "allowed_by")},
            "step": {"length": time_step.length, "criterion": time_step.criterion, "lands_on": time_step.lands_on},
            "budget": {name: getattr(budget, name).tolist() for name in BUDGET_ARRAYS}
            | {name: getattr(budget, name) for name in BUDGET_NUMBERS}
            | {"highest_pressure": budget.highest()},
            "late": self.setup.stepper.late.tolist(),
            "first_step": self.checks.first,
            "files": vars(self.files),
            "series": self.series,
        } | ({"origin": self.setup.origin} if self.setup.origin else {})

    def restore(self, checkpoint: Checkpoint, resume_late: Callable[[], None]) -> TimeStep:
        """Restore `checkpoint`, whose arrays the first process has, and return the next step.

        `resume_late` is called for the materials of a late stage, before the particles are predicted with them.
        Raises `CaseError` if the case has changed or ends before the checkpoint, `OutputError` if the content does not
        fit the run.
        """
        share, particles, arrays = self.setup.subdomain, self.setup.particles, checkpoint.arrays
        refuse_changed(checkpoint, self.case)
        header, rows, history = self._header(TimeStep(1.0, "")), self._rows(), self.setup.stepper.history()
        layout = {name: ((share.count, *values.shape[1:]), values.dtype) for name, values in rows.items()}
        layout |= {f"{HISTORY}{name}": (values.shape, values.dtype) for name, values in history.items()}

        def whole() -> dict[str, np.ndarray]:
            with _content_errors(checkpoint):
                refuse_misfit(checkpoint, header, layout)
                if header.get("origin") != checkpoint.header.get("origin"):
                    raise ValueError("the run that it started from has been run anew since")
                return {name: arrays[f"{HISTORY}{name}"] for name in history}

        history_values = share.world.broadcast_from_first(whole)
        own_rows = {name: share.scatter_rows(arrays.get(name)) for name in rows}
        with share.world.raise_together(), _content_errors(checkpoint):
            renews = header["case"]["formulation"].get("reference_update_strain") is not None
            refuse_other_particles(own_rows[STATE], own_rows[TAGS], particles, renews)
        with _content_errors(checkpoint):
            self._restore(checkpoint.header, own_rows, history_values)
            resume_late()
            return self._next_step(checkpoint.header)

    def _restore(self, header: Plain, rows: dict[str, np.ndarray], history: dict[str, np.ndarray]) -> None:
        clock, budget, particles, stepper = self.clock, self.budget, self.setup.particles, self.setup.stepper
        particles.data[...], particles.tags[...] = rows[STATE], rows[TAGS]
        self.peaks.rows[...] = rows[PEAKS]
        carried = {name.removeprefix(CARRIED): values for name, values in rows.items() if name.startswith(CARRIED)}
        stepper.restore(carried, history)
        for name, value in header["clock"].items():
            setattr(clock, name, value)
        for name in BUDGET_ARRAYS:
            getattr(budget, name)[...] = header["budget"][name]
        for name in (*BUDGET_NUMBERS, "highest_pressure"):
            setattr(budget, name, header["budget"][name])
        stepper.late[...] = header["late"]
        self.checks.first = header["first_step"]
        self.series[:] = [(time, name) for time, name in header["series"]]
        for name in vars(self.files):
            setattr(self.files, name, header["files"][name])

    def _next_step(self, header: Plain) -> TimeStep:
        if header["case"]["time"]["end"] == self.clock.end:
            return TimeStep(**header["step"])
        time_step = self.clock.extend()
        self.setup.stepper.predict(time_step.length)
        return time_step


@contextmanager
def _content_errors(checkpoint: Checkpoint) -> Iterator[None]:
    """Convert errors in reading the content of a checkpoint to an `OutputError`."""
    try:
        yield
    except (LookupError, ValueError, TypeError, AttributeError, OverflowError) as error:
        raise OutputError(f"the checkpoint of step {checkpoint.step} does not fit this run: {error}") from error


@dataclass
class CheckpointSchedule:
    """Schedule of checkpoints, one after each `every` [s] of wall time; None for never."""

    every: float | None
    _last: float = field(default_factory=wall.monotonic)
    _cost: float = 0.0

    @property
    def due(self) -> bool:
        """Return whether a checkpoint is due, considering the cost of the last one."""
        if self.every is None:
            return False
        return wall.monotonic() - self._last >= max(self.every, self._cost / TIME_SHARE)

    def record(self, start: float) -> None:
        """Record that a checkpoint begun at `start` on the monotonic clock [s] was written."""
        self._last = wall.monotonic()
        self._cost = self._last - start


def refuse_changed(checkpoint: Checkpoint, case: Case) -> None:
    """Raise `CaseError` with the differences of two cases, but for an end after the checkpoint."""
    before, current = checkpoint.header.get("case"), case.model_dump(mode="json")
    try:
        time, end = float(checkpoint.header["clock"]["time"]), before["time"]["end"]  # type: ignore[index]
    except (LookupError, ValueError, TypeError) as error:
        fault = f"the checkpoint of step {checkpoint.step} does not fit this run"
        raise OutputError(f"{fault}: it lacks {error}") from error
    changes = [
        "{} was {} and is {}".format(
            path, *("nothing" if value is None else shorten(str(value)) for value in (old, new))
        )
        for path, old, new in _differences(before, current, "")
        if not any(path == may or path.startswith(f"{may}.") for may in MAY_CHANGE)
    ]
    if changes:
        raise CaseError(
            f"the case has changed since the checkpoint: {'; '.join(changes[:5])}"
            f"{f' and {len(changes) - 5} more' if len(changes) > 5 else ''}; put it back, or begin a new run"
        )
    if case.time.end < time and case.time.end != end:
        unit = " s" if case.units == "si" else ""
        message = f"the run is at {time:.6g}{unit} already, beyond {case.time.end:.6g}{unit}"
        raise CaseError(message, where="time.end")


def _differences(before: object, after: object, path: str) -> list[tuple[str, Any, Any]]:
    if isinstance(before, dict) and isinstance(after, dict):
        keys = [*before, *(key for key in after if key not in before)]
        changes = [_differences(before.get(key), after.get(key), f"{path}.{key}" if path else key) for key in keys]
        return [difference for part in changes for difference in part]
    if isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        parts = [_differences(a, b, f"{path}.{k}") for k, (a, b) in enumerate(zip(before, after, strict=True))]
        return [difference for part in parts for difference in part]
    return [] if before == after else [(path, before, after)]


def refuse_misfit(checkpoint: Checkpoint, header: Plain, layout: dict[str, tuple[tuple[int, ...], np.dtype]]) -> None:
    """Raise `ValueError` unless a checkpoint has the types and shapes of `layout` and `header`."""
    for name, value in header.items():
        if name != "case":
            _refuse_other_kind(value, checkpoint.header[name], name)
    if checkpoint.header["fields"] != header["fields"]:
        raise ValueError("it has other fields")
    if not (checkpoint.header["clock"]["time"] >= 0.0 and checkpoint.header["step"]["length"] > 0.0):
        raise ValueError("its time or its step is not positive")
    if checkpoint.arrays.keys() != layout.keys():
        raise ValueError(f"it differs in {', '.join(sorted(checkpoint.arrays.keys() ^ layout.keys()))}")
    for name, (shape, dtype) in layout.items():
        stored = checkpoint.arrays[name]
        if stored.dtype != dtype or stored.shape != shape:
            raise ValueError(f"'{name}' has another shape or kind: {stored.shape}, not {shape}")
    numbers = checkpoint.arrays["tags"][:, ID]
    if not np.array_equal(numbers, np.arange(len(numbers))):
        raise ValueError("its particles are not in the order of their numbers, each once")


def refuse_other_particles(state: np.ndarray, tags: np.ndarray, particles: Particles, renews: bool) -> None:
    """Raise `ValueError` unless the constant data of `particles` are unchanged, row by row."""
    fixed = np.array([BODY, MATERIAL])
    flags = tags[:, FLAGS] & ~np.uint32(RETIRED)
    if (tags[:, fixed] != particles.tags[:, fixed]).any() or (flags != particles.tags[:, FLAGS]).any():
        raise ValueError("its particles are of other bodies or materials, or others are held")
    restored = Particles(particles.dim, 0, particles.names[len(Particles(particles.dim, 0).names) :])
    restored.data = state
    active = (tags[:, FLAGS] & RETIRED) == 0
    if (restored["mass"] != np.where(active, particles["mass"], 0.0)).any():
        raise ValueError("its particles have other masses")
    if not (restored["smoothing_length"] > 0.0).all() or not np.isfinite(restored["position"]).all():
        raise ValueError("its particles have no places or no smoothing lengths")
    if "kernel_type" in restored.offsets and not np.isin(restored["kernel_type"], (0.0, 1.0)).all():
        raise ValueError("its particles have no kind of kernel")
    if "reference_position" not in restored.offsets:
        return
    at = restored["reference_position"]
    if not np.isfinite(at).all() or (not renews and (at != particles["reference_position"]).any()):
        raise ValueError("its particles have other places in the reference configuration")


def _refuse_other_kind(form: object, stored: object, path: str) -> None:
    """Raise `ValueError` unless plain values have equal types; None may stand for a number."""
    if isinstance(form, dict):
        if not isinstance(stored, dict) or form.keys() != stored.keys():
            raise ValueError(f"its {path} has other keys")
        for name, value in form.items():
            _refuse_other_kind(value, stored[name], f"{path}.{name}")
    elif path == "series":
        if not isinstance(stored, list) or not all(_is_entry(entry) for entry in stored):
            raise ValueError(f"its {path} is no list of times and files")
    elif isinstance(form, list):
        if not isinstance(stored, list) or len(stored) != len(form):
            raise ValueError(f"its {path} has another length")
        for number, (value, stored_value) in enumerate(zip(form, stored, strict=True)):
            _refuse_other_kind(value, stored_value, f"{path}.{number}")
    elif isinstance(form, str) != isinstance(stored, str) or not (
        stored is None or isinstance(stored, str) or is_number(stored)
    ):
        raise ValueError(f"its {path} is of another kind")
    elif isinstance(form, int) and not isinstance(form, bool) and not (isinstance(stored, int) and abs(stored) < 2**62):
        raise ValueError(f"its {path} is no whole number")
    elif form is not None and stored is None:
        raise ValueError(f"its {path} is missing")


def _is_entry(entry: object) -> bool:
    return isinstance(entry, list) and len(entry) == 2 and is_number(entry[0]) and isinstance(entry[1], str)
