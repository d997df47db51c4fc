"""Analysis of the results of a sweep, and further cases of a bisection."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import sqrt
from typing import Any

import numpy as np

from hvisph.case import sweep as models

from .calibration import Calibration
from .comparison import against_experiment
from .design import converge_cases, distribution, variants
from .finding import finding
from .folder import ENDED
from .parameters import FACTORS, Scale, Values, product, split
from .statistics import convergence, spread
from .surrogate import sensitivity
from .table import Row
from .threshold import Bracket, bracket, lambert_jonas, logistic_limit, next_values
from .uncertainty import combine_uncertainties


def verdict(vary: Any, base: Mapping[str, Any], rows: Sequence[Row]) -> dict[str, Any]:
    """Analyse the results of a sweep, in plain form for `results.json`."""
    said: dict[str, Any] = {
        "type": vary.type,
        "cases": len(rows),
        "done": sum(row["status"] == "done" for row in rows),
        "failures": [
            {key: row[key] for key in ("number", "status", "message")} for row in rows if row["status"] in ENDED[1:]
        ],
    }
    done = [row for row in rows if row["status"] == "done"]
    if isinstance(vary, models.Converge):
        said["converge"] = _converge(vary, base, done)
    elif isinstance(vary, models.Listed) and (found := against_experiment(done)):
        said["experiment"] = found
    elif isinstance(vary, models.Sample):
        said["sample"] = _sample(vary, base, done)
    elif isinstance(vary, models.Bisect):
        said["limits"] = [_limit(vary, base, fixed, group) for fixed, group in _groups(vary, base, done)]
        _add_uncertainty(vary, base, said["limits"])
    elif isinstance(vary, models.Fit):
        said["fit"] = Calibration(vary, base, done).solve()[1]
    said["finding"] = finding(said, done)
    return said


def following(vary: Any, base: Mapping[str, Any], rows: Sequence[Row], points: int) -> list[Values]:
    """Return the cases of the next round of a bisection, `points` for each limit, or of a fit; none of other sweeps."""
    if isinstance(vary, models.Fit):
        return Calibration(vary, base, [row for row in rows if row["status"] == "done"]).solve()[0]
    if not isinstance(vary, models.Bisect):
        return []
    without, beyond, width = Scale(vary.path, [*vary.bracket, vary.tolerance], base).numbers
    cases: list[Values] = []
    for fixed, group in _groups(vary, base, [row for row in rows if row["status"] == "done"]):
        decided = _classify(vary.event, group)
        if len(decided) < len(group):  # the shot first has to go on to a later time
            continue
        scale = Scale(vary.path, [*vary.bracket, vary.tolerance, *(row["values"][vary.path] for row in group)], base)
        known = bracket(scale.numbers[3:], [yes for _, yes in decided], beyond < without)
        cases += [fixed | {vary.path: scale.value(number)} for number in next_values(known, points, width)]
    return cases


def _groups(vary: models.Bisect, base: Mapping[str, Any], rows: Sequence[Row]) -> list[tuple[Values, list[Row]]]:
    """Return the settings of each limit with its shots."""
    every = [one | variant for one in product(vary.parameters) for variant in variants(vary, base)]
    paths = {path for one in every for path in one}
    return [
        (fixed, [row for row in rows if all(row["values"].get(path) == fixed.get(path) for path in paths)])
        for fixed in every
    ]


def undecided_shots(vary: Any, rows: Sequence[Row]) -> list[int]:
    """Return the numbers of the shots of a limit that are done and do not tell on which side of it they are."""
    if not isinstance(vary, models.Bisect):
        return []
    return [row["number"] for row in rows if row["status"] == "done" and _outcome(vary.event, row) is None]


def _add_uncertainty(vary: models.Bisect, base: Mapping[str, Any], limits: Sequence[dict[str, Any]]) -> None:
    """Add the combined uncertainty to the first limit of each group of variants."""
    extras = variants(vary, base)
    if len(extras) == 1:
        return
    spacings = Scale("resolution", vary.resolutions, base).numbers if vary.resolutions else [1.0]
    for k in range(0, len(limits), len(extras)):
        group = limits[k : k + len(extras)]
        if any(one["limit"] is None for one in group):
            continue
        values = [one["limit"] for one in group]
        finest = group[spacings.index(min(spacings))]
        half = 0.5 * abs(finest["above"] - finest["below"])
        correlation = vary.fit["correlation"] if isinstance(vary.fit, dict) else []
        count = len(spacings)
        finest["uncertainty"] = combine_uncertainties(spacings, values[:count], half, values[count:], correlation)


def _outcome(event: models.Event, row: Row) -> bool | None:
    """Return on which side of the limit a case is; None where its measure does not tell."""
    value = row["measures"].get(event.measure, {}).get("value")
    if value is None:
        return None if event.absent == "undecided" else event.absent == "above"
    return float(value) > event.threshold


def _classify(event: models.Event, rows: Sequence[Row]) -> list[tuple[Row, bool]]:
    judged = [(row, _outcome(event, row)) for row in rows]
    return [(row, yes) for row, yes in judged if yes is not None]


def _limit(vary: models.Bisect, base: Mapping[str, Any], fixed: Values, rows: Sequence[Row]) -> dict[str, Any]:
    decided = _classify(vary.event, rows)
    undecided = [row["number"] for row in rows if _outcome(vary.event, row) is None]
    rows, happened = [row for row, _ in decided], [yes for _, yes in decided]
    scale = Scale(vary.path, [*vary.bracket, *(row["values"][vary.path] for row in rows)], base)
    (without, beyond), numbers = scale.numbers[:2], scale.numbers[2:]
    limits = bracket(numbers, happened, beyond < without)
    shots = [
        {"number": row["number"], "value": number, "happened": yes,
         "residual": row["measures"].get(vary.residual, {}).get("value")}
        for row, number, yes in sorted(zip(rows, numbers, happened, strict=True), key=lambda one: one[1])
    ]  # fmt: skip
    curve = None
    through = [shot for shot in shots if shot["happened"] and shot["residual"] is not None]
    if scale.unit in FACTORS:  # the fit is in m/s
        factor = FACTORS[scale.unit]
        curve = lambert_jonas([factor * s["value"] for s in through], [abs(s["residual"]) for s in through],
                              bracket([factor * number for number in numbers], happened))  # fmt: skip
    v50 = logistic_limit(numbers, happened) if limits.mixed else None
    if v50 is None and limits.below is not None and limits.above is not None:  # equally likely within the bracket
        v50 = 0.5 * (limits.below + limits.above), abs(limits.above - limits.below) / sqrt(12.0)
    return {"parameters": fixed, "path": vary.path, "unit": scale.unit, **limits.as_dict(), "v50": v50, "shots": shots,
            "undecided": undecided, "open": _open(limits, without, beyond, decided, undecided),
            "lambert_jonas": None if curve is None else curve.as_dict()}  # fmt: skip


def _open(limits: Bracket, without: float, beyond: float, decided: Sequence[Any], undecided: Sequence[int]) -> str:
    """Return why no limit was found, with the remedy; empty where one was."""
    if undecided:
        which = ", ".join(map(str, undecided))
        told = f"shots {which} do not tell yet" if len(undecided) > 1 else f"shot {which} does not tell yet"
        return f"{told} on which side of it: give a later `longest`, or the time.end of a run that tells"
    if not decided:
        return "no shot is done"
    farther = ("lower", "higher") if without < beyond else ("higher", "lower")
    if limits.below is None:
        return f"it happens at every value that was tried: begin at a {farther[0]} one"
    if limits.above is None:
        return f"it happens at no value that was tried: end at a {farther[1]} one"
    if (limits.below, limits.above) == (beyond, without):
        return "it happens at the first value and not at the second: give them the other way round"
    return ""


def _converge(vary: models.Converge, base: Mapping[str, Any], rows: Sequence[Row]) -> dict[str, Any]:
    perturbed = [next((row for row in rows if row["values"] == one), None)
                 for one in converge_cases(vary, base)[len(vary.values) :]]  # fmt: skip
    rows = [row for row in rows if len(row["values"]) == 1]
    scale = Scale(vary.path, [row["values"][vary.path] for row in rows], base) if rows else None
    spacings = scale.numbers if scale else []
    names = dict.fromkeys(name for row in rows for name in row["measures"])
    verdicts = {}
    for name in names:
        known = [
            (row["measures"][name], h)
            for row, h in zip(rows, spacings, strict=True)
            if isinstance(row["measures"].get(name, {}).get("value"), int | float)
        ]
        if not known:
            continue
        values = [float(measure["value"]) for measure, _ in known]
        uncertain = [_noise(measure) for measure, _ in known]
        verdicts[name] = convergence(values, [h for _, h in known], uncertain).as_dict() | {
            "unit": known[0][0]["unit"], "spacings": [h for _, h in known], "values": values,
            "uncertainties": uncertain, "spacing_unit": scale.unit if scale else "",
        }  # fmt: skip
        if len(values) == len(vary.values):
            finest = min(known, key=lambda one: one[1])[0]
            time = (finest.get("uncertainty_by") or {}).get("swing", 0.0)
            others = [None if row is None else row["measures"].get(name, {}).get("value") for row in perturbed]
            correlation = vary.fit["correlation"] if isinstance(vary.fit, dict) else []
            verdicts[name]["uncertainty"] = combine_uncertainties(
                [h for _, h in known], values, time, others, correlation
            )
    return verdicts


def _noise(measure: Mapping[str, Any]) -> float | None:
    """Return the uncertainty of a measure without the estimated discretization error, which resolutions tell."""
    kinds = measure.get("uncertainty_by") or {}
    if not kinds:
        return measure["uncertainty"]
    return sum(size**2 for kind, size in kinds.items() if kind != "discretization") ** 0.5


def _sample(vary: models.Sample, base: Mapping[str, Any], rows: Sequence[Row]) -> dict[str, Any]:
    drawn = {path: distribution(path, one, base) for path, one in vary.values.items()
             if not isinstance(one, models.Choice)}  # fmt: skip
    verdicts = {}
    for name in dict.fromkeys(name for row in rows for name in row["measures"]):
        chosen = [row for row in rows if isinstance(row["measures"].get(name, {}).get("value"), int | float)]
        if not chosen:
            continue
        results = np.array([float(row["measures"][name]["value"]) for row in chosen])
        verdicts[name] = {"unit": chosen[0]["measures"][name]["unit"], **spread(results.tolist())}
        if len(drawn) < len(vary.values) or not (scale := {path: one for path, (one, _) in drawn.items()}):
            continue
        inputs = np.array([[split(path, row["values"][path])[0] for path in drawn] for row in chosen])
        found = sensitivity(inputs, results, [one for _, one in drawn.values()])
        if found:
            verdicts[name]["sensitivity"] = found | {"inputs": {path: one.unit for path, one in scale.items()}}
    return verdicts
