"""What the results of a sweep say, by what it varies; and the cases that are to follow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hvisph.case import sweep as models

from .experiment_comparison import against_experiment
from .folder import ENDED
from .parameters import FACTORS, Scale, Values, product
from .statistics import convergence, rank_correlations, spread
from .table import Row
from .threshold import Bracket, bracket, lambert_jonas, next_values


def verdict(vary: Any, base: Mapping[str, Any], rows: Sequence[Row]) -> dict[str, Any]:
    """Return what a sweep's results say, in plain form for `results.json`."""
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
        said["limits"] = [_limit(vary, base, fixed, group) for fixed, group in _groups(vary, done)]
    return said


def following(vary: Any, base: Mapping[str, Any], rows: Sequence[Row], points: int) -> list[Values]:
    """Return the cases of the next round of a bisection, `points` for each limit; none of other sweeps."""
    if not isinstance(vary, models.Bisect):
        return []
    without, beyond, width = Scale(vary.path, [*vary.bracket, vary.tolerance], base).numbers
    cases: list[Values] = []
    for fixed, group in _groups(vary, [row for row in rows if row["status"] == "done"]):
        decided = _decided(vary.event, group)
        if len(decided) < len(group):  # a shot that tells nothing now would tell nothing again
            continue
        scale = Scale(vary.path, [*vary.bracket, vary.tolerance, *(row["values"][vary.path] for row in group)], base)
        known = bracket(scale.numbers[3:], [yes for _, yes in decided], beyond < without)
        cases += [fixed | {vary.path: scale.value(number)} for number in next_values(known, points, width)]
    return cases


def _groups(vary: models.Bisect, rows: Sequence[Row]) -> list[tuple[Values, list[Row]]]:
    return [
        (fixed, [row for row in rows if all(row["values"].get(path) == value for path, value in fixed.items())])
        for fixed in product(vary.parameters)
    ]


def _happened(event: models.Event, row: Row) -> bool | None:
    """Return on which side of the limit a case is; None where its measure does not tell."""
    value = row["measures"].get(event.measure, {}).get("value")
    if value is None:
        return None if event.absent == "undecided" else event.absent == "above"
    return float(value) > event.threshold


def _decided(event: models.Event, rows: Sequence[Row]) -> list[tuple[Row, bool]]:
    judged = [(row, _happened(event, row)) for row in rows]
    return [(row, yes) for row, yes in judged if yes is not None]


def _limit(vary: models.Bisect, base: Mapping[str, Any], fixed: Values, rows: Sequence[Row]) -> dict[str, Any]:
    decided = _decided(vary.event, rows)
    undecided = [row["number"] for row in rows if _happened(vary.event, row) is None]
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
    return {"parameters": fixed, "path": vary.path, "unit": scale.unit, **limits.as_dict(), "shots": shots,
            "undecided": undecided, "open": _open(limits, without, beyond, decided, undecided),
            "lambert_jonas": None if curve is None else curve.as_dict()}  # fmt: skip


def _open(limits: Bracket, without: float, beyond: float, decided: Sequence[Any], undecided: Sequence[int]) -> str:
    """Return why no limit was found, with the remedy; empty where one was."""
    if undecided:
        which = ", ".join(map(str, undecided))
        told = f"shots {which} do not tell yet" if len(undecided) > 1 else f"shot {which} does not tell yet"
        return f"{told} on which side of it: a later time.end is needed"
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
    return verdicts


def _noise(measure: Mapping[str, Any]) -> float | None:
    """Return the uncertainty of a measure without the estimated discretization error, which resolutions tell."""
    kinds = measure.get("uncertainty_by") or {}
    if not kinds:
        return measure["uncertainty"]
    return sum(size**2 for kind, size in kinds.items() if kind != "discretization") ** 0.5


def _sample(vary: models.Sample, base: Mapping[str, Any], rows: Sequence[Row]) -> dict[str, Any]:
    inputs: dict[str, list[Any]] = {}
    for path, one in vary.values.items():
        values = [row["values"].get(path) for row in rows]
        plain = isinstance(one, models.Choice) or not values
        inputs[path] = values if plain else Scale(path, values, base).numbers
    verdicts = {}
    for name in dict.fromkeys(name for row in rows for name in row["measures"]):
        chosen = [k for k, row in enumerate(rows)
                  if isinstance(row["measures"].get(name, {}).get("value"), int | float)]  # fmt: skip
        if not chosen:
            continue
        results = [float(rows[k]["measures"][name]["value"]) for k in chosen]
        some = {path: [values[k] for k in chosen] for path, values in inputs.items()}
        verdicts[name] = {"unit": rows[chosen[0]]["measures"][name]["unit"], **spread(results),
                       "rank_correlation": rank_correlations(results, some)}  # fmt: skip
    return verdicts
