"""The finding of a sweep in a sentence, in the units of the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hvisph.core.measure_catalogue import format_of, main_measures

from .calibration import parameter_text


def finding(said: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> str:
    """Return what the results of a sweep say, the main measure first; empty where nothing is done.

    Parameters
    ----------
    said
        Content of ``results.json``.
    rows
        Cases that are done.
    """
    if said.get("fit"):
        fit = said["fit"]
        text = "; ".join(parameter_text(path, one) for path, one in fit["parameters"].items())
        return f"{text}. Sum of squares {fit['sum_of_squares']:.3g} for {fit['freedom']} degrees of freedom."
    if "limits" in said:
        return " ".join(map(_limit, said["limits"]))
    for kind, sentence in (("converge", _converge), ("sample", _sample), ("experiment", _experiment)):
        if said.get(kind):
            name = _main(said[kind])
            return sentence(format_of(name), said[kind][name])
    numbers: dict[str, list[float]] = {}
    for row in rows:
        for name, one in row["measures"].items():
            if isinstance(one.get("value"), int | float) and name != "perforated":
                numbers.setdefault(name, []).append(one["value"])
    varied = {name: one for name, one in numbers.items() if len(set(one)) > 1}
    if not varied:
        return ""
    name = _main(varied)
    display = format_of(name).scale_to(max(map(abs, varied[name])))
    low, high = (display.factor * one for one in (min(varied[name]), max(varied[name])))
    return f"The {display.label} ranges from {low:.4g} to {high:.4g} {display.unit} over {len(varied[name])} cases."


def _main(names: Mapping[str, Any]) -> str:
    return main_measures([name for name in names if name != "perforated"] or list(names))[0]


def _limit(one: Mapping[str, Any]) -> str:
    where = "".join(f"{path.split('.')[-1]} = {value}: " for path, value in one["parameters"].items())
    if one["open"] or one["v50"] is None:
        return f"{where}No limit: {one['open']}."
    value, deviation = one["v50"]
    low, high = sorted((one["below"], one["above"]))
    kind = "mixed" if one["mixed"] else "between"
    text = f"{where}The limit is {value:.5g} {one['unit']}, standard deviation {deviation:.2g}"
    text += f" ({kind} {low:.5g} and {high:.5g})"
    return text + uncertainty_text(one.get("uncertainty"), 1.0, one["unit"]) + "."


def _converge(display: Any, one: Mapping[str, Any]) -> str:
    finest = one["values"][one["spacings"].index(min(one["spacings"]))]
    display = display.scale_to(abs(finest))
    text = (
        f"The {display.label} is {finest * display.factor:.4g} {display.unit} at the finest spacing: {one['verdict']}"
    )
    return text + uncertainty_text(one.get("uncertainty"), display.factor, display.unit) + "."


def _sample(display: Any, one: Mapping[str, Any]) -> str:
    display = display.scale_to(abs(one["mean"]))
    mean, deviation = one["mean"] * display.factor, one["sd"] * display.factor
    text = f"The {display.label} is {mean:.4g} {display.unit}, standard deviation {deviation:.2g}"
    if "sensitivity" in one:
        shares = dict(zip(one["sensitivity"]["inputs"], one["sensitivity"]["total"], strict=True))
        path = max(shares, key=lambda name: shares[name])
        text += f"; {100.0 * shares[path]:.0f} % of the variance is due to {path}"
    return text + "."


def _experiment(display: Any, one: Mapping[str, Any]) -> str:
    if one["mean"] is None:
        return ""
    return (f"The {display.label} differs by {100.0 * one['mean']:+.2g} % in the mean of {len(one['cases'])} shots, by "
            f"{100.0 * one['worst']:+.2g} % at most.")  # fmt: skip


def uncertainty_text(one: Mapping[str, Any] | None, factor: float, unit: str) -> str:
    """Return a combined uncertainty and its shares in words; empty for none."""
    if not one:
        return ""
    shares = ", ".join(f"{kind} {100.0 * share:.0f} %" for kind, share in one["shares"].items())
    return f"; ± {one['half_width'] * factor:.2g} {unit} (95 %: {shares})"
