"""Registration and evaluation of measures: one function for each row, or a few rows, of the catalogue."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from hvisph.core.measure_catalogue import SECTIONS, Measure, reported_measures

from .result import Result, UndefinedMeasureError, undefined_result

if TYPE_CHECKING:
    from hvisph.measures.frame.measurement_frame import Scene

F = TypeVar("F", bound=Callable[..., Any])
Outcome = float | Result | str  # a number, or with what is known of it, or why there is none
Outcomes = Mapping[str, Outcome | Mapping[str, Outcome]]  # by name of the measure; of several variants by their names
# SI units of quantities whose discretization error is estimated by the number of particles across the projectile.
ESTIMATED = ("m/s", "Pa", "kg", "N s", "J", "rad")
MISSING = {
    "layer": (lambda scene: scene.has_target, "there is no target"),
    "start": (lambda scene: scene.start is not None, "a single snapshot does not contain the initial state"),
    "motion": (lambda scene: {"velocity", "mass"} <= scene.now.fields.keys(),
               "the snapshot has no velocity or no mass"),
}  # fmt: skip


@dataclass(frozen=True)
class Entry:
    """A function and the measures that it returns.

    Parameters
    ----------
    names
        Measures of the catalogue.
    function
        Of a scene, and in the section of layers also of the plate; returns an `Outcome`, or `Outcomes` by name.
    needs
        Data without which the measures are undefined: ``layer``, ``start``, ``motion``.
    """

    names: tuple[str, ...]
    function: Callable[..., Any]
    needs: tuple[str, ...]

    def outcomes(self, scene: Scene, *subject: Any) -> Outcomes:
        """Return what the function finds, or the reason for all of its measures."""
        for need in self.needs:
            present, reason = MISSING[need]
            if not present(scene):
                return dict.fromkeys(self.names, reason)
        try:
            found = self.function(scene, *subject)
        except UndefinedMeasureError as reason:
            return dict.fromkeys(self.names, str(reason))
        return found if isinstance(found, Mapping) and self.names[0] in found else {self.names[0]: found}


# The modules with measures, below `hvisph.measures`.
MODULES = ("debris.cloud", "pressure", "projectile.bars", "projectile.cavities", "projectile.lengths",
           "projectile.residual_projectile", "target.perforation_times", "target.plug", "target.target_damage",
           "target.targets")  # fmt: skip
ENTRIES: dict[str, list[Entry]] = {section: [] for section in SECTIONS}


def measures(section: str, *names: str, needs: tuple[str, ...] = ()) -> Callable[[F], F]:
    """Register a function as the one that computes measures of a section."""

    def register(function: F) -> F:
        ENTRIES[section].append(Entry(names, function, needs))
        return function

    return register


@lru_cache(maxsize=1)
def entries() -> Mapping[str, list[Entry]]:
    """Return the functions of every section, which are registered as their modules are imported."""
    for module in MODULES:
        import_module(f"hvisph.measures.{module}")
    return ENTRIES


def evaluate(section: str, scene: Scene, *subject: Any, names: Collection[str] = (), reason: str = ""
             ) -> dict[str, Result]:  # fmt: skip
    """Return the measures of a section in the order of the catalogue.

    Parameters
    ----------
    section, scene, subject
        The section, and what its functions take.
    names
        The measures to compute; all unless given.
    reason
        Why all of them are undefined, where they are.
    """
    dim, rows = scene.now.dimensions, SECTIONS[section]
    chosen = names or reported_measures(dim, section)
    found: dict[str, Any] = {}
    for entry in entries()[section]:
        if reason or not any(dim in rows[name].dims for name in entry.names):
            found |= dict.fromkeys(entry.names, reason or f"it is undefined in {dim}D")
        elif not set(chosen).isdisjoint(entry.names):
            found |= entry.outcomes(scene, *subject)
    return {
        name: complete(measure, found[name] if dim in measure.dims else f"it is undefined in {dim}D", scene)
        for name, measure in rows.items() if name in chosen
    }  # fmt: skip


def complete(measure: Measure, outcome: Any, scene: Scene) -> Result:
    """Return the result of an outcome: with its unit, its resolution and its variants."""
    if isinstance(outcome, Mapping):
        variants = {name: complete(measure, outcome[name], scene) for name in measure.variants}
        return replace(next(iter(variants.values())), variants=variants)
    unit = measure.unit_in(scene.space)
    if isinstance(outcome, str):
        return undefined_result(unit, outcome)
    result = replace(outcome, unit=unit) if isinstance(outcome, Result) else Result(float(outcome), unit)
    if result.value is None:
        return undefined_result(unit, result.reason)
    if not np.isfinite(result.value):
        return undefined_result(unit, "its value is not finite")
    if unit == "m":
        return replace(result, spacing=scene.spacing, support=scene.support)
    if measure.unit in ESTIMATED and result.discretization is None:
        return replace(result, discretization=scene.discretization * abs(result.value))
    return result
