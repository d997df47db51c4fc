"""The measures of a run or of one snapshot, from its files alone."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from hvisph.core.errors import CaseError, OutputError
from hvisph.core.measure_catalogue import CATALOGUE, reported_measures
from hvisph.core.text import Plain
from hvisph.output import file_names, reader
from hvisph.output.snapshot import Snapshot

from .debris import Cloud, cloud, ejecta_over_speed
from .fragments import FEWEST_PARTICLES, BodyFragments, Fragments
from .impact_geometry import PROJECTILE
from .lengths import plug_of
from .measurement_frame import InitialReference, Scene
from .result import MASS_UNITS, Result, evaluate, plain_results, undefined_result
from .symmetry_completion import Symmetry
from .targets import LayerMeasures, Moment, Timeline, layer_measures, perforation_text

History = Mapping[str, np.ndarray]
Read = Callable[[Path], Snapshot]
Results = Mapping[str, Result]
VARIATION_PERIOD = 0.1  # share of the run over which the variation is measured
MOST_MOMENTS = 3  # earlier moments that are measured for the variation
LARGE_SNAPSHOT = 300_000  # particles above which one earlier moment is measured
ROUND_OFF = 1e-12  # of the largest velocity of a body: a smaller mean component is zero


@dataclass(frozen=True)
class Measures:
    """The measures at one moment.

    `time`, `step`: the moment [s] and the number of steps done.
    `bodies`: of every body: ``mass`` [kg], ``velocity`` (mass mean, list) [m/s] and ``kinetic_energy`` [J].
    `fragments`: of every body, in the order of bodies: its connected groups with masses and velocities.
    `whole`: how the whole model, which is measured, follows from the computed part.
    `profile`: outline of a bar: ``distance`` from its foot and ``diameter`` [m]; empty where there is none.
    `series`: all moments in the order of time, where all were measured. This one is the last.
    """

    source: str
    title: str
    time: float
    step: int
    results: dict[str, Result]
    dimensions: int = 3
    unitless: bool = False
    bodies: dict[str, Plain] = field(default_factory=dict)
    fragments: tuple[BodyFragments, ...] = field(default=(), compare=False, repr=False)
    layers: tuple[LayerMeasures, ...] = ()
    whole: Symmetry = field(default_factory=Symmetry)
    projectile: dict[str, Result] = field(default_factory=dict)
    cloud: Cloud = field(default_factory=lambda: Cloud({}))
    profile: dict[str, list[float]] = field(default_factory=dict)
    # mass and momentum of the first layer's ejecta by launch speed, with angle and radius; empty where there are none
    ejecta: dict[str, list[float]] = field(default_factory=dict)
    series: "tuple[Measures, ...]" = field(default=(), compare=False, repr=False)

    def __getitem__(self, name: str) -> Result:
        return self.results[name]

    @property
    def sections(self) -> Mapping[str, Results]:
        """Results by section: ``run``, ``projectile``, ``cloud``, and ``layer.NAME`` of each layer."""
        layers = {f"layer.{layer.body}": layer.results for layer in self.layers}
        return {"run": self.results, "projectile": self.projectile, "cloud": self.cloud.results} | layers

    @property
    def answer(self) -> str:
        """Line that states which layers are perforated."""
        return perforation_text(self.layers, self.unitless)

    @property
    def mass_unit(self) -> str:
        """SI unit of a mass, which is one per depth or area in 2D and 1D; empty without units."""
        return "" if self.unitless else MASS_UNITS[3 if self.whole.revolution else self.dimensions]

    def as_dict(self) -> Plain:
        """Return the plain form for JSON: SI units throughout."""
        content = self._head() | {
            "answer": self.answer,
            "measures": plain_results(self.results),
            "bodies": self.bodies,
            "layers": [layer.as_dict() for layer in self.layers],
            "projectile": {"measures": plain_results(self.projectile)},
            "cloud": self.cloud.as_dict(),
            "whole": self.whole.as_dict(),
        }
        if self.ejecta:
            content["ejecta"] = self.ejecta
        if self.profile:
            content["profile"] = self.profile
        if self.series:
            content["series"] = [moment.as_dict() for moment in self.series]
        return content

    def fragments_as_dict(self, fewest: int = FEWEST_PARTICLES) -> Plain:
        """Return the fragments of `fewest` particles or more in their plain form for JSON, others summed up; in SI."""
        content = self._head() | {"mass_unit": self.mass_unit}
        content["bodies"] = [part.as_dict(fewest) for part in self.fragments]
        if self.series:
            content["series"] = [moment.fragments_as_dict(fewest) for moment in self.series]
        return content

    def _head(self) -> Plain:
        return {"source": self.source, "title": self.title, "time": self.time, "step": self.step}


def measure_snapshot(
    state: Snapshot, start: Snapshot | InitialReference | None = None, history: History | None = None, source: str = ""
) -> Measures:
    """Return the measures of a snapshot in memory.

    `start` is the run's first snapshot, or its reference; without it axis and plate come from `state`. `history`: the
    columns of ``history.csv`` by name, whose peaks count up to the moment, and `source` is what to name as measured.
    """
    scene = Scene.from_snapshot(state, start)
    scene.history = history
    return measure_scene(scene, source)


def measure_scene(scene: Scene, source: str = "") -> Measures:
    """Measure a scene; raises `OutputError` where it has no particle of a projectile."""
    if not scene.is_projectile.any():
        remedy = "" if PROJECTILE in scene.shot.roles else "; give a body `role: projectile`"
        raise OutputError(f"{source or 'the snapshot'}: there is no particle of the projectile{remedy}")
    state = scene.state
    return Measures(
        source=source,
        title=str(state.metadata.get("title", "")),
        time=state.time,
        step=state.step,
        results=evaluate("run", scene),
        dimensions=state.dimensions,
        unitless=state.metadata.get("units") == "none",
        bodies=body_table(scene),
        fragments=debris(scene),
        layers=layer_measures(scene),
        whole=scene.shot.whole,
        projectile=evaluate("projectile", scene),
        cloud=cloud(scene, state.metadata.get("witness")),
        profile=scene.profile,
        ejecta=ejecta_over_speed(scene),
    )


def body_table(scene: Scene) -> dict[str, Plain]:
    """Return mass, mass-mean velocity in the case's axes and kinetic energy of every body; empty without masses."""
    if not scene.has_motion:
        return {}
    velocity = scene.shot.back(scene.state.fields["velocity"].reshape(scene.state.count, -1))
    velocity = velocity + np.array(scene.shot.drift or (0.0,))
    table = {}
    for body in scene.state.present:
        rows = scene.state.body == body
        mass = scene.state.fields["mass"][rows]
        total = float(mass.sum())
        mean = mass @ velocity[rows] / total if total > 0.0 else np.zeros(velocity.shape[1])
        mean = np.where(np.abs(mean) > ROUND_OFF * np.abs(velocity[rows]).max(initial=0.0), mean, 0.0)
        energy = 0.5 * float(mass @ (velocity[rows] ** 2).sum(axis=1))
        values = np.array([total, *mean, energy])
        if np.isfinite(values).all():
            table[scene.name(body)] = {"mass": total, "velocity": mean.tolist(), "kinetic_energy": energy}
    return table


def debris(scene: Scene) -> tuple[BodyFragments, ...]:
    """Return the fragments of every body, centres and velocities in the case's axes, extents in the shot's."""
    pieces = []
    for body in scene.state.present:
        fragments = scene.fragments(body)
        roles = _roles(scene, body, fragments)
        elsewhere = scene.shot.is_rotated or scene.shot.drift
        moved_fragments = replace(fragments, back=scene.shot.case_axes(scene.state.time)) if elsewhere else fragments
        pieces.append(BodyFragments(scene.name(body), moved_fragments, roles))
    return tuple(pieces)


def _roles(scene: Scene, body: int, fragments: Fragments) -> tuple[str, ...]:
    roles = [""] * len(fragments)
    if body == scene.target:
        roles = ["attached" if is_attached else "" for is_attached in scene.attached_groups(body)]
        plug = plug_of(scene)
        if plug is not None:
            roles[plug] = "plug"
    if roles[0] != "plug":
        roles[0] = "main body"
    return tuple(roles)


def undefined_measures(moment: Snapshot, reason: str) -> Measures:
    """Return the measures of a snapshot that cannot be measured: all undefined, with the reason."""
    results = {name: undefined_result(CATALOGUE[name].unit, reason) for name in reported_measures(moment.dimensions)}
    return Measures("", str(moment.metadata.get("title", "")), moment.time, moment.step, results, moment.dimensions)


def recent_moments(times: Sequence[float], end: float) -> list[int]:
    """Return the numbers of the moments before `end` [s] for the variation: one to three of the last tenth."""
    recent = [number for number, time in enumerate(times) if time >= end * (1.0 - VARIATION_PERIOD) * (1.0 - 1e-9)]
    if not recent:
        return [len(times) - 1] if len(times) else []
    step = max(1, -(-len(recent) // MOST_MOMENTS))
    return recent[::step]


def add_variation(results: Results, end: float, earlier: Sequence[tuple[float, Results]]) -> dict[str, Result]:
    """Return the results at time `end` [s] with their variation: half of their range over the last tenth of the run.

    A single earlier moment that lies further back gives a drift, of which the share of a tenth of the run counts.
    """
    varied = dict(results)
    for name, result in results.items():
        values_before = [(time, before[name]) for time, before in earlier if name in before]
        if result.variants:
            parts = [(time, before.variants) for time, before in values_before]
            result = replace(result, variants=add_variation(result.variants, end, parts))
            varied[name] = result
        values = [before.value for _, before in values_before if before.value is not None]
        if result.value is None or result.time is not None or name in ("perforated", "perforation_time") or not values:
            continue
        span = end - min(time for time, _ in values_before)
        share = min(1.0, VARIATION_PERIOD * end / span) if span > 0.0 else 1.0
        variation = 0.5 * share * (max(*values, result.value) - min(*values, result.value))
        varied[name] = replace(result, variation=variation)
    return varied


def measure(
    source: str | os.PathLike[str],
    at: float | str | None = None,
    *,
    names: Mapping[str, str] | None = None,
    units: tuple[float, float, float] | None = None,
    witness: float | None = None,
) -> Measures:
    """Measure a run folder or a single snapshot file.

    `source`: a run folder, a folder of another code's files (VTU, VTP, VTK, LAMMPS dumps), or one snapshot. A single
    snapshot is measured alone, without history and start.
    `at`: None for the last moment, a time [s] for the snapshot nearest to it, ``"all"`` for all of them.
    `names`: of another code's files: their own name of a quantity, ``{"density": "rho_0"}``.
    `units`: of another code's files: units of length [m], mass [kg] and time [s]; SI unless given.
    `witness`: coordinate of a witness plane along the shot line [m]; the case's unless given.
    Returns `Measures`: ``measure(run)["plug_velocity"].value`` is a number in SI, and ``[piece.mass for body in
    measure(run).fragments for piece in body]`` are the masses of all fragments. `hvisph.measures.tables` writes what
    ``at="all"`` returns, `hvisph.visualization.curves` draws it.
    Raises `CaseError` when there is no such file or folder, a folder holds no snapshot, or `at` is none of the above;
    `OutputError` when a file is damaged or foreign.
    """
    path = Path(source)
    if not path.exists():
        raise CaseError(f"no such run folder or snapshot: {path}")
    if not (at is None or at == "all" or (isinstance(at, int | float) and np.isfinite(at))):
        raise CaseError(f"{at!r} is no time; allowed: a time in seconds, or 'all'", where="at")
    convention = reader.Convention(names or {}, units)

    def read_file(file: Path) -> Snapshot:
        snapshot = reader.read_snapshot(file, convention, lazily=True)
        if witness is not None:
            snapshot.metadata["witness"] = witness
        return snapshot

    if path.is_file():
        return measure_snapshot(read_file(path), source=str(path))
    files = reader.snapshots_in(path)
    first = read_file(files[0])
    start = first if first.step == 0 else None  # the start is unknown where the first snapshots are gone
    # a folder of another code's files has no history; a damaged one is an error
    history = reader.read_history(path) if (path / file_names.HISTORY).exists() else None
    if at == "all":
        return _measure_series(files, None if start is None else InitialReference(start), history, str(path), read_file)
    if at is not None:
        times = (reader.read_time(file, convention) for file in files)
        number = min(enumerate(times), key=lambda entry: abs(entry[1] - float(at)))[0]
        files = files[: number + 1]
    return measure_in_time(read_file(files[-1]), files, start, history, str(path), read_file)


def measure_in_time(
    moment: Snapshot,
    files: Sequence[Path],
    start: Snapshot | None = None,
    history: History | None = None,
    source: str = "",
    read_file: Read | None = None,
) -> Measures:
    """Measure one moment with temporal scatter and times of perforation and exit, which follow from earlier ones.

    `files` are the snapshots up to it in order of time, `start` is the first of them, if it is the run's first, and
    `read_file` reads one of them; `history` and `source` are as in `measure_snapshot`.
    """
    initial = None if start is None else InitialReference(start)
    read_file = read_file or partial(reader.read_snapshot, lazily=True)
    scene = Scene.from_snapshot(moment, initial)
    scene.history = history
    if files:
        last = len(files) - 1
        scene.timeline = Timeline(_loader(files, initial, read_file), len(files), {last: Moment(lambda: scene)})
    measured = measure_scene(scene, source)
    earlier = [file for file in files if file.stem != file_names.POST_MORTEM][:-1]
    if not earlier:
        return measured
    recent = [read_file(earlier[-1])]
    for file in reversed(earlier[-MOST_MOMENTS:-1] if recent[0].count < LARGE_SNAPSHOT else ()):
        before = read_file(file)
        if before.time < (1.0 - VARIATION_PERIOD) * moment.time:
            break
        recent.append(before)
    return _add_variation(measured, [measure_snapshot(snapshot, initial) for snapshot in reversed(recent)])


def _loader(files: Sequence[Path], initial: InitialReference | None, read_file: Read) -> Callable[[int], Scene]:
    """Return a function that loads the scene of a snapshot by its number; of a large run it keeps only one."""
    return lru_cache(maxsize=1)(lambda number: Scene.from_snapshot(read_file(files[number]), initial))


def _measure_series(
    files: Sequence[Path], initial: InitialReference | None, history: History | None, source: str, read_file: Read
) -> Measures:
    """Measure all snapshots of a run; the last result contains the series."""
    load, moments = _loader(files, initial, read_file), dict[int, Moment]()
    series: list[Measures] = []
    for number, file in enumerate(files):
        scene = Scene.from_snapshot(read_file(file), initial)
        scene.history = history
        moments[number] = moment = Moment(lambda scene=scene: scene)  # type: ignore[misc]
        scene.timeline = Timeline(load, number + 1, moments, series=True)
        measured = measure_scene(scene, source)
        for body in scene.layers:
            moment.state(body)
        moment.scene = partial(load, number)  # the scene is not held
        series.append(_add_variation(measured, series))
    return replace(series[-1], series=tuple(series))


def _add_variation(measured: Measures, earlier: Sequence[Measures]) -> Measures:
    """Return measures with their range over the last tenth of the run."""
    earlier = [earlier[number] for number in recent_moments([moment.time for moment in earlier], measured.time)]
    if not earlier:
        return measured
    before = [(moment.time, moment.sections) for moment in earlier]
    varied = {
        name: add_variation(results, measured.time, [(time, sections.get(name, {})) for time, sections in before])
        for name, results in measured.sections.items()
    }
    layers = tuple(replace(layer, results=varied[f"layer.{layer.body}"]) for layer in measured.layers)
    cloud = replace(measured.cloud, results=varied["cloud"])
    return replace(measured, results=varied["run"], layers=layers, projectile=varied["projectile"], cloud=cloud)
