"""Summary of a run: cost, conservation, measures, expectations, and mass fractions beyond the models."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hvisph import __version__
from hvisph.case.bodies import Body
from hvisph.case.case import Case
from hvisph.casefile.loader import case_hash
from hvisph.compiler.jit import python_twin
from hvisph.core.errors import HvisphError
from hvisph.core.text import Plain
from hvisph.materials.material_table import Material
from hvisph.materials.melting import melt_temperature
from hvisph.materials.slots import MELT_TEMPERATURE
from hvisph.materials.validity_limits import outside_range, range_of
from hvisph.measures.compare import compare_expected
from hvisph.measures.measure import measure_in_time, undefined_measures
from hvisph.measures.tables import angular_velocity
from hvisph.output.reader import read_snapshot
from hvisph.output.snapshot import Snapshot
from hvisph.precheck.correlation_input import correlations_of
from hvisph.precheck.impact_pair import compare_peak_pressure
from hvisph.setup.materials import material_of

from .warnings import ValidityRange, final_warnings

NEGATIVE_ENERGY_SHARE = 1e-9  # share of the mean energy of the start below which a negative energy is round-off


def shares(state: Snapshot, start: Snapshot, materials: Sequence[Material]) -> dict[str, float | None]:
    """Return mass fractions [-] by name, None where unknown; `materials` are those of the particles' numbers."""
    mass = state.fields["mass"]
    total = float(mass.sum())
    if not total > 0.0:
        return {}
    parts: dict[str, float | None] = {}
    damage = state.fields.get("damage")
    if damage is not None:
        breaks = np.isin(state.material, [k for k, m in enumerate(materials) if m.damage.tag != 0])
        parts["failed"] = float(mass[breaks & (damage >= 1.0)].sum()) / total if breaks.any() else None
    parts["above_melting"] = _melted_mass(state, materials, mass)
    energy = state.fields.get("internal_energy")
    if energy is not None:
        density, temperature, mass_beyond = state.fields["density"], state.fields.get("temperature"), 0.0
        for number, material in enumerate(materials):
            rows = state.material == number
            hot = None if temperature is None else temperature[rows]
            borne = [None if values is None else values[rows] for values in (state.fields.get("pressure"), damage)]
            mass_beyond += float(mass[rows][outside_range(material, density[rows], energy[rows], hot, *borne)].sum())
        parts["beyond_range"] = mass_beyond / total
        squared = (start.fields["velocity"].reshape(start.count, -1) ** 2).sum(axis=1)
        energies = start.fields["mass"] * (0.5 * squared + np.abs(start.fields["internal_energy"]))
        mean = float(energies.sum() / start.fields["mass"].sum())
        floor = min(0.0, float(start.fields["internal_energy"].min())) - NEGATIVE_ENERGY_SHARE * mean
        parts["negative_energy"] = float(mass[energy < floor].sum()) / total
    return parts


def _melted_mass(state: Snapshot, materials: Sequence[Material], mass: np.ndarray) -> float | None:
    temperature = state.fields.get("temperature")
    if temperature is None:
        return None
    melted, defined = 0.0, False
    point = python_twin(melt_temperature)
    for number, material in enumerate(materials):
        row = material.row()
        if not np.isfinite(row[MELT_TEMPERATURE]):
            continue
        defined = True
        # most of a target is cold: Lindemann's and Simon's points are not below half of that without pressure
        hot = np.flatnonzero((state.material == number) & (temperature > 0.5 * row[MELT_TEMPERATURE]))
        states = zip(state.fields["density"][hot], state.fields["pressure"][hot], strict=True)
        limits = np.array([point(rho, p, row) for rho, p in states])
        melted += float(mass[hot][temperature[hot] >= limits].sum()) if len(hot) else 0.0
    return melted / float(mass.sum()) if defined else None


def summarise(case: Case, text: str, *, status: str, time: float, failure: Plain | None, particles: int,
              steps: int, threads: int, wall_seconds: float, conservation: dict[str, float | None],
              start: Snapshot, now: Snapshot, history: Plain, materials: Sequence[Material],
              snapshots: Sequence[Path] = (), energies: Mapping[str, float | None] | None = None,
              highest_pressure: float = 0.0, crack_area: float | None = None,
              ) -> Plain:  # fmt: skip
    """Return the content of ``summary.json``, as ``schemas/summary.schema.json`` describes it."""
    try:
        measured = measure_in_time(now, snapshots, start, history)
    except HvisphError as error:
        measured = undefined_measures(now, str(error))
    except (ValueError, FloatingPointError) as error:
        if status != "failed":
            raise
        measured = undefined_measures(now, f"the run failed and its last state cannot be measured ({error})")
    content = measured.as_dict()
    if case.kinematics != "axisymmetric":
        for name, table in content.get("bodies", {}).items():
            rows, fields = now.body == now.bodies.index(name), now.fields
            if case.bodies[name].rigid is not None and case.dim > 1:
                turns = angular_velocity(fields["position"][rows], fields["velocity"][rows], fields["mass"][rows])
                table["angular_velocity"] = turns
    pressures, remarks = compare_peak_pressure(case, highest_pressure)
    fractions = shares(now, start, materials)
    models = [body.material for body in case.bodies.values()]
    restores = case.formulation.type == "projection"  # its pressures restore the density: no states of a material
    breaks = [model.damage.type != "none" or model.strength.type in ("none", "fabric") for model in models]
    unbreakable = [not (restores or b) for b in breaks]
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
            name: content[name]
            for name in ("measures", "bodies", "layers", "projectile", "cloud", "whole", "profile")
            if name in content
        },
        "remarks": [*_final_warnings(case, unbreakable, start, now, snapshots), *(() if restores else remarks)],
        "correlations": [asdict(one) for one in correlations_of(case)[0]],
        "energies": {k: None if one is None else one * measured.whole.factor for k, one in (energies or {}).items()},
        **({} if crack_area is None else {"crack_area": crack_area * measured.whole.factor}),
        "shares": fractions,
        "pressures": pressures,
        "conservation": conservation,
        "expected": compare_expected({**measured.results, **conservation}, case.expected.items()),
    }


def _final_warnings(
    case: Case, sound: Sequence[bool], start: Snapshot, final: Snapshot, files: Sequence[Path]
) -> list[str]:
    unread: list[str] = []

    def moments() -> Iterator[Snapshot]:
        for file in files:
            try:
                moment = read_snapshot(file, lazily=True)
            except HvisphError as error:
                unread.append(f"{error}: remarks look at the other moments alone")
                continue
            if moment.time < final.time:
                yield moment

    states = case.formulation.type != "projection"
    valid = [_validity_range(body, case.units == "none") for body in case.bodies.values() if states]
    cracks = [bool(getattr(body.material.damage, "breaks", False)) for body in case.bodies.values()]
    return [*final_warnings(final, start, list(case.bodies), sound, case.resolution, valid, moments(), cracks), *unread]


def _validity_range(body: Body, unitless: bool) -> ValidityRange:
    material = material_of(body.material, body.internal_energy)
    if body.rigid is not None:  # its density is that of its mass
        return ValidityRange(lambda density, *_, **__: np.zeros(len(density), bool), "", None)
    limits = range_of(material)
    damage: Any = body.material.damage
    limited = [getattr(damage, key, None) for key in ("spall_strength", "pressure_cutoff")]
    knows_none = damage.type in ("none", "johnson_cook", "cockcroft_latham") and limited == [None, None]
    bears = limits.tension if knows_none else None
    return ValidityRange(partial(outside_range, material), limits.describe(unitless), bears)
