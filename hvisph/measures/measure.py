"""Every measure of a run or of one snapshot, from its files alone."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hvisph.core.errors import CaseError, OutputError
from hvisph.core.measures import CATALOGUE, reported
from hvisph.measures.answer import answer
from hvisph.measures.bars import bar, penetration_ratio
from hvisph.measures.cloud import Cloud, cloud
from hvisph.measures.debris import BodyFragments, debris
from hvisph.measures.hollow import radii
from hvisph.measures.layers import LayerMeasures, layer_measures, perforated, states, with_times
from hvisph.measures.lengths import crater_diameter, extension, penetration
from hvisph.measures.motion import momentum_transfer, residual_velocity
from hvisph.measures.plateau import before_release, plateau
from hvisph.measures.plug import FEWEST, plug_and_lip
from hvisph.measures.pressure import centre_pressure_peak, centre_tension_peak
from hvisph.measures.residue import residue
from hvisph.measures.result import MASS_UNITS, Result, meaningless
from hvisph.measures.scene import Scene
from hvisph.measures.spall import pull_back
from hvisph.measures.swing import LATELY, MOST, lately, swinging
from hvisph.measures.voids import void_fraction
from hvisph.measures.whole import Whole
from hvisph.output.snapshot import Snapshot

History = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Measures:
    """The measures at one moment.

    Parameters
    ----------
    source
        The file or folder that was measured.
    title
        The case's title.
    time, step
        The moment [s] and the number of steps done.
    results
        By name; values in SI.
    dimensions
        1, 2 or 3.
    unitless
        Whether the case has no units.
    fragments
        Of every body, in the order of bodies: its connected groups with masses and velocities.
    layers
        What the shot did to every layer, in the order along the shot line.
    answer
        One line: which layers are perforated.
    whole
        How the whole model, which is what is measured, follows from what was computed.
    projectile
        What is left of the projectile, by name.
    cloud
        What flies on behind the perforated layers.
    profile
        Outline of a bar: ``distance`` from its foot and ``diameter`` [m]; empty where there is none.
    series
        Where every moment was asked for: all of them, in the order of time. This one is the last.
    """

    source: str
    title: str
    time: float
    step: int
    results: dict[str, Result]
    dimensions: int = 3
    unitless: bool = False
    fragments: tuple[BodyFragments, ...] = field(default=(), compare=False, repr=False)
    layers: tuple[LayerMeasures, ...] = ()
    answer: str = ""
    whole: Whole = field(default_factory=Whole)
    projectile: dict[str, Result] = field(default_factory=dict)
    cloud: Cloud = field(default_factory=lambda: Cloud({}))
    profile: dict[str, list[float]] = field(default_factory=dict)
    series: tuple[Measures, ...] = field(default=(), compare=False, repr=False)

    def __getitem__(self, name: str) -> Result:
        return self.results[name]

    @property
    def mass_unit(self) -> str:
        """SI unit of a fragment's mass, which is one per depth or area in 2D and 1D; empty without units."""
        return "" if self.unitless else MASS_UNITS[3 if self.whole.revolution else self.dimensions]

    def as_dict(self) -> dict[str, Any]:
        """Return the plain form for JSON: SI units throughout."""
        plain: dict[str, Any] = {
            "source": self.source,
            "title": self.title,
            "time": self.time,
            "step": self.step,
            "answer": self.answer,
            "measures": {name: result.as_dict() for name, result in self.results.items()},
            "layers": [layer.as_dict() for layer in self.layers],
            "projectile": {"measures": {name: result.as_dict() for name, result in self.projectile.items()}},
            "cloud": self.cloud.as_dict(),
            "whole": self.whole.as_dict(),
        }
        if self.profile:
            plain["profile"] = self.profile
        if self.series:
            plain["series"] = [moment.as_dict() for moment in self.series]
        return plain

    def fragments_as_dict(self, fewest: int = FEWEST) -> dict[str, Any]:
        """Return the fragments in their plain form for JSON: SI units throughout.

        Parameters
        ----------
        fewest
            Particles of a fragment that is listed; smaller ones are summed up.
        """
        plain: dict[str, Any] = {
            "source": self.source,
            "title": self.title,
            "time": self.time,
            "step": self.step,
            "mass_unit": self.mass_unit,
            "bodies": [part.as_dict(fewest) for part in self.fragments],
        }
        if self.series:
            plain["series"] = [moment.fragments_as_dict(fewest) for moment in self.series]
        return plain


def measure(source: str | os.PathLike[str], at: float | str | None = None, *,
            names: Mapping[str, str] | None = None, units: tuple[float, float, float] = (1.0, 1.0, 1.0),
            ) -> Measures:  # fmt: skip
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

    Returns
    -------
    Measures
        ``measure(run)["plug_velocity"].value`` is a number in SI, and
        ``[piece.mass for body in measure(run).fragments for piece in body]`` are the masses of all fragments.
        `hvisph.measures.series` writes what ``at="all"`` returns, `hvisph.pictures.series` draws it.

    Raises
    ------
    CaseError
        When there is no such file or folder, or `at` is none of the above.
    OutputError
        When a folder holds no snapshot, or a file is damaged or foreign.
    """
    path = Path(source)
    if not path.exists():
        raise CaseError(f"no such run folder or snapshot: {path}")
    if not (at is None or at == "all" or (isinstance(at, int | float) and np.isfinite(at))):
        raise CaseError(f"{at!r} is no moment; allowed: a time in seconds, or 'all'", where="at")
    from hvisph.output import names as files_of
    from hvisph.output import reader

    convention = reader.Convention(names or {}, units)

    def read(file: Path) -> Snapshot:
        return reader.read_snapshot(file, convention)

    if path.is_file():
        return measure_snapshot(read(path), source=str(path))
    files = reader.list_snapshots(path)
    if not files:
        raise OutputError(f"{path}: the folder holds no snapshot")
    first = read(files[0])
    # a folder whose first snapshots are gone does not tell how the run began
    start = first if first.step == 0 else None
    # a folder of another code's files has no history; a damaged one is an error
    history = reader.read_history(path) if (path / files_of.HISTORY).exists() else None
    if at == "all":
        moments = tuple(measure_snapshot(read(file), start, history, str(path)) for file in files)
        known = [(moment.time, [layer.state for layer in moment.layers]) for moment in moments]
        moments = tuple(_timed(moment, number + 1, known.__getitem__) for number, moment in enumerate(moments))
        moments = tuple(_swung(moment, moments[:number]) for number, moment in enumerate(moments))
        return replace(moments[-1], series=moments)
    if at is None:
        return in_time(measure_snapshot(read(files[-1]), start, history, str(path)), files, start, read)
    times = (read(file).time for file in files)
    number = min(enumerate(times), key=lambda known: abs(known[1] - float(at)))[0]
    now = read(files[number])
    return in_time(measure_snapshot(now, start, history, str(path)), files[: number + 1], start, read)


def in_time(now: Measures, files: Sequence[Path], start: Snapshot | None,
            read: Callable[[Path], Snapshot] | None = None) -> Measures:  # fmt: skip
    """Return measures with what only earlier snapshots tell: how far they swing, and when layers were perforated.

    Parameters
    ----------
    now
        Measured at the last moment.
    files
        The snapshots up to it, in order of time.
    start
        The first of them, if it is the run's first.
    read
        Reads one of them; `hvisph.output.reader.read_snapshot` unless given.
    """
    from hvisph.output import reader

    read = read or reader.read_snapshot

    def moment(number: int) -> tuple[float, Sequence[str]]:
        snapshot = read(files[number])
        return snapshot.time, states(Scene.of(snapshot, start))

    from hvisph.output import names

    earlier = [file for file in files if file.stem != names.POST_MORTEM][:-1]
    if now.dimensions == 1:
        now = _plateau_of(now, files, start, read)
    if earlier:
        recent = [read(earlier[-1])]
        for file in reversed(earlier[:-1]):
            before = read(file)
            if len(recent) >= MOST or before.time < (1.0 - LATELY) * now.time:
                break
            recent.append(before)
        now = _swung(now, [measure_snapshot(one, start) for one in reversed(recent)])
    return _timed(now, len(files), moment)


def _plateau_of(now: Measures, files: Sequence[Path], start: Snapshot | None, read: Callable[[Path], Snapshot]
                ) -> Measures:  # fmt: skip
    """Return the measures of a plate impact with the plateau as it was before it was released."""
    snapshots = (read(file) for file in files)
    seen = [(one.time, plateau(Scene.of(one, start))) for one in snapshots if one.time <= now.time]
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


def _timed(now: Measures, count: int, moment: Callable[[int], tuple[float, Sequence[str]]]) -> Measures:
    layers = with_times(now.layers, count, moment)
    return replace(now, layers=layers, answer=answer(layers, now.unitless))


def measure_snapshot(
    now: Snapshot, start: Snapshot | None = None, history: History | None = None, source: str = ""
) -> Measures:
    """Measure one moment held in memory.

    Parameters
    ----------
    now
        The moment.
    start
        The run's first snapshot; without it the axis and the plate come from `now` (see `scene`).
    history
        Columns of ``history.csv`` by name; peaks are taken up to the moment.
    source
        What to name as measured.
    """
    scene = Scene.of(now, start)
    if not scene.is_projectile.any():
        raise OutputError(f"{source or 'the snapshot'}: there is no particle of the projectile")
    layers, one_bar = layer_measures(scene), bar(scene)
    results = {
        "perforated": perforated(layers),
        **crater_diameter(scene),
        "extension": extension(scene),
        "penetration": penetration(scene),
        "void_fraction": void_fraction(scene),
        "centre_pressure_peak": centre_pressure_peak(history, now.time),
        "centre_tension_peak": centre_tension_peak(history, now.time),
        "residual_velocity": residual_velocity(scene, layers),
        "momentum_transfer": momentum_transfer(scene),
        **plug_and_lip(scene),
        "penetration_ratio": penetration_ratio(scene, layers),
        **one_bar.results,
        **radii(scene),
        **pull_back(history, now),
    }
    if now.dimensions == 1:
        behind_shocks = plateau(scene)
        results |= {"plateau_stress": behind_shocks.stress, "interface_velocity": behind_shocks.velocity}
    results = {name: result.finite() for name, result in results.items()}
    return Measures(
        source=source,
        title=str(now.metadata.get("title", "")),
        time=now.time,
        step=now.step,
        results=results,
        dimensions=now.dimensions,
        unitless=now.metadata.get("units") == "none",
        fragments=debris(scene),
        layers=layers,
        whole=scene.shot.whole,
        projectile=residue(scene, layers),
        cloud=cloud(scene, layers, now.metadata.get("witness")),
        profile=one_bar.profile,
        answer=answer(layers, now.metadata.get("units") == "none"),
    )


def unmeasured(now: Snapshot, reason: str) -> Measures:
    """Return what there is of a moment that cannot be measured: every measure without a value."""
    results = {name: meaningless(CATALOGUE[name].unit, reason) for name in reported(now.dimensions)}
    return Measures("", str(now.metadata.get("title", "")), now.time, now.step, results, now.dimensions)
