"""Every measure of one moment: what there is of a run at a time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hvisph.core.errors import OutputError
from hvisph.core.measure_catalogue import CATALOGUE, reported
from hvisph.measures.debris.cloud import Cloud, cloud
from hvisph.measures.debris.debris import BodyFragments, debris
from hvisph.measures.debris.voids import void_fraction
from hvisph.measures.frame.initial_reference import Begun
from hvisph.measures.frame.measurement_frame import Scene
from hvisph.measures.frame.roles import PROJECTILE
from hvisph.measures.frame.symmetry_completion import Whole
from hvisph.measures.one_dimensional.plateau import plateau
from hvisph.measures.one_dimensional.pressure import centre_pressure_peak, centre_tension_peak
from hvisph.measures.one_dimensional.shell_radii import radii
from hvisph.measures.one_dimensional.spall import pull_back
from hvisph.measures.projectile.bars import bar, penetration_ratio
from hvisph.measures.projectile.motion import momentum_transfer, residual_velocity
from hvisph.measures.projectile.perforation_times import Moment, moment_of
from hvisph.measures.projectile.residual_projectile import residue
from hvisph.measures.target.plug import FEWEST, plug_and_lip
from hvisph.measures.target.targets import LayerMeasures, layer_measures, perforated, without_meaning
from hvisph.output.snapshot import Snapshot

from .heat import temperatures
from .lengths import crater_diameter, extension, penetration
from .result import MASS_UNITS, Result, meaningless
from .verdict import answer

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
    moment
        What it tells of when layers were perforated and passed.
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
    moment: Moment = field(default=Moment(0.0), compare=False, repr=False)

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


def measure_snapshot(
    now: Snapshot, start: Snapshot | None = None, history: History | None = None, source: str = "",
    begun: Begun | None = None,
) -> Measures:  # fmt: skip
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
    begun
        What is known of the start, where several moments of a run are measured.
    """
    scene = Scene.of(now, begun or start)
    if not scene.is_projectile.any():
        remedy = "" if PROJECTILE in scene.shot.roles else "; give a body `role: projectile`"
        raise OutputError(f"{source or 'the snapshot'}: there is no particle of the projectile{remedy}")
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
        **temperatures(scene),
        "penetration_ratio": penetration_ratio(scene, layers),
        **one_bar.results,
        **radii(scene),
        **pull_back(history, now),
    }
    if now.dimensions == 1:
        behind_shocks = plateau(scene)
        results |= {"plateau_stress": behind_shocks.stress, "interface_velocity": behind_shocks.velocity}
    results = {name: result.finite() for name, result in results.items()} | without_meaning(layers)
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
        moment=replace(moment_of(scene), state=lambda _: "", projectile=dict),  # nothing is held
    )


def unmeasured(now: Snapshot, reason: str) -> Measures:
    """Return what there is of a moment that cannot be measured: every measure without a value."""
    results = {name: meaningless(CATALOGUE[name].unit, reason) for name in reported(now.dimensions)}
    return Measures("", str(now.metadata.get("title", "")), now.time, now.step, results, now.dimensions)
