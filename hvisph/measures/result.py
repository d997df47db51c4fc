"""Results of measures, and the functions that compute them by the rows of the catalogue."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from importlib import import_module
from pkgutil import walk_packages
from typing import Any, TypeVar

import numpy as np

import hvisph.measures as measures_package
from hvisph.core.measure_catalogue import SECTIONS, Measure, reported_measures
from hvisph.core.text import Plain, PlainMapping

from .measurement_frame import Scene
from .target_geometry import Plate

SETTLED_CHANGE = 0.02  # relative change over the last tenth of the run below which a number is settled
MASS_UNITS = {1: "kg/m^2", 2: "kg/m", 3: "kg"}  # per area in 1D and per depth in 2D


class UndefinedMeasureError(Exception):
    """A measure is undefined here; the message is the reason."""


def refuse_if(condition: object, reason: str) -> None:
    """Raise `UndefinedMeasureError` with the reason where a condition holds."""
    if condition:
        raise UndefinedMeasureError(reason)


@dataclass(frozen=True)
class Result:
    """A measured number in SI, or the reason why there is none.

    `scatter`: half-width by the sample that the number was taken from; None where that is not known.
    `spacing`, `support`: resolution of a length: dx [m], by which two edges together are uncertain, and the kernel's
        reach [m].
    `variation`: half of the range of the number over the last tenth of the run; None where that is not known.
    `variants`: the same quantity by further definitions, the first being this one.
    """

    value: float | None  # the number in `unit`; None where the measure is undefined, and then `reason` says why
    unit: str = ""
    scatter: float | None = None
    time: float | None = None  # time of a peak [s]; None for what belongs to a snapshot's own time
    reason: str = ""
    spacing: float | None = None
    support: float | None = None
    discretization: float | None = None  # estimated error of the particle spacing of other numbers
    variation: float | None = None
    note: str = ""  # what qualifies the number
    final: bool = True  # whether the state that it describes has come to rest
    variants: "Mapping[str, Result]" = field(default_factory=dict)

    @property
    def uncertainty_by(self) -> dict[str, float]:
        """The uncertainty by kind, in `unit`: ``spacing``, ``discretization``, ``scatter`` and ``variation``."""
        kinds = {name: getattr(self, name) for name in ("spacing", "discretization", "scatter", "variation")}
        if self.unit != "m":
            del kinds["spacing"]
        return {name: size for name, size in kinds.items() if size is not None and self.value is not None}

    @property
    def uncertainty(self) -> float | None:
        """Half-width of the uncertainty in `unit` at one resolution, of all kinds together."""
        kinds = self.uncertainty_by
        return float(np.sqrt(sum(size**2 for size in kinds.values()))) if kinds else None

    @property
    def settled(self) -> bool:
        """Whether the number is stationary: its change is below spacing and scatter, or below 2 % of itself."""
        if self.value is None or self.variation is None:
            return self.final
        kinds = self.uncertainty_by
        noise = float(np.hypot(kinds.get("spacing", 0.0), kinds.get("scatter", 0.0)))
        return self.final and self.variation <= max(noise, SETTLED_CHANGE * abs(self.value))

    def as_dict(self) -> Plain:
        """Return the plain form for JSON; optional entries appear only where they have a value."""
        plain: Plain = {"value": self.value, "unit": self.unit, "uncertainty": self.uncertainty}
        if self.uncertainty_by:
            plain["uncertainty_by"] = self.uncertainty_by
        if not self.settled:
            plain["settled"] = False
        if self.spacing is not None:
            plain["resolution"] = {"spacing": self.spacing, "support": self.support}
        plain |= {key: getattr(self, key) for key in ("time", "reason", "note") if getattr(self, key) not in (None, "")}
        if self.variants:
            plain["variants"] = plain_results(self.variants)
        return plain

    @classmethod
    def from_dict(cls, plain: PlainMapping) -> "Result":
        """Return the result with the plain form `plain`."""
        at, kinds = plain.get("resolution", {}), plain.get("uncertainty_by", {})
        scatter = kinds.get("scatter", None if kinds else plain.get("uncertainty"))
        values = {key: plain[key] for key in ("value", "unit", "time", "reason", "note") if key in plain} | at
        values |= {key: kinds[key] for key in ("discretization", "variation") if key in kinds}
        variants = {name: cls.from_dict(variant) for name, variant in plain.get("variants", {}).items()}
        result = cls(**values, scatter=scatter, variants=variants)
        return replace(result, final=plain.get("settled", True) or not result.settled)


def plain_results(results: Mapping[str, Result]) -> Plain:
    """Return the plain forms of results by name."""
    return {name: result.as_dict() for name, result in results.items()}


def undefined_result(unit: str, reason: str) -> Result:
    """Return the result of a measure that is undefined."""
    return Result(None, unit, reason=reason)


def weighted_quantile(values: np.ndarray, weights: np.ndarray, share: float) -> float:
    """Return the value that a `share` of the weight does not exceed, the same for a part and its mirrored whole."""
    order = np.argsort(values, kind="stable")
    cumulated = np.cumsum(weights[order])
    at = int(np.searchsorted(cumulated, share * cumulated[-1] * (1.0 - 1e-9)))
    return float(values[order[min(at, len(order) - 1)]])


F = TypeVar("F", bound=Callable[..., Any])
Outcome = float | Result | str  # a number, or one with its uncertainty, or the reason why there is none
Outcomes = Mapping[str, Outcome | Mapping[str, Outcome]]  # by name of the measure; of several variants by their names
# Relative discretization error by SI unit, over dx/w, w being the width of the projectile: of first order, about twice
# the median change of the measures of five bundled cases when their spacing is halved.
RELATIVE_ERRORS = {"m/s": 1.0, "N s": 1.0, "J": 1.5, "kg": 2.0, "K": 2.0, "rad": 4.0, "Pa": 5.0}
MISSING: dict[str, tuple[Callable[[Scene], bool], str]] = {
    "layer": (lambda scene: scene.has_target, "there is no target"),
    "start": (lambda scene: scene.start is not None, "a single snapshot does not contain the initial state"),
    "motion": (lambda scene: scene.has_motion, "the snapshot has no velocity or no mass"),
}


@dataclass(frozen=True)
class Entry:
    """A function and the names of the measures that it returns."""

    names: tuple[str, ...]  # measures of the catalogue
    # of a scene, and in the section of layers also of the plate; returns an `Outcome`, or `Outcomes` by name
    function: Callable[..., Any]
    needs: tuple[str, ...]  # data without which the measures are undefined: ``layer``, ``start``, ``motion``

    def outcomes(self, scene: Scene, *subject: Plate) -> Outcomes:
        """Return what the function finds, or the reason for all of its measures."""
        for need in self.needs:
            is_present, reason = MISSING[need]
            if not is_present(scene):
                return dict.fromkeys(self.names, reason)
        try:
            outcome = self.function(scene, *subject)
        except UndefinedMeasureError as reason:
            return dict.fromkeys(self.names, str(reason))
        return outcome if isinstance(outcome, Mapping) and self.names[0] in outcome else {self.names[0]: outcome}


ENTRIES: dict[str, list[Entry]] = {section: [] for section in SECTIONS}


def measures(section: str, *names: str, needs: tuple[str, ...] = ()) -> Callable[[F], F]:
    """Register a function that computes measures of a section."""

    def register(function: F) -> F:
        ENTRIES[section].append(Entry(names, function, needs))
        return function

    return register


@lru_cache(maxsize=1)
def entries() -> Mapping[str, list[Entry]]:
    """Return the functions of every section, which are registered as the modules of `hvisph.measures` are imported."""
    for module in walk_packages(measures_package.__path__, f"{measures_package.__name__}."):
        import_module(module.name)
    return ENTRIES


def evaluate(
    section: str, scene: Scene, *subject: Plate, names: Collection[str] = (), reason: str = ""
) -> dict[str, Result]:
    """Return the measures of a section in the catalogue's order; `reason`: why all are undefined, if they are."""
    dim, rows = scene.state.dimensions, SECTIONS[section]
    listed = names or reported_measures(dim, section)
    found: dict[str, Outcome | Mapping[str, Outcome]] = {}
    for entry in entries()[section]:
        if reason or not any(dim in rows[name].dims for name in entry.names):
            found |= dict.fromkeys(entry.names, reason or f"it is undefined in {dim}D")
        elif not set(listed).isdisjoint(entry.names):
            found |= entry.outcomes(scene, *subject)
    outcomes = {
        name: found[name] if dim in rows[name].dims else f"it is undefined in {dim}D" for name in rows if name in listed
    }
    return {name: complete(rows[name], outcome, scene) for name, outcome in outcomes.items()}


def complete(measure: Measure, outcome: Outcome | Mapping[str, Outcome], scene: Scene) -> Result:
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
    if measure.unit in RELATIVE_ERRORS and result.discretization is None:
        error = min(RELATIVE_ERRORS[measure.unit] * scene.relative_spacing, 1.0)
        return replace(result, discretization=error * abs(result.value))
    return result
