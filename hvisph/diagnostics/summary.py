"""Summary of a run: cost, conservation, measures and expectations."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hvisph import __version__
from hvisph.casefile.loader import case_hash
from hvisph.core.errors import HvisphError
from hvisph.materials.validity_limits import outside_range, range_of
from hvisph.measures.compare import compare_expected
from hvisph.measures.correlations import correlations
from hvisph.measures.measure import measure_in_time, undefined_measures
from hvisph.output.reader import read_snapshot
from hvisph.output.snapshot import Snapshot
from hvisph.precheck.correlation_input import impact_of
from hvisph.precheck.hugoniot_check import compare_peak_pressure
from hvisph.setup.materials import material_of

from .mass_fractions import shares
from .model_validity import Holds
from .warnings import remarks

if TYPE_CHECKING:
    from hvisph.case.case import Case


def summarise(case: Case, text: str, *, status: str, time: float, failure: dict[str, Any] | None, particles: int,
              steps: int, threads: int, wall_seconds: float, conservation: dict[str, float | None],
              start: Snapshot, now: Snapshot, history: dict[str, Any],
              snapshots: Sequence[Path] = (), energies: Mapping[str, float | None] | None = None,
              highest_pressure: float = 0.0,
              ) -> dict[str, Any]:  # fmt: skip
    """Return the content of ``summary.json``, as ``schemas/summary.schema.json`` describes it."""
    try:
        measured = measure_in_time(now, snapshots, start, history)
    except HvisphError as error:
        measured = undefined_measures(now, str(error))
    except (ValueError, FloatingPointError) as error:
        if status != "failed":
            raise
        measured = undefined_measures(now, f"the run failed and its last state cannot be measured ({error})")
    plain = measured.as_dict()
    pressures, apart = compare_peak_pressure(case, highest_pressure)
    told = shares(now, start, [material_of(body.material, body.internal_energy) for body in case.bodies.values()])
    models = [body.material for body in case.bodies.values()]
    restores = case.formulation.type == "projection"  # its pressures restore the density: no states of a material
    whole = [not restores and one.strength.type != "none" and one.damage.type == "none" for one in models]
    return {
        "answer": measured.answer,
        "title": case.title,
        "code_version": __version__,
        "case_hash": case_hash(text),
        "status": status,
        "end_time": time,
        "failure": failure,
        "particles": particles,
        "steps": steps,
        "threads": threads,
        "wall_seconds": wall_seconds,
        "microseconds_per_particle_step": 1e6 * wall_seconds / (particles * steps) if steps else None,
        **{
            name: plain[name]
            for name in ("measures", "bodies", "layers", "projectile", "cloud", "whole", "profile")
            if name in plain
        },
        "remarks": [*_remarks(case, whole, start, now, snapshots), *(() if restores else apart)],
        "correlations": _correlations(case),
        "energies": {
            name: None if value is None else value * measured.whole.factor for name, value in (energies or {}).items()
        },
        "shares": told,
        "pressures": pressures,
        "conservation": conservation,
        "expected": compare_expected({**measured.results, **conservation}, case.expected),
    }


def _remarks(case: Case, whole: Sequence[bool], start: Snapshot, now: Snapshot, files: Sequence[Path]) -> list[str]:
    unread: list[str] = []

    def moments() -> Iterator[Snapshot]:
        for file in files:
            try:
                moment = read_snapshot(file, lazily=True)
            except HvisphError as error:
                unread.append(f"{error}: remarks look at the other moments alone")
                continue
            if moment.time < now.time:
                yield moment

    states = case.formulation.type != "projection"
    holds = [_holds(body, case.units == "none") for body in case.bodies.values() if states]
    return [*remarks(now, start, list(case.bodies), whole, case.resolution, holds, moments()), *unread]


def _holds(body: Any, unitless: bool) -> Holds:
    material = material_of(body.material, body.internal_energy)
    holds = range_of(material)
    damage: Any = body.material.damage
    limited = [getattr(damage, key, None) for key in ("spall_strength", "pressure_cutoff")]
    knows_none = damage.type in ("none", "johnson_cook", "cockcroft_latham") and limited == [None, None]
    bears = holds.tension if knows_none else None
    return Holds(partial(outside_range, material), holds.describe(unitless), bears)


def _correlations(case: Case) -> list[dict[str, Any]]:
    impact, _ = impact_of(case)
    return [] if impact is None else [one.as_dict() for one in correlations(impact)]
