"""Every measure of a run or of one snapshot, from its files alone."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from hvisph.core.errors import CaseError
from hvisph.measures.frame.initial_reference import Begun
from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.one_dimensional.plateau import before_release, plateau
from hvisph.measures.projectile.perforation_times import Moment, moment_of, with_history
from hvisph.output.snapshot import Snapshot

from .result import Result
from .snapshot_measures import History, Measures, measure_snapshot, unmeasured
from .temporal_scatter import LARGE, LATELY, MOST, lately, swinging
from .verdict import answer

__all__ = ["History", "Measures", "measure", "measure_in_time", "measure_snapshot", "unmeasured"]


def measure(source: str | os.PathLike[str], at: float | str | None = None, *,
            names: Mapping[str, str] | None = None, units: tuple[float, float, float] = (1.0, 1.0, 1.0),
            witness: float | None = None) -> Measures:  # fmt: skip
    """Measure a run folder or a single snapshot file.

    Parameters
    ----------
    source
        A run folder, a folder of another code's files (VTU, VTP, VTK, LAMMPS dumps), or one snapshot. A single
        snapshot is measured alone: its history and its start, and what needs them, are not looked for elsewhere.
    at
        None for the last moment, a time [s] for the snapshot nearest to it, ``"all"`` for all of them.
    names
        Of another code's files: their own name of a quantity, ``{"density": "rho_0"}``.
    units
        Of another code's files: units of length [m], mass [kg] and time [s].
    witness
        Coordinate of a witness plane along the shot line [m]; the case's unless given.

    Returns
    -------
    Measures
        ``measure(run)["plug_velocity"].value`` is a number in SI, and
        ``[piece.mass for body in measure(run).fragments for piece in body]`` are the masses of all fragments.
        `hvisph.measures.series` writes what ``at="all"`` returns, `hvisph.visualization.measure_series` draws it.

    Raises
    ------
    CaseError
        When there is no such file or folder, a folder holds no snapshot, or `at` is none of the above.
    OutputError
        When a file is damaged or foreign.
    """
    path = Path(source)
    if not path.exists():
        raise CaseError(f"no such run folder or snapshot: {path}")
    if not (at is None or at == "all" or (isinstance(at, int | float) and np.isfinite(at))):
        raise CaseError(f"{at!r} is no moment; allowed: a time in seconds, or 'all'", where="at")
    from hvisph.output import file_names as files_of
    from hvisph.output import reader

    convention = reader.Convention(names or {}, units)

    def read(file: Path) -> Snapshot:
        snapshot = reader.read_snapshot(file, convention, lazily=True)
        if witness is not None:
            snapshot.metadata["witness"] = witness
        return snapshot

    if path.is_file():
        return measure_snapshot(read(path), source=str(path))
    files = reader.snapshots_in(path)
    first = read(files[0])
    # a folder whose first snapshots are gone does not tell how the run began
    start = first if first.step == 0 else None
    # a folder of another code's files has no history; a damaged one is an error
    history = reader.read_history(path) if (path / files_of.HISTORY).exists() else None
    if at == "all":
        begun = None if start is None else Begun(start)
        moments = tuple(measure_snapshot(read(file), start, history, str(path), begun) for file in files)
        known = [_known(one, file, lambda file: Scene.of(read(file), begun))
                 for one, file in zip(moments, files, strict=True)]  # fmt: skip
        moments = tuple(_timed(moment, number + 1, known.__getitem__) for number, moment in enumerate(moments))
        moments = tuple(_swung(moment, moments[:number]) for number, moment in enumerate(moments))
        return replace(moments[-1], series=moments)
    if at is not None:
        times = (reader.read_time(file, convention) for file in files)
        number = min(enumerate(times), key=lambda known: abs(known[1] - float(at)))[0]
        files = files[: number + 1]
    return measure_in_time(read(files[-1]), files, start, history, str(path), read)


def measure_in_time(now: Snapshot, files: Sequence[Path], start: Snapshot | None = None,
                    history: History | None = None, source: str = "",
                    read: Callable[[Path], Snapshot] | None = None) -> Measures:  # fmt: skip
    """Measure one moment, with what only earlier ones tell: how far measures swing, and when layers were perforated.

    Parameters
    ----------
    now
        The moment.
    files
        The snapshots up to it, in order of time.
    start
        The first of them, if it is the run's first.
    history, source
        As in `measure_snapshot`.
    read
        Reads one of them; `hvisph.output.reader.read_snapshot`, fields when they are asked for, unless given.
    """
    from hvisph.output import reader

    begun = None if start is None else Begun(start)
    read = read or partial(reader.read_snapshot, lazily=True)
    return _in_time(measure_snapshot(now, start, history, source, begun), files, begun, read)


def _in_time(now: Measures, files: Sequence[Path], begun: Begun | None, read: Callable[[Path], Snapshot]) -> Measures:
    """Return the measures of the last of the snapshots `files` with what only the earlier ones tell."""
    from hvisph.output import file_names

    last = now.moment

    @lru_cache(maxsize=1)  # of a large run no more are held
    def scene(number: int) -> Scene:
        return Scene.of(read(files[number]), begun)

    def moment(number: int) -> Moment:
        if number == len(files) - 1:
            return replace(last, projectile=lambda: moment_of(scene(number)).projectile())
        return moment_of(scene(number), lambda: scene(number))

    earlier = [file for file in files if file.stem != file_names.POST_MORTEM][:-1]
    if now.dimensions == 1:
        now = _plateau_of(now, files, begun, read)
    if earlier:
        recent = [read(earlier[-1])]
        for file in reversed(earlier[-MOST:-1] if recent[0].count < LARGE else ()):
            before = read(file)
            if before.time < (1.0 - LATELY) * now.time:
                break
            recent.append(before)
        now = _swung(now, [measure_snapshot(one, begun=begun) for one in reversed(recent)])
    return _timed(now, len(files), moment)


def _known(measured: Measures, file: Path, scene: Callable[[Path], Scene]) -> Moment:
    """Return what a measured moment tells, its layers' states among it."""
    states = [layer.state for layer in measured.layers]
    return replace(measured.moment, state=states.__getitem__, projectile=lambda: moment_of(scene(file)).projectile())


def _plateau_of(now: Measures, files: Sequence[Path], begun: Begun | None, read: Callable[[Path], Snapshot]
                ) -> Measures:  # fmt: skip
    """Return the measures of a plate impact with the plateau as it was before it was released."""
    snapshots = (read(file) for file in files)
    seen = [(one.time, plateau(Scene.of(one, begun))) for one in snapshots if one.time <= now.time]
    if not seen:
        return now
    best = before_release(seen)
    return replace(now, results=now.results | {"plateau_stress": best.stress.finite(),
                                                   "interface_velocity": best.velocity.finite()})  # fmt: skip


def _swung(now: Measures, earlier: Sequence[Measures]) -> Measures:
    """Return measures with their swing over the last tenth of the run."""
    earlier = [earlier[number] for number in lately([one.time for one in earlier], now.time)]
    if not earlier:
        return now

    def swung(of: Callable[[Measures], Mapping[str, Result]]) -> dict[str, Result]:
        return swinging(of(now), now.time, [(one.time, of(one)) for one in earlier])

    def of_layer(body: str) -> Callable[[Measures], Mapping[str, Result]]:
        return lambda one: next((layer.results for layer in one.layers if layer.body == body), {})

    layers = [replace(layer, results=swung(of_layer(layer.body))) for layer in now.layers]
    return replace(now, results=swung(lambda one: one.results), layers=tuple(layers),
                   projectile=swung(lambda one: one.projectile),
                   cloud=replace(now.cloud, results=swung(lambda one: one.cloud.results)))  # fmt: skip


def _timed(now: Measures, count: int, moment: Callable[[int], Moment]) -> Measures:
    layers = with_history(now.layers, count, moment)
    return replace(now, layers=layers, answer=answer(layers, now.unitless))
