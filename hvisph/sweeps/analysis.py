"""Analysis of the results of a sweep, its finding in a sentence, and further cases of a bisection."""

from collections.abc import Sequence
from dataclasses import asdict
from math import sqrt

import numpy as np

from hvisph.case import sweep as models
from hvisph.core.measure_catalogue import NumberFormat, format_of, main_measures
from hvisph.core.text import Plain, PlainMapping, format_value, last_name

from . import statistics
from .calibration import Calibration, parameter_text
from .comparison import against_experiment
from .design import converge_cases, distribution, variants
from .folder import ENDED, Row
from .parameters import FACTORS, Scale, Values, product, split


def verdict(vary: models.Vary, base: PlainMapping, rows: Sequence[Row], record: Sequence[str] | None = None) -> Plain:
    """Analyse the results of a sweep, in plain form for `results.json`."""
    results: Plain = {
        "type": vary.type,
        "cases": len(rows),
        "done": sum(row["status"] == "done" for row in rows),
        "failures": [
            {k: row[k] for k in ("number", "status", "message")} for row in rows if row["status"] in ENDED[1:]
        ],
    }
    ended = [row for row in rows if row["status"] == "done"]
    if isinstance(vary, models.Converge):
        results["converge"] = _converge(vary, base, ended)
    elif isinstance(vary, models.Listed) and (differences := against_experiment(ended)):
        results["experiment"] = differences
    elif isinstance(vary, models.Sample):
        results["sample"] = _sample(vary, base, ended)
    elif isinstance(vary, models.Bisect):
        results["limits"] = [_limit(vary, base, fixed, group) for fixed, group in _groups(vary, base, ended)]
        _add_uncertainty(vary, base, results["limits"])
    elif isinstance(vary, models.Fit):
        results["fit"] = Calibration(vary, base, ended).solve()[1]
    results["finding"] = finding(results, ended, record)
    return results


def following(vary: models.Vary, base: PlainMapping, rows: Sequence[Row], points: int) -> list[Values]:
    """Return the cases of the next round of a bisection, `points` for each limit, or of a fit; none of other sweeps."""
    if isinstance(vary, models.Fit):
        return Calibration(vary, base, [row for row in rows if row["status"] == "done"]).solve()[0]
    if not isinstance(vary, models.Bisect):
        return []
    without, upper, width = Scale(vary.path, [*vary.bracket, vary.tolerance], base).numbers
    cases: list[Values] = []
    for fixed, group in _groups(vary, base, [row for row in rows if row["status"] == "done"]):
        decided = _classify(vary.event, group)
        if len(decided) < len(group):  # the undecided shot is continued first
            continue
        scale = Scale(vary.path, [*vary.bracket, vary.tolerance, *(row["values"][vary.path] for row in group)], base)
        limits = statistics.bracket(scale.numbers[3:], [yes for _, yes in decided], upper < without)
        cases += [fixed | {vary.path: scale.value(number)} for number in statistics.next_values(limits, points, width)]
    return cases


def _groups(vary: models.Bisect, base: PlainMapping, rows: Sequence[Row]) -> list[tuple[Values, list[Row]]]:
    """Return the settings of each limit with its shots."""
    settings = [fixed | variant for fixed in product(vary.parameters) for variant in variants(vary, base)]
    paths = {path for fixed in settings for path in fixed}
    return [
        (fixed, [row for row in rows if all(row["values"].get(path) == fixed.get(path) for path in paths)])
        for fixed in settings
    ]


def undecided_shots(vary: models.Vary, rows: Sequence[Row]) -> list[int]:
    """Return the numbers of the finished shots of a limit that are undecided."""
    if not isinstance(vary, models.Bisect):
        return []
    return [row["number"] for row in rows if row["status"] == "done" and _outcome(vary.event, row) is None]


def _add_uncertainty(vary: models.Bisect, base: PlainMapping, limits: Sequence[Plain]) -> None:
    """Add the combined uncertainty to the first limit of each group of variants."""
    extras = variants(vary, base)
    if len(extras) == 1:
        return
    spacings = Scale("resolution", vary.resolutions, base).numbers if vary.resolutions else [1.0]
    for k in range(0, len(limits), len(extras)):
        group = limits[k : k + len(extras)]
        if any(limit["limit"] is None for limit in group):
            continue
        values = [limit["limit"] for limit in group]
        finest = group[spacings.index(min(spacings))]
        half = 0.5 * abs(finest["above"] - finest["below"])
        correlation = vary.fit["correlation"] if isinstance(vary.fit, dict) else []
        count = len(spacings)
        finest["uncertainty"] = statistics.combine_uncertainties(
            spacings, values[:count], half, values[count:], correlation
        )


def _outcome(event: models.Event, row: Row) -> bool | None:
    """Return on which side of the limit a case is; None where it is undecided."""
    value = row["measures"].get(event.measure, {}).get("value")
    if value is None:
        return None if event.absent == "undecided" else event.absent == "above"
    return float(value) > event.threshold


def _classify(event: models.Event, rows: Sequence[Row]) -> list[tuple[Row, bool]]:
    judged = [(row, _outcome(event, row)) for row in rows]
    return [(row, yes) for row, yes in judged if yes is not None]


def _limit(vary: models.Bisect, base: PlainMapping, fixed: Values, rows: Sequence[Row]) -> Plain:
    decided = _classify(vary.event, rows)
    undecided = [row["number"] for row in rows if _outcome(vary.event, row) is None]
    rows, happened = [row for row, _ in decided], [yes for _, yes in decided]
    scale = Scale(vary.path, [*vary.bracket, *(row["values"][vary.path] for row in rows)], base)
    (without, with_event), numbers = scale.numbers[:2], scale.numbers[2:]
    limits = statistics.bracket(numbers, happened, with_event < without)
    shots = [
        {
            "number": row["number"],
            "value": number,
            "happened": yes,
            "residual": row["measures"].get(vary.residual, {}).get("value"),
        }
        for row, number, yes in sorted(zip(rows, numbers, happened, strict=True), key=lambda shot: shot[1])
    ]
    curve = None
    through = [shot for shot in shots if shot["happened"] and shot["residual"] is not None]
    if scale.unit in FACTORS:  # the fit is in m/s
        factor = FACTORS[scale.unit]
        curve = statistics.lambert_jonas(
            [factor * s["value"] for s in through],
            [abs(s["residual"]) for s in through],
            statistics.bracket([factor * number for number in numbers], happened),
        )
    v50 = statistics.logistic_limit(numbers, happened) if limits.mixed else None
    if v50 is None and limits.below is not None and limits.above is not None:  # equally likely within the bracket
        v50 = 0.5 * (limits.below + limits.above), abs(limits.above - limits.below) / sqrt(12.0)
    return {
        "parameters": fixed,
        "path": vary.path,
        "unit": scale.unit,
        **limits.as_dict(),
        "v50": v50,
        "shots": shots,
        "undecided": undecided,
        "open": _open(limits, without, with_event, decided, undecided),
        "lambert_jonas": None if curve is None else asdict(curve),
    }


def _open(
    limits: statistics.Bracket, without: float, upper: float, decided: Sequence[object], undecided: Sequence[int]
) -> str:
    """Return why no limit was found, with the remedy; empty where one was."""
    if undecided:
        shots = f"shot{'s' * (len(undecided) > 1)} {', '.join(map(str, undecided))}"
        return f"{shots} undecided: give a later `longest`, or a time.end at which the event is decided"
    if not decided:
        return "no shot is done"
    farther = ("lower", "higher") if without < upper else ("higher", "lower")
    if limits.below is None:
        return f"it happens at every value that was tried: begin at a {farther[0]} one"
    if limits.above is None:
        return f"it happens at no value that was tried: end at a {farther[1]} one"
    if (limits.below, limits.above) == (upper, without):
        return "it happens at the first value and not at the second: give them the other way round"
    return ""


def _converge(vary: models.Converge, base: PlainMapping, rows: Sequence[Row]) -> Plain:
    perturbed = [
        next((row for row in rows if row["values"] == values), None)
        for values in converge_cases(vary, base)[len(vary.values) :]
    ]
    rows = [row for row in rows if len(row["values"]) == 1]
    scale = Scale(vary.path, [row["values"][vary.path] for row in rows], base) if rows else None
    spacings = scale.numbers if scale else []
    names = dict.fromkeys(name for row in rows for name in row["measures"])
    verdicts = {}
    for name in names:
        pairs = [
            (row["measures"][name], h)
            for row, h in zip(rows, spacings, strict=True)
            if isinstance(row["measures"].get(name, {}).get("value"), int | float)
        ]
        if not pairs:
            continue
        values = [float(measure["value"]) for measure, _ in pairs]
        uncertain = [_noise(measure) for measure, _ in pairs]
        verdicts[name] = asdict(statistics.convergence(values, [h for _, h in pairs], uncertain)) | {
            "unit": pairs[0][0]["unit"],
            "spacings": [h for _, h in pairs],
            "values": values,
            "uncertainties": uncertain,
            "spacing_unit": scale.unit if scale else "",
        }
        if len(values) == len(vary.values):
            finest = min(pairs, key=lambda pair: pair[1])[0]
            time = (finest.get("uncertainty_by") or {}).get("variation", 0.0)
            moved = [None if row is None else row["measures"].get(name, {}).get("value") for row in perturbed]
            related = vary.fit["correlation"] if isinstance(vary.fit, dict) else []
            combined = statistics.combine_uncertainties([h for _, h in pairs], values, time, moved, related)
            verdicts[name]["uncertainty"] = combined
    return verdicts


def _noise(measure: PlainMapping) -> float | None:
    """Return the uncertainty of a measure without the estimated discretization error."""
    kinds = measure.get("uncertainty_by") or {}
    if not kinds:
        return measure["uncertainty"]
    return sum(size**2 for name, size in kinds.items() if name != "discretization") ** 0.5


def _sample(vary: models.Sample, base: PlainMapping, rows: Sequence[Row]) -> Plain:
    continuous = {path: setting for path, setting in vary.values.items() if not isinstance(setting, models.Choice)}
    laws = {path: distribution(path, setting, base) for path, setting in continuous.items()}
    verdicts = {}
    for name in dict.fromkeys(name for row in rows for name in row["measures"]):
        valid = [row for row in rows if isinstance(row["measures"].get(name, {}).get("value"), int | float)]
        if not valid:
            continue
        results = np.array([float(row["measures"][name]["value"]) for row in valid])
        verdicts[name] = {"unit": valid[0]["measures"][name]["unit"], **statistics.spread(results.tolist())}
        if len(laws) < len(vary.values) or not laws:
            continue
        inputs = np.array([[split(path, row["values"][path])[0] for path in laws] for row in valid])
        linear = statistics.sensitivity(inputs, results, [law for _, law in laws.values()])
        if linear:
            verdicts[name]["sensitivity"] = linear | {"inputs": {path: scale.unit for path, (scale, _) in laws.items()}}
    return verdicts


def finding(results: PlainMapping, rows: Sequence[PlainMapping], record: Sequence[str] | None = None) -> str:
    """Return the results of a sweep in words, the main measure first; empty without any."""
    if results.get("fit"):
        fit = results["fit"]
        text = "; ".join(parameter_text(path, parameter) for path, parameter in fit["parameters"].items())
        return f"{text}. Sum of squares {fit['sum_of_squares']:.3g} for {fit['freedom']} degrees of freedom."
    if "limits" in results:
        return " ".join(map(_limit_text, results["limits"]))
    for form, sentence in (("converge", _convergence_text), ("sample", _sample_text), ("experiment", _experiment_text)):
        if results.get(form):
            name = _main_measure(results[form])
            return sentence(format_of(name), results[form][name])
    numbers: dict[str, list[tuple[float, str]]] = {}
    for row in rows:
        where = ", ".join(f"{last_name(path)} {format_value(value)}" for path, value in row["values"].items())
        for name, measure in row["measures"].items():
            is_reported = name != "perforated" and (record is None or name in record)
            if is_reported and isinstance(measure.get("value"), int | float):
                numbers.setdefault(name, []).append((measure["value"], where))
    varied = {name: pairs for name, pairs in numbers.items() if len({value for value, _ in pairs}) > 1}
    if not varied:
        return ""
    name = _main_measure(varied)
    display = format_of(name).scale_to(max(abs(value) for value, _ in varied[name]))
    low, high = (
        f"{display.factor * value:.4g} {display.unit} ({where})"
        for value, where in (min(varied[name]), max(varied[name]))
    )
    return f"The {display.label} ranges from {low} to {high} over {len(varied[name])} cases."


def _main_measure(names: PlainMapping) -> str:
    return main_measures([name for name in names if name != "perforated"] or list(names))[0]


def _limit_text(limit: PlainMapping) -> str:
    where = "".join(f"{last_name(path)} = {value}: " for path, value in limit["parameters"].items())
    if limit["open"] or limit["v50"] is None:
        return f"{where}No limit: {limit['open']}."
    value, deviation = limit["v50"]
    low, high = sorted((limit["below"], limit["above"]))
    gap = "mixed" if limit["mixed"] else "between"
    text = f"{where}The limit is {value:.5g} {limit['unit']}, standard deviation {deviation:.2g}"
    text += f" ({gap} {low:.5g} and {high:.5g})"
    return text + uncertainty_text(limit.get("uncertainty"), 1.0, limit["unit"]) + "."


def _convergence_text(display: NumberFormat, study: PlainMapping) -> str:
    finest = study["values"][study["spacings"].index(min(study["spacings"]))]
    display = display.scale_to(abs(finest))
    value = f"{finest * display.factor:.4g} {display.unit}"
    text = f"The {display.label} is {value} at the finest spacing: {study['verdict']}"
    return text + uncertainty_text(study.get("uncertainty"), display.factor, display.unit) + "."


def _sample_text(display: NumberFormat, sample: PlainMapping) -> str:
    display = display.scale_to(abs(sample["mean"]))
    mean, deviation = sample["mean"] * display.factor, sample["sd"] * display.factor
    text = f"The {display.label} is {mean:.4g} {display.unit}, standard deviation {deviation:.2g}"
    if "sensitivity" in sample:
        shares = dict(zip(sample["sensitivity"]["inputs"], sample["sensitivity"]["total"], strict=True))
        path = max(shares, key=lambda name: shares[name])
        text += f"; {100.0 * shares[path]:.0f} % of the variance is due to {path}"
    return text + "."


def _experiment_text(display: NumberFormat, comparison: PlainMapping) -> str:
    if comparison["mean"] is None:
        return ""
    mean, worst, count = 100.0 * comparison["mean"], 100.0 * comparison["worst"], len(comparison["cases"])
    return f"The {display.label} differs by {mean:+.2g} % in the mean of {count} shots, by {worst:+.2g} % at most."


def uncertainty_text(uncertainty: PlainMapping | None, factor: float, unit: str) -> str:
    """Return a combined uncertainty and its shares in words; empty for none."""
    if not uncertainty:
        return ""
    shares = ", ".join(f"{source} {100.0 * share:.0f} %" for source, share in uncertainty["shares"].items())
    return f"; ± {uncertainty['half_width'] * factor:.2g} {unit} (95 %: {shares})"
